// SPDX-License-Identifier: Apache-2.0
#include "film/exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <numeric>
#include <set>
#include <sstream>

#include "core/parallel.h"
#include "film/exr_library.h"
#include "film/input_error.h"
#include "film/luminance_chroma.h"
#include "imageio/exr_image.h"

namespace covary {
namespace {

std::string compression_name(Imf::Compression compression) {
  constexpr const char* kNames[] = {"none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"};
  const auto i = static_cast<size_t>(compression);
  return i < std::size(kNames) ? kNames[i] : "unknown";
}

/// Upper bound on bytes of pixels per byte of file: runs of 128 in two bytes, 1032 for deflate (after pxr24 has dropped
/// a quarter). No such bound is known for the others, which pack a black block into a few bytes.
double largest_ratio(const std::string& compression) {
  if (compression == "none") return 1;
  if (compression == "rle") return 64;
  if (compression == "zip" || compression == "zips") return 1032;
  if (compression == "pxr24") return 1032 * 4 / 3.0;
  return 1e5;
}

/// Throws if the windows are empty or absurdly large.
ImagePlace place_of(const std::string& path, const Imf::Header& header) {
  const Imath::Box2i display = header.displayWindow(), window = header.dataWindow();
  const auto extent = [](int low, int high) { return static_cast<int64_t>(high) - low + 1; };
  const int64_t width = extent(window.min.x, window.max.x), height = extent(window.min.y, window.max.y);
  const int64_t frame_width = extent(display.min.x, display.max.x), frame_height = extent(display.min.y, display.max.y);
  if (std::min({width, height, frame_width, frame_height}) < 1 ||
      std::max({width, height, frame_width, frame_height}) > kMaxExrSize)
    fail_input(path, fmt::format("{} x {} pixels in a frame of {} x {}; expected 1 to {} in each direction", width,
                                 height, frame_width, frame_height, kMaxExrSize));
  ImagePlace place{static_cast<int>(frame_width), static_cast<int>(frame_height), {}};
  place.window = {window.min.x - display.min.x, window.min.y - display.min.y, static_cast<int>(width),
                  static_cast<int>(height)};
  return place;
}

/// Of all parts, which share it.
ColourSpace colour_space_of(const Imf::Header& header, const std::map<std::string, std::string>& attributes) {
  if (Imf::hasChromaticities(header)) {
    const Imf::Chromaticities& c = Imf::chromaticities(header);
    return {{c.red.x, c.red.y}, {c.green.x, c.green.y}, {c.blue.x, c.blue.y}, {c.white.x, c.white.y}};
  }
  const auto* aces = header.findTypedAttribute<Imf::IntAttribute>("acesImageContainerFlag");
  return aces && aces->value() == 1 ? aces_colour_space() : named_colour_space(attributes);
}

/// The dot-separated parts of the name of a channel's layer.
std::vector<std::string> layer_words(const std::string& channel) {
  std::vector<std::string> words;
  std::stringstream text(channel);
  for (std::string word; std::getline(text, word, '.');) words.push_back(word);
  if (!words.empty()) words.pop_back();
  return words;
}

/// Views by the attribute multiView (of which those without a layer's name have the first one), or by layers called
/// left and right; parts may have said theirs before.
void assign_views(const Imf::Header& header, std::vector<ExrFile::Channel>& channels) {
  std::vector<std::string> views = {"left", "right"};
  const bool is_told = Imf::hasMultiView(header) && !Imf::multiView(header).empty();
  if (is_told) views = Imf::multiView(header);
  std::set<std::string> found;
  for (ExrFile::Channel& channel : channels) {
    for (const std::string& word : layer_words(channel.name))
      if (channel.view.empty() && std::find(views.begin(), views.end(), word) != views.end()) channel.view = word;
    if (!channel.view.empty()) found.insert(channel.view);
  }
  if (!is_told && found.size() == 1 && *found.begin() == "left") std::swap(views[0], views[1]);
  for (ExrFile::Channel& channel : channels)
    if (!found.empty() && channel.view.empty() && channel.name.find('.') == std::string::npos) channel.view = views[0];
}

}  // namespace

struct ExrFile::Handle {
  explicit Handle(const std::string& path) : file(path.c_str()) {}
  Imf::MultiPartInputFile file;
  Imath::Box2i window;                                       // of place_
  bool has_pixels = false;                                   // in any part so far
  std::map<std::string, std::pair<int, std::string>> parts;  // channel -> part, name in the part
  std::unique_ptr<LuminanceChroma> luminance_chroma;         // gives R, G and B, which are of no part
};

namespace {
constexpr int kNoPart = -1;
}  // namespace

ExrFile::~ExrFile() = default;

ExrFile::ExrFile(const std::string& path, ChecksumPolicy checksums, bool unreadable_too) : path_(path) {
  prepare_exr_library();
  // OpenEXR's own messages do not distinguish a missing file from a damaged one.
  if (!is_exr(path)) fail_input(path, "not an EXR file; `covary convert` makes one of an image in another format");
  check_exr_header(path);
  try {
    handle_ = std::make_unique<Handle>(path);
  } catch (const std::exception& error) {
    fail_input(path, fmt::format("damaged EXR file: {}", error.what()));
  }

  std::vector<int> parts(static_cast<size_t>(handle_->file.parts()));
  std::iota(parts.begin(), parts.end(), 0);
  for (const int part : parts) add_part(part), add_attributes(part, checksums);
  if (has_luminance_chroma(handle_->file.header(0).channels()) && parts.size() == 1) {
    handle_->luminance_chroma = std::make_unique<LuminanceChroma>(path);
    for (const char* name : {"R", "G", "B"})
      channels_.push_back({name, "half", ""}), handle_->parts[name] = {kNoPart, name};
  }
  if (channels_.empty() && !(unreadable_too && !unreadable_.empty()))
    fail_input(path, unreadable_.empty()
                         ? "an EXR file without channels"
                         : fmt::format("no channels that can be read: {} ({}); render or flatten it with one "
                                       "value per pixel and channel",
                                       unreadable_[0].name, unreadable_[0].type));
  assign_views(handle_->file.header(0), channels_);
  colours_ = colour_space_of(handle_->file.header(0), attributes_);
  check_pixels();
  if (checksums == ChecksumPolicy::kCheck) check_header();
}

void ExrFile::add_part(int part) {
  const Imf::Header& header = handle_->file.header(part);
  const std::string name = header.hasName() ? header.name() : "", view = header.hasView() ? header.view() : "";
  const std::string prefix = handle_->file.parts() > 1 && !name.empty() ? name + "." : "";
  const bool is_deep = header.hasType() && Imf::isDeepData(header.type());
  const ImagePlace place = place_of(path_, header);
  bool any = false;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    const Imf::Channel& channel = it.channel();
    std::string full = it.name(), type = exr_type_name(channel.type);
    if (!full.starts_with(prefix)) full.insert(0, prefix);
    const bool is_luminance = full == "Y" && has_luminance_chroma(header.channels());
    const bool is_subsampled = channel.xSampling != 1 || channel.ySampling != 1;
    if (is_deep || is_subsampled || is_luminance) {
      type += is_deep         ? ", deep"
              : is_subsampled ? fmt::format(", {} x {} sub-sampled", channel.xSampling, channel.ySampling)
                              : ", luminance";
      unreadable_.push_back({full, type, view});
      continue;
    }
    any = true;
    channels_.push_back({full, type, view});
    handle_->parts[full] = {part, it.name()};
  }
  const std::string compression = compression_name(header.compression());
  if (compression_.empty())
    compression_ = compression;
  else if ((", " + compression_ + ",").find(", " + compression + ",") == std::string::npos)
    compression_ += ", " + compression;
  if (place_.frame_width == 0 || (any && !handle_->has_pixels)) {
    place_ = place;
    handle_->window = header.dataWindow();
  } else if (any) {
    handle_->window.extendBy(header.dataWindow());
    const Imath::Box2i& all = handle_->window;
    place_.window = {all.min.x - header.displayWindow().min.x, all.min.y - header.displayWindow().min.y,
                     all.max.x - all.min.x + 1, all.max.y - all.min.y + 1};
  }
  handle_->has_pixels |= any;
}

void ExrFile::add_attributes(int part, ChecksumPolicy checksums) {
  const Imf::Header& header = handle_->file.header(part);
  for (auto it = header.begin(); it != header.end(); ++it) {
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute()))
      attributes_.emplace(it.name(), text->value());
    else if (it.name() == std::string(kChecksums) && checksums == ChecksumPolicy::kCheck)
      fail_input(path_, fmt::format("damaged: the attribute {} is of the type '{}', not 'string'", kChecksums,
                                    it.attribute().typeName()));
  }
}

void ExrFile::check_header() {
  checksums_ = find_checksums(path_, attributes_);
  if (!checksums_) return;
  if (const uint32_t found = crc_of_header(shape_text(), attributes_); found != checksums_->header)
    fail_checksum(path_, "the header is one", found, checksums_->header);
  if (checksums_->channels.size() != channels_.size())
    fail_input(path_,
               fmt::format("damaged: {} channels and {} checksums", channels_.size(), checksums_->channels.size()));
}

std::string ExrFile::shape_text() const {
  std::vector<std::string> names;
  for (const Channel& channel : channels_) names.push_back(channel.name + " " + channel.type);
  return exr_shape_text(place_, names);
}

void ExrFile::check_channel(const std::string& name, uint32_t crc) const {
  const auto it = std::find_if(channels_.begin(), channels_.end(), [&](const Channel& c) { return c.name == name; });
  const uint32_t stored = checksums_->channels[static_cast<size_t>(it - channels_.begin())];
  if (crc != stored) fail_checksum(path_, fmt::format("the channel {} is one", name), crc, stored);
}

void ExrFile::check(std::span<const std::string> channels) const {
  const std::set<std::string> each(channels.begin(), channels.end());  // a grey layer names its channel three times
  if (checksums_) checksums_of(std::vector(each.begin(), each.end()));
}

std::vector<uint32_t> ExrFile::checksums_of(std::span<const std::string> channels) const {
  constexpr size_t kValuesAtOnce = size_t{1} << 20;
  std::vector<uint32_t> sums(channels.size(), 0);
  if (channels.empty()) return sums;
  const size_t width = static_cast<size_t>(place_.window.width), height = static_cast<size_t>(place_.window.height);
  const size_t rows = std::min(std::max<size_t>(kValuesAtOnce / (width * channels.size()), 1), height);
  std::vector<uint32_t> values(rows * width * channels.size());
  std::vector<ExrPlane> planes;
  for (size_t c = 0; c < channels.size(); ++c) {
    const auto type = find(channels[c])->type == "uint" ? ExrPlane::Type::kUint : ExrPlane::Type::kFloat;
    planes.push_back({channels[c], type, values.data() + c * rows * width, sizeof(uint32_t)});
  }
  for (size_t y = 0; y < height; y += rows) {
    const size_t n = std::min(rows, height - y);
    read_rows(planes, static_cast<int>(y), static_cast<int>(n));
    for (size_t c = 0; c < channels.size(); ++c)
      sums[c] = crc_of_values(sums[c], planes[c].base, n * width, sizeof(uint32_t));
  }
  for (size_t c = 0; checksums_ && c < channels.size(); ++c) check_channel(channels[c], sums[c]);
  return sums;
}

void ExrFile::check_pixels() const {
  double file_values = 0, min_bytes = 0, memory = 0;
  for (const auto& [name, where] : handle_->parts) {
    if (where.first == kNoPart) continue;
    const Imf::Header& header = handle_->file.header(where.first);
    const Imath::Box2i& window = header.dataWindow();
    const double n_pixels =
        (static_cast<double>(window.max.x) - window.min.x + 1) * (static_cast<double>(window.max.y) - window.min.y + 1);
    const double bytes = header.channels().findChannel(where.second)->type == Imf::HALF ? 2 : 4;
    file_values += 1, memory += n_pixels * sizeof(float);
    min_bytes += n_pixels * bytes / largest_ratio(compression_name(header.compression()));
  }
  const double all_memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  std::error_code ignored;
  const double file_bytes = static_cast<double>(std::filesystem::file_size(path_, ignored));
  if (memory > all_memory || min_bytes > file_bytes)
    fail_input(path_, fmt::format("{}the header says {} x {} pixels of {} channels, more than {} can hold",
                                  min_bytes > file_bytes ? "is damaged or cut off: " : "", place_.window.width,
                                  place_.window.height, file_values,
                                  min_bytes > file_bytes ? fmt::format("a file of {:.0f} bytes with compression '{}'",
                                                                       file_bytes, compression_)
                                                         : "the memory"));
}

const ExrFile::Channel* ExrFile::find(const std::string& name) const {
  const auto it = std::find_if(channels_.begin(), channels_.end(), [&](const Channel& c) { return c.name == name; });
  return it == channels_.end() ? nullptr : &*it;
}

void ExrFile::read(std::span<const ExrPlane> planes) const {
  read_rows(planes, 0, place_.window.height);
  if (!checksums_) return;
  const size_t n_pixels = static_cast<size_t>(place_.window.width) * static_cast<size_t>(place_.window.height);
  std::vector<uint32_t> sums(planes.size());
  parallel_for(planes.size(),
               [&](size_t i) { sums[i] = crc_of_values(0, planes[i].base, n_pixels, planes[i].pixel_stride); });
  std::vector<std::string> converted;
  for (size_t i = 0; i < planes.size(); ++i) {
    if (find(planes[i].name)->type == exr_type_name(exr_pixel_type(planes[i])))
      check_channel(planes[i].name, sums[i]);
    else
      converted.push_back(planes[i].name);
  }
  if (!converted.empty()) check(converted);
}

void ExrFile::read_rows(std::span<const ExrPlane> planes, int first_row, int n_rows) const {
  COVARY_CHECK(first_row >= 0 && n_rows >= 1 && first_row + n_rows <= place_.window.height, "rows are in the window");
  Imath::Box2i rows = handle_->window;
  rows.min.y += first_row;
  rows.max.y = rows.min.y + n_rows - 1;
  std::map<int, std::vector<ExrPlane>> by_part;
  for (const ExrPlane& plane : planes) {
    const auto it = handle_->parts.find(plane.name);
    COVARY_CHECK(it != handle_->parts.end(), "channel " + plane.name + " exists");
    ExrPlane& in_part = by_part[it->second.first].emplace_back(plane);
    in_part.name = it->second.second;
  }
  try {
    for (const auto& [part, of_part] : by_part) {
      if (part == kNoPart) {
        handle_->luminance_chroma->read_rows(of_part, rows.min.y, n_rows);
        continue;
      }
      if (!(handle_->file.header(part).dataWindow() == handle_->window)) {
        read_from_other_window(part, of_part, first_row, n_rows);
        continue;
      }
      Imf::FrameBuffer buffer;
      for (const ExrPlane& plane : of_part) buffer.insert(plane.name, exr_slice(plane, rows));
      Imf::InputPart input(handle_->file, part);
      input.setFrameBuffer(buffer);
      input.readPixels(rows.min.y, rows.max.y);
    }
  } catch (const std::exception& error) {
    fail_input(path_, fmt::format("damaged or incomplete EXR file: {}", error.what()));
  }
}

void ExrFile::read_from_other_window(int part, std::span<const ExrPlane> planes, int first_row, int n_rows) const {
  const Imath::Box2i &to = handle_->window, from = handle_->file.header(part).dataWindow();
  const auto width = static_cast<size_t>(place_.window.width), n_bytes = sizeof(float);
  Imath::Box2i rows({from.min.x, std::max(from.min.y, to.min.y + first_row)},
                    {from.max.x, std::min(from.max.y, to.min.y + first_row + n_rows - 1)});
  const int left = std::max(to.min.x, from.min.x), right = std::min(to.max.x, from.max.x);
  const size_t from_width = static_cast<size_t>(from.max.x - from.min.x + 1);
  const size_t n = rows.max.y < rows.min.y ? 0 : from_width * static_cast<size_t>(rows.max.y - rows.min.y + 1);
  std::vector<std::vector<uint32_t>> values(planes.size(), std::vector<uint32_t>(n));
  Imf::FrameBuffer buffer;
  for (size_t i = 0; i < planes.size() && n > 0; ++i)
    buffer.insert(planes[i].name, exr_slice({planes[i].name, planes[i].type, values[i].data(), n_bytes}, rows));
  if (n > 0) {
    Imf::InputPart input(handle_->file, part);
    input.setFrameBuffer(buffer);
    input.readPixels(rows.min.y, rows.max.y);
  }
  for (size_t i = 0; i < planes.size(); ++i)
    for (int y = 0; y < n_rows; ++y)
      for (size_t x = 0; x < width; ++x) {
        const int at_x = to.min.x + static_cast<int>(x), at_y = to.min.y + first_row + y;
        const bool inside = at_x >= left && at_x <= right && at_y >= rows.min.y && at_y <= rows.max.y;
        const size_t source =
            static_cast<size_t>(at_y - rows.min.y) * from_width + static_cast<size_t>(at_x - from.min.x);
        const uint32_t value = inside ? values[i][source] : 0;
        char* pixel =
            static_cast<char*>(planes[i].base) + (static_cast<size_t>(y) * width + x) * planes[i].pixel_stride;
        std::memcpy(pixel, &value, n_bytes);
      }
}

}  // namespace covary
