// SPDX-License-Identifier: Apache-2.0
// Mitsuba 0.x ".serialized": a sequence of meshes, each a 4-byte header and a zlib stream, followed by the offsets of
// all meshes and their number.
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

#include "core/error.h"
#include "core/memory_limit.h"
#include "meshes/mesh_file.h"

namespace covary {
namespace {

constexpr uint16_t kMagic = 0x041c;
enum Flags : uint32_t { kHasNormals = 0x0001, kHasUvs = 0x0002, kHasColours = 0x0008, kDoublePrecision = 0x2000 };
/// Maximum compression ratio of a zlib stream.
constexpr uint64_t kMaxRatio = 1032;

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::kInput, "serialized: " + message); }

template <typename T>
T load(std::span<const std::byte> bytes, size_t offset) {
  if (offset > bytes.size() || bytes.size() - offset < sizeof(T)) fail("the file is truncated");
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

/// Decompresses on demand.
class Inflater {
 public:
  explicit Inflater(std::span<const std::byte> bytes) : capacity_(bytes.size() * kMaxRatio) {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(std::min<size_t>(bytes.size(), std::numeric_limits<uInt>::max()));
    if (inflateInit(&stream_) != Z_OK) throw Error(ErrorCode::kInternal, "zlib cannot be initialised");
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// Upper bound on the decompressed size of the stream in bytes.
  uint64_t capacity() const { return capacity_; }
  void read(void* to, size_t size) {
    auto* out = static_cast<Bytef*>(to);
    while (size > 0) {
      const uInt chunk = static_cast<uInt>(std::min<size_t>(size, 1u << 30));
      stream_.next_out = out;
      stream_.avail_out = chunk;
      const int status = inflate(&stream_, Z_NO_FLUSH);
      const uInt got = chunk - stream_.avail_out;
      out += got, size -= got;
      if (size > 0 && (status != Z_OK || got == 0)) fail("the compressed data is truncated or damaged");
    }
  }
  template <typename T>
  T value() {
    T v;
    read(&v, sizeof(T));
    return v;
  }

 private:
  z_stream stream_{};
  uint64_t capacity_;
};

/// Reads `n` values of the file's precision as floats.
std::vector<float> read_floats(Inflater& in, size_t n, bool double_precision) {
  std::vector<float> values(n);
  if (!double_precision) {
    in.read(values.data(), n * sizeof(float));
    return values;
  }
  std::array<double, 1024> buffer;
  for (size_t i = 0; i < n;) {
    const size_t m = std::min(buffer.size(), n - i);
    in.read(buffer.data(), m * sizeof(double));
    for (size_t k = 0; k < m; ++k) values[i + k] = static_cast<float>(buffer[k]);
    i += m;
  }
  return values;
}

template <typename T>
std::vector<T> read_vectors(Inflater& in, size_t n, bool double_precision) {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(float) == 0);
  const std::vector<float> numbers = read_floats(in, n * (sizeof(T) / sizeof(float)), double_precision);
  std::vector<T> result(n);
  if (n > 0) std::memcpy(static_cast<void*>(result.data()), numbers.data(), n * sizeof(T));
  return result;
}

/// The bytes starting at the header of mesh `shape_index`.
std::span<const std::byte> find_mesh(std::span<const std::byte> bytes, int shape_index, uint16_t version) {
  if (shape_index == 0) return bytes;
  const uint32_t count = bytes.size() >= 4 ? load<uint32_t>(bytes, bytes.size() - 4) : 0;
  const size_t entry = version >= 4 ? 8 : 4;
  if (count > (bytes.size() - 4) / entry)
    fail(fmt::format("the file says it has {} meshes, more than it can hold", count));
  if (shape_index < 0 || static_cast<uint32_t>(shape_index) >= count)
    fail(fmt::format("shape_index is {}, but the file has {} meshes", shape_index, count));
  const size_t at = bytes.size() - 4 - entry * (count - static_cast<uint32_t>(shape_index));
  const uint64_t offset = version >= 4 ? load<uint64_t>(bytes, at) : load<uint32_t>(bytes, at);
  if (offset >= bytes.size())
    fail(fmt::format("mesh {} starts at byte {}, after the end of the file", shape_index, offset));
  return bytes.subspan(offset);
}

}  // namespace

MeshFile read_serialized(std::span<const std::byte> bytes, int shape_index) {
  if (load<uint16_t>(bytes, 0) != kMagic) fail("the file does not start with 0x041c");
  const uint16_t version = load<uint16_t>(bytes, 2);
  if (version != 3 && version != 4) fail(fmt::format("format version {}; expected 3 or 4", version));
  const std::span<const std::byte> own = find_mesh(bytes, shape_index, version);
  if (load<uint16_t>(own, 0) != kMagic) fail(fmt::format("mesh {} does not start with 0x041c", shape_index));
  Inflater in(own.subspan(std::min<size_t>(4, own.size())));

  const uint32_t flags = in.value<uint32_t>();
  if (version == 4)
    while (in.value<char>() != '\0') {
    }  // skips the name
  const uint64_t n_vertices = in.value<uint64_t>(), n_triangles = in.value<uint64_t>();
  const bool double_precision = (flags & kDoublePrecision) != 0;
  uint64_t numbers = 3;
  if (flags & kHasNormals) numbers += 3;
  if (flags & kHasUvs) numbers += 2;
  if (flags & kHasColours) numbers += 3;
  const uint64_t vertex_size = numbers * (double_precision ? 8 : 4), triangle_size = 12;
  if (n_vertices > in.capacity() / vertex_size || n_triangles > in.capacity() / triangle_size ||
      n_vertices >= std::numeric_limits<uint32_t>::max())
    fail(fmt::format("the header promises {} vertices and {} triangles, more than the file can hold", n_vertices,
                     n_triangles));

  require_memory(fmt::format("mesh {}", shape_index),
                 fmt::format("a mesh of {} vertices and {} triangles", n_vertices, n_triangles),
                 2.0 * static_cast<double>(n_vertices * vertex_size + n_triangles * triangle_size));

  MeshFile file;
  file.mesh.positions = read_vectors<Vec3>(in, n_vertices, double_precision);
  if (flags & kHasNormals) file.mesh.normals = read_vectors<Vec3>(in, n_vertices, double_precision);
  if (flags & kHasUvs) file.mesh.uvs = read_vectors<Vec2>(in, n_vertices, double_precision);
  if (flags & kHasColours) file.mesh.colours = read_vectors<Spectrum>(in, n_vertices, double_precision);
  file.mesh.triangles.resize(n_triangles);
  in.read(file.mesh.triangles.data(), n_triangles * triangle_size);
  check_mesh(file);
  return file;
}

}  // namespace covary
