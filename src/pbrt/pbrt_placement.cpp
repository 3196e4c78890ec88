// SPDX-License-Identifier: Apache-2.0
#include "pbrt/pbrt_placement.h"

#include <fmt/format.h>

#include <functional>

namespace covary {
namespace {

Vec3 vec3(const std::vector<double>& n, size_t i) {
  return {static_cast<float>(n[i]), static_cast<float>(n[i + 1]), static_cast<float>(n[i + 2])};
}

}  // namespace

bool change_placement(const std::string& word, PbrtTokens& tokens, const SourceLocation& where,
                      PbrtPlacement& placement, PbrtSystems& systems, PbrtMessages& messages) {
  const auto apply = [&](const std::function<Transform()>& make, bool replace = false) {
    if (placement.at_start != placement.at_end)
      messages.warn(where, "the scene moves: it is shown as it is at the start, without motion blur");
    if (!placement.at_start) return;
    try {
      placement.to_world = replace ? make() : placement.to_world * make();
      if (replace) placement.flat = false;
    } catch (const Error& error) {
      messages.warn(where, fmt::format("{}: {}; what it places is left out", word, error.what()));
      placement.flat = true;
    }
  };
  if (word == "Identity") {
    apply([] { return Transform(); }, true);
  } else if (word == "Translate") {
    apply([n = tokens.numbers(3)] { return Transform::translate(vec3(n, 0)); });
  } else if (word == "Scale") {
    apply([n = tokens.numbers(3)] {
      return Transform(Matrix4{{{n[0], 0, 0, 0}, {0, n[1], 0, 0}, {0, 0, n[2], 0}, {0, 0, 0, 1}}});
    });
  } else if (word == "Rotate") {
    apply([n = tokens.numbers(4)] {
      if (vec3(n, 1) == Vec3{}) throw Error(ErrorCode::kInput, "the axis has length zero");
      return Transform::rotate(vec3(n, 1), n[0]);
    });
  } else if (word == "LookAt") {
    apply([n = tokens.numbers(9)] { return Transform::look_at(vec3(n, 0), vec3(n, 3), vec3(n, 6)).inverse(); });
  } else if (word == "Transform" || word == "ConcatTransform") {
    apply(
        [n = tokens.numbers(16)] {
          Matrix4 m;
          for (size_t i = 0; i < 16; ++i) m[i % 4][i / 4] = n[i];  // column-major
          return Transform(m);
        },
        word == "Transform");
  } else if (word == "CoordinateSystem") {
    systems[tokens.string("a name")] = placement.to_world;
  } else if (word == "CoordSysTransform") {
    const auto found = systems.find(tokens.string("the name of a coordinate system"));
    if (found == systems.end())
      messages.error(where, "no coordinate system has this name");
    else
      apply([&] { return found->second; }, true);
  } else if (word == "ActiveTransform") {
    const PbrtToken token = tokens.next();
    if (token.text != "StartTime" && token.text != "EndTime" && token.text != "All")
      tokens.stop(token, fmt::format("found '{}'; expected StartTime, EndTime or All", token.text));
    placement.at_start = token.text != "EndTime", placement.at_end = token.text != "StartTime";
  } else if (word == "TransformTimes") {
    tokens.numbers(2);
  } else if (word == "ReverseOrientation") {
    placement.reverse_orientation = !placement.reverse_orientation;
  } else {
    return false;
  }
  return true;
}

}  // namespace covary
