// SPDX-License-Identifier: Apache-2.0
#include "scene/field_of_view.h"
#include "core/number_text.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace covary {

FieldOfView get_field_of_view(Parameters& p) {
  FieldOfView view;
  static const std::vector<std::string> kAxes = {"x", "y", "diagonal", "smaller", "larger"};
  const bool has_fov = p.has("fov"), has_length = p.has("focal_length");
  if (has_fov && has_length) p.error_at("focal_length", "cannot be combined with 'fov'");
  if (has_fov) {
    view.degrees = p.get_float("fov", 50);
    if (!(view.degrees > 0 && view.degrees < 180)) {
      p.error_at("fov", fmt::format("is {}; it must lie in (0, 180)", view.degrees));
      view.degrees = 50;
    }
    const std::string axis = p.get_choice("fov_axis", "x", kAxes);
    view.axis = axis == "y"          ? FovAxis::kY
                : axis == "diagonal" ? FovAxis::kDiagonal
                : axis == "smaller"  ? FovAxis::kSmaller
                : axis == "larger"   ? FovAxis::kLarger
                                     : FovAxis::kX;
    return view;
  }
  // Focal length in terms of 36 x 24 mm film, as in photography.
  std::string text = p.get_string("focal_length", "50mm");
  if (text.ends_with("mm")) text.resize(text.size() - 2);
  const std::optional<double> given = parse_real(text);
  if (!given) p.error_at("focal_length", fmt::format("'{}' is not a number; expected a length like '50mm'", text));
  double length = given.value_or(50);
  if (!(length > 0)) {
    p.error_at("focal_length", fmt::format("is {} mm; it must be positive", length));
    length = 50;
  }
  view.degrees =
      static_cast<float>(2 * 180 / std::numbers::pi * std::atan(std::sqrt(36.0 * 36 + 24 * 24) / (2 * length)));
  view.axis = FovAxis::kDiagonal;
  if (p.has("fov_axis")) p.get_choice("fov_axis", "diagonal", {"diagonal"});
  return view;
}

}  // namespace covary
