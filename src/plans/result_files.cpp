// SPDX-License-Identifier: Apache-2.0
#include "plans/result_files.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "estimators/result_file.h"
#include "film/film_file.h"
#include "film/image_writer.h"

namespace covary {

std::string preview_path(const std::string& output) {
  return std::filesystem::path(output).replace_extension(".png").string();
}

void write_result_files(const Plan& plan, const RenderRequest& request, RenderResult& result) {
  if (request.output.empty()) return;
  Film& film = result.passes.back().film;
  if (plan.film_is_image) {
    film.attributes[film_key::kComplete] = "true";
    film.aovs = result.aovs;
    write_film(request.output, film);
  } else {
    std::map<std::string, std::string> attributes;
    for (const char* key :
         {film_key::kSeed, film_key::kSceneHash, film_key::kSettings, film_key::kVersion, film_key::kCommand})
      if (film.attributes.count(key)) attributes[std::string("covary:") + key] = film.attributes.at(key);
    attributes["covary:estimator"] = plan.estimator;
    attributes["covary:samples"] = fmt::format("{:g}", result.samples_per_pixel());
    const ImagePlace place{film.frame_width(), film.frame_height(), film.crop()};
    write_result(request.output, place, attributes, result.image, result.aovs);
  }
  if (request.preview) write_png(preview_path(request.output), result.picture());
}

}  // namespace covary
