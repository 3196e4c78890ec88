// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_textures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/memory_limit.h"
#include "core/srgb.h"
#include "core/vec.h"
#include "gltf/gltf_compression.h"
#include "scene/embedded_data.h"

namespace covary {
namespace {

/// Width and height of a PNG, JPEG or WebP image, from its header; zeros if it is none of them.
std::pair<int, int> size_of(std::string_view bytes) {
  const auto byte = [&](size_t at) { return static_cast<int>(static_cast<unsigned char>(bytes[at])); };
  const auto two = [&](size_t at) { return byte(at) * 256 + byte(at + 1); };
  if (is_webp(bytes)) {
    const WebpImage header = webp_size(bytes);
    return {header.width, header.height};
  }
  if (bytes.size() > 24 && byte(0) == 0x89 && bytes[1] == 'P') {
    if (two(16) > 0 || two(20) > 0) return {1 << 16, 1 << 16};  // more than is supported
    return {two(18), two(22)};
  }
  if (bytes.size() < 4 || two(0) != 0xffd8) return {0, 0};
  for (size_t at = 2; at + 9 < bytes.size() && byte(at) == 0xff; at += 2 + static_cast<size_t>(two(at + 2))) {
    const int marker = byte(at + 1);
    if (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc)
      return {two(at + 7), two(at + 5)};
  }
  return {0, 0};
}

/// What an image is that is not read.
std::string unknown_format(std::string_view bytes) {
  if (bytes.starts_with("\xabKTX"))
    return "is a KTX 2 texture (Basis Universal), which is not supported; 'gltf-transform ktxdecompress IN OUT' turns "
           "those of a file into PNG";
  if (is_webp(bytes) && !reads_webp())
    return "is a WebP picture, and covary was built without libwebp-dev; build it with the latter, or convert it";
  return "is not a readable PNG, JPEG or WebP picture; convert it to PNG";
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string wrap_mode(int wrap) {
  return wrap == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE     ? "clamp"
         : wrap == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? "mirror"
                                                         : "repeat";
}

/// v points upwards at our vertices, downwards in the file. KHR_texture_transform: rotation is counter-clockwise as
/// seen in the image.
Transform uv_transform(const tinygltf::ExtensionMap& extensions) {
  const Transform flip = Transform::translate({0, 1, 0}) * Transform::scale({1, -1, 1});
  const tinygltf::Value* khr = find_extension(extensions, "KHR_texture_transform");
  if (!khr) return flip;
  const auto pair = [&](const char* name, float fallback) {
    const tinygltf::Value& value = khr->Get(name);
    Vec2 result{fallback, fallback};
    if (value.IsArray() && value.ArrayLen() == 2) {
      result.x = static_cast<float>(value.Get(0).GetNumberAsDouble());
      result.y = static_cast<float>(value.Get(1).GetNumberAsDouble());
    }
    return result;
  };
  const Vec2 offset = pair("offset", 0), scale = pair("scale", 1);
  const double turn = extension_number(*khr, "rotation", 0) * 180 / M_PI;
  return Transform::translate({offset.x, offset.y, 0}) * Transform::rotate({0, 0, 1}, -turn) *
         Transform::scale({scale.x, scale.y, 1}) * flip;
}

}  // namespace

int gltf_texture_set(int set, const tinygltf::ExtensionMap& extensions) {
  const tinygltf::Value* khr = find_extension(extensions, "KHR_texture_transform");
  const int other = khr ? extension_index(*khr, "texCoord") : -1;
  return other >= 0 ? other : set;
}

ObjectPtr GltfTextures::make(int texture, int set, const tinygltf::ExtensionMap& extensions, const GltfUse& use) {
  const ObjectPtr bitmap = make_bitmap(texture, extensions, use);
  set = gltf_texture_set(set, extensions);
  if (!bitmap || set == own_set_) return bitmap;
  const ObjectPtr coordinates =
      make_object("texture", "mesh_attribute", file_.where(), {{"name", fmt::format("vertex_uv{}", set)}});
  return make_object("texture", "projected", file_.where(), {{"coordinates", coordinates}, {"", bitmap}});
}

ObjectPtr GltfTextures::make_bitmap(int texture, const tinygltf::ExtensionMap& extensions, const GltfUse& use) {
  const tinygltf::Model& model = file_.model();
  if (texture < 0 || static_cast<size_t>(texture) >= model.textures.size()) {
    file_.error(fmt::format("there is no texture {}", texture));
    return nullptr;
  }
  const int source = source_of(texture);
  if (source < 0) return nullptr;
  const tinygltf::Texture& given = model.textures[texture];
  auto bitmap = make_object("texture", "bitmap", file_.where());
  try {
    set_property(*bitmap, "to_uv", uv_transform(extensions));
  } catch (const Error& error) {
    file_.error(fmt::format("the transformation of texture {}: {}", texture, error.what()));
  }
  if (given.sampler >= 0 && static_cast<size_t>(given.sampler) < model.samplers.size()) {
    const tinygltf::Sampler& sampler = model.samplers[given.sampler];
    if (sampler.wrapS != sampler.wrapT)
      file_.warn("a texture is wrapped in different ways along u and v: that along u is taken for both");
    set_property(*bitmap, "wrap_mode", wrap_mode(sampler.wrapS));
    if (sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST)
      set_property(*bitmap, "filter_type", std::string("nearest"));
  }
  const bool as_it_is = use.kind == GltfUse::kVector || (use.kind == GltfUse::kColour && use.factor == Spectrum(1));
  set_property(*bitmap, "raw", use.kind != GltfUse::kColour);
  const GltfImage& image = file_.images()[source];
  const bool is_file = !image.uri.empty() && !image.uri.starts_with("data:");
  if (is_file && file_.path_of_image(source).empty()) return nullptr;  // reported
  if (as_it_is && is_file && !lower(image.uri).ends_with(".webp")) {
    set_property(*bitmap, "filename", file_of_uri(image.uri));
    return bitmap;
  }
  const Pixels* pixels = decoded(source);
  if (!pixels) return nullptr;
  set_property(*bitmap, std::string(kEmbeddedData), embedded(*pixels, use));
  return bitmap;
}

int GltfTextures::source_of(int texture) {
  const tinygltf::Texture& given = file_.model().textures[texture];
  const auto is_there = [&](int image) { return image >= 0 && static_cast<size_t>(image) < file_.images().size(); };
  if (is_there(given.source)) return given.source;
  for (const char* name : {"EXT_texture_webp", "KHR_texture_basisu", "MSFT_texture_dds"})
    if (const tinygltf::Value* khr = find_extension(given.extensions, name))
      if (const int image = extension_index(*khr, "source"); is_there(image)) return image;
  file_.error(fmt::format("texture {} has no image", texture));
  return -1;
}

const GltfTextures::Pixels* GltfTextures::decoded(int index) {
  if (const auto found = images_.find(index); found != images_.end())
    return found->second.width > 0 ? &found->second : nullptr;
  Pixels& pixels = images_[index];
  const std::string bytes = file_.bytes_of_image(index);
  const auto [width, height] = size_of(bytes);
  const auto fail = [&](const std::string& why) {
    const GltfImage& image = file_.images()[index];
    file_.error(fmt::format("image {} '{}' {}", index, image.uri.empty() ? image.name : image.uri.substr(0, 40), why));
    return nullptr;
  };
  if (bytes.empty()) return nullptr;  // reported
  if (width <= 0 || height <= 0 || width > 32768 || height > 32768) return fail(unknown_format(bytes));
  require_memory(file_.where().text(), fmt::format("image {} of {} x {} pixels", index, width, height),
                 20.0 * width * height);
  if (is_webp(bytes)) {
    pixels.values = decode_webp(bytes).rgba;
    if (pixels.values.empty()) return fail("cannot be decoded: it is damaged");
    pixels.channels = 4, pixels.width = width, pixels.height = height;
    return &pixels;
  }
  tinygltf::Image image;
  std::string problem, warning;
  if (!tinygltf::LoadImageData(&image, index, &problem, &warning, 0, 0,
                               reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()),
                               nullptr) ||
      image.width != width || image.height != height || image.component < 1 || (image.bits != 8 && image.bits != 16))
    return fail("cannot be decoded: it is damaged");
  const size_t n = static_cast<size_t>(width) * height * image.component, step = image.bits / 8;
  if (image.image.size() < n * step) return fail("cannot be decoded: it is damaged");
  pixels.channels = image.component;
  pixels.values.resize(n);
  for (size_t i = 0; i < n; ++i) pixels.values[i] = image.image[i * step + step - 1];  // the high byte of 16 bits
  pixels.width = width, pixels.height = height;
  return &pixels;
}

std::string GltfTextures::embedded(const Pixels& pixels, const GltfUse& use) const {
  const size_t n = static_cast<size_t>(pixels.width) * pixels.height;
  const bool one = use.kind == GltfUse::kChannel;
  const bool plain = (use.factor == Spectrum(1) && use.offset == 0) || use.cutoff >= 0;
  const auto value = [&](size_t i, int c) {  // grey images: equal in all channels, opaque
    const int n_colours = pixels.channels < 3 ? 1 : 3;
    if (c == 3)
      return pixels.channels % 2 == 0 ? pixels.values[i * pixels.channels + pixels.channels - 1] : uint8_t{255};
    return pixels.values[i * pixels.channels + std::min(c, n_colours - 1)];
  };
  const int channels = one ? 1 : 3;
  if (plain) {
    std::string text = fmt::format("P{}\n{} {}\n255\n", one ? 5 : 6, pixels.width, pixels.height);
    for (size_t i = 0; i < n; ++i)
      for (int c = 0; c < channels; ++c) {
        uint8_t x = value(i, one ? use.channel : c);
        if (use.cutoff >= 0) x = x / 255.0 * use.factor.r >= use.cutoff ? 255 : 0;
        text += static_cast<char>(x);
      }
    return text;
  }
  // PFM: linear floats, bottom row first.
  std::string text = fmt::format("P{}\n{} {}\n-1.0\n", one ? 'f' : 'F', pixels.width, pixels.height);
  for (int y = pixels.height - 1; y >= 0; --y)
    for (int x = 0; x < pixels.width; ++x) {
      const auto raw = [&](int c) {
        return static_cast<float>(value(static_cast<size_t>(y) * pixels.width + x, c)) / 255;
      };
      Spectrum linear(one ? raw(use.channel) : raw(0), one ? 0 : raw(1), one ? 0 : raw(2));
      if (use.kind == GltfUse::kNormal) {
        const float scale = use.factor.r;
        const Vec3 normal =
            normalize({(2 * linear.r - 1) * scale, (2 * linear.g - 1) * scale, std::max(2 * linear.b - 1, 1e-3f)});
        linear = Spectrum(0.5f + 0.5f * normal.x, 0.5f + 0.5f * normal.y, 0.5f + 0.5f * normal.z);
      } else {
        for (int c = 0; c < channels; ++c)
          linear[c] =
              (use.kind == GltfUse::kColour ? srgb_to_linear(linear[c]) : linear[c]) * use.factor[c] + use.offset;
      }
      for (int c = 0; c < channels; ++c) text.append(reinterpret_cast<const char*>(&linear[c]), sizeof(float));
    }
  return text;
}

}  // namespace covary
