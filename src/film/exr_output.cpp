// SPDX-License-Identifier: Apache-2.0
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "film/exr.h"
#include "film/exr_library.h"
#include "film/output_file.h"

namespace covary {
namespace {

Checksums checksums_of(const ImagePlace& place, const std::map<std::string, std::string>& attributes,
                       std::span<const ExrPlane> planes) {
  std::map<std::string, const ExrPlane*> by_name;
  for (const ExrPlane& plane : planes) by_name[plane.name] = &plane;
  std::vector<const ExrPlane*> sorted;
  std::vector<std::string> names;
  for (const auto& [name, plane] : by_name) {
    sorted.push_back(plane);
    names.push_back(name + " " + exr_type_name(exr_pixel_type(*plane)));
  }
  Checksums sums{crc_of_header(exr_shape_text(place, names), attributes), std::vector<uint32_t>(sorted.size())};
  const size_t n_pixels = static_cast<size_t>(place.window.width) * static_cast<size_t>(place.window.height);
  parallel_for(sorted.size(), [&](size_t i) {
    sums.channels[i] = crc_of_values(0, sorted[i]->base, n_pixels, sorted[i]->pixel_stride);
  });
  return sums;
}

}  // namespace

void add_image_planes(const std::string& name, Image& image, std::vector<ExrPlane>& planes) {
  if (image.channels == 1) {
    planes.push_back({name, ExrPlane::Type::kFloat, image.data.data(), sizeof(float)});
    return;
  }
  COVARY_CHECK(image.channels == 3, "an image of one or three channels");
  const bool is_vector = name == "N" || name == "P" || name == "DenoisingNormal" || name == "Motion";
  const std::string components = is_vector ? "XYZ" : "RGB";
  for (size_t c = 0; c < 3; ++c)
    planes.push_back({(name.empty() ? "" : name + ".") + components[c], ExrPlane::Type::kFloat, image.data.data() + c,
                      3 * sizeof(float)});
}

void write_exr(const std::string& path, const ImagePlace& place, const std::map<std::string, std::string>& attributes,
               std::span<const ExrPlane> planes, ExrCompression compression) {
  prepare_exr_library();
  const CropWindow& w = place.window;
  const Imath::Box2i window({w.x, w.y}, {w.x + w.width - 1, w.y + w.height - 1});
  Imf::Header header(Imath::Box2i({0, 0}, {place.frame_width - 1, place.frame_height - 1}), window);
  header.compression() = compression == ExrCompression::kZip ? Imf::ZIP_COMPRESSION : Imf::NO_COMPRESSION;
  for (const auto& [key, value] : attributes) header.insert(key, Imf::StringAttribute(value));
  header.insert(kChecksums, Imf::StringAttribute(checksums_of(place, attributes, planes).text()));
  Imf::FrameBuffer pixels;
  for (const ExrPlane& plane : planes) {
    header.channels().insert(plane.name, Imf::Channel(exr_pixel_type(plane)));
    pixels.insert(plane.name, exr_slice(plane, window));
  }
  OutputFile file(path);
  try {
    ExrStream stream(file, path);
    Imf::OutputFile exr(stream, header);
    exr.setFrameBuffer(pixels);
    exr.writePixels(w.height);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(ErrorCode::kIo, fmt::format("cannot write {}: {}", path, error.what()));
  }
  file.commit();
}

}  // namespace covary
