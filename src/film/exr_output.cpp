// SPDX-License-Identifier: Apache-2.0
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "film/auxiliary_features.h"
#include "film/exr.h"
#include "film/exr_library.h"
#include "film/image_writer.h"
#include "imageio/output_file.h"

namespace covary {
namespace {

std::vector<ExrPlane> sorted_by_name(std::vector<ExrPlane> planes) {
  std::sort(planes.begin(), planes.end(), [](const ExrPlane& a, const ExrPlane& b) { return a.name < b.name; });
  return planes;
}

/// Of planes in the order of their names.
uint32_t crc_of_shape(const ImagePlace& place, const std::map<std::string, std::string>& attributes,
                      std::span<const ExrPlane> planes) {
  std::vector<std::string> names;
  for (const ExrPlane& plane : planes) names.push_back(plane.name + " " + exr_type_name(exr_pixel_type(plane)));
  return crc_of_header(exr_shape_text(place, names), attributes);
}

Checksums checksums_of(const ImagePlace& place, const std::map<std::string, std::string>& attributes,
                       std::span<const ExrPlane> planes) {
  const std::vector<ExrPlane> sorted = sorted_by_name({planes.begin(), planes.end()});
  Checksums sums{crc_of_shape(place, attributes, sorted), std::vector<uint32_t>(sorted.size())};
  const size_t n_pixels = static_cast<size_t>(place.window.width) * static_cast<size_t>(place.window.height);
  parallel_for(sorted.size(), [&](size_t i) {
    sums.channels[i] = crc_of_values(0, sorted[i].base, n_pixels, sorted[i].pixel_stride);
  });
  return sums;
}

/// n rows of the window from row `first` on.
Imath::Box2i rows_of(const CropWindow& w, int first, int n) {
  return {{w.x, w.y + first}, {w.x + w.width - 1, w.y + first + n - 1}};
}

/// The header of a file with these channels, without their pixels.
Imf::Header header_of(const ImagePlace& place, const std::map<std::string, std::string>& attributes,
                      std::span<const ExrPlane> planes, const Checksums& checksums, ExrCompression compression) {
  Imf::Header header(Imath::Box2i({0, 0}, {place.frame_width - 1, place.frame_height - 1}),
                     rows_of(place.window, 0, place.window.height));
  header.compression() = compression == ExrCompression::kZip ? Imf::ZIP_COMPRESSION : Imf::NO_COMPRESSION;
  for (const auto& [key, value] : attributes) header.insert(key, Imf::StringAttribute(value));
  header.insert(kChecksums, Imf::StringAttribute(checksums.text()));
  for (const ExrPlane& plane : planes) header.channels().insert(plane.name, Imf::Channel(exr_pixel_type(plane)));
  return header;
}

/// Writes the file; `write` gives all pixels to it. Throws Error(kIo).
template <typename Write>
void write_file(const std::string& path, const Imf::Header& header, const Write& write) {
  OutputFile file(path);
  try {
    ExrStream stream(file, path);
    Imf::OutputFile exr(stream, header);
    write(exr);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(ErrorCode::kIo, fmt::format("cannot write {}: {}", path, error.what()));
  }
  file.commit();
}

void set_planes(std::span<const ExrPlane> planes, const Imath::Box2i& window, Imf::OutputFile& exr) {
  Imf::FrameBuffer pixels;
  for (const ExrPlane& plane : planes) pixels.insert(plane.name, exr_slice(plane, window));
  exr.setFrameBuffer(pixels);
}

/// The channels of a picture, and of its alpha if it has one, by their names.
std::vector<ExrPlane> picture_planes(Image& colours, Image& alpha) {
  std::vector<ExrPlane> planes;
  if (!alpha.data.empty()) add_image_planes("A", alpha, planes);
  add_image_planes("", colours, planes);
  return sorted_by_name(std::move(planes));
}

}  // namespace

void add_image_planes(const std::string& name, Image& image, std::vector<ExrPlane>& planes) {
  if (image.channels == 1) {
    planes.push_back({name, ExrPlane::Type::kFloat, image.data.data(), sizeof(float)});
    return;
  }
  COVARY_CHECK(image.channels == 3, "an image of one or three channels");
  const bool is_vector = name == "Motion" || std::ranges::any_of(kAuxiliaryFeatures, [&](const AuxiliaryFeature& of) {
                           return name == of.layer && !of.is_colour;
                         });
  const std::string components = is_vector ? "XYZ" : "RGB";
  for (size_t c = 0; c < 3; ++c)
    planes.push_back({(name.empty() ? "" : name + ".") + components[c], ExrPlane::Type::kFloat, image.data.data() + c,
                      3 * sizeof(float)});
}

void write_exr(const std::string& path, const ImagePlace& place, const std::map<std::string, std::string>& attributes,
               std::span<const ExrPlane> planes, ExrCompression compression) {
  prepare_exr_library();
  const int height = place.window.height;
  write_file(path, header_of(place, attributes, planes, checksums_of(place, attributes, planes), compression),
             [&](Imf::OutputFile& exr) {
               set_planes(planes, rows_of(place.window, 0, height), exr);
               exr.writePixels(height);
             });
}

void write_exr_rows(const std::string& path, const ImagePlace& place,
                    const std::map<std::string, std::string>& attributes, const PictureRows& rows) {
  constexpr int kRows = 64;
  prepare_exr_library();
  const int height = place.window.height;
  const auto for_all_rows = [&](const auto& use) {
    for (int first = 0; first < height; first += kRows) {
      const int n = std::min(kRows, height - first);
      auto [colours, alpha] = rows(first, n);
      use(picture_planes(colours, alpha), first, n);
    }
  };
  std::vector<ExrPlane> channels;  // without pixels
  Checksums sums;
  for_all_rows([&](const std::vector<ExrPlane>& planes, int, int n) {
    sums.channels.resize(planes.size());
    const size_t n_pixels = static_cast<size_t>(place.window.width) * static_cast<size_t>(n);
    for (size_t i = 0; i < planes.size(); ++i)
      sums.channels[i] = crc_of_values(sums.channels[i], planes[i].base, n_pixels, planes[i].pixel_stride);
    channels = planes;
  });
  sums.header = crc_of_shape(place, attributes, channels);
  write_file(path, header_of(place, attributes, channels, sums, ExrCompression::kZip), [&](Imf::OutputFile& exr) {
    for_all_rows([&](const std::vector<ExrPlane>& planes, int first, int n) {
      set_planes(planes, rows_of(place.window, first, n), exr);
      exr.writePixels(n);
    });
  });
}

}  // namespace covary
