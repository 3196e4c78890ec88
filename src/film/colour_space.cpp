// SPDX-License-Identifier: Apache-2.0
#include "film/colour_space.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {
namespace {

using Vector = std::array<double, 3>;

/// Published values of one space differ by this much, those of different spaces by more.
constexpr float kRounding = 1e-3f;

const std::array<std::pair<const char*, ColourSpace>, 6>& known_spaces() {
  constexpr ColourSpace::Point d65{0.3127f, 0.329f}, aces_white{0.32168f, 0.33767f};
  static const std::array<std::pair<const char*, ColourSpace>, 6> spaces = {{
      {"Rec. 709", {}},
      {"CIE XYZ", ColourSpace::xyz()},
      {"ACES2065-1", {{0.7347f, 0.2653f}, {0, 1}, {0.0001f, -0.077f}, aces_white}},   // SMPTE ST 2065-1
      {"ACEScg", {{0.713f, 0.293f}, {0.165f, 0.83f}, {0.128f, 0.044f}, aces_white}},  // S-2014-004
      {"Rec. 2020", {{0.708f, 0.292f}, {0.17f, 0.797f}, {0.131f, 0.046f}, d65}},      // ITU-R BT.2020
      {"P3 (D65)", {{0.68f, 0.32f}, {0.265f, 0.69f}, {0.15f, 0.06f}, d65}},           // SMPTE EG 432-1
  }};
  return spaces;
}

Vector times(const RgbMatrix& m, const Vector& v) {
  Vector result{};
  for (size_t row = 0; row < 3; ++row)
    for (size_t k = 0; k < 3; ++k) result[row] += m[row][k] * v[k];
  return result;
}

RgbMatrix times(const RgbMatrix& a, const RgbMatrix& b) {
  RgbMatrix result{};
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 3; ++column)
      for (size_t k = 0; k < 3; ++k) result[row][column] += a[row][k] * b[k][column];
  return result;
}

RgbMatrix scaling(const Vector& v) { return {{{v[0], 0, 0}, {0, v[1], 0}, {0, 0, v[2]}}}; }

/// By cofactors. Throws if there is none.
RgbMatrix inverse(const RgbMatrix& m) {
  RgbMatrix cofactors{};
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 3; ++column) {
      const size_t r1 = (row + 1) % 3, r2 = (row + 2) % 3, c1 = (column + 1) % 3, c2 = (column + 2) % 3;
      cofactors[column][row] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    }
  double determinant = 0;
  for (size_t k = 0; k < 3; ++k) determinant += m[0][k] * cofactors[k][0];
  if (!(std::abs(determinant) > 1e-6))
    throw Error(ErrorCode::kInput, "chromaticities whose primaries lie on a line; expected those of a colour space");
  for (Vector& row : cofactors)
    for (double& value : row) value /= determinant;
  return cofactors;
}

/// X, Y, Z of unit luminance.
Vector white_of(const ColourSpace& space) {
  const ColourSpace::Point w = space.white;
  if (!(w.y > 0))
    throw Error(ErrorCode::kInput,
                fmt::format("chromaticities with the white ({:g}, {:g}); expected one with light", w.x, w.y));
  return {w.x / w.y, 1, (1 - w.x - w.y) / w.y};
}

RgbMatrix to_xyz(const ColourSpace& space) {
  RgbMatrix primaries{};
  const std::array<ColourSpace::Point, 3> points = {space.red, space.green, space.blue};
  for (size_t c = 0; c < 3; ++c) {
    const double x = points[c].x, y = points[c].y;
    primaries[0][c] = x, primaries[1][c] = y, primaries[2][c] = 1 - x - y;
  }
  return times(primaries, scaling(times(inverse(primaries), white_of(space))));
}

/// Bradford's cone responses (CIECAM97s).
constexpr RgbMatrix kBradford = {{{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};

RgbMatrix adaptation(const ColourSpace& from, const ColourSpace& to) {
  const Vector source = times(kBradford, white_of(from)), target = times(kBradford, white_of(to));
  Vector factors{};
  for (size_t k = 0; k < 3; ++k) factors[k] = target[k] / source[k];
  return times(inverse(kBradford), times(scaling(factors), kBradford));
}

}  // namespace

bool ColourSpace::operator==(const ColourSpace& other) const {
  const auto same = [](const Point& a, const Point& b) {
    return std::abs(a.x - b.x) <= kRounding && std::abs(a.y - b.y) <= kRounding;
  };
  return same(red, other.red) && same(green, other.green) && same(blue, other.blue) && same(white, other.white);
}

std::string ColourSpace::text() const {
  for (const auto& [name, space] : known_spaces())
    if (space == *this) return name;
  return fmt::format("primaries ({:.4g}, {:.4g}), ({:.4g}, {:.4g}), ({:.4g}, {:.4g}), white ({:.4g}, {:.4g})", red.x,
                     red.y, green.x, green.y, blue.x, blue.y, white.x, white.y);
}

ColourSpace aces_colour_space() { return known_spaces()[2].second; }

ColourSpace named_colour_space(const std::map<std::string, std::string>& attributes) {
  constexpr std::array<std::pair<const char*, size_t>, 8> kNames = {{{"lin_ciexyzd65_scene", 1},
                                                                     {"lin_ap0_scene", 2},
                                                                     {"ACES2065-1", 2},
                                                                     {"lin_ap1_scene", 3},
                                                                     {"ACEScg", 3},
                                                                     {"lin_ap1", 3},
                                                                     {"lin_rec2020_scene", 4},
                                                                     {"lin_p3d65_scene", 5}}};
  for (const char* key : {"colorInteropID", "oiio:ColorSpace"})
    if (const auto found = attributes.find(key); found != attributes.end())
      for (const auto& [name, space] : kNames)
        if (found->second == name) return known_spaces()[space].second;
  return {};
}

RgbMatrix colour_conversion(const ColourSpace& from, const ColourSpace& to) {
  const ColourSpace xyz = ColourSpace::xyz();
  RgbMatrix matrix = to_xyz(from);
  if (!(from == xyz) && !(to == xyz)) matrix = times(adaptation(from, to), matrix);
  return times(inverse(to_xyz(to)), matrix);
}

void convert_colours(const RgbMatrix& matrix, Image& image) {
  COVARY_CHECK(image.channels == 3, "a picture of 3 channels");
  const size_t row = static_cast<size_t>(image.width) * 3;
  parallel_for(static_cast<size_t>(image.height), [&](size_t y) {
    float* values = image.data.data() + y * row;
    for (size_t i = 0; i < row; i += 3) {
      const Vector colour = times(matrix, Vector{values[i], values[i + 1], values[i + 2]});
      for (size_t c = 0; c < 3; ++c) values[i + c] = static_cast<float>(colour[c]);
    }
  });
}

}  // namespace covary
