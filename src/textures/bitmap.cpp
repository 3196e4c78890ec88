// SPDX-License-Identifier: Apache-2.0
// `bitmap`: a texture from an image file. Values agree with Mitsuba 3's plugin of the same name.
//
// | parameter   | type      | default  | meaning                                                                      |
// |-------------|-----------|----------|------------------------------------------------------------------------------|
// | filename    | string    | required | PNG, JPEG, EXR, HDR, PFM, TGA, BMP, …; alpha is ignored                      |
// | raw         | boolean   | false    | values are data, not colours: integers are not decoded from sRGB             |
// | filter_type | string    | bilinear | `bilinear` or `nearest`                                                      |
// | wrap_mode   | string    | repeat   | outside [0, 1]: `repeat`, `mirror`, `clamp` or, our own, `black`             |
// | gamma       | float     | 0        | our own: if positive, integers are decoded by this power                     |
// | to_uv       | transform | identity | from surface parameters to texture coordinates                               |
// | grey        | string    | luminance | one channel of colours, or `alpha_or_mean`, as in pbrt                      |
// | format      | string    | auto     | accepted for compatibility; bytes stay bytes, other files become floats      |
// | accel       | boolean   | true     | accepted for compatibility; no effect                                        |
//
// A one-channel lookup gives the grey value, or the luminance of a colour (of a raw one, too), unless `grey` is
// `alpha_or_mean`: alpha, if the image has colours and is not opaque, otherwise the mean of the colour's channels.
// Differences from Mitsuba 3.9: the gradient follows the chain rule for any to_uv (there, only for square images or
// diagonal to_uv); 16-bit files keep full precision; lights sample positions uniformly if to_uv does not preserve the
// unit square (an error there).
#include "textures/bitmap.h"

#include <array>
#include <memory>
#include <mutex>

#include "core/distribution.h"
#include "core/large_vector.h"
#include "core/srgb.h"
#include "core/warp.h"
#include "scene/embedded_data.h"
#include "textures/block_layout.h"
#include "textures/image.h"
#include "textures/registry.h"

namespace covary {
namespace {

using DecodeTable = std::array<float, 256>;

const DecodeTable& decode_table(bool srgb) {
  static const auto kTables = [] {
    std::array<DecodeTable, 2> tables;
    for (int i = 0; i < 256; ++i) {
      tables[0][i] = static_cast<float>(i) / 255;
      tables[1][i] = srgb_to_linear(tables[0][i]);
    }
    return tables;
  }();
  return kTables[srgb];
}

/// The values of an interleaved image, reordered to `layout`.
template <typename T>
LargeVector<T> in_blocks(const std::vector<T>& values, const TexelImage& image, const BlockLayout& layout) {
  const int channels = image.channels;
  LargeVector<T> result(layout.size() * channels);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      std::copy_n(values.data() + (static_cast<size_t>(y) * image.width + x) * channels, channels,
                  result.data() + layout.index(x, y) * channels);
  return result;
}

// Four storage formats of texels. Each has Value (the result of a lookup), value(index) and prefetch(index), with
// indices of the layout.

class FloatGrey {
 public:
  using Value = float;
  FloatGrey(const TexelImage& image, const BlockLayout& layout) : texels_(in_blocks(image.floats, image, layout)) {}
  float value(size_t i) const { return texels_[i]; }
  void prefetch(size_t i) const { __builtin_prefetch(&texels_[i]); }

 private:
  LargeVector<float> texels_;
};

class FloatRgb {
 public:
  using Value = Spectrum;
  FloatRgb(const TexelImage& image, const BlockLayout& layout) : texels_(in_blocks(image.floats, image, layout)) {}
  Spectrum value(size_t i) const { return {texels_[3 * i], texels_[3 * i + 1], texels_[3 * i + 2]}; }
  void prefetch(size_t i) const { __builtin_prefetch(&texels_[3 * i]); }

 private:
  LargeVector<float> texels_;
};

class ByteGrey {
 public:
  using Value = float;
  ByteGrey(const TexelImage& image, const BlockLayout& layout, const DecodeTable& decode)
      : texels_(in_blocks(image.bytes, image, layout)), decode_(decode.data()) {}
  float value(size_t i) const { return decode_[texels_[i]]; }
  void prefetch(size_t i) const { __builtin_prefetch(&texels_[i]); }

 private:
  LargeVector<uint8_t> texels_;
  const float* decode_;
};

class ByteRgb {
 public:
  using Value = Spectrum;
  ByteRgb(const TexelImage& image, const BlockLayout& layout, const DecodeTable& decode)
      : texels_(layout.size()), decode_(decode.data()) {
    const uint8_t* rgb = image.bytes.data();
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x, rgb += 3) texels_[layout.index(x, y)] = rgb[0] | rgb[1] << 8 | rgb[2] << 16;
  }
  Spectrum value(size_t i) const {
    const uint32_t rgb = texels_[i];
    return {decode_[rgb & 255], decode_[rgb >> 8 & 255], decode_[rgb >> 16]};
  }
  void prefetch(size_t i) const { __builtin_prefetch(&texels_[i]); }

 private:
  LargeVector<uint32_t> texels_;  // one load per texel
  const float* decode_;
};

float grey(float value) { return value; }
float grey(const Spectrum& value) { return luminance(value); }

/// Position of a coordinate along one axis: between texels `i0` and `i1`, at fraction `f` from the first.
struct AxisCell {
  int i0, i1;
  float f;
  float direction;  // -1 if mirroring reverses the axis
};

/// `n` texels along the axis; any `u`, even one that is not finite (which gives some texel).
inline AxisCell find_cell(float u, int n, WrapMode wrap) {
  float direction = 1;
  switch (wrap) {
    case WrapMode::kRepeat:
      u -= std::floor(u);
      break;
    case WrapMode::kMirror:
      u -= 2 * std::floor(u * 0.5f);
      if (u > 1) u = 2 - u, direction = -1;
      break;
    case WrapMode::kClamp:
    case WrapMode::kBlack:
      u = clamp01(u);
      break;
  }
  float x = u * static_cast<float>(n) - 0.5f;
  x = x > -0.5f ? x : -0.5f;  // also catches NaN
  const int i = std::min(static_cast<int>(std::floor(x)), n - 1);
  const float f = x - static_cast<float>(i);
  if (wrap == WrapMode::kRepeat) return {i < 0 ? n - 1 : i, i + 1 < n ? i + 1 : 0, f, direction};
  return {std::max(i, 0), std::min(i + 1, n - 1), f, direction};
}

template <typename Texels>
class Bitmap final : public Texture {
 public:
  using Value = typename Texels::Value;

  Bitmap(Texels texels, int width, int height, const BitmapSettings& settings)
      : texels_(std::move(texels)),
        width_(width),
        height_(height),
        layout_(width, height),
        settings_(settings),
        samples_luminance_(settings.to_uv.permutes_unit_square()) {
    double sum = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) sum += grey_at(x, y);
    mean_ = static_cast<float>(sum / (static_cast<double>(width) * height));
  }

  Spectrum eval(const SurfaceHit& hit) const override { return Spectrum(lookup(hit.uv)); }
  float eval_1(const SurfaceHit& hit) const override { return grey(lookup(hit.uv)); }
  float mean() const override { return mean_; }
  float aspect() const override { return static_cast<float>(width_) / static_cast<float>(height_); }

  void prefetch(Vec2 uv) const override {
    const Vec2 st = settings_.to_uv.apply(uv);
    const AxisCell x = find_cell(st.x, width_, settings_.wrap), y = find_cell(st.y, height_, settings_.wrap);
    texels_.prefetch(layout_.index(x.i0, y.i0));
    texels_.prefetch(layout_.index(x.i1, y.i1));
  }

  Vec2 grad_1(const SurfaceHit& hit) const override {
    if (settings_.filter == FilterType::kNearest) return {0, 0};
    const Vec2 st = settings_.to_uv.apply(hit.uv);
    const AxisCell x = find_cell(st.x, width_, settings_.wrap), y = find_cell(st.y, height_, settings_.wrap);
    const float v00 = grey_at(x.i0, y.i0), v10 = grey_at(x.i1, y.i0);
    const float v01 = grey_at(x.i0, y.i1), v11 = grey_at(x.i1, y.i1);
    const Vec2 d = {lerp(y.f, v10 - v00, v11 - v01) * x.direction * static_cast<float>(width_),
                    lerp(x.f, v01 - v00, v11 - v10) * y.direction * static_cast<float>(height_)};
    return settings_.to_uv.chain(d);
  }

  PositionSample sample_position(Vec2 u) const override {
    const PiecewiseConstant2D* texel_choice = distribution();
    if (!texel_choice) return {u, 1};
    // Samples a texel by its luminance, then the tent around its centre; the density is the interpolated luminance.
    Vec2 st = texel_choice->sample(u).uv;
    if (settings_.filter == FilterType::kBilinear) {
      st.x = within_filter(st.x, width_);
      st.y = within_filter(st.y, height_);
    }
    return {settings_.to_uv.apply_inverse(st), density(*texel_choice, st)};
  }

  float pdf_position(Vec2 uv) const override {
    const PiecewiseConstant2D* texel_choice = distribution();
    return texel_choice ? density(*texel_choice, settings_.to_uv.apply(uv)) : 1;
  }

 private:
  Value lookup(Vec2 uv) const {
    const Vec2 st = settings_.to_uv.apply(uv);
    if (settings_.wrap == WrapMode::kBlack && !(st.x >= 0 && st.x <= 1 && st.y >= 0 && st.y <= 1)) return Value(0);
    const AxisCell x = find_cell(st.x, width_, settings_.wrap), y = find_cell(st.y, height_, settings_.wrap);
    if (settings_.filter == FilterType::kNearest) return texels_.value(layout_.index(nearest(x), nearest(y)));
    const size_t row0 = layout_.row_offset(y.i0), row1 = layout_.row_offset(y.i1);
    const size_t column0 = BlockLayout::column_offset(x.i0), column1 = BlockLayout::column_offset(x.i1);
    return lerp(y.f, lerp(x.f, texels_.value(row0 + column0), texels_.value(row0 + column1)),
                lerp(x.f, texels_.value(row1 + column0), texels_.value(row1 + column1)));
  }

  static int nearest(const AxisCell& cell) { return cell.f < 0.5f ? cell.i0 : cell.i1; }
  float grey_at(int x, int y) const { return grey(texels_.value(layout_.index(x, y))); }

  /// Maps `s`, uniform within its texel, to a tent around the texel's centre. Positions outside [0, 1] are mapped back
  /// according to the wrap mode; mirror and clamp repeat the border texel, so both fold back.
  float within_filter(float s, int n) const {
    const float x = s * static_cast<float>(n), texel = std::min(std::floor(x), static_cast<float>(n - 1));
    const float t = (texel + 0.5f + warp::interval_to_tent(clamp01(x - texel), 1)) / static_cast<float>(n);
    if (settings_.wrap == WrapMode::kRepeat) return clamp01(t < 0 ? t + 1 : (t >= 1 ? t - 1 : t));
    return clamp01(t < 0 ? -t : (t > 1 ? 2 - t : t));
  }

  /// Density of sample_position per unit area, at texture coordinates `st`.
  float density(const PiecewiseConstant2D& texel_choice, Vec2 st) const {
    const AxisCell x = find_cell(st.x, width_, settings_.wrap), y = find_cell(st.y, height_, settings_.wrap);
    const auto at = [&](int i, int j) {
      return texel_choice.pdf({(static_cast<float>(i) + 0.5f) / width_, (static_cast<float>(j) + 0.5f) / height_});
    };
    if (settings_.filter == FilterType::kNearest) return at(nearest(x), nearest(y));
    return lerp(y.f, lerp(x.f, at(x.i0, y.i0), at(x.i1, y.i0)), lerp(x.f, at(x.i0, y.i1), at(x.i1, y.i1)));
  }

  /// Built on first use, because few textures emit. Null: positions are sampled uniformly.
  const PiecewiseConstant2D* distribution() const {
    if (!samples_luminance_) return nullptr;
    std::call_once(distribution_once_, [this] {
      std::vector<float> weights;
      weights.reserve(static_cast<size_t>(width_) * height_);
      bool any = false;
      for (int y = 0; y < height_; ++y)
        for (int x = 0; x < width_; ++x) {
          const float w = grey_at(x, y);
          weights.push_back(w > 0 && w < kInfinity ? w : 0);
          any |= weights.back() > 0;
        }
      if (any) distribution_ = std::make_unique<PiecewiseConstant2D>(weights, width_, height_);
    });
    return distribution_.get();
  }

  Texels texels_;
  int width_, height_;
  BlockLayout layout_;
  BitmapSettings settings_;
  bool samples_luminance_;
  float mean_;
  mutable std::once_flag distribution_once_;
  mutable std::unique_ptr<const PiecewiseConstant2D> distribution_;
};

template <typename Texels>
std::shared_ptr<Texture> wrap_texels(Texels texels, const TexelImage& image, const BitmapSettings& settings) {
  return std::make_shared<Bitmap<Texels>>(std::move(texels), image.width, image.height, settings);
}

}  // namespace

std::shared_ptr<Texture> make_bitmap_texture(TexelImage image, const BitmapSettings& settings) {
  if (settings.gamma > 0 && image.srgb) {  // as floats: rare, and byte images keep their tables
    for (const uint8_t byte : image.bytes) image.floats.push_back(static_cast<float>(byte) / 255);
    image.bytes.clear(), image.srgb = false;
    for (float& value : image.floats) value = std::pow(std::max(value, 0.0f), settings.gamma);
  }
  const bool decode = image.srgb && !settings.raw;
  const BlockLayout layout(image.width, image.height);
  if (!image.bytes.empty()) {
    const DecodeTable& table = decode_table(decode);
    if (image.channels == 1) return wrap_texels(ByteGrey(image, layout, table), image, settings);
    return wrap_texels(ByteRgb(image, layout, table), image, settings);
  }
  if (decode)
    for (float& value : image.floats) value = srgb_to_linear(value);
  if (image.channels == 1) return wrap_texels(FloatGrey(image, layout), image, settings);
  return wrap_texels(FloatRgb(image, layout), image, settings);
}

std::shared_ptr<Texture> make_bitmap(Parameters& parameters) {
  const std::string* data = find_embedded(parameters);
  const std::string path = data ? "" : parameters.require_file("filename");
  BitmapSettings settings;
  settings.raw = parameters.get_bool("raw", false);
  settings.filter = parameters.get_choice("filter_type", "bilinear", {"bilinear", "nearest"}) == "nearest"
                        ? FilterType::kNearest
                        : FilterType::kBilinear;
  const std::string wrap = parameters.get_choice("wrap_mode", "repeat", {"repeat", "mirror", "clamp", "black"});
  settings.wrap = wrap == "mirror"  ? WrapMode::kMirror
                  : wrap == "clamp" ? WrapMode::kClamp
                  : wrap == "black" ? WrapMode::kBlack
                                    : WrapMode::kRepeat;
  settings.gamma = parameters.get_float("gamma", 0, 0, 10);
  settings.to_uv = UvTransform(parameters.get_transform("to_uv"));
  const bool mean = parameters.get_choice("grey", "luminance", {"luminance", "alpha_or_mean"}) == "alpha_or_mean";
  parameters.get_choice("format", "auto", {"auto", "variant", "float16", "fp16", "uint8"});
  parameters.get_bool("accel", true);
  if (path.empty() && !data) return nullptr;  // already reported
  try {
    if (data) return make_bitmap_texture(read_embedded_image(*data), settings);
    return make_bitmap_texture(mean ? read_alpha_or_mean(path, settings.raw) : read_texels(path), settings);
  } catch (const Error& error) {
    parameters.error_at("filename", std::string("cannot be used: ") + error.what());
    return nullptr;
  }
}

}  // namespace covary
