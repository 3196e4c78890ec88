// SPDX-License-Identifier: Apache-2.0
#include "io/curve_file.h"

#include <fmt/format.h>

#include "core/error.h"
#include "formats/xml_values.h"

namespace covary {
namespace {

class Reader {
 public:
  Reader(CurveKind kind, const Transform& to_world)
      : n_least_(kind == CurveKind::kLinear ? 2 : 4), to_world_(to_world) {}

  void read(std::string_view text) {
    while (!text.empty()) {
      ++line_;
      const size_t end = std::min(text.find('\n'), text.size());
      std::string_view line = text.substr(0, end);
      if (line.ends_with('\r')) line.remove_suffix(1);
      text.remove_prefix(std::min(end + 1, text.size()));
      const bool blank = line.find_first_not_of(" \t") == std::string_view::npos;
      blank ? end_curve() : add_point(line);
    }
    end_curve();
  }
  std::vector<CurvePoint> points;
  std::vector<uint32_t> segments;

 private:
  void add_point(std::string_view line) {
    try {
      const std::vector<double> v = parse_numbers(line, 4);
      const Vec3 p = to_world_.point({static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])});
      if (v[3] < 0) throw Error(ErrorCode::kInput, fmt::format("the radius is {}; it must not be negative", v[3]));
      points.push_back({p.x, p.y, p.z, static_cast<float>(v[3])});
    } catch (const Error& error) {
      throw Error(ErrorCode::kInput, fmt::format("line {}: {}", line_, error.what()));
    }
  }
  void end_curve() {
    const size_t n = points.size() - first_;
    if (n == 0) return;
    if (n < n_least_)
      throw Error(ErrorCode::kInput, fmt::format("line {}: the curve before it has {} control points; at least {} are "
                                                 "needed",
                                                 line_, n, n_least_));
    for (size_t i = first_; i + n_least_ <= points.size(); ++i) segments.push_back(static_cast<uint32_t>(i));
    first_ = points.size();
  }

  size_t n_least_, first_ = 0, line_ = 0;
  Transform to_world_;
};

}  // namespace

std::shared_ptr<CurveShape> read_curves(std::string_view text, CurveKind kind, const Transform& to_world) {
  Reader reader(kind, to_world);
  reader.read(text);
  return std::make_shared<CurveShape>(kind, std::move(reader.points), std::move(reader.segments));
}

}  // namespace covary
