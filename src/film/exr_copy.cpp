// SPDX-License-Identifier: Apache-2.0
#include "film/exr_copy.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepScanLineInputPart.h>
#include <OpenEXR/ImfDeepScanLineOutputPart.h>
#include <OpenEXR/ImfDeepTiledInputPart.h>
#include <OpenEXR/ImfDeepTiledOutputPart.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledInputPart.h>
#include <OpenEXR/ImfTiledOutputPart.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>

#include "film/exr_library.h"
#include "film/luminance_chroma.h"

namespace covary {
namespace {

/// Attributes that describe the old pixels: a thumbnail, and what OpenImageIO computes of them.
constexpr const char* kOfOldPixels[] = {"preview", "oiio:SHA-1", "oiio:AverageColor", "oiio:ConstantColor"};
constexpr const char* kOwnPrefix = "covary:";
constexpr int kRowsOfZip = 16;                     // compressed together
constexpr size_t kBytesAtOnce = size_t{32} << 20;  // of channels that are decoded and encoded again

/// A part of the new file.
struct Part {
  int source = 0;  ///< number of the part it comes from
  Imf::Header header;
  bool is_same = true;                     ///< all channels of the source
  std::vector<std::string> kept;           ///< in the source, by the names there
  std::vector<std::string> subsampled;     ///< in the source; kept only if all channels are
  std::vector<ExrFile::Channel> channels;  ///< of the new part, sorted by name, as ExrFile will list them
  std::vector<std::pair<std::string, const ExrPlane*>> planes;  ///< by the names in the part

  bool is_deep() const { return header.hasType() && Imf::isDeepData(header.type()); }
  bool is_tiled() const { return header.hasTileDescription(); }
};

std::string prefix_of(const Imf::MultiPartInputFile& file, int part) {
  const Imf::Header& header = file.header(part);
  return file.parts() > 1 && header.hasName() ? header.name() + "." : "";
}

/// As ExrFile names channels.
std::string full_name(const std::string& prefix, const std::string& channel) {
  return channel.starts_with(prefix) ? channel : prefix + channel;
}

class Copy {
 public:
  Copy(const std::string& source, const ExrChanges& changes, ChecksumPolicy checksums)
      : source_(source), changes_(changes), file_(source, checksums), in_(source.c_str()) {
    for (int n = 0; n < in_.parts(); ++n)
      if (std::optional<Part> part = part_of(n)) parts_.push_back(std::move(*part));
    place_planes();
    for (Part& part : parts_)
      if (!part.is_same) make_scan_lines(part);
    Part& first = parts_[picture_part()];
    for (const auto& [name, value] : changes_.attributes) first.header.insert(name, Imf::StringAttribute(value));
  }

  void write(const std::string& path) {
    if (can_have_checksums())
      parts_[picture_part()].header.insert(kChecksums, Imf::StringAttribute(checksums().text()));
    OutputFile output(path);
    try {
      ExrStream stream(output, path);
      std::vector<Imf::Header> headers;
      for (const Part& part : parts_) headers.push_back(part.header);
      Imf::MultiPartOutputFile out(stream, headers.data(), static_cast<int>(headers.size()), true);
      for (size_t n = 0; n < parts_.size(); ++n)
        parts_[n].is_same ? copy(parts_[n], static_cast<int>(n), out) : rewrite(parts_[n], static_cast<int>(n), out);
    } catch (const Error&) {
      throw;
    } catch (const std::exception& error) {
      throw Error(ErrorCode::kIo, fmt::format("cannot write {} as a version of {}: {}", path, source_, error.what()));
    }
    output.commit();
  }

  const std::vector<std::string>& lost() const { return lost_; }

 private:
  const ExrPlane* plane(const std::string& name) const {
    for (const ExrPlane& plane : changes_.planes)
      if (plane.name == name) return &plane;
    return nullptr;
  }

  /// Part `n` with what it keeps, or with planes of the same name in place; nullopt if it keeps nothing.
  std::optional<Part> part_of(int n) {
    Part part{n, in_.header(n), true, {}, {}, {}};
    for (const char* name : kOfOldPixels) part.header.erase(name);
    std::vector<std::string> own;
    for (auto it = part.header.begin(); it != part.header.end(); ++it)
      if (std::string(it.name()).starts_with(kOwnPrefix)) own.emplace_back(it.name());
    for (const std::string& name : own) part.header.erase(name);
    if (part.is_deep()) return changes_.only_planes ? std::nullopt : std::optional(part);
    const std::string prefix = prefix_of(in_, n);
    bool has_planes = false;
    const Imf::ChannelList& channels = in_.header(n).channels();
    for (auto it = channels.begin(); it != channels.end(); ++it) {
      const std::string name = full_name(prefix, it.name());
      const bool is_luminance = name == "Y" && has_luminance_chroma(channels);
      if (is_luminance || it.channel().xSampling != 1 || it.channel().ySampling != 1) {
        part.subsampled.emplace_back(it.name());
        continue;
      }
      if (const ExrPlane* replacing = plane(name)) {
        part.planes.emplace_back(it.name(), replacing), has_planes = true;
      } else if (!changes_.only_planes && !changes_.left_out.contains(name)) {
        part.kept.emplace_back(it.name());
        continue;
      }
      part.is_same = false;
    }
    if (changes_.only_planes) part.subsampled.clear();
    if (part.kept.empty() && part.subsampled.empty() && !has_planes && n != part_of_picture()) return std::nullopt;
    return part;
  }

  /// Number of the picture's part in the source.
  int part_of_picture() const {
    for (int n = 0; n < in_.parts(); ++n) {
      const std::string prefix = prefix_of(in_, n);
      const Imf::Header& header = in_.header(n);
      if (header.hasType() && Imf::isDeepData(header.type())) continue;
      if (changes_.picture.empty()) return n;
      for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
        if (full_name(prefix, it.name()) == changes_.picture) return n;
    }
    return 0;
  }

  size_t picture_part() const {
    const auto is_it = [&](const Part& part) { return part.source == part_of_picture(); };
    return static_cast<size_t>(std::find_if(parts_.begin(), parts_.end(), is_it) - parts_.begin());
  }

  /// Of the part's channels, in the new file.
  std::string new_prefix(const Part& part) const {
    return parts_.size() > 1 && !part.is_deep() ? prefix_of(in_, part.source) : "";
  }

  /// Puts planes without a channel of their name into the part of which they have the prefix, or into the picture's.
  void place_planes() {
    Part& picture = parts_[picture_part()];
    for (const ExrPlane& plane : changes_.planes) {
      const bool placed = std::any_of(parts_.begin(), parts_.end(), [&](const Part& part) {
        return std::any_of(part.planes.begin(), part.planes.end(), [&](const auto& p) { return p.second == &plane; });
      });
      if (placed) continue;
      const auto is_of = [&](const Part& part) {
        const std::string own = new_prefix(part);
        return !own.empty() && plane.name.starts_with(own);
      };
      const auto named = std::find_if(parts_.begin(), parts_.end(), is_of);
      Part& part = named == parts_.end() ? picture : *named;
      part.planes.emplace_back(named == parts_.end() ? plane.name : plane.name.substr(new_prefix(part).size()), &plane);
      part.is_same = false;
    }
    for (Part& part : parts_) {
      const std::string own = new_prefix(part);
      part.channels.clear();
      const Imf::ChannelList& channels = in_.header(part.source).channels();
      for (const std::string& name : part.kept)
        part.channels.push_back({full_name(own, name), exr_type_name(channels[name.c_str()].type)});
      for (const auto& [name, plane] : part.planes)
        part.channels.push_back({full_name(own, name), exr_type_name(exr_pixel_type(*plane))});
    }
  }

  /// Whether all parts have the window of the planes, which checksums are of, and channels whose values are read as
  /// they are.
  bool can_have_checksums() const {
    return std::all_of(parts_.begin(), parts_.end(), [&](const Part& part) {
      if (part.is_same && has_luminance_chroma(part.header.channels())) return false;
      return part.is_deep() || part.header.dataWindow() == window_of_planes(part);
    });
  }

  /// The window of the planes, in the part's coordinates.
  Imath::Box2i window_of_planes(const Part& part) const {
    const CropWindow& w = file_.place().window;
    const Imath::V2i corner = part.header.displayWindow().min + Imath::V2i(w.x, w.y);
    return {corner, corner + Imath::V2i(w.width - 1, w.height - 1)};
  }

  void make_scan_lines(Part& part) {
    if (part.is_tiled() && part.header.tileDescription().mode != Imf::ONE_LEVEL)
      lost_.push_back(
          fmt::format("{}: smaller levels (mip maps) are not kept, since they show the old image", source_));
    const bool is_replaced = has_luminance_chroma(in_.header(part.source).channels());  // by R, G and B
    for (const std::string& name : part.subsampled)
      if (!is_replaced)
        lost_.push_back(fmt::format("{}: the channel {} is not kept, since it is sub-sampled", source_, name));
    part.header.erase("tiles");
    if (part.header.hasType()) part.header.setType(Imf::SCANLINEIMAGE);
    part.header.lineOrder() = Imf::INCREASING_Y;
    part.header.compression() = Imf::ZIP_COMPRESSION;
    Imf::ChannelList channels;
    const Imf::ChannelList& old = in_.header(part.source).channels();
    for (const std::string& name : part.kept) channels.insert(name, old[name.c_str()]);
    for (const auto& [name, plane] : part.planes) channels.insert(name, Imf::Channel(exr_pixel_type(*plane)));
    part.header.channels() = channels;
  }

  /// Of the header and of all channels, in the order in which ExrFile will list them.
  Checksums checksums() {
    std::vector<std::string> shape;
    Checksums sums;
    const CropWindow& w = file_.place().window;
    const size_t n_pixels = static_cast<size_t>(w.width) * static_cast<size_t>(w.height);
    for (const Part& part : parts_) {
      if (part.is_deep()) continue;
      const std::string prefix = prefix_of(in_, part.source);
      std::vector<std::string> read;
      for (const std::string& name : part.kept) read.push_back(full_name(prefix, name));
      const std::vector<uint32_t> kept = file_.checksums_of(read);
      std::vector<std::pair<std::string, std::pair<std::string, uint32_t>>> sorted;  // by the names in the part
      for (size_t i = 0; i < part.kept.size(); ++i)
        sorted.push_back({part.kept[i], {part.channels[i].name + " " + part.channels[i].type, kept[i]}});
      for (size_t i = 0; i < part.planes.size(); ++i) {
        const ExrPlane& plane = *part.planes[i].second;
        const ExrFile::Channel& channel = part.channels[part.kept.size() + i];
        sorted.push_back(
            {part.planes[i].first,
             {channel.name + " " + channel.type, crc_of_values(0, plane.base, n_pixels, plane.pixel_stride)}});
      }
      std::sort(sorted.begin(), sorted.end());
      for (const auto& [name, entry] : sorted) shape.push_back(entry.first), sums.channels.push_back(entry.second);
    }
    sums.header = crc_of_header(exr_shape_text(file_.place(), shape), changes_.attributes);
    return sums;
  }

  void copy(const Part& part, int number, Imf::MultiPartOutputFile& out) {
    if (part.is_deep() && part.is_tiled()) {
      Imf::DeepTiledInputPart from(in_, part.source);
      Imf::DeepTiledOutputPart(out, number).copyPixels(from);
    } else if (part.is_deep()) {
      Imf::DeepScanLineInputPart from(in_, part.source);
      Imf::DeepScanLineOutputPart(out, number).copyPixels(from);
    } else if (part.is_tiled()) {
      Imf::TiledInputPart from(in_, part.source);
      Imf::TiledOutputPart(out, number).copyPixels(from);
    } else {
      Imf::InputPart from(in_, part.source);
      Imf::OutputPart(out, number).copyPixels(from);
    }
  }

  void rewrite(const Part& part, int number, Imf::MultiPartOutputFile& out) {
    const Imath::Box2i window = part.header.dataWindow();
    const auto width = static_cast<size_t>(window.max.x - window.min.x + 1);
    const Imf::ChannelList& channels = in_.header(part.source).channels();
    const size_t row_bytes = width * sizeof(float);  // of a channel; halves use half of it
    const size_t at_once = kBytesAtOnce / std::max<size_t>(row_bytes * part.kept.size(), 1) / kRowsOfZip * kRowsOfZip;
    const int n_rows = static_cast<int>(std::clamp<size_t>(at_once, kRowsOfZip, 1 << 14));
    std::vector<char> values(row_bytes * part.kept.size() * static_cast<size_t>(n_rows));
    Imf::InputPart from(in_, part.source);
    Imf::OutputPart to(out, number);
    for (int y = window.min.y; y <= window.max.y; y += n_rows) {
      const Imath::Box2i rows({window.min.x, y}, {window.max.x, std::min(y + n_rows - 1, window.max.y)});
      Imf::FrameBuffer read, written;
      for (size_t i = 0; i < part.kept.size(); ++i) {
        const Imf::PixelType type = channels[part.kept[i].c_str()].type;
        const size_t size = type == Imf::HALF ? 2 : 4;
        char* base = values.data() + i * row_bytes * static_cast<size_t>(n_rows);
        read.insert(part.kept[i], Imf::Slice::Make(type, base, rows, size, size * width));
      }
      written = read;
      for (const auto& [name, plane] : part.planes) written.insert(name, exr_slice(*plane, window_of_planes(part)));
      if (!part.kept.empty()) {
        from.setFrameBuffer(read);
        from.readPixels(rows.min.y, rows.max.y);
      }
      to.setFrameBuffer(written);
      to.writePixels(rows.max.y - rows.min.y + 1);
    }
  }

  const std::string& source_;
  const ExrChanges& changes_;
  const ExrFile file_;
  Imf::MultiPartInputFile in_;
  std::vector<Part> parts_;
  std::vector<std::string> lost_;
};

}  // namespace

std::vector<std::string> write_changed_exr(const std::string& path, const std::string& source,
                                           const ExrChanges& changes, ChecksumPolicy checksums) {
  Copy copy(source, changes, checksums);
  copy.write(path);
  return copy.lost();
}

std::string alpha_channel(std::span<const ExrFile::Channel> channels, const std::string& first) {
  const size_t dot = first.rfind('.');
  const std::string prefix = dot == std::string::npos ? "" : first.substr(0, dot + 1);
  std::string last = first.substr(prefix.size());
  std::transform(last.begin(), last.end(), last.begin(), [](unsigned char c) { return std::tolower(c); });
  if (last != "r" && last != "red" && last != "x" && last != "y") return "";  // such as depth
  for (const char* suffix : {"A", "a", "alpha", "Alpha"})
    for (const ExrFile::Channel& channel : channels)
      if (channel.name == prefix + suffix) return channel.name;
  return "";
}

}  // namespace covary
