// SPDX-License-Identifier: Apache-2.0
#include "film/film_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/number_text.h"
#include "film/exr.h"
#include "film/image_file.h"
#include "film/input_error.h"

namespace covary {
namespace {

constexpr const char* kPrefix = "covary:";
constexpr const char* kFormat = "film";  // attribute covary:film: version of the format
constexpr const char* kFormatVersion = "1";
constexpr const char* kGroups = "groups";
constexpr const char* kFileChecksums = "checksums";
constexpr const char* kSamples = "samples";              // attribute covary:samples and channel `samples`
constexpr const char* kVariance = "variance_in_groups";  // channels .R .G .B, in some films
constexpr const char* kStdError = "StdError";            // layer computed from the groups
constexpr const char* kShown = "shown";                  // "more": R G B contain more than the groups' samples
constexpr const char* kMinSamples = "samples_fewest";    // fewest in any pixel; only if pixels differ
constexpr const char* kMaxSamples = "samples_most";

/// Attributes computed when writing, which reading does not keep in Film::attributes.
bool is_derived(const std::string& key) {
  return key == kFormat || key == kGroups || key == kSamples || key == kMinSamples || key == kMaxSamples ||
         key == kFileChecksums || key == kShown || key == film_key::kPredicted || key == film_key::kPredictedBounds ||
         key == film_key::kPredictionDoubt || key == film_key::kCleanFeatures;
}

std::string group_name(int group) { return fmt::format("group{:02d}", group); }

/// The channels of a film and where their values are stored; the same list serves writing and reading.
/// `means` holds the image for R G B unless these are the channels of a single group.
std::vector<ExrPlane> film_planes(Film& film, Image& means) {
  std::vector<ExrPlane> planes;
  const auto add_rgb = [&](const std::array<std::string, 3>& names, float* data, size_t values_per_pixel) {
    for (size_t c = 0; c < 3; ++c)
      planes.push_back({names[c], ExrPlane::Type::kFloat, data + c, values_per_pixel * sizeof(float)});
  };
  const size_t stride = static_cast<size_t>(film.groups()) * 3;
  if (means.data.empty()) {
    add_rgb({"R", "G", "B"}, film.data().data(), stride);
  } else {
    add_rgb({"R", "G", "B"}, means.data.data(), 3);
    for (int g = 0; g < film.groups(); ++g) {
      const std::string name = group_name(g);
      add_rgb({name + ".R", name + ".G", name + ".B"}, film.data().data() + g * 3, stride);
    }
  }
  if (film.keeps_sample_variance()) {
    const std::string name = kVariance;
    add_rgb({name + ".R", name + ".G", name + ".B"}, film.variance_in_groups().data(), 3);
  }
  planes.push_back({kSamples, ExrPlane::Type::kUint, film.counts().data(), sizeof(uint32_t)});
  for (auto& [name, image] : film.aovs) {
    COVARY_CHECK(image.width == film.width() && image.height == film.height(),
                 "auxiliary image " + name + " has the film's size");
    add_image_planes(name, image, planes);
  }
  return planes;
}

/// The layer a channel belongs to: "Albedo" for "Albedo.R", "" for "R".
std::string layer_of(const std::string& channel) {
  const size_t dot = channel.rfind('.');
  return channel.substr(0, dot == std::string::npos ? 0 : dot);
}

/// Auxiliary images with a single channel.
constexpr std::array<const char*, 2> kGrey = {kAlpha, "Depth"};

bool is_grey(const std::string& name) { return std::ranges::find(kGrey, name) != kGrey.end(); }

/// Names of the auxiliary images: those of one channel, and every channel triple that is not a group, mean, error or
/// variance.
std::vector<std::string> find_aovs(const ExrFile& file, bool has_groups) {
  std::vector<std::string> names;
  for (const ExrFile::Channel& channel : file.channels()) {
    const std::string name = is_grey(channel.name) ? channel.name : layer_of(channel.name);
    if (name.empty() || name == kVariance || name == kStdError || (name.starts_with("group") && has_groups)) continue;
    if (names.empty() || names.back() != name) names.push_back(name);
  }
  return names;
}

/// Attributes of a film, including derived ones, without the prefix.
std::map<std::string, std::string> film_attributes(const ExrFile& file, const std::string& path) {
  std::map<std::string, std::string> attributes;
  for (const auto& [name, value] : file.attributes())
    if (name.starts_with(kPrefix)) attributes[name.substr(std::string(kPrefix).size())] = value;
  if (!attributes.count(kFormat)) fail_input(path, "not a film of covary (attribute covary:film is missing)");
  if (attributes[kFormat] != kFormatVersion)
    fail_input(path, fmt::format("film format '{}'; this version reads '{}'", attributes[kFormat], kFormatVersion));
  return attributes;
}

}  // namespace

std::optional<std::array<double, 2>> predicted_bounds(const ImageInfo& file) {
  const auto text = file.attributes.find(std::string(kPrefix) + film_key::kPredictedBounds);
  if (text == file.attributes.end()) return std::nullopt;
  const size_t space = text->second.find(' ');
  const auto low = parse_number<double>(text->second.substr(0, space));
  const auto high = parse_number<double>(space == std::string::npos ? "" : text->second.substr(space + 1));
  if (!low || !high) return std::nullopt;
  return std::array{*low, *high};
}

std::map<std::string, std::string> read_film_attributes(const std::string& path) {
  std::map<std::string, std::string> attributes = film_attributes(ExrFile(path), path);
  std::erase_if(attributes, [](const auto& item) { return is_derived(item.first); });
  return attributes;
}

void write_film(const std::string& path, const Film& film, const Image& std_error) {
  std::map<std::string, std::string> attributes;
  for (const auto& [key, value] : film.attributes) attributes[kPrefix + key] = value;
  const auto derive = [&](const char* key, const std::string& value) {
    attributes[std::string(kPrefix) + key] = value;
  };
  derive(kFormat, kFormatVersion);
  derive(kGroups, fmt::to_string(film.groups()));
  derive(kSamples, fmt::to_string(film.mean_count()));
  const auto [fewest, most] = std::minmax_element(film.counts().begin(), film.counts().end());
  if (*fewest < *most) {
    derive(kMinSamples, fmt::to_string(*fewest));
    derive(kMaxSamples, fmt::to_string(*most));
  }

  if (!film.shown.data.empty()) derive(kShown, "more");
  Image means = !film.shown.data.empty() ? film.shown : film.groups() > 1 ? film.mean_image() : Image();
  // The list of planes also serves reading and so needs a mutable film; write_exr only reads it.
  std::vector<ExrPlane> planes = film_planes(const_cast<Film&>(film), means);
  if (!std_error.data.empty()) add_image_planes(kStdError, const_cast<Image&>(std_error), planes);
  write_exr(path, {film.frame_width(), film.frame_height(), film.crop()}, attributes, planes,
            film.groups() > 1 ? ExrCompression::kNone : ExrCompression::kZip);
}

Film read_film(const std::string& path) {
  const ExrFile file(path);
  std::map<std::string, std::string> attributes = film_attributes(file, path);
  const std::string text = attributes[kGroups];
  const int groups = parse_number<int>(text).value_or(0);
  if (groups < 1 || groups > Film::kMaxGroups)
    fail_input(path, fmt::format("attribute covary:groups is '{}'; expected 1 to {}", text, Film::kMaxGroups));
  // Before allocating: all channels must exist, with the right type.
  if (!file.find(group_name(groups - 1) + ".R") && groups > 1)
    fail_input(path, fmt::format("channel {}.R of a film with {} groups is missing", group_name(groups - 1), groups));

  require_image_memory(path, file.place().window.width, file.place().window.height,
                       static_cast<double>(file.channels().size() * sizeof(float)));
  Film film;
  try {
    film = Film(file.place().frame_width, file.place().frame_height, file.place().window, groups);
  } catch (const Error& error) {
    fail_input(path, error.what());
  }
  for (const auto& [key, value] : attributes)
    if (!is_derived(key)) film.attributes[key] = value;
  if (file.find(std::string(kVariance) + ".R")) film.keep_sample_variance();
  const bool has_groups = groups > 1 || attributes.count(kShown);
  for (const std::string& name : find_aovs(file, has_groups))
    film.aovs[name] = Image(film.width(), film.height(), is_grey(name) ? 1 : 3);

  Image means = has_groups ? Image(film.width(), film.height(), 3) : Image();
  const std::vector<ExrPlane> planes = film_planes(film, means);
  for (const ExrPlane& plane : planes) {
    const ExrFile::Channel* found = file.find(plane.name);
    if (!found) fail_input(path, fmt::format("channel {} of a film with {} groups is missing", plane.name, groups));
    const char* expected = plane.type == ExrPlane::Type::kUint ? "uint" : "float";
    if (found->type != expected)
      fail_input(path, fmt::format("channel {} is of type {}; expected {}", plane.name, found->type, expected));
  }
  for (const ExrFile::Channel& channel : file.channels())
    if (layer_of(channel.name) != kStdError &&
        std::none_of(planes.begin(), planes.end(), [&](const ExrPlane& p) { return p.name == channel.name; }))
      fail_input(path, fmt::format("channel {} does not belong to a film with {} groups", channel.name, groups));
  file.read(planes);
  return film;
}

}  // namespace covary
