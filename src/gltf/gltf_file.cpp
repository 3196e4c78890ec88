// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

namespace covary {
namespace {

/// Supported extensions that affect the image.
constexpr std::array kRead = {"KHR_lights_punctual",  "KHR_materials_clearcoat", "KHR_materials_emissive_strength",
                              "KHR_materials_ior",    "KHR_materials_specular",  "KHR_materials_transmission",
                              "KHR_materials_unlit",  "KHR_materials_volume",    "KHR_mesh_quantization",
                              "KHR_texture_transform"};

/// Images are decoded on demand.
bool keep_encoded(tinygltf::Image* image, const int, std::string*, std::string*, int, int, const unsigned char* bytes,
                  int size, void*) {
  image->image.assign(bytes, bytes + size);
  image->as_is = true;
  return true;
}

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
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keep_encoded, nullptr);
  const std::string folder = std::filesystem::path(name).parent_path().string();
  std::string problem, warning;
  bool read = false;
  try {
    const auto size = static_cast<unsigned int>(bytes.size());
    read = bytes.starts_with("glTF")
               ? loader.LoadBinaryFromMemory(&model_, &problem, &warning,
                                             reinterpret_cast<const unsigned char*>(bytes.data()), size, folder)
               : loader.LoadASCIIFromString(&model_, &problem, &warning, bytes.data(), size, folder);
  } catch (const std::exception& error) {  // from the JSON library
    problem = error.what();
  }
  if (!read || !problem.empty())
    throw Error(ErrorCode::kInput, fmt::format("{}: is not a readable glTF file: {}", name,
                                               problem.empty() ? "it ends too soon" : first_line(problem)));
  if (!warning.empty()) warn(first_line(warning));
  if (!model_.asset.version.starts_with("2."))
    error(fmt::format("the file is of glTF {}; supported: 2.0", model_.asset.version));
  check_extensions();
  for (const tinygltf::Buffer& buffer : model_.buffers)
    if (!buffer.uri.empty()) reads(buffer.uri);
}

void GltfFile::reads(const std::string& uri) {
  if (!uri.starts_with("data:")) files_.resolve(file_of_uri(uri), where_, diagnostics_);
}

void GltfFile::check_extensions() {
  const auto is_read = [](const std::string& name) {
    return std::find(kRead.begin(), kRead.end(), name) != kRead.end();
  };
  for (const std::string& name : model_.extensionsRequired)
    if (!is_read(name))
      error(fmt::format("needs the extension '{}', which is not supported; export {}", name,
                        name.find("draco") != std::string::npos || name.find("meshopt") != std::string::npos
                            ? "without compression of meshes"
                            : "without it"));
  for (const std::string& name : model_.extensionsUsed)
    if (!is_read(name)) warn(fmt::format("the extension '{}' is not read", name));
}

void GltfFile::error(const std::string& message) { diagnostics_.error(where_, message); }

void GltfFile::warn(const std::string& message) {
  if (warned_.insert(message).second) diagnostics_.warn(where_, message);
}

std::string_view GltfFile::bytes_of_view(int view, const std::string& what) {
  if (view < 0 || static_cast<size_t>(view) >= model_.bufferViews.size()) {
    error(fmt::format("{}: there is no buffer view {}", what, view));
    return {};
  }
  const tinygltf::BufferView& part = model_.bufferViews[view];
  if (part.buffer < 0 || static_cast<size_t>(part.buffer) >= model_.buffers.size()) {
    error(fmt::format("{}: there is no buffer {}", what, part.buffer));
    return {};
  }
  const std::vector<unsigned char>& data = model_.buffers[part.buffer].data;
  if (part.byteOffset > data.size() || part.byteLength > data.size() - part.byteOffset) {
    error(fmt::format("{}: buffer view {} reaches beyond its buffer, which has {} bytes", what, view, data.size()));
    return {};
  }
  return {reinterpret_cast<const char*>(data.data()) + part.byteOffset, part.byteLength};
}

std::vector<double> GltfFile::numbers(int accessor, int width, const std::string& what) {
  if (accessor < 0 || static_cast<size_t>(accessor) >= model_.accessors.size()) {
    error(fmt::format("{}: there is no accessor {}", what, accessor));
    return {};
  }
  const tinygltf::Accessor& a = model_.accessors[accessor];
  if (a.sparse.isSparse || a.bufferView < 0) {
    error(fmt::format("{}: accessor {} is sparse, which is not supported; export without it", what, accessor));
    return {};
  }
  const int given = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(a.type));
  const int size = tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(a.componentType));
  if (given != width || size <= 0 || size > 4) {
    error(fmt::format("{}: accessor {} has {} numbers an element; expected {}", what, accessor, given, width));
    return {};
  }
  const std::string_view view = bytes_of_view(a.bufferView, what);
  const size_t element = static_cast<size_t>(size) * width, stride_given = model_.bufferViews[a.bufferView].byteStride;
  const size_t stride = stride_given == 0 ? element : stride_given;
  if (a.count == 0 || a.byteOffset > view.size() || element > view.size() - a.byteOffset ||
      (view.size() - a.byteOffset - element) / stride < a.count - 1) {
    error(fmt::format("{}: accessor {} with {} elements reaches beyond its buffer view", what, accessor, a.count));
    return {};
  }
  std::vector<double> result(a.count * width);
  const auto* from = reinterpret_cast<const unsigned char*>(view.data()) + a.byteOffset;
  for (size_t i = 0; i < a.count; ++i)
    for (int k = 0; k < width; ++k)
      result[i * width + k] =
          component(a.componentType, a.normalized, from + i * stride + static_cast<size_t>(k) * size);
  if (!std::all_of(result.begin(), result.end(), [](double x) { return std::isfinite(x); })) {
    error(fmt::format("{}: accessor {} has a number that is not finite", what, accessor));
    return {};
  }
  return result;
}

std::string file_of_uri(const std::string& uri) {
  std::string path;
  for (size_t i = 0; i < uri.size(); ++i) {
    unsigned value = 0;
    if (uri[i] == '%' && i + 2 < uri.size() && std::isxdigit(uri[i + 1]) && std::isxdigit(uri[i + 2])) {
      value = static_cast<unsigned>(std::stoul(uri.substr(i + 1, 2), nullptr, 16));
      path += static_cast<char>(value);
      i += 2;
    } else {
      path += uri[i];
    }
  }
  return path;
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

}  // namespace covary
