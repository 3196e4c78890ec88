// SPDX-License-Identifier: Apache-2.0
#include "io/default_sensor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/object_builder.h"

namespace covary {
namespace {

ObjectPtr sensor_of_shape(const ObjectDescription& scene) {
  ObjectPtr found;
  visit_properties(scene, [&](const ObjectDescription& object, const Property& property) {
    const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
    if (!found && object.kind == "shape" && child && *child && (*child)->kind == "sensor") found = *child;
  });
  return found;
}

}  // namespace

ObjectPtr default_sensor(const ObjectDescription& scene, const Bounds3& bounds, Diagnostics& diagnostics) {
  const SourceLocation where{scene.where.file, 0, 0};
  if (const ObjectPtr meter = sensor_of_shape(scene))
    diagnostics.error(meter->where,
                      fmt::format("sensor '{}' measures the light on its shape: a number, not a picture; outside of "
                                  "shapes, <sensor type=\"perspective\"> makes one",
                                  meter->type));
  else
    diagnostics.warn(where, "the scene has no sensor: it is seen along the z axis, as in Mitsuba");
  constexpr double kAngle = 45;
  const double width = std::max(max_component(bounds.upper - bounds.lower), 1e-6f);
  const double distance = width / 2 / std::tan(kAngle / 2 * M_PI / 180);
  const Vec3 center = bounds.center(), from{center.x, center.y, bounds.lower.z - static_cast<float>(distance)};
  return make_object("sensor", "perspective", where,
                     {{"fov", kAngle},
                      {"near_clip", distance / 100},
                      {"far_clip", width * 5 + distance},
                      {"to_world", Transform::translate(from)}});
}

}  // namespace covary
