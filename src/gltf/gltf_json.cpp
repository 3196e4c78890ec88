// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_json.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/error.h"

namespace covary {
namespace {

using nlohmann::json;

constexpr uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
/// A buffer of one byte, for those whose bytes nothing reads.
constexpr const char* kOneByte = "data:application/octet-stream;base64,AA==";

[[noreturn]] void refuse(const std::string& name, const std::string& problem) {
  throw Error(ErrorCode::kInput, fmt::format("{}: {}", name, problem));
}
[[noreturn]] void refuse_version(const std::string& name, const std::string& version) {
  refuse(name, fmt::format("the file is of glTF {}; supported: 2.0 (the program gltf-pipeline converts it)", version));
}

uint32_t word_at(std::string_view bytes, size_t at) {
  uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

struct Chunks {
  std::string_view text, data;
};
Chunks chunks_of(std::string_view bytes, const std::string& name) {
  if (bytes.size() < 20) refuse(name, "is not a readable glTF file: it ends too soon");
  if (const uint32_t version = word_at(bytes, 4); version != 2) refuse_version(name, fmt::format("{}.0", version));
  Chunks chunks;
  for (size_t at = 12; at + 8 <= bytes.size();) {
    const size_t size = word_at(bytes, at);
    const uint32_t type = word_at(bytes, at + 4);
    if (size > bytes.size() - at - 8) refuse(name, "is not a readable glTF file: it ends too soon");
    const std::string_view content = bytes.substr(at + 8, size);
    if (type == kJsonChunk && chunks.text.empty()) chunks.text = content;
    if (type == kBinaryChunk && chunks.data.empty()) chunks.data = content;
    at += 8 + (size + 3) / 4 * 4;
  }
  return chunks;
}

/// The member of that type, or null.
json* find(json& object, const char* key, json::value_t type) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found != object.end() && found->type() == type ? &*found : nullptr;
}
json* find_object(json& object, const char* key) { return find(object, key, json::value_t::object); }
template <typename Visit>
void each(json& object, const char* key, const Visit& visit) {
  if (json* list = find(object, key, json::value_t::array))
    for (json& element : *list)
      if (element.is_object()) visit(element);
}
std::string text_of(json& object, const char* key) {
  const json* text = find(object, key, json::value_t::string);
  return text ? text->get<std::string>() : "";
}

std::vector<GltfImage> take_images(json& file) {
  std::vector<GltfImage> images;
  each(file, "images", [&](json& image) {
    GltfImage taken{text_of(image, "name"), text_of(image, "uri"), -1};
    if (const auto view = image.find("bufferView"); view != image.end() && view->is_number_unsigned())
      taken.view = view->get<int>();
    images.push_back(std::move(taken));
  });
  file.erase("images");
  return images;
}

int index_of(json& object, const char* key) {
  const json* number = find(object, key, json::value_t::number_unsigned);
  return number && number->get<uint64_t>() < (1u << 30) ? number->get<int>() : -1;
}

void take_animations(json& file, GltfJson& result) {
  each(file, "animations", [&](json& animation) {
    GltfAnimation taken{text_of(animation, "name"), {}};
    json* samplers = find(animation, "samplers", json::value_t::array);
    each(animation, "channels", [&](json& channel) {
      json* target = find_object(channel, "target");
      const int sampler = index_of(channel, "sampler");
      if (!target || !samplers || sampler < 0 || static_cast<size_t>(sampler) >= samplers->size()) return;
      json& of = (*samplers)[static_cast<size_t>(sampler)];
      const std::string path = text_of(*target, "path"), interpolation = text_of(of, "interpolation");
      const int node = index_of(*target, "node");
      result.moves_pointers |= path == "pointer";
      if (node < 0 || path == "pointer") return;
      taken.channels.push_back({node, index_of(of, "input"), index_of(of, "output"), path,
                                interpolation.empty() ? "LINEAR" : interpolation});
    });
    if (!taken.channels.empty()) result.animations.push_back(std::move(taken));
  });
  file.erase("animations");
}

/// Buffers without bytes, which stand for decompressed ones, and data URIs of types that tinygltf does not know.
void complete_buffers(json& file, bool is_binary) {
  size_t index = 0;
  each(file, "buffers", [&](json& buffer) {
    const std::string uri = text_of(buffer, "uri");
    if (uri.empty() && !(is_binary && index == 0))
      buffer["uri"] = kOneByte, buffer["byteLength"] = 1;
    else if (const size_t comma = uri.find(','); uri.starts_with("data:") && comma < 200)
      buffer["uri"] = "data:application/octet-stream;base64" + uri.substr(comma);
    ++index;
  });
}

/// Indices of accessors without bytes: of meshes compressed by Draco, or all zero.
void remove_absent_indices(json& file) {
  json* accessors = find(file, "accessors", json::value_t::array);
  each(file, "meshes", [&](json& mesh) {
    each(mesh, "primitives", [&](json& primitive) {
      const auto indices = primitive.find("indices");
      if (indices == primitive.end()) return;
      json* extensions = find_object(primitive, "extensions");
      const bool is_compressed = extensions && find_object(*extensions, "KHR_draco_mesh_compression");
      const size_t i = indices->is_number_unsigned() ? indices->get<size_t>() : 0;
      const bool is_absent = accessors && i < accessors->size() && !(*accessors)[i].contains("bufferView");
      if (is_compressed || is_absent) primitive.erase(indices);
    });
  });
}

std::string chunk(uint32_t type, std::string_view content, char padding) {
  std::string padded(content);
  padded.resize((padded.size() + 3) / 4 * 4, padding);
  const uint32_t head[2] = {static_cast<uint32_t>(padded.size()), type};
  return std::string(reinterpret_cast<const char*>(head), sizeof head) + padded;
}

int value_of_hex(char c) {
  return c >= '0' && c <= '9'   ? c - '0'
         : c >= 'a' && c <= 'f' ? c - 'a' + 10
         : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                : -1;
}

std::string from_base64(std::string_view text) {
  std::string bytes;
  uint32_t bits = 0;
  int n = 0;
  for (const char c : text) {
    const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+' || c == '-' ? 62
                      : c == '/' || c == '_' ? 63
                                             : -1;
    if (value < 0) continue;
    bits = bits << 6 | static_cast<uint32_t>(value);
    if ((n += 6) >= 8) bytes += static_cast<char>(bits >> (n -= 8) & 255);
  }
  return bytes;
}

}  // namespace

GltfJson prepare_gltf(std::string_view bytes, const std::string& name) {
  GltfJson result;
  result.is_binary = bytes.starts_with("glTF");
  const Chunks chunks = result.is_binary ? chunks_of(bytes, name) : Chunks{bytes, {}};
  json file;
  try {
    file = json::parse(chunks.text);
  } catch (const json::exception& error) {
    const std::string what = error.what();
    refuse(name, "is not a readable glTF file: " + what.substr(0, what.find('\n')));
  }
  if (!file.is_object()) refuse(name, "is not a readable glTF file: it holds no JSON object");
  json* asset = find_object(file, "asset");
  const std::string version = asset ? text_of(*asset, "version") : "";
  const bool is_old = find_object(file, "nodes") || find_object(file, "meshes");  // lists since 2.0
  if (!version.starts_with("2") && (is_old || !version.empty()))
    refuse_version(name, version.empty() ? "1.0" : version);
  take_animations(file, result);
  result.images = take_images(file);
  complete_buffers(file, result.is_binary);
  remove_absent_indices(file);
  each(file, "skins", [](json& skin) {  // tinygltf misses them, although they are optional
    if (!skin.contains("inverseBindMatrices")) skin["inverseBindMatrices"] = -1;
  });
  const std::string text = file.dump(-1, ' ', false, json::error_handler_t::replace);
  if (!result.is_binary) {
    result.bytes = text;
    return result;
  }
  std::string content = chunk(kJsonChunk, text, ' ');
  if (!chunks.data.empty()) content += chunk(kBinaryChunk, chunks.data, '\0');
  const uint32_t head[2] = {2, static_cast<uint32_t>(content.size() + 12)};
  result.bytes = "glTF" + std::string(reinterpret_cast<const char*>(head), sizeof head) + content;
  return result;
}

std::string bytes_of_data_uri(std::string_view uri) {
  const size_t comma = uri.find(',');
  if (comma == std::string_view::npos) return "";
  const std::string_view content = uri.substr(comma + 1);
  return uri.substr(0, comma).ends_with(";base64") ? from_base64(content) : file_of_uri(content);
}

std::string file_of_uri(std::string_view uri) {
  std::string path;
  for (size_t i = 0; i < uri.size(); ++i) {
    const int high = uri[i] == '%' && i + 2 < uri.size() ? value_of_hex(uri[i + 1]) : -1;
    const int low = high >= 0 ? value_of_hex(uri[i + 2]) : -1;
    if (low >= 0)
      path += static_cast<char>(high * 16 + low), i += 2;
    else
      path += uri[i];
  }
  return path;
}

}  // namespace covary
