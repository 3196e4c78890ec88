// SPDX-License-Identifier: Apache-2.0
// Stanford PLY. The general path reads any legal layout value by value; the most common layout (binary little endian,
// single-precision vertices, faces "uchar n, int index[n]") has a fast path.
#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>

#include "core/error.h"
#include "meshes/mesh_file.h"
#include "meshes/ply_attributes.h"
#include "meshes/ply_header.h"
#include "meshes/ply_polygons.h"

namespace covary {
namespace {

static_assert(std::endian::native == std::endian::little);

/// Assigns slots to the vertex properties and records which groups are complete.
struct Contents {
  bool normals = false, uvs = false, colours = false, tangents = false;
};
Contents assign_slots(PlyElement& vertex) {
  const auto find = [&](std::string_view name) -> PlyProperty* {
    for (PlyProperty& p : vertex.properties)
      if (p.name == name && !p.is_list) return &p;
    return nullptr;
  };
  const auto assign = [&](std::initializer_list<std::string_view> names, int first_slot) {
    for (std::string_view name : names)
      if (!find(name)) return false;
    int slot = first_slot;
    for (std::string_view name : names) find(name)->slot = static_cast<PlySlot>(slot++);
    return true;
  };
  if (!assign({"x", "y", "z"}, kX)) fail_ply("the vertices lack one of the properties x, y, z");
  Contents contents;
  contents.normals = assign({"nx", "ny", "nz"}, kNx);
  contents.uvs = assign({"texture_u", "texture_v"}, kU) || assign({"s", "t"}, kU) || assign({"u", "v"}, kU) ||
                 assign({"texture_s", "texture_t"}, kU);
  contents.tangents = assign({"tx", "ty", "tz", "tw"}, kTx);
  contents.colours = assign({"r", "g", "b"}, kR) || assign({"red", "green", "blue"}, kR) ||
                     assign({"color_r", "color_g", "color_b"}, kR) || assign({"color_x", "color_y", "color_z"}, kR) ||
                     assign({"color_0", "color_1", "color_2"}, kR) || assign({"color_1", "color_2", "color_3"}, kR);
  return contents;
}

// ---- body -----------------------------------------------------------------------------------------------------------

/// Reads the values of a binary body in order.
class BinaryBody {
 public:
  BinaryBody(std::span<const std::byte> bytes, bool swap) : p_(bytes.data()), end_(p_ + bytes.size()), swap_(swap) {}

  size_t remaining() const { return static_cast<size_t>(end_ - p_); }
  bool swap() const { return swap_; }
  /// Largest number of records that fit in the rest of the file.
  uint64_t capacity(const PlyElement& element) const {
    return remaining() / std::max<size_t>(1, element.smallest_record());
  }
  const std::byte* take(size_t size) {
    if (size > remaining()) return nullptr;
    const std::byte* at = p_;
    p_ += size;
    return at;
  }
  bool read(PlyType type, double& value) {
    const std::byte* at = take(size_of(type));
    if (!at) return false;
    switch (type) {
      case PlyType::kInt8:
        value = load<int8_t>(at);
        break;
      case PlyType::kUint8:
        value = load<uint8_t>(at);
        break;
      case PlyType::kInt16:
        value = load<int16_t>(at);
        break;
      case PlyType::kUint16:
        value = load<uint16_t>(at);
        break;
      case PlyType::kInt32:
        value = load<int32_t>(at);
        break;
      case PlyType::kUint32:
        value = load<uint32_t>(at);
        break;
      case PlyType::kInt64:
        value = static_cast<double>(load<int64_t>(at));
        break;
      case PlyType::kUint64:
        value = static_cast<double>(load<uint64_t>(at));
        break;
      case PlyType::kFloat32:
        value = load<float>(at);
        break;
      case PlyType::kFloat64:
        value = load<double>(at);
        break;
    }
    return true;
  }

 private:
  template <typename T>
  T load(const std::byte* at) const {
    std::byte raw[sizeof(T)];
    for (size_t i = 0; i < sizeof(T); ++i) raw[i] = at[swap_ ? sizeof(T) - 1 - i : i];
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
  }
  const std::byte *p_, *end_;
  bool swap_;
};

/// Reads the values of an ascii body, separated by white space.
class AsciiBody {
 public:
  explicit AsciiBody(std::string_view text) : p_(text.data()), end_(p_ + text.size()) {}

  uint64_t capacity(const PlyElement& element) const {
    return (static_cast<size_t>(end_ - p_) + 1) / std::max<size_t>(2, 2 * element.properties.size());
  }
  bool read(PlyType type, double& value) {
    while (p_ < end_ && (*p_ == ' ' || *p_ == '\t' || *p_ == '\n' || *p_ == '\r')) ++p_;
    if (p_ < end_ && *p_ == '+') ++p_;
    const char* start = p_;
    const auto [rest, error] = std::from_chars(p_, end_, value);
    // from_chars leaves the value alone when it is out of range: strtod gives 0 on underflow, and infinity, which
    // check_mesh() rejects, on overflow.
    if (error == std::errc::result_out_of_range) value = std::strtod(std::string(start, rest).c_str(), nullptr);
    if (error == std::errc::invalid_argument || (rest<end_&& * rest> ' ')) return false;
    if (type < PlyType::kFloat32 && value != std::floor(value)) return false;
    p_ = rest;
    return true;
  }

 private:
  const char *p_, *end_;
};

/// Divisor of integer colours: the maximum of the type.
float colour_scale(PlyType type) {
  switch (type) {
    case PlyType::kUint8:
      return 1 / 255.0f;
    case PlyType::kUint16:
      return 1 / 65535.0f;
    default:
      return 1;
  }
}

/// Resizes the arrays for `n` vertices.
void allocate(MeshData& mesh, const Contents& contents, size_t n) {
  mesh.positions.resize(n);
  if (contents.normals) mesh.normals.resize(n);
  if (contents.uvs) mesh.uvs.resize(n);
  if (contents.colours) mesh.colours.resize(n);
  if (contents.tangents) mesh.tangents.resize(n);
}

void store(MeshData& mesh, const Contents& contents, size_t i, const float* v) {
  mesh.positions[i] = {v[kX], v[kY], v[kZ]};
  if (contents.normals) mesh.normals[i] = {v[kNx], v[kNy], v[kNz]};
  if (contents.uvs) mesh.uvs[i] = {v[kU], v[kV]};
  if (contents.colours) mesh.colours[i] = {v[kR], v[kG], v[kB]};
  if (contents.tangents) mesh.tangents[i] = {{v[kTx], v[kTy], v[kTz]}, v[kTw] < 0 ? -1.0f : 1.0f};
}

[[noreturn]] void fail_in(const PlyElement& element, uint64_t index) {
  fail_ply(
      fmt::format("the file ends, or a number cannot be read, in {} {} of {}", element.name, index, element.count));
}

template <typename Body>
double read_value(Body& body, PlyType type, const PlyElement& element, uint64_t index) {
  double value = 0;
  if (!body.read(type, value)) fail_in(element, index);
  return value;
}

template <typename Body>
uint64_t read_length(Body& body, const PlyProperty& property, const PlyElement& element, uint64_t index) {
  const double length = read_value(body, property.count_type, element, index);
  if (!(length >= 0 && length <= 1e9))
    fail_ply(fmt::format("list '{}' of {} {} has length {}", property.name, element.name, index, length));
  return static_cast<uint64_t>(length);
}

template <typename Body>
void skip_list(Body& body, const PlyProperty& property, const PlyElement& element, uint64_t index) {
  const uint64_t length = read_length(body, property, element, index);
  for (uint64_t k = 0; k < length; ++k) read_value(body, property.type, element, index);
}

/// Integer colours are divided by the maximum of their type.
float attribute_value(const PlyProperty& p, const MeshAttribute& attribute, double value) {
  const bool colour = attribute.name.find("color") != std::string::npos;
  return static_cast<float>(value) * (colour ? colour_scale(p.type) : 1);
}

/// Reads vertices of single-precision values only, in native byte order. False: another layout.
bool read_float_vertices(BinaryBody& body, const PlyElement& element, const Contents& contents, MeshData& mesh) {
  if (body.swap() || element.has_lists()) return false;
  std::vector<std::pair<size_t, PlySlot>> fields;
  size_t offset = 0;
  for (const PlyProperty& p : element.properties) {
    if (p.slot != kSkip && p.type != PlyType::kFloat32) return false;
    if (p.slot != kSkip) fields.emplace_back(offset, p.slot);
    offset += size_of(p.type);
  }
  const std::byte* record = body.take(element.count * offset);
  float values[kSlots] = {};
  for (size_t i = 0; i < element.count; ++i, record += offset) {
    for (const auto& [at, slot] : fields) std::memcpy(&values[slot], record + at, sizeof(float));
    store(mesh, contents, i, values);
  }
  return true;
}

template <typename Body>
void read_vertices(Body& body, const PlyElement& element, const Contents& contents, MeshData& mesh) {
  allocate(mesh, contents, element.count);
  const auto in_attribute = [](const PlyProperty& p) { return p.attribute >= 0; };
  const bool attributes = std::any_of(element.properties.begin(), element.properties.end(), in_attribute);
  for (MeshAttribute& a : mesh.attributes)
    if (!a.per_face) a.values.resize(element.count * static_cast<size_t>(a.channels));
  if constexpr (std::is_same_v<Body, BinaryBody>)
    if (!attributes && read_float_vertices(body, element, contents, mesh)) return;
  float values[kSlots] = {};
  for (uint64_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& p : element.properties) {
      if (p.is_list) {
        skip_list(body, p, element, i);
        continue;
      }
      const double value = read_value(body, p.type, element, i);
      if (p.attribute >= 0) {
        MeshAttribute& a = mesh.attributes[p.attribute];
        a.values[i * a.channels + p.channel] = attribute_value(p, a, value);
      }
      if (p.slot != kSkip)
        values[p.slot] = static_cast<float>(value) * (p.slot >= kR && p.slot <= kB ? colour_scale(p.type) : 1);
    }
    store(mesh, contents, i, values);
  }
}

/// Reads faces "uchar n, int index[n]" without other properties. False: another layout.
bool read_plain_faces(BinaryBody& body, const PlyElement& element, MeshData& mesh, PlyPolygons& polygons) {
  if (body.swap() || element.properties.size() != 1) return false;
  const PlyProperty& list = element.properties[0];
  if (list.count_type != PlyType::kUint8 || (list.type != PlyType::kInt32 && list.type != PlyType::kUint32))
    return false;
  std::array<uint32_t, 255> corners;
  for (uint64_t i = 0; i < element.count; ++i) {
    const std::byte* length = body.take(1);
    const size_t n = length ? static_cast<size_t>(*length) : 0;
    const std::byte* indices = length ? body.take(n * sizeof(uint32_t)) : nullptr;
    if (!indices) fail_in(element, i);
    if (n == 3) [[likely]] {
      std::memcpy(mesh.triangles.emplace_back().data(), indices, 3 * sizeof(uint32_t));
      continue;
    }
    std::memcpy(corners.data(), indices, n * sizeof(uint32_t));
    polygons.add({corners.data(), n}, i);
  }
  return true;
}

/// Repeats the values of a face for each of its `n` triangles.
void add_face_values(MeshData& mesh, const std::vector<std::array<float, 3>>& values, size_t n) {
  for (size_t a = 0; a < mesh.attributes.size(); ++a) {
    MeshAttribute& attribute = mesh.attributes[a];
    if (!attribute.per_face) continue;
    for (size_t i = 0; i < n; ++i)
      attribute.values.insert(attribute.values.end(), values[a].begin(), values[a].begin() + attribute.channels);
  }
}

template <typename Body>
void read_faces(Body& body, const PlyElement& element, MeshData& mesh, PlyPolygons& polygons) {
  const auto is_indices = [](const PlyProperty& p) {
    return p.is_list && (p.name == "vertex_indices" || p.name == "vertex_index") && p.type < PlyType::kFloat32;
  };
  if (std::none_of(element.properties.begin(), element.properties.end(), is_indices))
    fail_ply("the faces have no integer list 'vertex_indices' or 'vertex_index'");
  mesh.triangles.reserve(element.count);
  if constexpr (std::is_same_v<Body, BinaryBody>)
    if (read_plain_faces(body, element, mesh, polygons)) return;
  constexpr double kMaxIndex = std::numeric_limits<uint32_t>::max();
  std::vector<std::array<float, 3>> of_face(mesh.attributes.size());
  std::vector<uint32_t> corners;
  for (uint64_t i = 0; i < element.count; ++i) {
    const size_t n_before = mesh.triangles.size();
    for (const PlyProperty& p : element.properties) {
      if (!p.is_list) {
        const double value = read_value(body, p.type, element, i);
        if (p.attribute >= 0) of_face[p.attribute][p.channel] = attribute_value(p, mesh.attributes[p.attribute], value);
      } else if (!is_indices(p)) {
        skip_list(body, p, element, i);
      } else {
        const uint64_t n = read_length(body, p, element, i);
        corners.clear();
        for (uint64_t k = 0; k < n; ++k) {
          const double value = read_value(body, p.type, element, i);
          if (!(value >= 0 && value < kMaxIndex)) fail_ply(fmt::format("face {} uses vertex {}", i, value));
          corners.push_back(static_cast<uint32_t>(value));
        }
        polygons.add(corners, i);
      }
    }
    add_face_values(mesh, of_face, mesh.triangles.size() - n_before);
  }
}

template <typename Body>
void read_body(Body body, PlyHeader& header, std::span<const std::string> attributes, MeshData& mesh) {
  PlyPolygons polygons(mesh);
  for (PlyElement& element : header.elements) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    if (element.properties.empty() && !is_vertex && !is_face) continue;
    if (element.count > body.capacity(element) || element.count >= std::numeric_limits<uint32_t>::max())
      fail_ply(fmt::format("the header promises {} elements '{}', more than the file can hold", element.count,
                           element.name));
    if (is_vertex || is_face) assign_attributes(element, attributes, mesh);
    if (is_vertex) {
      const Contents contents = assign_slots(element);
      read_vertices(body, element, contents, mesh);
    } else if (is_face) {
      read_faces(body, element, mesh, polygons);
    } else {
      for (uint64_t i = 0; i < element.count; ++i)
        for (const PlyProperty& p : element.properties) {
          if (p.is_list) {
            skip_list(body, p, element, i);
          } else {
            read_value(body, p.type, element, i);
          }
        }
    }
  }
  polygons.finish();
}

}  // namespace

MeshFile read_ply(std::span<const std::byte> bytes, std::span<const std::string> attributes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  PlyHeader header = parse_ply_header(text);
  for (const char* needed : {"vertex", "face"})
    if (std::none_of(header.elements.begin(), header.elements.end(),
                     [&](const PlyElement& e) { return e.name == needed; }))
      fail_ply(fmt::format("the file has no element '{}'", needed));
  MeshFile file;
  if (header.format == PlyFormat::kAscii) {
    read_body(AsciiBody(text.substr(header.size)), header, attributes, file.mesh);
  } else {
    read_body(BinaryBody(bytes.subspan(header.size), header.format == PlyFormat::kBigEndian), header, attributes,
              file.mesh);
  }
  check_mesh(file);
  return file;
}

}  // namespace covary
