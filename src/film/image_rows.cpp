// SPDX-License-Identifier: Apache-2.0
#include "film/image_rows.h"

#include <algorithm>
#include <utility>

#include "core/srgb.h"
#include "film/exr_copy.h"
#include "imageio/exr_image.h"

namespace covary {
namespace {

constexpr double kRowBytes = 3 * sizeof(float);  // per pixel

/// Copies channels `sources` of pixels with `n_channels` values, decoding each value.
template <typename T, typename Decode>
void fill(const std::vector<T>& values, size_t n_channels, const std::array<size_t, 3>& sources, const Decode& decode,
          Image& image) {
  for (size_t p = 0; p < image.data.size() / 3; ++p)
    for (size_t c = 0; c < 3; ++c) image.data[p * 3 + c] = decode(values[p * n_channels + sources[c]]);
}

/// Linear value of each byte, with the bits of OpenImageIO followed by srgb_to_linear().
std::array<float, 256> linear_bytes() {
  std::array<float, 256> linear{};
  for (size_t i = 0; i < linear.size(); ++i) linear[i] = srgb_to_linear(static_cast<float>(i) * (1.0f / 255));
  return linear;
}

}  // namespace

ImageRows::ImageRows(const std::string& path, const std::string& layer, ChecksumPolicy checksums)
    : path_(path), layer_(layer) {
  if (is_exr_image(path)) {
    exr_ = std::make_unique<ExrFile>(path, checksums);
    place_ = exr_->place();
    names_ = layer_channels(path, exr_->channels(), layer);
    colours_ = layer_colours(exr_->colours(), names_);
    alpha_ = alpha_channel(exr_->channels(), names_[0]);
    return;
  }
  file_ = open_image(path);
  const ImageInfo info = info_of(file_->header());
  place_ = info.place;
  names_ = layer_channels(path, info.channels, layer);
  low_dynamic_range_ = !file_->header().floating_point;
}

void ImageRows::convert_to(const ColourSpace& colours) {
  conversion_.reset();
  if (holds_colours(names_) && !(colours_ == colours)) try {
      conversion_ = colour_conversion(colours_, colours);
    } catch (const Error& error) {
      throw Error(error.code(), path_ + ": " + error.what());
    }
}

Image ImageRows::read(int first_row, int n_rows) {
  Image image = read_stored(first_row, n_rows);
  if (conversion_) convert_colours(*conversion_, image);
  return image;
}

Image ImageRows::read_stored(int first_row, int n_rows) {
  if (exr_) return read_exr(first_row, n_rows);
  const bool is_all = n_rows == place_.window.height;
  if (is_all || file_->has_rows()) return read_other(first_row, n_rows);
  if (whole_.data.empty()) whole_ = read_other(0, place_.window.height);
  Image rows(whole_.width, n_rows, 3);
  std::copy_n(whole_.pixel(0, first_row), rows.data.size(), rows.data.begin());
  return rows;
}

Image ImageRows::read_exr(int first_row, int n_rows) {
  const bool is_grey = names_[0] == names_[2], is_all = n_rows == place_.window.height;
  if (!is_all && !std::exchange(checked_, true)) exr_->check(std::span(names_).first(is_grey ? 1 : 3));
  return std::move(read_layers(*exr_, path_, {&layer_, 1}, first_row, n_rows)[0]);
}

Image ImageRows::read_other(int first_row, int n_rows) {
  const ImageHeader& header = file_->header();
  const size_t n_channels = header.channels.size();
  std::array<size_t, 3> sources{};
  for (size_t c = 0; c < 3; ++c)
    sources[c] = std::find(header.channels.begin(), header.channels.end(), names_[c]) - header.channels.begin();
  const bool is_bytes = header.type == "uint8";
  require_image_memory(path_, header.width, n_rows,
                       kRowBytes + static_cast<double>(n_channels * (is_bytes ? 1 : sizeof(float))));
  const auto last = static_cast<int>(n_channels);
  Image image;
  if (is_bytes) {
    const std::vector<uint8_t> values = file_->read_bytes(0, last, first_row, n_rows);
    image = Image(header.width, n_rows, 3);
    fill(
        values, n_channels, sources, [linear = linear_bytes()](uint8_t value) { return linear[value]; }, image);
  } else {
    const std::vector<float> values = file_->read_floats(0, last, first_row, n_rows);
    image = Image(header.width, n_rows, 3);
    const auto decode = [&](float value) { return low_dynamic_range_ ? srgb_to_linear(value) : value; };
    fill(values, n_channels, sources, decode, image);
  }
  return image;
}

PlacedImage read_image(const std::string& path, const std::string& layer, ChecksumPolicy checksums,
                       const std::optional<ColourSpace>& colours) {
  ImageRows file(path, layer, checksums);
  if (colours) file.convert_to(*colours);
  PlacedImage result{file.place(), {}, file.low_dynamic_range()};
  result.image = file.read_all();
  return result;
}

bool ImageRows::has_alpha() const {
  return exr_ ? !alpha_.empty() : layer_.empty() && file_->header().alpha_channel >= 0;
}

bool ImageRows::has_straight_alpha() const { return file_ && has_alpha() && file_->header().straight_alpha; }

Image ImageRows::read_alpha(int first_row, int n_rows) {
  const int width = place_.window.width;
  require_image_memory(path_, width, n_rows, sizeof(float));
  Image alpha(width, n_rows, 1);
  if (exr_) {
    const ExrPlane plane{alpha_, ExrPlane::Type::kFloat, alpha.data.data(), sizeof(float)};
    n_rows == place_.window.height ? exr_->read({&plane, 1}) : exr_->read_rows({&plane, 1}, first_row, n_rows);
    return alpha;
  }
  if (!alpha_file_) alpha_file_ = open_image(path_);
  const int channel = file_->header().alpha_channel;
  alpha.data = alpha_file_->read_floats(channel, channel + 1, first_row, n_rows);
  return alpha;
}

Alpha read_alpha(const std::string& path, const std::string& layer, ChecksumPolicy checksums) {
  ImageRows file(path, layer, checksums);
  if (!file.has_alpha()) return {};
  return {file.read_alpha(0, file.place().window.height), file.has_straight_alpha()};
}

}  // namespace covary
