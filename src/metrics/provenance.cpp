// SPDX-License-Identifier: Apache-2.0
#include "metrics/provenance.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <set>
#include <sstream>

#include "film/denoised_by.h"
#include "film/film_file.h"
#include "film/outputs.h"
#include "film/pictures.h"
#include "film/splat_layer.h"

namespace covary {
namespace {

constexpr const char* kPrefix = "covary:";

std::string attribute(const ImageFacts& image, const std::string& key, const std::string& otherwise = "") {
  const auto it = image.info.attributes.find(kPrefix + key);
  return it == image.info.attributes.end() ? otherwise : it->second;
}

/// The attribute `settings`, "path …; filter …; …": integrator with parameters, pixel filter, sampler.
struct Settings {
  std::string integrator, filter, sampler = "independent";
  explicit Settings(const std::string& text) {
    std::stringstream parts(text);
    for (std::string part; std::getline(parts, part, ';');) {
      part.erase(0, part.find_first_not_of(' '));
      if (part.starts_with("filter "))
        filter = part.substr(7);
      else if (part.starts_with("sampler "))
        sampler = part.substr(8);
      else if (integrator.empty())
        integrator = part;
    }
  }
  /// Light paths are independent of the sampler.
  bool traces_light() const { return has_light_film(integrator); }
};

std::set<std::string> seeds_of(const ImageFacts& image) {
  std::set<std::string> seeds;
  std::stringstream words(attribute(image, "seed"));
  for (std::string seed; std::getline(words, seed, ',');) seeds.insert(seed);
  return seeds;
}

/// Samples per pixel; 0 if the file does not say.
double samples_of(const ImageFacts& image) { return std::strtod(attribute(image, "samples", "0").c_str(), nullptr); }

/// The predicted relMSE; 0 if the file does not say.
double predicted_of(const ImageFacts& image) {
  return std::strtod(attribute(image, film_key::kPredicted, "0").c_str(), nullptr);
}

/// Of the predicted error of an image, what its reference may have without a word.
constexpr double kMaxOfItself = 0.2;

/// Of the picture.
ColourSpace colours_of(const ImageFacts& image) {
  const std::vector<Picture> pictures = find_pictures(image.info.channels);
  return pictures.empty() ? image.info.colours : layer_colours(image.info.colours, pictures[0].channels);
}

bool is_integer(const ImageFacts& image) {
  const auto& channels = image.info.channels;
  return image.info.format != "openexr" && std::any_of(channels.begin(), channels.end(), [](const ExrFile::Channel& c) {
           return c.type.find("int") != std::string::npos;
         });
}

}  // namespace

std::map<std::string, std::string> inherited_attributes(std::span<const std::map<std::string, std::string>> files) {
  static const std::set<std::string> of_samples = {"seed",           "sampling", "scene_hash", "settings",
                                                   "samples",        "training", "light_film", "exposure",
                                                   "clean_features", "complete"};
  std::map<std::string, std::string> result;
  if (files.empty()) return result;
  for (const auto& [name, value] : files[0]) {
    if (!name.starts_with(kPrefix) || !of_samples.count(name.substr(std::string_view(kPrefix).size()))) continue;
    const bool agree = std::all_of(files.begin(), files.end(), [&name = name, &value = value](const auto& file) {
      const auto found = file.find(name);
      return found != file.end() && found->second == value;
    });
    if (agree) result[name] = value;
  }
  const std::string seed = std::string(kPrefix) + film_key::kSeed;
  std::set<std::pair<size_t, std::string>> seeds;  // by length first, which orders numbers
  for (const auto& file : files) {
    const auto found = file.find(seed);
    if (found == file.end()) return result;
    std::stringstream words(found->second);
    for (std::string word; std::getline(words, word, ',');) seeds.insert({word.size(), word});
  }
  std::string joined;
  for (const auto& [size, word] : seeds) joined += (joined.empty() ? "" : ",") + word;
  result[seed] = joined;
  return result;
}

std::map<std::string, std::string> inherited_attributes(std::span<const std::string> paths) {
  std::vector<std::map<std::string, std::string>> files;
  for (const std::string& path : paths) files.push_back(inspect_image(path).attributes);
  return inherited_attributes(files);
}

ImageFacts read_facts(const std::string& path, const std::string& name) {
  return {path, name.empty() ? path : name, inspect_image(path)};
}

std::vector<std::string> image_warnings(const ImageFacts& image) {
  std::vector<std::string> warnings;
  const bool is_film = !attribute(image, "film").empty();
  if (!attribute(image, film_key::kLightPaths).empty())
    warnings.push_back(image.name + " holds light paths alone, a part of an image; 'covary combine --light' adds it");
  else if (is_film && attribute(image, film_key::kLight).empty() &&
           Settings(attribute(image, "settings")).traces_light())
    warnings.push_back(image.name +
                       " lacks the light of its light film, usually light.exr beside it; 'covary combine --light' adds "
                       "it");
  if (attribute(image, film_key::kComplete) == "false")
    warnings.push_back(image.name + " is of an interrupted render" +
                       (is_film ? "" : ", which the same command with --resume completes"));
  return warnings;
}

std::vector<std::string> reference_warnings(const ImageFacts& image, const ImageFacts& reference, bool may_have_two) {
  if (is_same_file(image.path, reference.path)) return {};
  std::vector<std::string> warnings;
  if (!denoised_by(reference.info.attributes, reference.info.channels).empty())
    warnings.push_back(reference.name + " is denoised, and so biased: it cannot be a reference for errors");
  const double samples = samples_of(image), of_reference = samples_of(reference);
  if (of_reference > 0 && of_reference <= samples)
    warnings.push_back(
        fmt::format("{} has {:g} samples per pixel, no more than {} with {:g}: its noise counts as error",
                    reference.name, of_reference, image.name, samples));
  const double error = predicted_of(image), of_itself = predicted_of(reference);
  // A denoised image may have the error of a hundred times as many samples.
  const bool is_denoised = !denoised_by(image.info.attributes, image.info.channels).empty();
  if (may_have_two && warnings.empty() && of_itself == 0 && is_denoised && of_reference > 0 &&
      of_reference < 100 * samples)
    warnings.push_back(
        fmt::format("{} has an unknown error of its own, which is counted as {}'s, and {} is denoised: "
                    "two references would cancel it",
                    reference.name, image.name, image.name));
  if (warnings.empty() && of_itself > kMaxOfItself * error && error > 0)
    warnings.push_back(
        fmt::format("{} has an error of its own, predicted relMSE {:.2g} beside {:.2g} of {}, which is counted as "
                    "{}'s: render it with more samples, or give two references",
                    reference.name, of_itself, error, image.name, image.name));
  return warnings;
}

std::vector<std::string> comparison_warnings(const ImageFacts& image, const ImageFacts& reference) {
  if (is_same_file(image.path, reference.path))
    return {fmt::format("{} and {} are the same file", image.name, reference.name)};
  std::vector<std::string> warnings;
  const auto warn = [&](const std::string& what) {
    warnings.push_back(fmt::format("{} and {} {}", image.name, reference.name, what));
  };
  const auto compare = [&](const std::string& what, const std::string& a, const std::string& b) {
    if (!a.empty() && !b.empty() && a != b) warn(fmt::format("{}: '{}' and '{}'", what, a, b));
  };
  const std::set<std::string> seeds = seeds_of(image), other_seeds = seeds_of(reference);
  std::vector<std::string> common;
  std::set_intersection(seeds.begin(), seeds.end(), other_seeds.begin(), other_seeds.end(), std::back_inserter(common));
  // Passes of common and of independent random numbers share no samples, whatever their seeds; nor do different
  // samplers.
  const Settings settings(attribute(image, "settings")), other(attribute(reference, "settings"));
  const bool same_sampler = settings.sampler == other.sampler || settings.traces_light();
  const std::string sampling = attribute(image, "sampling"), other_sampling = attribute(reference, "sampling");
  if (!common.empty() && same_sampler && (sampling.empty() || other_sampling.empty() || sampling == other_sampling))
    warn(fmt::format("have seed {} in common and so share samples, which makes errors between them wrong",
                     fmt::join(common, ", ")));
  if (const std::string a = attribute(image, "scene_hash"), b = attribute(reference, "scene_hash");
      !a.empty() && !b.empty() && a != b)
    warn("show different scenes, or versions of one (attribute covary:scene_hash)");
  compare("were rendered with different settings", settings.integrator, other.integrator);
  compare("were rendered with different pixel filters", settings.filter, other.filter);
  // An exposure of 0 is not stored.
  compare("have different exposures in stops", attribute(image, "exposure", "0"),
          attribute(reference, "exposure", "0"));
  if (const ColourSpace own = colours_of(image), other_space = colours_of(reference); !(own == other_space))
    warn(fmt::format("have different colour spaces, {} and {}; they are converted to one", own.text(),
                     other_space.text()));
  if (is_integer(image) != is_integer(reference)) {
    const ImageFacts& rounded = is_integer(image) ? image : reference;
    warn(fmt::format("differ in precision: {} holds {} values, rounded and cut off at white", rounded.name,
                     rounded.info.channels[0].type));
  }
  return warnings;
}

}  // namespace covary
