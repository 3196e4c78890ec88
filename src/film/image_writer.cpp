// SPDX-License-Identifier: Apache-2.0
#include "film/image_writer.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "core/error.h"
#include "core/srgb.h"
#include "film/output_file.h"

namespace covary {
namespace {

constexpr const char* kSoftware = "covary";
constexpr int kJpegQuality = 95;
constexpr float kLargestRgbe = 0x1.fep126f;  // 255 / 256 times the power of 2 of the largest exponent

/// Writes `pixels` in one of OpenImageIO's formats into memory and from there to the file, so that every failed write
/// is seen.
void write_with_oiio(const std::string& path, const char* format, const OIIO::ImageSpec& spec, const void* pixels) {
  std::vector<unsigned char> file_content;
  OIIO::Filesystem::IOVecOutput proxy(file_content);
  const auto output = OIIO::ImageOutput::create(format, &proxy);
  if (!output || !output->open(std::string("image.") + format, spec) || !output->write_image(spec.format, pixels) ||
      !output->close())
    throw Error(ErrorCode::kIo,
                fmt::format("cannot write {}: {}", path, output ? output->geterror() : OIIO::geterror()));
  OutputFile file(path);
  file.write(file_content.data(), file_content.size());
  file.commit();
}

void write_display(const std::string& path, const char* format, const Image& linear) {
  std::vector<uint8_t> encoded(linear.data.size());
  for (size_t i = 0; i < encoded.size(); ++i) {
    const float value = std::isnan(linear.data[i]) ? 0 : clamp01(linear.data[i]);
    encoded[i] = static_cast<uint8_t>(std::lround(linear_to_srgb(value) * 255));
  }
  OIIO::ImageSpec spec(linear.width, linear.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("Software", kSoftware);
  spec.attribute("CompressionQuality", kJpegQuality);
  write_with_oiio(path, format, spec, encoded.data());
}

void write_float(const std::string& path, const char* format, const Image& linear) {
  OIIO::ImageSpec spec(linear.width, linear.height, 3, OIIO::TypeDesc::FLOAT);
  spec.attribute("oiio:ColorSpace", "Linear");
  write_with_oiio(path, format, spec, linear.data.data());
}

/// Radiance's format holds no sign.
void write_hdr(const std::string& path, Image linear) {
  for (float& value : linear.data)
    value = value > 0 ? std::min(value, kLargestRgbe) : 0;  // not-a-number is not above 0
  write_float(path, "hdr", linear);
}

/// Portable float map: a header of text, then the rows from the lowest to the highest.
void write_pfm(const std::string& path, const Image& linear) {
  const char* scale = std::endian::native == std::endian::little ? "-1.0" : "1.0";  // the sign tells the order of bytes
  const std::string header = fmt::format("PF\n{} {}\n{}\n", linear.width, linear.height, scale);
  OutputFile file(path);
  file.write(header.data(), header.size());
  for (int y = linear.height - 1; y >= 0; --y)
    file.write(linear.pixel(0, y), static_cast<size_t>(linear.width) * 3 * sizeof(float));
  file.commit();
}

}  // namespace

const std::vector<std::string>& image_extensions() {
  static const std::vector<std::string> extensions = {".exr", ".png", ".hdr", ".pfm", ".jpg", ".jpeg", ".tif", ".tiff"};
  return extensions;
}

std::string lower_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

void write_image(const std::string& path, const Image& linear, const ImagePlace& place,
                 const std::map<std::string, std::string>& attributes) {
  COVARY_CHECK(linear.channels == 3, "a picture of 3 channels");
  const std::string extension = lower_extension(path);
  if (extension == ".exr") {
    Image copy = linear;  // planes point into an image that they could change
    std::vector<ExrPlane> planes;
    add_image_planes("", copy, planes);
    write_exr(path, place, attributes, planes);
  } else if (extension == ".hdr") {
    write_hdr(path, linear);
  } else if (extension == ".pfm") {
    write_pfm(path, linear);
  } else if (extension == ".tif" || extension == ".tiff") {
    write_float(path, "tiff", linear);
  } else {
    write_display(path, extension == ".jpg" || extension == ".jpeg" ? "jpeg" : "png", linear);
  }
}

void write_png(const std::string& path, const Image& linear) {
  COVARY_CHECK(linear.channels == 3, "a PNG of 3 channels");
  write_display(path, "png", linear);
}

bool is_own_png(const std::string& path) {
  const auto input = OIIO::ImageInput::open(path);
  if (input) return std::string(input->format_name()) == "png" && input->spec()["Software"].get() == kSoftware;
  OIIO::geterror();  // what is not an image, is not ours
  return false;
}

}  // namespace covary
