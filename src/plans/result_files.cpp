// SPDX-License-Identifier: Apache-2.0
#include "plans/result_files.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "combine/result_file.h"
#include "film/exposure.h"
#include "film/film_file.h"
#include "film/image_writer.h"
#include "film/outputs.h"
#include "integrators/aov.h"
#include "plans/light_plan.h"
#include "plans/made_of.h"
#include "plans/pass_files.h"
#include "risk/plain_mean.h"

namespace covary {

std::string preview_path(const std::string& output) {
  return std::filesystem::path(output).replace_extension(".png").string();
}

void check_output(const std::string& path) {
  if (!path.empty()) Outputs().writes("`output`", path, OutputKind::kFilm);
}

void write_result_files(const Plan& plan, const RenderRequest& request, RenderResult& result) {
  if (request.output.empty()) return;
  std::map<std::string, Image> aovs = result.aovs;
  if (!request.aovs)  // only needed by the estimator
    for (const AuxiliaryFeature& feature : kAuxiliaryFeatures) aovs.erase(feature.layer);
  aovs.insert(request.beside.begin(), request.beside.end());
  Film& last = result.passes[camera_passes(result.passes).size() - 1].film;
  if (plan.makes_film()) {
    const Pass* light = light_pass(result.passes);
    Film sum;
    if (light) sum = sum_of_films(last, light->film);
    Film& film = light ? sum : last;
    film.attributes[film_key::kComplete] = result.interrupted ? "false" : "true";
    film.aovs = aovs;
    film.shown = result.image.estimate;
    for (const auto& [key, value] : prediction_attributes(result.predicted)) film.attributes[key] = value;
    if (aovs.contains("Albedo")) film.attributes[film_key::kCleanFeatures] = "true";
    write_film(request.output, film, result.image.std_error);
  } else {
    const Film& film = last;
    std::map<std::string, std::string> attributes;
    for (const char* key : {film_key::kSeed, film_key::kSceneHash, film_key::kSettings, film_key::kVersion,
                            film_key::kCommand, film_key::kMadeOf, film_key::kTimeChoice, film_key::kTrial})
      if (film.attributes.count(key)) attributes[std::string("covary:") + key] = film.attributes.at(key);
    const bool estimated = !result.image.estimate.data.empty();
    attributes["covary:estimator"] = estimated ? plan.method->text : kMeanName;
    if (estimated && !plan.method->network.empty()) attributes["covary:denoiser"] = plan.method->network;
    if (const std::string device = estimated && request.made_by ? request.made_by() : ""; !device.empty())
      attributes["covary:device"] = device;
    if (result.interrupted) attributes[std::string("covary:") + film_key::kComplete] = "false";
    attributes["covary:samples"] = fmt::format("{:g}", result.samples_per_pixel());
    if (aovs.contains("Albedo")) attributes[std::string("covary:") + film_key::kCleanFeatures] = "true";
    const ImagePlace place{film.frame_width(), film.frame_height(), film.crop()};
    EstimatorResult mean;  // of an interrupted render whose films have too few samples for the estimator
    if (!estimated) mean.estimate = result.picture();
    write_result(request.output, place, attributes, estimated ? result.image : mean, aovs);
  }
  if (!request.preview) return;
  const Image picture = result.picture();
  result.preview_stops = request.exposure == kAutomaticExposure ? exposure_for_display(picture) : request.exposure;
  const auto alpha = aovs.find(kAlpha);
  write_png(preview_path(request.output), result.preview_stops == 0 ? picture : exposed(picture, result.preview_stops),
            alpha != aovs.end() ? alpha->second : Image());
}

}  // namespace covary
