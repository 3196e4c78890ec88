// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "core/memory_limit.h"
#include "gltf/gltf_compression.h"

namespace covary {
namespace {

/// Supported extensions that affect the image.
constexpr std::array kRead = {"EXT_mesh_gpu_instancing",
                              "EXT_texture_webp",
                              "KHR_lights_punctual",
                              "KHR_materials_anisotropy",
                              "KHR_materials_clearcoat",
                              "KHR_materials_diffuse_transmission",
                              "KHR_materials_emissive_strength",
                              "KHR_materials_ior",
                              "KHR_materials_iridescence",
                              "KHR_materials_pbrSpecularGlossiness",
                              "KHR_materials_sheen",
                              "KHR_materials_specular",
                              "KHR_materials_transmission",
                              "KHR_materials_unlit",
                              "KHR_materials_volume",
                              "KHR_mesh_quantization",
                              "KHR_texture_transform"};
/// Those whose absence does not change a still picture, or that messages of their own tell about.
constexpr std::array kHarmless = {"EXT_meshopt_compression",
                                  "EXT_structural_metadata",
                                  "EXT_mesh_features",
                                  "KHR_animation_pointer",
                                  "KHR_draco_mesh_compression",
                                  "KHR_materials_dispersion",
                                  "KHR_materials_variants",
                                  "KHR_meshopt_compression",
                                  "KHR_node_hoverability",
                                  "KHR_node_selectability",
                                  "KHR_texture_basisu",
                                  "KHR_xmp",
                                  "KHR_xmp_json_ld",
                                  "MSFT_lod",
                                  "MSFT_texture_dds"};

std::string first_line(std::string text) {
  text = text.substr(0, text.find('\n'));
  while (!text.empty() && (text.back() == '.' || text.back() == ' ')) text.pop_back();
  return text;
}

/// Reads one number of component type `type` at `from`.
double component(int type, bool normalized, const unsigned char* from) {
  const auto read = [&]<typename T>(T value) {
    std::memcpy(&value, from, sizeof(T));
    if constexpr (std::is_integral_v<T>)
      if (normalized) return std::max(static_cast<double>(value) / std::numeric_limits<T>::max(), -1.0);
    return static_cast<double>(value);
  };
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return read(int8_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return read(uint8_t{});
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return read(int16_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return read(uint16_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return read(uint32_t{});
    default:
      return read(0.0f);
  }
}

}  // namespace

GltfFile::GltfFile(std::string_view bytes, const std::string& name, FileResolver& files, Diagnostics& diagnostics)
    : where_{name, 1, 1}, files_(files), diagnostics_(diagnostics) {
  if (bytes.size() > std::numeric_limits<int>::max())
    throw Error(ErrorCode::kInput,
                fmt::format("{}: the file has {} bytes; at most 2 GB are accepted", name, bytes.size()));
  GltfJson prepared = prepare_gltf(bytes, name);
  images_ = std::move(prepared.images);
  animations_ = std::move(prepared.animations), moves_pointers_ = prepared.moves_pointers;
  tinygltf::TinyGLTF loader;
  const std::string folder = std::filesystem::path(name).parent_path().string();
  std::string problem, warning;
  bool read = false;
  try {
    const auto size = static_cast<unsigned int>(prepared.bytes.size());
    const char* data = prepared.bytes.data();
    read = prepared.is_binary ? loader.LoadBinaryFromMemory(&model_, &problem, &warning,
                                                            reinterpret_cast<const unsigned char*>(data), size, folder)
                              : loader.LoadASCIIFromString(&model_, &problem, &warning, data, size, folder);
  } catch (const std::exception& error) {  // from the JSON library
    problem = error.what();
  }
  constexpr std::string_view kMissing = "File not found : ";
  if (problem.starts_with(kMissing))
    throw Error(ErrorCode::kInput, fmt::format("{}: names the file '{}', which is not there", name,
                                               first_line(problem.substr(kMissing.size()))));
  if (!read || !problem.empty())
    throw Error(ErrorCode::kInput, fmt::format("{}: is not a readable glTF file: {}", name,
                                               problem.empty() ? "it ends too soon" : first_line(problem)));
  if (!warning.empty()) warn(first_line(warning));
  check_extensions();
  for (const tinygltf::Buffer& buffer : model_.buffers)  // for the hash of the scene
    if (!buffer.uri.empty() && !buffer.uri.starts_with("data:"))
      files_.resolve(file_of_uri(buffer.uri), where_, diagnostics_);
}

void GltfFile::check_extensions() {
  const auto is_among = [](const auto& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (const std::string& name : model_.extensionsRequired)
    if (!is_among(kRead, name) && !is_among(kHarmless, name))
      error(fmt::format("needs the extension '{}', which is not supported; export without it", name));
  for (const std::string& name : model_.extensionsUsed)
    if (!is_among(kRead, name) && !is_among(kHarmless, name)) warn(fmt::format("the extension '{}' is not read", name));
}

void GltfFile::error(const std::string& message) { diagnostics_.error(where_, message); }

void GltfFile::warn(const std::string& message) {
  if (warned_.insert(message).second) diagnostics_.warn(where_, message);
}

std::string_view GltfFile::bytes_of_buffer(size_t buffer, size_t offset, size_t length, const std::string& what) {
  if (buffer >= model_.buffers.size()) {
    error(fmt::format("{}: there is no buffer {}", what, static_cast<int64_t>(buffer)));
    return {};
  }
  const std::vector<unsigned char>& data = model_.buffers[buffer].data;
  if (offset > data.size() || length > data.size() - offset) {
    error(fmt::format("{}: a buffer view reaches beyond its buffer, which has {} bytes", what, data.size()));
    return {};
  }
  return {reinterpret_cast<const char*>(data.data()) + offset, length};
}

std::string_view GltfFile::bytes_of_view(int view, const std::string& what) {
  if (view < 0 || static_cast<size_t>(view) >= model_.bufferViews.size()) {
    error(fmt::format("{}: there is no buffer view {}", what, view));
    return {};
  }
  const tinygltf::BufferView& part = model_.bufferViews[view];
  for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
    if (const tinygltf::Value* khr = find_extension(part.extensions, name))
      return decompressed(static_cast<size_t>(view), *khr, what);
  return bytes_of_buffer(static_cast<size_t>(part.buffer), part.byteOffset, part.byteLength, what);
}

std::string_view GltfFile::decompressed(size_t view, const tinygltf::Value& khr, const std::string& what) {
  const auto [made, is_new] = decompressed_.try_emplace(view);
  if (!is_new) return made->second;
  const auto number = [&](const char* name) { return static_cast<size_t>(std::max(extension_index(khr, name), 0)); };
  const std::string_view bytes = bytes_of_buffer(number("buffer"), number("byteOffset"), number("byteLength"), what);
  if (bytes.empty()) return {};
  const auto text = [&](const char* name) {
    return khr.Get(name).IsString() ? khr.Get(name).Get<std::string>() : std::string();
  };
  require_memory(where_.text(), what, static_cast<double>(number("count")) * static_cast<double>(number("byteStride")));
  try {
    made->second = decode_meshopt(bytes, number("count"), number("byteStride"), text("mode"), text("filter"));
  } catch (const Error& problem) {
    error(fmt::format("{}: {}", what, problem.what()));
  }
  return made->second;
}

const tinygltf::Accessor* GltfFile::find_accessor(int accessor, const std::string& what) {
  if (accessor < 0 || static_cast<size_t>(accessor) >= model_.accessors.size()) {
    error(fmt::format("{}: there is no accessor {}", what, accessor));
    return nullptr;
  }
  return &model_.accessors[accessor];
}

std::vector<double> GltfFile::dense(int view, size_t offset, size_t count, int width, int component_type,
                                    bool normalized, const std::string& what) {
  const int size = tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(component_type));
  if (size <= 0 || size > 4) {
    error(fmt::format("{}: has components of the type {}, which there is not", what, component_type));
    return {};
  }
  const std::string_view bytes = bytes_of_view(view, what);
  if (bytes.empty()) return {};
  const size_t element = static_cast<size_t>(size) * width, stride_given = model_.bufferViews[view].byteStride;
  const size_t stride = stride_given == 0 ? element : stride_given;
  if (count == 0 || offset > bytes.size() || element > bytes.size() - offset ||
      (bytes.size() - offset - element) / stride < count - 1) {
    error(fmt::format("{}: an accessor with {} elements reaches beyond its buffer view", what, count));
    return {};
  }
  std::vector<double> result(count * width);
  const auto* from = reinterpret_cast<const unsigned char*>(bytes.data()) + offset;
  for (size_t i = 0; i < count; ++i)
    for (int k = 0; k < width; ++k)
      result[i * width + k] = component(component_type, normalized, from + i * stride + static_cast<size_t>(k) * size);
  return result;
}

std::vector<double> GltfFile::numbers(int accessor, int width, const std::string& what) {
  const tinygltf::Accessor* a = find_accessor(accessor, what);
  if (!a) return {};
  const int given = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(a->type));
  if (given != width) {
    error(fmt::format("{}: accessor {} has {} numbers an element; expected {}", what, accessor, given, width));
    return {};
  }
  std::vector<double> result;
  if (a->bufferView >= 0) {
    result = dense(a->bufferView, a->byteOffset, a->count, width, a->componentType, a->normalized, what);
  } else {
    require_memory(where_.text(), fmt::format("{}: accessor {} with {} elements", what, accessor, a->count),
                   8.0 * width * static_cast<double>(a->count));
    result.resize(a->count * width);
  }
  if (result.empty()) return {};
  if (a->sparse.isSparse) {
    const auto n = static_cast<size_t>(std::max(a->sparse.count, 0));
    const std::vector<double> places =
        dense(a->sparse.indices.bufferView, static_cast<size_t>(std::max(a->sparse.indices.byteOffset, 0)), n, 1,
              a->sparse.indices.componentType, false, what);
    const std::vector<double> values =
        dense(a->sparse.values.bufferView, static_cast<size_t>(std::max(a->sparse.values.byteOffset, 0)), n, width,
              a->componentType, a->normalized, what);
    for (size_t i = 0; i < std::min(places.size(), values.size() / width); ++i) {
      const auto place = static_cast<size_t>(places[i]);
      if (place < a->count)
        std::copy_n(values.begin() + static_cast<ptrdiff_t>(i * width), width,
                    result.begin() + static_cast<ptrdiff_t>(place * width));
    }
  }
  if (!std::all_of(result.begin(), result.end(), [](double x) { return std::isfinite(x); })) {
    error(fmt::format("{}: accessor {} has a number that is not finite", what, accessor));
    return {};
  }
  return result;
}

std::string GltfFile::path_of_image(int image) {
  const std::string& uri = images_[image].uri;
  if (uri.empty() || uri.starts_with("data:")) return "";
  return files_.resolve(file_of_uri(uri), where_, diagnostics_);
}

std::string GltfFile::bytes_of_image(int image) {
  const GltfImage& given = images_[image];
  const std::string what = fmt::format("image {} '{}'", image, given.name);
  if (given.uri.starts_with("data:")) return bytes_of_data_uri(given.uri);
  if (given.uri.empty()) return std::string(bytes_of_view(given.view, what));
  const std::string path = path_of_image(image);
  if (path.empty()) return "";
  try {
    return std::string(FileView(path).text());
  } catch (const Error& problem) {
    error(fmt::format("{}: {}", what, problem.what()));
    return "";
  }
}

const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const std::string& name) {
  const auto found = extensions.find(name);
  return found == extensions.end() || !found->second.IsObject() ? nullptr : &found->second;
}

double extension_number(const tinygltf::Value& extension, const std::string& name, double fallback) {
  const tinygltf::Value& value = extension.Get(name);
  return value.IsNumber() ? value.GetNumberAsDouble() : fallback;
}

std::optional<tinygltf::TextureInfo> extension_texture(const tinygltf::Value& extension, const std::string& name) {
  const tinygltf::Value& value = extension.Get(name);
  if (!value.IsObject() || !value.Get("index").IsInt()) return std::nullopt;
  tinygltf::TextureInfo info;
  info.index = value.Get("index").GetNumberAsInt();
  info.texCoord = value.Get("texCoord").IsInt() ? value.Get("texCoord").GetNumberAsInt() : 0;
  if (const tinygltf::Value& extensions = value.Get("extensions"); extensions.IsObject())
    for (const std::string& key : extensions.Keys()) info.extensions[key] = extensions.Get(key);
  return info;
}

int extension_index(const tinygltf::Value& extension, const std::string& name) {
  const tinygltf::Value& value = extension.Get(name);
  return value.IsInt() ? value.GetNumberAsInt() : -1;
}

}  // namespace covary
