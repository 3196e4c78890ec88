// SPDX-License-Identifier: Apache-2.0
// The three mesh formats and the placement of a mesh in the scene.
#include <gtest/gtest.h>
#include <zlib.h>

#include <bit>
#include <cstring>

#include "meshes/mesh_file.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::message_of;

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

void expect_near(const Vec3& a, const Vec3& b, float tolerance = 1e-6f) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

/// Appends the raw bytes of a number, last byte first when `swap`.
template <typename T>
void append(std::string& to, T value, bool swap = false) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (swap) std::reverse(raw, raw + sizeof(T));
  to.append(raw, sizeof(T));
}

using Triangle = std::array<uint32_t, 3>;

// ---- PLY ----

const std::string kAsciiSquare = R"(ply
format ascii 1.0
comment two triangles, one of them a quadrilateral's
element vertex 4
property float x
property float y
property float z
property float nx
property float ny
property float nz
property float s
property float t
property uchar red
property uchar green
property uchar blue
property int tag
element face 1
property list uchar int vertex_indices
element edge 1
property int vertex1
property list uchar float weights
end_header
0 0 0 0 0 1 0 0 255 0 0 7
1 0 0 0 0 1 1 0 0 255 0 7
1 1 0 0 0 1 1 1 0 0 255 7
0 1 0.5e0 0 0 1 0 1 51 51 51 7
4 0 1 2 3
0 2 0.5 0.25
)";

void expect_square(const MeshFile& file) {
  const MeshData& mesh = file.mesh;
  ASSERT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.positions[3], (Vec3{0, 1, 0.5f}));
  EXPECT_EQ(mesh.normals[2], (Vec3{0, 0, 1}));
  EXPECT_EQ(mesh.uvs[1], (Vec2{1, 0}));
  EXPECT_EQ(mesh.colours[1], Spectrum(0, 1, 0));
  EXPECT_NEAR(mesh.colours[3].r, 0.2f, 1e-6f);
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_TRUE(file.points.empty());
}

/// The same square in a binary layout with other types: double positions, short tag, uint indices with an int count.
std::string binary_square(bool swap) {
  std::string text =
      std::string("ply\nformat binary_") + (swap ? "big" : "little") +
      "_endian 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\nproperty float nx\n"
      "property float ny\nproperty float nz\nproperty float texture_u\nproperty float texture_v\nproperty ushort r\n"
      "property ushort g\nproperty ushort b\nproperty list uchar short extra\nelement face 1\n"
      "property list int uint vertex_index\nproperty uchar material\nend_header\n";
  const float p[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.5f}};
  const uint16_t colours[4][3] = {{65535, 0, 0}, {0, 65535, 0}, {0, 0, 65535}, {13107, 13107, 13107}};
  for (int i = 0; i < 4; ++i) {
    for (float v : p[i]) append(text, static_cast<double>(v), swap);
    for (float v : {0.0f, 0.0f, 1.0f, p[i][0], p[i][1]}) append(text, v, swap);
    for (uint16_t v : colours[i]) append(text, v, swap);
    append(text, uint8_t{2});
    append(text, int16_t{-1}, swap), append(text, int16_t{-2}, swap);
  }
  append(text, int32_t{4}, swap);
  for (uint32_t k = 0; k < 4; ++k) append(text, k, swap);
  append(text, uint8_t{9});
  return text;
}

/// The most common layout, `n_faces` triangles over `n_vertices` vertices.
std::string plain_ply(const std::vector<Vec3>& vertices, const std::vector<Triangle>& faces) {
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                     std::to_string(faces.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vec3& v : vertices) append(text, v);
  for (const Triangle& f : faces) {
    append(text, uint8_t{3});
    append(text, f);
  }
  return text;
}

TEST(PlyReader, ReadsAscii) { expect_square(read_ply(bytes_of(kAsciiSquare))); }

TEST(PlyReader, ReadsWindowsLines) {
  std::string text = kAsciiSquare;
  for (size_t i = 0; (i = text.find('\n', i)) != std::string::npos; i += 2) text.replace(i, 1, "\r\n");
  expect_square(read_ply(bytes_of(text)));
}

TEST(PlyReader, ReadsBothByteOrders) {
  expect_square(read_ply(bytes_of(binary_square(false))));
  expect_square(read_ply(bytes_of(binary_square(true))));
}

TEST(PlyReader, ReadsThePlainLayout) {
  const std::vector<Vec3> vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<Triangle> faces = {{0, 1, 2}, {3, 2, 1}};
  const MeshFile file = read_ply(bytes_of(plain_ply(vertices, faces)));
  EXPECT_EQ(file.mesh.positions, vertices);
  EXPECT_EQ(file.mesh.triangles, faces);
  EXPECT_TRUE(file.mesh.normals.empty());
  EXPECT_TRUE(file.mesh.uvs.empty());
  EXPECT_TRUE(file.mesh.colours.empty());
}

TEST(PlyReader, TakesPolygonsInThePlainLayoutApart) {
  std::string text = plain_ply({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {-1, 0.5f, 0}}, {});
  text.replace(text.find("face 0"), 6, "face 3");
  append(text, uint8_t{5});
  for (uint32_t k = 0; k < 5; ++k) append(text, k);
  append(text, uint8_t{2});  // degenerate: two vertices
  append(text, 0u), append(text, 1u);
  append(text, uint8_t{3});
  append(text, Triangle{2, 1, 0});
  EXPECT_EQ(read_ply(bytes_of(text)).mesh.triangles,
            (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {2, 1, 0}}));
}

std::string ply_error(const std::string& text) {
  return message_of([&] { read_ply(bytes_of(text)); });
}

TEST(PlyReader, ReportsWrongHeaders) {
  EXPECT_EQ(ply_error(""), "PLY: line 1: the header has no 'end_header'");
  EXPECT_EQ(ply_error("plx\n"), "PLY: the file does not start with 'ply'");
  EXPECT_EQ(ply_error("ply\nformat binary 1.0\nend_header\n"),
            "PLY: line 2: unknown format 'binary'; expected ascii, binary_little_endian or binary_big_endian");
  EXPECT_EQ(ply_error("ply\nformat ascii 2.0\nend_header\n"), "PLY: line 2: version '2.0'; expected 1.0");
  EXPECT_EQ(ply_error("ply\nend_header\n"), "PLY: the header has no 'format' line");
  EXPECT_EQ(ply_error("ply\nformat ascii 1.0\nelement vertex many\nend_header\n"),
            "PLY: line 3: 'many' is not a number of elements");
  EXPECT_EQ(ply_error("ply\nformat ascii 1.0\nelement vertex 1\nelement vertex 1\nend_header\n"),
            "PLY: line 4: element 'vertex' is given twice");
  EXPECT_EQ(ply_error("ply\nformat ascii 1.0\nproperty float x\nend_header\n"),
            "PLY: line 3: a property before any element");
  EXPECT_EQ(ply_error("ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\nend_header\n"),
            "PLY: line 4: unknown type 'real'");
  EXPECT_EQ(ply_error("ply\nformat ascii 1.0\nelement face 1\nproperty list float int vertex_indices\nend_header\n"),
            "PLY: line 4: the length of list 'vertex_indices' must be an integer");
  EXPECT_EQ(ply_error("ply\nformat ascii 1.0\nnonsense\nend_header\n"), "PLY: line 3: cannot read 'nonsense'");
  EXPECT_EQ(ply_error("ply\nformat ascii 1.0\nelement vertex 0\nend_header\n"), "PLY: the file has no element 'face'");
  EXPECT_EQ(ply_error("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nelement face 0\nend_header\n"),
            "PLY: the vertices lack one of the properties x, y, z");
}

TEST(PlyReader, DoesNotBelieveCounts) {
  std::string text = plain_ply({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  const std::string body = text.substr(text.find("end_header"));
  for (const char* count : {"4000000000", "18446744073709551615", "5"}) {
    std::string huge = text;
    huge.replace(huge.find("vertex 3"), 8, std::string("vertex ") + count);
    EXPECT_EQ(ply_error(huge),
              std::string("PLY: the header promises ") + count + " elements 'vertex', more than the file can hold");
  }
  std::string huge = kAsciiSquare;
  huge.replace(huge.find("face 1"), 6, "face 999999999");
  EXPECT_EQ(ply_error(huge), "PLY: the header promises 999999999 elements 'face', more than the file can hold");
  huge = kAsciiSquare;
  huge.replace(huge.find("4 0 1 2 3"), 9, "999999999 0 1 2 3");
  EXPECT_EQ(ply_error(huge), "PLY: the file ends, or a number cannot be read, in face 0 of 1");
}

TEST(PlyReader, ReportsEveryTruncation) {
  for (const std::string& text :
       {plain_ply({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}), binary_square(false), binary_square(true)})
    for (size_t length = 0; length < text.size(); ++length)
      EXPECT_EQ(ply_error(text.substr(0, length)).substr(0, 5), "PLY: ") << length;
  // An ascii file is complete even without its last newline and trailing elements that are not used.
  EXPECT_EQ(ply_error(kAsciiSquare.substr(0, kAsciiSquare.find("4 0 1 2 3") + 5)),
            "PLY: the file ends, or a number cannot be read, in face 0 of 1");
}

TEST(PlyReader, ReportsWrongContent) {
  EXPECT_EQ(ply_error(plain_ply({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 3}})),
            "triangle 0 uses vertex 3, but there are only 3");
  EXPECT_EQ(ply_error(plain_ply({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 0xffffffffu}})),
            "triangle 0 uses vertex 4294967295, but there are only 3");
  EXPECT_EQ(ply_error(plain_ply({{0, 0, 0}, {1, std::nanf(""), 0}, {0, 1, 0}}, {{0, 1, 2}})),
            "vertex 1 has the position (1, nan, 0)");
  EXPECT_EQ(ply_error(plain_ply({{0, 0, 0}, {1, 0, 0}, {0, 1, kInfinity}}, {{0, 1, 2}})),
            "vertex 2 has the position (0, 1, inf)");
  EXPECT_EQ(ply_error(plain_ply({{0, 0, 0}}, {})), "the mesh has no triangles");
  std::string text = kAsciiSquare;
  text.replace(text.find("4 0 1 2 3"), 9, "4 0 1 2 -3");
  EXPECT_EQ(ply_error(text), "PLY: face 0 uses vertex -3");
  text = kAsciiSquare;
  text.replace(text.find("1 0 0 0"), 7, "1 0 x 0");
  EXPECT_EQ(ply_error(text), "PLY: the file ends, or a number cannot be read, in vertex 1 of 4");
  text = kAsciiSquare;
  text.replace(text.find("vertex_indices"), 14, "vertex_corners");
  EXPECT_EQ(ply_error(text), "PLY: the faces have no integer list 'vertex_indices' or 'vertex_index'");
}

// ---- OBJ ----

TEST(ObjReader, ReadsPositionsTextureCoordinatesAndNormals) {
  const MeshFile file = read_obj(R"(# a square
mtllib none.mtl
o square
v 0 0 0
v 1 0 0 1.0
v 1 1 0
v 0 1 -.5e0
vt 0 0
vt 1 0 0
vt 0.5
vn 0 0 1
usemtl white
s off
f 1/1/1 2/2/1 3/3/1 4/1/1
)");
  const MeshData& mesh = file.mesh;
  EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, -0.5f}}));
  EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0, 0}, {1, 0}, {0.5f, 0}, {0, 0}}));
  EXPECT_EQ(mesh.normals, std::vector<Vec3>(4, {0, 0, 1}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(ObjReader, SplitsVerticesWhereAttributesDiffer) {
  const MeshFile file = read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 2/1 3/1\n");
  EXPECT_EQ(file.mesh.positions.size(), 4u);
  EXPECT_EQ(file.points, (std::vector<uint32_t>{0, 1, 2, 0}));
  EXPECT_EQ(file.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 1, 2}}));
  EXPECT_TRUE(file.mesh.normals.empty());
}

TEST(ObjReader, CountsNegativeIndicesFromTheEnd) {
  const MeshFile file = read_obj("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf -3//-1 -2//-1 -1//-1");
  EXPECT_EQ(file.mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(file.mesh.normals, std::vector<Vec3>(3, {0, 0, 1}));
  EXPECT_TRUE(file.mesh.uvs.empty());
}

TEST(ObjReader, JoinsLinesThatABackslashEnds) {
  const MeshFile file = read_obj("v 0 0 0\nv 1 \\\n0 0\nv 0 1 0\r\nf 1 \\\r\n2 \\\n3\\");
  EXPECT_EQ(file.mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(file.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  EXPECT_EQ(message_of([] { read_obj("v 0 \\\n0 0\n\nv a 0 0\n"); }), "OBJ: line 4: 'a' is not a number");
  EXPECT_EQ(message_of([] { read_obj("v 0 0 0\nf 1 \\\n\\\n7\n"); }),
            "OBJ: line 2: vertex 7 does not exist; there are 1");
}

TEST(ObjReader, ReportsProblemsWithTheirLine) {
  const auto error = [](const std::string& text) { return message_of([&] { read_obj(text); }); };
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_EQ(error("v 0 0\n"), "OBJ: line 1: '' is not a number");
  EXPECT_EQ(error("\n\nv 0 0 1x\n"), "OBJ: line 3: '1x' is not a number");
  EXPECT_EQ(error(triangle + "f 1 2 4\n"), "OBJ: line 4: vertex 4 does not exist; there are 3");
  EXPECT_EQ(error(triangle + "f 1 2 0\n"), "OBJ: line 4: vertex 0 does not exist; there are 3");
  EXPECT_EQ(error(triangle + "f 1 2 -4\n"), "OBJ: line 4: vertex -4 does not exist; there are 3");
  EXPECT_EQ(error(triangle + "f 1/1 2/1 3/1\n"), "OBJ: line 4: texture coordinate 1 does not exist; there are 0");
  EXPECT_EQ(error(triangle + "f 1//2 2 3\n"), "OBJ: line 4: normal 2 does not exist; there are 0");
  EXPECT_EQ(error(triangle + "f a b c\n"), "OBJ: line 4: 'a' is not an index");
  EXPECT_EQ(error(triangle + "f 1/ 2 3x\n"), "OBJ: line 4: 'x' after an index");
  EXPECT_EQ(error(triangle + "f 1 2 3 1/2/3/4\n"), "OBJ: line 4: texture coordinate 2 does not exist; there are 0");
  EXPECT_EQ(error("v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n"), "vertex 2 has the position (0, nan, 0)");
  EXPECT_EQ(error("v 0 0 0\nv 1 0 0\nv 0 1e999 0\nf 1 2 3\n"), "vertex 2 has the position (0, inf, 0)");
  EXPECT_EQ(error("v 0 0 0\nv 1 0 0\nv 0 1 1e-999\nf 1 2 3\n"), "no error");
  EXPECT_EQ(error(triangle), "the mesh has no triangles");
}

// ---- serialized ----

std::string deflate(const std::string& data) {
  uLongf size = compressBound(data.size());
  std::string out(size, '\0');
  EXPECT_EQ(
      compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(data.data()), data.size()),
      Z_OK);
  out.resize(size);
  return out;
}

template <typename T>
std::string serialized_body(uint16_t version, float x, uint64_t n_vertices = 3) {
  std::string data;
  append(data, static_cast<uint32_t>(0x0001 | 0x0002 | 0x0008 | (sizeof(T) == 8 ? 0x2000 : 0x1000)));
  if (version == 4) data += std::string("name") + '\0';
  append(data, n_vertices);
  append(data, uint64_t{1});
  for (T v : {T(x), T(0), T(0), T(1), T(0), T(0), T(0), T(1), T(0)}) append(data, v);  // positions
  for (int i = 0; i < 3; ++i)
    for (T v : {T(0), T(0), T(1)}) append(data, v);                  // normals
  for (T v : {T(0), T(0), T(1), T(0), T(0), T(1)}) append(data, v);  // texture coordinates
  for (int i = 0; i < 9; ++i) append(data, T(0.5));                  // colours
  append(data, Triangle{0, 1, 2});
  std::string mesh;
  append(mesh, uint16_t{0x041c});
  append(mesh, version);
  return mesh + deflate(data);
}

template <typename Offset>
std::string serialized_file(const std::vector<std::string>& meshes) {
  std::string file, offsets;
  for (const std::string& mesh : meshes) {
    append(offsets, static_cast<Offset>(file.size()));
    file += mesh;
  }
  append(offsets, static_cast<uint32_t>(meshes.size()));
  return file + offsets;
}

TEST(SerializedReader, ReadsBothPrecisionsAndVersions) {
  const std::string v4 = serialized_file<uint64_t>(
      {serialized_body<float>(4, 5), serialized_body<double>(4, 6), serialized_body<float>(4, 7)});
  const std::string v3 = serialized_file<uint32_t>(
      {serialized_body<double>(3, 5), serialized_body<float>(3, 6), serialized_body<float>(3, 7)});
  for (const std::string& text : {v4, v3})
    for (int i = 0; i < 3; ++i) {
      const MeshData mesh = read_serialized(bytes_of(text), i).mesh;
      EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{5.0f + static_cast<float>(i), 0, 0}, {1, 0, 0}, {0, 1, 0}}));
      EXPECT_EQ(mesh.normals, std::vector<Vec3>(3, {0, 0, 1}));
      EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0, 0}, {1, 0}, {0, 1}}));
      EXPECT_EQ(mesh.colours, std::vector<Spectrum>(3, Spectrum(0.5f)));
      EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
    }
}

TEST(SerializedReader, ReportsWrongFiles) {
  const auto error = [](const std::string& text, int index = 0) {
    return message_of([&] { read_serialized(bytes_of(text), index); });
  };
  const std::string good = serialized_file<uint64_t>({serialized_body<float>(4, 5)});
  EXPECT_EQ(error(""), "serialized: the file is truncated");
  EXPECT_EQ(error("ply\n"), "serialized: the file does not start with 0x041c");
  EXPECT_EQ(error(std::string("\x1c\x04\x05\x00", 4)), "serialized: format version 5; expected 3 or 4");
  EXPECT_EQ(error(good, 1), "serialized: shape_index is 1, but the file has 1 meshes");
  EXPECT_EQ(error(good.substr(0, 40)), "serialized: the compressed data is truncated or damaged");
  EXPECT_EQ(error(serialized_body<float>(4, 5, 1ull << 40)),
            "serialized: the header promises 1099511627776 vertices and 1 triangles, more than the file can hold");
  EXPECT_EQ(error(serialized_body<float>(4, 5, 4)), "serialized: the compressed data is truncated or damaged");
  // With no vertices, the indices are read from the bytes after the header: the bits of the first position, 5.
  EXPECT_EQ(error(serialized_body<float>(4, 5, 0)),
            "triangle 0 uses vertex " + std::to_string(std::bit_cast<uint32_t>(5.0f)) + ", but there are only 0");
  std::string many = good;
  std::memcpy(many.data() + many.size() - 4, "\xff\xff\xff\x7f", 4);
  EXPECT_EQ(error(many, 3), "serialized: the file says it has 2147483647 meshes, more than it can hold");
}

// ---- into the scene ----

/// A tent of three faces, whose vertex normals Mitsuba 3.9.1 computes as below.
MeshFile tent() {
  MeshFile file;
  file.mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 2}, {1, 1, 0.5f}};
  file.mesh.triangles = {{0, 1, 2}, {1, 4, 2}, {0, 2, 3}};
  return file;
}

MeshData place(MeshFile file, const MeshPlacement& placement, size_t expected_repaired = 0) {
  size_t n_repaired = 0;
  MeshData mesh = place_mesh(std::move(file), placement, n_repaired);
  EXPECT_EQ(n_repaired, expected_repaired);
  return mesh;
}

TEST(PlaceMesh, ComputesTheNormalsMitsubaComputes) {
  const MeshData mesh = place(tent(), {});
  const Vec3 expected[] = {{0.70711f, 0, 0.70711f},
                           {-0.22705f, -0.22705f, 0.94705f},
                           {0.43303f, -0.21014f, 0.87654f},
                           {1, 0, 0},
                           {-0.40825f, -0.40825f, 0.8165f}};
  ASSERT_EQ(mesh.normals.size(), 5u);
  for (int i = 0; i < 5; ++i) expect_near(mesh.normals[i], expected[i], 1e-5f);
}

TEST(PlaceMesh, SharesComputedNormalsBetweenVerticesOfOnePoint) {
  MeshFile file = tent();
  file.mesh.positions.push_back({0, 0, 0});  // a copy of vertex 0 for the third face
  file.mesh.triangles[2][0] = 5;
  file.points = {0, 1, 2, 3, 4, 0};
  const MeshData mesh = place(file, {});
  expect_near(mesh.normals[0], {0.70711f, 0, 0.70711f}, 1e-5f);
  expect_near(mesh.normals[5], {0.70711f, 0, 0.70711f}, 1e-5f);
  file.points.clear();
  expect_near(place(file, {}).normals[0], {0, 0, 1}, 1e-5f);
}

TEST(PlaceMesh, DropsNormalsForFlatShading) {
  MeshFile file = tent();
  file.mesh.normals.assign(5, {0, 0, 1});
  MeshPlacement placement;
  placement.face_normals = true;
  EXPECT_TRUE(place(file, placement).normals.empty());
  EXPECT_TRUE(place(tent(), placement).normals.empty());
}

TEST(PlaceMesh, TransformsPositionsAndNormals) {
  MeshFile file;
  file.mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 1}};
  file.mesh.normals.assign(3, {0, -2, 2});  // not normalised
  file.mesh.triangles = {{0, 1, 2}};
  MeshPlacement placement;
  placement.to_world = Transform::translate({1, 2, 3}) * Transform::scale({1, 1, 3});
  const MeshData mesh = place(file, placement);
  EXPECT_EQ(mesh.positions[2], (Vec3{1, 3, 6}));
  expect_near(mesh.normals[0], normalize(Vec3{0, -1, 1 / 3.0f}));
  EXPECT_EQ(mesh.triangles, file.mesh.triangles);
}

TEST(PlaceMesh, KeepsTheGivenNormalsSideUnderMirrors) {
  MeshFile file;
  file.mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  file.mesh.normals.assign(3, {0, 0, 1});
  file.mesh.triangles = {{0, 1, 2}};
  MeshPlacement placement;
  placement.to_world = Transform::scale({-1, 1, 1});
  const MeshData mesh = place(file, placement);
  const auto& t = mesh.triangles[0];
  const Vec3 geometric =
      cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]);
  expect_near(geometric, {0, 0, 1});
  expect_near(mesh.normals[0], {0, 0, 1});
}

TEST(PlaceMesh, RepairsNormalsWithoutDirection) {
  MeshFile file = tent();
  file.mesh.normals.assign(5, {0, 1, 0});
  file.mesh.normals[0] = {0, 0, 0};
  file.mesh.normals[1] = {std::nanf(""), 0, 1};
  const MeshData mesh = place(file, {}, 2);
  expect_near(mesh.normals[0], {0.70711f, 0, 0.70711f}, 1e-5f);
  expect_near(mesh.normals[1], {-0.22705f, -0.22705f, 0.94705f}, 1e-5f);
  expect_near(mesh.normals[2], {0, 1, 0});
}

TEST(PlaceMesh, FlipsTextureCoordinatesAndPassesFlippedNormalsOn) {
  MeshFile file = tent();
  file.mesh.uvs = {{0, 0}, {1, 0.25f}, {0, 1}, {0, 2}, {std::nanf(""), 0}};
  MeshPlacement placement;
  placement.flip_tex_coords = placement.flip_normals = true;
  const MeshData mesh = place(file, placement);
  EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0, 1}, {1, 0.75f}, {0, 0}, {0, -1}, {0, 0}}));
  EXPECT_TRUE(mesh.flip_normals);
}

}  // namespace
}  // namespace covary
