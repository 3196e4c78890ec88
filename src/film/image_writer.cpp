// SPDX-License-Identifier: Apache-2.0
#include "film/image_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "core/error.h"
#include "core/srgb.h"
#include "film/output_file.h"
#include "imageio/image_io.h"
#include "imageio/png.h"

namespace covary {
namespace {

constexpr const char* kSoftwareKey = "Software";
constexpr const char* kSoftware = "covary";
constexpr int kLargestJpeg = 65500;          // limit of libjpeg
constexpr float kLargestRgbe = 0x1.fep126f;  // 255 / 256 times the power of 2 of the largest exponent

void write_content(const std::string& path, const std::vector<unsigned char>& content) {
  OutputFile file(path);
  file.write(content.data(), content.size());
  file.commit();
}

/// sRGB-encoded bytes; negative values and NaN become black.
std::vector<uint8_t> display_bytes(const Image& linear) {
  std::vector<uint8_t> encoded(linear.data.size());
  for (size_t i = 0; i < encoded.size(); ++i) {
    const float value = std::isnan(linear.data[i]) ? 0 : clamp01(linear.data[i]);
    encoded[i] = static_cast<uint8_t>(std::lround(linear_to_srgb(value) * 255));
  }
  return encoded;
}

/// Formats other than EXR and PNG.
void write_encoded(const std::string& path, const char* format, const ImageToEncode& image) {
  std::vector<unsigned char> content;
  try {
    content = encode_image(format, image);
  } catch (const Error& error) {
    throw Error(ErrorCode::kIo, "cannot write " + path + ": " + error.what());
  }
  write_content(path, content);
}

void write_jpeg(const std::string& path, const Image& linear) {
  // libjpeg would terminate the program for larger ones.
  if (std::max(linear.width, linear.height) > kLargestJpeg)
    throw Error(ErrorCode::kIo, fmt::format("cannot write {}: {} x {} pixels; a JPEG holds up to {} in each direction",
                                            path, linear.width, linear.height, kLargestJpeg));
  const std::vector<uint8_t> encoded = display_bytes(linear);
  ImageToEncode image{linear.width, linear.height};
  image.bytes = encoded.data();
  image.attributes = {{kSoftwareKey, kSoftware}};
  write_encoded(path, "jpg", image);
}

void write_float(const std::string& path, const char* format, const Image& linear) {
  ImageToEncode image{linear.width, linear.height};
  image.floats = linear.data.data();
  write_encoded(path, format, image);
}

/// Radiance's format has no sign.
void write_hdr(const std::string& path, Image linear) {
  for (float& value : linear.data)
    value = value > 0 ? std::min(value, kLargestRgbe) : 0;  // NaN compares false, which gives 0
  write_float(path, "hdr", linear);
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
    Image copy = linear;  // planes need mutable memory
    std::vector<ExrPlane> planes;
    add_image_planes("", copy, planes);
    write_exr(path, place, attributes, planes);
  } else if (extension == ".hdr") {
    write_hdr(path, linear);
  } else if (extension == ".pfm") {
    write_float(path, "pfm", linear);
  } else if (extension == ".tif" || extension == ".tiff") {
    write_float(path, "tif", linear);
  } else if (extension == ".jpg" || extension == ".jpeg") {
    write_jpeg(path, linear);
  } else {
    write_png(path, linear);
  }
}

void write_png(const std::string& path, const Image& linear) {
  COVARY_CHECK(linear.channels == 3, "a PNG of 3 channels");
  const std::vector<unsigned char> content =
      encode_png(linear.width, linear.height, display_bytes(linear), {{kSoftwareKey, kSoftware}});
  write_content(path, content);
}

bool is_own_png(const std::string& path) {
  const std::map<std::string, std::string> texts = read_png_texts(path);
  const auto software = texts.find(kSoftwareKey);
  return software != texts.end() && software->second == kSoftware;
}

}  // namespace covary
