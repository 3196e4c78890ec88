// SPDX-License-Identifier: Apache-2.0
#include "film/image_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <memory>

#include "core/error.h"
#include "core/srgb.h"
#include "imageio/image_io.h"
#include "imageio/output_file.h"
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

uint8_t byte_of(float value) {
  return static_cast<uint8_t>(std::lround((std::isnan(value) ? 0 : clamp01(value)) * 255));
}

/// sRGB-encoded bytes, followed by alpha if there is any; negative values and NaN become black. Colours are divided by
/// alpha; those without alpha stay, as light without a surface.
std::vector<uint8_t> display_bytes(const Image& linear, const Image& alpha) {
  const size_t n_channels = alpha.data.empty() ? 3 : 4, n_pixels = linear.data.size() / 3;
  std::vector<uint8_t> encoded(n_pixels * n_channels);
  for (size_t i = 0; i < n_pixels; ++i) {
    const float a = alpha.data.empty() ? 1 : alpha.data[i];
    for (size_t c = 0; c < 3; ++c) {
      const float value = a > 0 && a != 1 ? linear.data[3 * i + c] / a : linear.data[3 * i + c];
      encoded[n_channels * i + c] = byte_of(linear_to_srgb(std::isnan(value) ? 0 : clamp01(value)));
    }
    if (n_channels == 4) encoded[n_channels * i + 3] = byte_of(a);
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
  const std::vector<uint8_t> encoded = display_bytes(linear, {});
  ImageToEncode image{linear.width, linear.height};
  image.bytes = encoded.data();
  image.attributes = {{kSoftwareKey, kSoftware}};
  write_encoded(path, "jpg", image);
}

void write_float(const std::string& path, const char* format, const Image& linear) {
  ImageToEncode image{linear.width, linear.height, linear.channels};
  image.floats = linear.data.data();
  image.attributes = {{kSoftwareKey, kSoftware}};
  write_encoded(path, format, image);
}

/// Radiance's format has no sign.
void write_hdr(const std::string& path, Image linear) {
  for (float& value : linear.data)
    value = value > 0 ? std::min(value, kLargestRgbe) : 0;  // NaN compares false, which gives 0
  write_float(path, "hdr", linear);
}

/// Red, green, blue and alpha.
Image with_alpha(const Image& linear, const Image& alpha) {
  if (alpha.data.empty()) return linear;
  Image all(linear.width, linear.height, 4);
  for (size_t i = 0; i < alpha.data.size(); ++i) {
    std::copy_n(&linear.data[3 * i], 3, &all.data[4 * i]);
    all.data[4 * i + 3] = alpha.data[i];
  }
  return all;
}

}  // namespace

Image framed(const Image& image, const ImagePlace& place) {
  const CropWindow& window = place.window;
  if (window == CropWindow{0, 0, place.frame_width, place.frame_height}) return image;
  Image frame(place.frame_width, place.frame_height, image.channels);
  const int left = std::max(window.x, 0), right = std::min(window.x + window.width, place.frame_width);
  const int bottom = std::min(window.y + window.height, place.frame_height);
  for (int y = std::max(window.y, 0); y < bottom && left < right; ++y)
    std::copy_n(image.pixel(left - window.x, y - window.y), static_cast<size_t>(right - left) * image.channels,
                frame.pixel(left, y));
  return frame;
}

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

void write_image(const std::string& path, const Image& linear, const ImagePlace& given,
                 const std::map<std::string, std::string>& attributes, const Image& alpha) {
  COVARY_CHECK(linear.channels == 3, "a picture of 3 channels");
  const ImagePlace whole{linear.width, linear.height, {0, 0, linear.width, linear.height}};
  const ImagePlace& place = given == ImagePlace{} ? whole : given;
  const std::string extension = lower_extension(path);
  if (extension == ".exr") {
    Image copy = linear, copy_of_alpha = alpha;  // planes need mutable memory
    std::vector<ExrPlane> planes;
    add_image_planes("", copy, planes);
    if (!alpha.data.empty()) add_image_planes("A", copy_of_alpha, planes);
    return write_exr(path, place, attributes, planes);
  }
  const Image frame = framed(linear, place), alpha_of_frame = alpha.data.empty() ? Image() : framed(alpha, place);
  if (extension == ".hdr") {
    write_hdr(path, frame);
  } else if (extension == ".pfm") {
    write_float(path, "pfm", frame);
  } else if (extension == ".tif" || extension == ".tiff") {
    write_float(path, "tif", with_alpha(frame, alpha_of_frame));
  } else if (extension == ".jpg" || extension == ".jpeg") {
    write_jpeg(path, frame);
  } else {
    write_png(path, frame, alpha_of_frame);
  }
}

void write_png(const std::string& path, const Image& linear, const Image& alpha) {
  COVARY_CHECK(linear.channels == 3, "a PNG of 3 channels");
  const std::vector<unsigned char> content =
      encode_png(linear.width, linear.height, display_bytes(linear, alpha), {{kSoftwareKey, kSoftware}});
  write_content(path, content);
}

void write_png_rows(const std::string& path, int width, int height, const PictureRows& rows) {
  constexpr int kRows = 64;
  OutputFile file(path);
  std::unique_ptr<PngRowWriter> writer;
  for (int first = 0; first < height; first += kRows) {
    const int n = std::min(kRows, height - first);
    const auto [colours, alpha] = rows(first, n);
    const std::vector<uint8_t> bytes = display_bytes(colours, alpha);
    const size_t of_row = bytes.size() / static_cast<size_t>(n);
    if (!writer)
      writer = std::make_unique<PngRowWriter>(width, height, !alpha.data.empty(),
                                              std::map<std::string, std::string>{{kSoftwareKey, kSoftware}},
                                              [&](const void* data, size_t size) { file.write(data, size); });
    for (int y = 0; y < n; ++y) writer->write_row(&bytes[of_row * static_cast<size_t>(y)]);
  }
  writer->finish();
  file.commit();
}

bool is_own_png(const std::string& path) {
  const std::map<std::string, std::string> texts = read_png_texts(path);
  const auto software = texts.find(kSoftwareKey);
  return software != texts.end() && software->second == kSoftware;
}

}  // namespace covary
