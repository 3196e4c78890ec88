// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ. Corners with the same position, texture coordinate and normal become one vertex.
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cstdlib>
#include <limits>
#include <string>

#include "core/error.h"
#include "meshes/mesh_file.h"
#include "meshes/polygon.h"

namespace covary {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

/// Parses one line from left to right.
class Line {
 public:
  Line(std::string_view text, size_t number) : p_(text.data()), end_(p_ + text.size()), number_(number) {}

  [[noreturn]] void fail(const std::string& message) const {
    throw Error(ErrorCode::kInput, fmt::format("OBJ: line {}: {}", number_, message));
  }
  void skip_blanks() {
    while (p_ < end_ && (*p_ == ' ' || *p_ == '\t' || *p_ == '\r')) ++p_;
  }
  bool at_end() {
    skip_blanks();
    return p_ == end_;
  }
  std::string_view word() {
    skip_blanks();
    const char* start = p_;
    while (p_ < end_ && *p_ != ' ' && *p_ != '\t' && *p_ != '\r') ++p_;
    return {start, static_cast<size_t>(p_ - start)};
  }
  float number() {
    skip_blanks();
    if (p_ < end_ && *p_ == '+') ++p_;
    double value = 0;
    const auto [rest, error] = std::from_chars(p_, end_, value);
    const char* start = p_;
    p_ = rest;
    if (error == std::errc::invalid_argument || !at_blank()) {
      p_ = start;
      fail(fmt::format("'{}' is not a number", word()));
    }
    // from_chars leaves the value alone when it is out of range: strtod gives 0 on underflow, and infinity, which
    // check_mesh() rejects, on overflow.
    if (error == std::errc::result_out_of_range) value = std::strtod(std::string(start, rest).c_str(), nullptr);
    return static_cast<float>(value);
  }
  /// Index in "a/b/c"; kNone if empty. `count`: number of elements so far, for negative indices.
  uint32_t index(size_t count, const char* what) {
    if (at_blank() || *p_ == '/') return kNone;
    int64_t value = 0;
    const auto [rest, error] = std::from_chars(p_, end_, value);
    if (error != std::errc()) fail(fmt::format("'{}' is not an index", word()));
    p_ = rest;
    const int64_t n = static_cast<int64_t>(count);
    const int64_t from_zero = value < 0 ? n + value : value - 1;
    if (from_zero < 0 || from_zero >= n) fail(fmt::format("{} {} does not exist; there are {}", what, value, count));
    return static_cast<uint32_t>(from_zero);
  }
  bool at_blank() const { return p_ == end_ || *p_ == ' ' || *p_ == '\t' || *p_ == '\r'; }
  bool take(char c) {
    if (p_ == end_ || *p_ != c) return false;
    ++p_;
    return true;
  }

 private:
  const char *p_, *end_;
  size_t number_;
};

class ObjReader {
 public:
  MeshFile read(std::string_view text) {
    std::string joined;
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // byte order mark
    for (size_t start = 0, number = 1; start < text.size();) {
      const size_t first = number;
      Line line(next_line(text, start, number, joined), first);
      const std::string_view keyword = line.word();
      if (keyword == "v") {
        const float x = line.number(), y = line.number(), z = line.number();
        positions_.push_back({x, y, z});
        chains_.push_back(kNone);
      } else if (keyword == "vn") {
        const float x = line.number(), y = line.number(), z = line.number();
        normals_.push_back({x, y, z});
      } else if (keyword == "vt") {
        const float u = line.number();
        uvs_.push_back({u, line.at_end() ? 0 : line.number()});
      } else if (keyword == "f") {
        read_face(line);
      }
    }
    if (!any_normal_) file_.mesh.normals.clear();
    if (!any_uv_) file_.mesh.uvs.clear();
    check_mesh(file_);
    return std::move(file_);
  }

 private:
  /// The line at `start`, joined (in `joined`) with the lines after it while it ends in a backslash. Advances `start`
  /// and `number` to the next line.
  static std::string_view next_line(std::string_view text, size_t& start, size_t& number, std::string& joined) {
    joined.clear();
    while (true) {
      const size_t end = std::min(text.find('\n', start), text.size());
      std::string_view line = text.substr(start, end - start);
      start = end + 1;
      ++number;
      if (line.ends_with('\r')) line.remove_suffix(1);
      const bool goes_on = line.ends_with('\\');
      if (goes_on) line.remove_suffix(1);
      const bool last = !goes_on || start >= text.size();
      if (last && joined.empty()) return line;
      joined += line;
      if (last) return joined;
      joined += ' ';
    }
  }

  /// A vertex created so far; vertices with the same position form a chain.
  struct Vertex {
    uint32_t uv, normal, next;
  };

  void read_face(Line& line) {
    corners_.clear();
    while (!line.at_end()) corners_.push_back(read_corner(line));
    try {
      add_polygon(corners_, file_.mesh.positions, file_.mesh.triangles);
    } catch (const Error& error) {
      line.fail(error.what());
    }
  }

  uint32_t read_corner(Line& line) {
    const uint32_t position = line.index(positions_.size(), "vertex");
    if (position == kNone) line.fail(fmt::format("'{}' is not an index", line.word()));
    uint32_t uv = kNone, normal = kNone;
    if (line.take('/')) {
      uv = line.index(uvs_.size(), "texture coordinate");
      if (line.take('/')) normal = line.index(normals_.size(), "normal");
    }
    if (!line.at_blank()) line.fail(fmt::format("'{}' after an index", line.word()));

    for (uint32_t v = chains_[position]; v != kNone; v = vertices_[v].next)
      if (vertices_[v].uv == uv && vertices_[v].normal == normal) return v;
    const uint32_t made = static_cast<uint32_t>(vertices_.size());
    vertices_.push_back({uv, normal, chains_[position]});
    chains_[position] = made;
    any_uv_ |= uv != kNone, any_normal_ |= normal != kNone;
    file_.mesh.positions.push_back(positions_[position]);
    file_.mesh.normals.push_back(normal != kNone ? normals_[normal] : Vec3{});
    file_.mesh.uvs.push_back(uv != kNone ? uvs_[uv] : Vec2{});
    file_.points.push_back(position);
    return made;
  }

  std::vector<Vec3> positions_, normals_;
  std::vector<Vec2> uvs_;
  std::vector<uint32_t> chains_;   // per position: its last vertex
  std::vector<uint32_t> corners_;  // of one face
  std::vector<Vertex> vertices_;
  bool any_uv_ = false, any_normal_ = false;
  MeshFile file_;
};

}  // namespace

MeshFile read_obj(std::string_view text) { return ObjReader().read(text); }

}  // namespace covary
