// SPDX-License-Identifier: Apache-2.0
#include "combine/grouped_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numeric>

#include "core/number_text.h"
#include "film/denoised_by.h"
#include "film/input_error.h"
#include "film/pictures.h"
#include "film/splat_layer.h"

namespace covary {
namespace {

constexpr const char* kGroup = "group";                  // layers group00, group01, … of covary's films
constexpr const char* kCounts = "samples";               // channel in covary's films
constexpr const char* kVariance = "variance_in_groups";  // channels .R .G .B in some of them

bool is_same_frame(const ImagePlace& a, const ImagePlace& b) {
  return a.frame_width == b.frame_width && a.frame_height == b.frame_height;
}

std::string attribute(const ExrFile& file, const std::string& key) {
  const auto it = file.attributes().find(key);
  return it == file.attributes().end() ? "" : it->second;
}

/// The attribute with the samples per pixel: of covary's films, or cycles.LAYER.samples of Blender's images; "" if
/// there is none, or one for each of several layers.
std::string samples_key(const ExrFile& file) {
  const char* own = "covary:samples";
  if (file.attributes().contains(own)) return own;
  std::string found;
  for (const auto& [key, text] : file.attributes())
    if (key.starts_with("cycles.") && key.ends_with(".samples")) {
      if (!found.empty()) return "";
      found = key;
    }
  return found;
}

/// Mean number of samples per pixel according to the file; 0: unknown.
double samples_per_pixel(const ExrFile& file, const std::string& path) {
  const std::string key = samples_key(file), text = key.empty() ? "" : attribute(file, key);
  if (text.empty()) return 0;
  const double value = parse_real(text).value_or(-1);
  if (!(value >= 0 && value < 1e15))
    fail_input(path, fmt::format("attribute {} is '{}'; expected a number of samples per pixel", key, text));
  return value;
}

std::string number_of(double samples) { return samples > 0 ? fmt::format("{:g}", samples) : "an unknown number of"; }

/// Of files whose names differ in digits alone, as frames of a sequence do that a shell has listed.
std::string hint_of_frames(const std::string& a, const std::string& b) {
  std::string pattern = a;
  bool differ = false;
  for (size_t i = 0; i < a.size() && a.size() == b.size(); ++i) {
    const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)); };
    if (a[i] == b[i]) continue;
    if (!is_digit(a[i]) || !is_digit(b[i])) return "";
    differ = true;
    for (size_t k = i; k < a.size() && is_digit(a[k]); ++k) pattern[k] = '#';
    for (size_t k = i; k-- > 0 && is_digit(a[k]);) pattern[k] = '#';
  }
  return differ ? fmt::format("; if these are frames of a sequence, give '{}'", pattern) : "";
}

/// "group07" -> ("group", 7); number -1 if there are no trailing digits.
std::pair<std::string, int> split_number(const std::string& name) {
  size_t digits = name.size();
  while (digits > 0 && std::isdigit(static_cast<unsigned char>(name[digits - 1]))) --digits;
  if (digits == name.size() || name.size() - digits > 6) return {name, -1};
  return {name.substr(0, digits), std::stoi(name.substr(digits))};
}

/// Whether layers STEM0, STEM1, … are groups of samples, if nobody says so: of the name that covary gives them, or the
/// only layers of colours. Other numbered layers are light groups, mattes or AOVs.
bool are_groups(const std::string& stem, size_t n, const std::vector<ColourLayer>& layers) {
  return stem == kGroup || (n == layers.size() && holds_colours(layers[0].channels));
}

/// Numbered layers STEM0, STEM1, … that are groups of samples, ordered by number; `stem` "" means the only stem.
std::vector<ColourLayer> numbered_layers(const std::vector<ColourLayer>& layers, const std::string& stem) {
  if (std::any_of(layers.begin(), layers.end(), [&](const ColourLayer& layer) { return layer.name == stem; }) &&
      !stem.empty())
    return {};
  std::map<std::string, std::vector<std::pair<int, const ColourLayer*>>> by_stem;
  for (const ColourLayer& layer : layers)
    if (const auto [name, number] = split_number(layer.name); number >= 0) by_stem[name].emplace_back(number, &layer);
  for (auto& [name, found] : by_stem) {
    if (stem.empty() ? !are_groups(name, found.size(), layers) : name != stem) continue;
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<ColourLayer> result;
    for (const auto& [number, layer] : found) result.push_back(*layer);
    return result;
  }
  return {};
}

/// The layer of this name, or the file's picture. `option`: the argument that gives the name.
ColourLayer single_layer(const std::string& path, const ExrFile& file, const std::string& name,
                         const std::string& option) {
  const std::vector<Picture> pictures = find_pictures(file.channels());
  for (const Picture& picture : pictures)
    if (picture.layer == name || (name.empty() && pictures.size() == 1)) return {picture.layer, picture.channels};
  if (name.empty()) refuse_layer(path, file.channels(), name, option);
  const std::vector<std::string> channels = layer_channels(path, file.channels(), name);
  return {name, {channels[0], channels[1], channels[2]}};
}

}  // namespace

GroupedFile::GroupedFile(const std::vector<std::string>& paths, const std::string& layer, const std::string& option)
    : layer_option_(option) {
  COVARY_CHECK(!paths.empty(), "a grouped image needs a file");
  name_ = paths.size() == 1 ? paths[0] : fmt::format("{} … {}", paths.front(), paths.back());
  source_.files = paths;
  for (const std::string& path : paths) add_file(path, layer, paths.size() == 1);
}

ColourSpace GroupedFile::colours() const { return layer_colours(files_[0]->colours(), groups_[0].channels); }

Renderer GroupedFile::renderer() const { return written_by(files_[0]->attributes()); }

std::string GroupedFile::groups_text() const {
  return fmt::format("{} {}", groups(), files_.size() > 1 ? "renders" : "groups");
}

void GroupedFile::add_file(const std::string& path, const std::string& layer, bool only_file) {
  files_.push_back(std::make_unique<ExrFile>(path));
  const ExrFile& file = *files_.back();
  if (files_.size() == 1)
    place_ = file.place();
  else if (!(file.colours() == files_[0]->colours()))
    fail_input(path,
               fmt::format("its colours are {}, those of {} {}; renders of one picture have the same colour space",
                           file.colours().text(), source_.files[0], files_[0]->colours().text()));
  else if (!(file.place() == place_))
    fail_input(
        path,
        fmt::format("{} x {} pixels at ({}, {}) of a frame of {} x {}; {} has {} x {} at ({}, {}) of {} x {}; "
                    "render both with the same size and crop, without automatic cropping{}",
                    file.place().window.width, file.place().window.height, file.place().window.x, file.place().window.y,
                    file.place().frame_width, file.place().frame_height, source_.files[0], place_.window.width,
                    place_.window.height, place_.window.x, place_.window.y, place_.frame_width, place_.frame_height,
                    is_same_frame(file.place(), place_)
                        ? ", or fill each to its frame: `oiiotool IN.exr --croptofull -o OUT.exr`"
                        : ""));

  const std::vector<ColourLayer> layers = colour_layers(file.channels());
  const std::vector<ColourLayer> numbered = numbered_layers(layers, layer);
  const size_t first_group = groups_.size();
  if (numbered.size() > 1) {
    if (!only_file)
      fail_input(path, fmt::format(
                           "holds {} groups of samples; give it alone, or files of one image each, or {} for the image",
                           numbered.size(), layer_option_));
    for (const ColourLayer& group : numbered) {
      groups_.push_back({0, group.channels});
      source_.used.insert(group.channels.begin(), group.channels.end());
    }
  } else {
    groups_.push_back({files_.size() - 1, single_layer(path, file, layer, layer_option_).channels});
    if (files_.size() == 1) source_.picture = groups_[0].channels;
  }
  std::vector<std::string> read;
  for (size_t g = first_group; g < groups_.size(); ++g)
    for (const std::string& channel : groups_[g].channels) {
      const std::string& type = file.find(channel)->type;
      if (type == "uint") fail_input(path, fmt::format("channel {} holds integers; expected float values", channel));
      has_half_ |= type == "half";
      read.push_back(channel);
    }
  file.check(read);
  if (denoised_.empty() && attribute(file, "covary:film").empty())
    denoised_ = denoised_by(file.attributes(), file.channels(), layer);
  take_film_facts(path, file, only_file && (numbered.size() > 1 || layer.empty()));
}

void GroupedFile::take_film_facts(const std::string& path, const ExrFile& file, bool may_be_film) {
  const double samples = samples_per_pixel(file, path);
  if (files_.size() > 1 && samples != samples_of_group_)
    fail_input(path, fmt::format("has {} samples per pixel, {} {}; render all with the same number ({})",
                                 number_of(samples), source_.files[files_.size() - 2], number_of(samples_of_group_),
                                 where_to_set(RenderSetting::kSamples, renderer())));
  samples_of_group_ = samples;
  samples_ += samples;
  const ExrFile::Channel* counts = file.find(kCounts);
  const bool is_film = may_be_film && !attribute(file, "covary:film").empty();
  is_one_film_ = is_film;
  has_counts_ = is_film && counts && counts->type == "uint";
  has_variance_ = has_counts_ && file.find(std::string(kVariance) + ".R");
  if (has_counts_) file.check({{kCounts}});
  if (has_variance_)
    for (const char* c : {".R", ".G", ".B"}) file.check({{std::string(kVariance) + c}});
  const auto agree = [&](const char* key, std::string& value) {
    const std::string here = attribute(file, std::string("covary:") + key);
    if (files_.size() > 1 && here != value)
      fail_input(path, fmt::format("{} is '{}', in {} '{}'{}{}", key, here, source_.files[0], value,
                                   key == std::string_view("scene_hash") ? ": other scenes, frames or cameras" : "",
                                   hint_of_frames(path, source_.files[0])));
    value = here;
  };
  agree("sampling", sampling_);
  agree("scene_hash", scene_hash_);
  agree("settings", settings_);
  agree(film_key::kLightPaths, light_paths_per_sample_);
  agree(film_key::kLight, light_film_);
}

void GroupedFile::take_counts(const std::string& path) {
  if (has_counts()) fail_input(name_, "already says how many samples its pixels have; '" + path + "' is not needed");
  auto file = std::make_unique<ExrFile>(path);
  if (!(file->place() == place_)) {
    const CropWindow &there = file->place().window, &here = place_.window;
    fail_input(path, fmt::format("{} x {} pixels at ({}, {}); {} has {} x {} at ({}, {})", there.width, there.height,
                                 there.x, there.y, name_, here.width, here.height, here.x, here.y));
  }
  const bool is_only = file->channels().size() == 1;
  if (!is_only && !file->find(kCounts)) {
    std::vector<std::string> names;
    for (const ExrFile::Channel& channel : file->channels()) names.push_back(channel.name);
    fail_input(path, fmt::format("expected one channel, or one that is named '{}'; channels in it: {}", kCounts,
                                 fmt::join(names, ", ")));
  }
  counts_channel_ = is_only ? file->channels()[0].name : kCounts;
  file->check({&counts_channel_, 1});
  counts_file_ = std::move(file);
  counts_path_ = path;
  std::vector<uint32_t> counts;
  double sum = 0;
  for (int y = 0; y < height(); ++y) {
    read_counts(y, 1, counts);
    sum += std::accumulate(counts.begin(), counts.end(), 0.0);
  }
  samples_ = sum / (static_cast<double>(width()) * height());
}

void GroupedFile::take_count(uint32_t samples) {
  COVARY_CHECK(samples > 0 && !has_counts(), "counts are told once");
  count_of_all_ = samples;
  samples_ = samples;
}

void GroupedFile::read_counts(int first_row, int n_rows, std::vector<uint32_t>& counts) const {
  const size_t n_pixels = static_cast<size_t>(width()) * n_rows;
  counts.assign(n_pixels, count_of_all_);
  if (!counts_file_) return;
  if (counts_file_->find(counts_channel_)->type == "uint") {
    const ExrPlane plane{counts_channel_, ExrPlane::Type::kUint, counts.data(), sizeof(uint32_t)};
    counts_file_->read_rows({&plane, 1}, first_row, n_rows);
    return;
  }
  std::vector<float> values(n_pixels);
  const ExrPlane plane{counts_channel_, ExrPlane::Type::kFloat, values.data(), sizeof(float)};
  counts_file_->read_rows({&plane, 1}, first_row, n_rows);
  for (size_t i = 0; i < n_pixels; ++i) {
    if (!(values[i] >= 0 && values[i] <= 0x1p30f && values[i] == std::floor(values[i])))
      fail_input(counts_path_,
                 fmt::format("{} at ({}, {}); expected whole numbers of samples", values[i],
                             i % static_cast<size_t>(width()), first_row + i / static_cast<size_t>(width())));
    counts[i] = static_cast<uint32_t>(values[i]);
  }
}

void GroupedFile::read_rows(int first_row, int n_rows, Rows& rows) const {
  const size_t per_pixel = groups_.size() * 3, n_pixels = static_cast<size_t>(width()) * n_rows;
  rows.data.resize(n_pixels * per_pixel);
  rows.counts.clear();
  if (has_counts_) rows.counts.resize(n_pixels);
  if (has_counts() && !has_counts_) read_counts(first_row, n_rows, rows.counts);
  rows.variance_in_groups.resize(has_variance_ ? n_pixels * 3 : 0);
  for (size_t f = 0; f < files_.size(); ++f) {
    std::vector<ExrPlane> planes;
    for (size_t g = 0; g < groups_.size(); ++g) {
      if (groups_[g].file != f) continue;
      for (size_t c = 0; c < (groups_[g].is_grey() ? 1 : 3); ++c)
        planes.push_back(
            {groups_[g].channels[c], ExrPlane::Type::kFloat, rows.data.data() + 3 * g + c, per_pixel * sizeof(float)});
    }
    for (size_t c = 0; has_variance_ && c < 3; ++c)
      planes.push_back({std::string(kVariance) + "." + "RGB"[c], ExrPlane::Type::kFloat,
                        rows.variance_in_groups.data() + c, 3 * sizeof(float)});
    if (has_counts_) planes.push_back({kCounts, ExrPlane::Type::kUint, rows.counts.data(), sizeof(uint32_t)});
    files_[f]->read_rows(planes, first_row, n_rows);
  }
  for (size_t g = 0; g < groups_.size(); ++g)
    for (size_t i = 3 * g; groups_[g].is_grey() && i < rows.data.size(); i += per_pixel)
      rows.data[i + 1] = rows.data[i + 2] = rows.data[i];
}

GroupedImage GroupedFile::view(const Rows& rows, int n_rows) const {
  return {width(),
          n_rows,
          groups(),
          rows.data.data(),
          rows.counts.empty() ? nullptr : rows.counts.data(),
          samples_,
          rows.variance_in_groups.empty() ? nullptr : rows.variance_in_groups.data()};
}

}  // namespace covary
