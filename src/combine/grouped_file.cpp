// SPDX-License-Identifier: Apache-2.0
#include "combine/grouped_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "film/splat_layer.h"

namespace covary {
namespace {

constexpr const char* kCounts = "samples";               // channel of covary's films
constexpr const char* kVariance = "variance_in_groups";  // channels .R .G .B of some of them

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw Error(ErrorCode::kInput, path + ": " + what);
}

std::string attribute(const ExrFile& file, const std::string& key) {
  const auto it = file.attributes().find(key);
  return it == file.attributes().end() ? "" : it->second;
}

/// Prefixes P ("" or "name.") for which PR, PG, PB exist, in the file's order.
std::vector<std::string> layer_prefixes(const ExrFile& file) {
  std::vector<std::string> prefixes;
  for (const ExrFile::Channel& channel : file.channels()) {
    if (channel.name != "R" && !channel.name.ends_with(".R")) continue;
    const std::string prefix = channel.name.substr(0, channel.name.size() - 1);
    if (file.find(prefix + "G") && file.find(prefix + "B")) prefixes.push_back(prefix);
  }
  return prefixes;
}

std::string layer_name(const std::string& prefix) { return prefix.empty() ? "" : prefix.substr(0, prefix.size() - 1); }

/// Mean number of samples per pixel as covary's films tell it; 0: not told.
double samples_per_pixel(const ExrFile& file, const std::string& path) {
  const std::string text = attribute(file, "covary:samples");
  if (text.empty()) return 0;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= 0 && value < 1e15))
    fail(path, fmt::format("attribute covary:samples is '{}'; expected is a number of samples per pixel", text));
  return value;
}

/// "group07" -> ("group", 7); number -1 without digits at the end.
std::pair<std::string, int> split_number(const std::string& name) {
  size_t digits = name.size();
  while (digits > 0 && std::isdigit(static_cast<unsigned char>(name[digits - 1]))) --digits;
  if (digits == name.size() || name.size() - digits > 6) return {name, -1};
  return {name.substr(0, digits), std::stoi(name.substr(digits))};
}

std::string list_layers(const ExrFile& file, const std::vector<std::string>& prefixes) {
  std::vector<std::string> names;
  for (const std::string& p : prefixes) names.push_back(p.empty() ? "R,G,B" : fmt::format("'{}'", layer_name(p)));
  if (!names.empty()) return fmt::format("images in it: {}", fmt::join(names, ", "));
  for (const ExrFile::Channel& c : file.channels()) names.push_back(c.name);
  return fmt::format("channels in it: {}", fmt::join(names, ", "));
}

/// Numbered layers STEM0, STEM1, …, in the order of their numbers; `stem` "" takes the only stem there is.
std::vector<std::string> numbered_layers(const std::vector<std::string>& prefixes, const std::string& stem) {
  std::vector<std::pair<int, std::string>> found;
  std::string first_stem;
  for (const std::string& prefix : prefixes) {
    const auto [name, number] = split_number(layer_name(prefix));
    if (number < 0 || (!stem.empty() && name != stem)) continue;
    if (found.empty()) first_stem = name;
    if (name != first_stem) return {};
    found.emplace_back(number, prefix);
  }
  std::sort(found.begin(), found.end());
  std::vector<std::string> result;
  for (const auto& [number, prefix] : found) result.push_back(prefix);
  return result;
}

/// The one image of a file.
std::string single_layer(const std::string& path, const ExrFile& file, const std::vector<std::string>& prefixes,
                         const std::string& layer) {
  const auto has = [&](const std::string& prefix) {
    return std::find(prefixes.begin(), prefixes.end(), prefix) != prefixes.end();
  };
  if (!layer.empty()) {
    if (has(layer + ".")) return layer + ".";
    std::vector<std::string> names;
    for (const std::string& p : prefixes) names.push_back(layer_name(p));
    fail(path, fmt::format("no image '{}'{}; {}", layer, did_you_mean(layer, names), list_layers(file, prefixes)));
  }
  if (has("")) return "";
  if (prefixes.size() == 1) return prefixes[0];
  std::vector<std::string> combined;
  for (const std::string& p : prefixes)
    if (p.ends_with("Combined.")) combined.push_back(p);
  if (combined.size() == 1) return combined[0];
  fail(path, fmt::format("{}; {}",
                         prefixes.empty() ? "no image of channels R, G and B" : "several images; name one by its layer",
                         list_layers(file, prefixes)));
}

}  // namespace

GroupedFile::GroupedFile(const std::vector<std::string>& paths, const std::string& layer) {
  COVARY_CHECK(!paths.empty(), "a grouped image needs a file");
  name_ = paths.size() == 1 ? paths[0] : fmt::format("{} … {}", paths.front(), paths.back());
  for (const std::string& path : paths) add_file(path, layer, paths.size() == 1);
}

void GroupedFile::add_file(const std::string& path, const std::string& layer, bool only_file) {
  files_.push_back(std::make_unique<ExrFile>(path));
  const ExrFile& file = *files_.back();
  if (files_.size() == 1)
    place_ = file.place();
  else if (!(file.place() == place_))
    fail(path,
         fmt::format(
             "{} x {} pixels at ({}, {}) of a frame of {} x {}; the first group has {} x {} at ({}, {}) of {} x {}",
             file.place().window.width, file.place().window.height, file.place().window.x, file.place().window.y,
             file.place().frame_width, file.place().frame_height, place_.window.width, place_.window.height,
             place_.window.x, place_.window.y, place_.frame_width, place_.frame_height));

  const std::vector<std::string> prefixes = layer_prefixes(file);
  const std::vector<std::string> numbered = numbered_layers(prefixes, layer);
  const size_t first_group = groups_.size();
  if (numbered.size() > 1) {
    if (!only_file)
      fail(path,
           fmt::format("holds {} groups; give one file with all groups, or one file with one image for each group",
                       numbered.size()));
    for (const std::string& prefix : numbered) groups_.push_back({0, prefix});
  } else {
    groups_.push_back({files_.size() - 1, single_layer(path, file, prefixes, layer)});
  }
  for (size_t g = first_group; g < groups_.size(); ++g)
    for (const char* c : {"R", "G", "B"}) {
      const std::string& type = file.find(groups_[g].prefix + c)->type;
      if (type == "uint")
        fail(path, fmt::format("channel {}{} holds integers; expected are float values", groups_[g].prefix, c));
      has_half_ |= type == "half";
    }

  std::vector<std::string> read;
  for (size_t g = first_group; g < groups_.size(); ++g)
    for (const char* c : {"R", "G", "B"}) read.push_back(groups_[g].prefix + c);
  file.check(read);
  take_film_facts(path, file, only_file && (numbered.size() > 1 || layer.empty()));
}

void GroupedFile::take_film_facts(const std::string& path, const ExrFile& file, bool may_be_film) {
  const double samples = samples_per_pixel(file, path);
  if (files_.size() > 1 && samples != samples_of_group_)
    fail(path, fmt::format("has {} samples per pixel, the group before it {}; all groups must have the same number",
                           samples, samples_of_group_));
  samples_of_group_ = samples;
  samples_ += samples;
  const ExrFile::Channel* counts = file.find(kCounts);
  const bool is_film = may_be_film && !attribute(file, "covary:film").empty();
  has_counts_ = is_film && counts && counts->type == "uint";
  has_variance_ = has_counts_ && file.find(std::string(kVariance) + ".R");
  if (has_counts_) file.check({{kCounts}});
  if (has_variance_)
    for (const char* c : {".R", ".G", ".B"}) file.check({{std::string(kVariance) + c}});
  const auto agree = [&](const char* key, std::string& value) {
    const std::string here = attribute(file, std::string("covary:") + key);
    if (files_.size() > 1 && here != value)
      fail(path, fmt::format("{} is '{}', in the first group '{}'", key, here, value));
    value = here;
  };
  agree("sampling", sampling_);
  agree("scene_hash", scene_hash_);
  agree("settings", settings_);
  agree(film_key::kLightPaths, light_paths_per_sample_);
  agree(film_key::kLight, light_film_);
}

void GroupedFile::take_counts(const std::string& path) {
  if (has_counts()) fail(name_, "tells itself how many samples its pixels have; '" + path + "' is not needed");
  auto file = std::make_unique<ExrFile>(path);
  if (!(file->place() == place_)) {
    const CropWindow &there = file->place().window, &here = place_.window;
    fail(path, fmt::format("{} x {} pixels at ({}, {}); {} has {} x {} at ({}, {})", there.width, there.height, there.x,
                           there.y, name_, here.width, here.height, here.x, here.y));
  }
  const bool is_only = file->channels().size() == 1;
  if (!is_only && !file->find(kCounts))
    fail(path, fmt::format("expected is one channel, or one that is named '{}'; {}", kCounts, list_layers(*file, {})));
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
      fail(counts_path_, fmt::format("{} at ({}, {}); expected are whole numbers of samples", values[i],
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
      for (size_t c = 0; c < 3; ++c)
        planes.push_back({groups_[g].prefix + "RGB"[c], ExrPlane::Type::kFloat, rows.data.data() + 3 * g + c,
                          per_pixel * sizeof(float)});
    }
    for (size_t c = 0; has_variance_ && c < 3; ++c)
      planes.push_back({std::string(kVariance) + "." + "RGB"[c], ExrPlane::Type::kFloat,
                        rows.variance_in_groups.data() + c, 3 * sizeof(float)});
    if (has_counts_) planes.push_back({kCounts, ExrPlane::Type::kUint, rows.counts.data(), sizeof(uint32_t)});
    files_[f]->read_rows(planes, first_row, n_rows);
  }
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
