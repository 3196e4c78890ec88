// SPDX-License-Identifier: Apache-2.0
#include "io/media.h"

#include "formats/object_builder.h"

namespace covary {
namespace {

/// Location of the object's first reference to a medium: "file:line:column: medium 'type'".
std::string place_of_medium(const ObjectDescription& object) {
  for (const Property& property : object.properties)
    if (const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value); child && *child && (*child)->kind == "medium")
      return property.where.text() + ": medium '" + (*child)->type + "'";
  return object.where.text();
}

}  // namespace

void name_path(ObjectDescription& integrator, const ObjectDescription& scene, Diagnostics& diagnostics) {
  if (integrator.type == "bdpt" && has_media(scene)) {
    diagnostics.warn(integrator.where,
                     "integrator 'bdpt' sees no media here and is read as 'path', whose expected picture is the same");
    std::erase_if(integrator.properties, [](const Property& p) { return p.name == "light_tracing"; });
    integrator.type = "path";
  }
  if (integrator.type != "volpath" && integrator.type != "volpathmis") return;
  if (integrator.type == "volpathmis")  // selects among estimators of the same expectation
    std::erase_if(integrator.properties, [](const Property& p) { return p.name == "use_spectral_mis"; });
  integrator.type = "path";
}

bool has_media(const ObjectDescription& scene) {
  bool found = false;
  visit_properties(scene, [&](const ObjectDescription& object, const Property& property) {
    const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
    found |= (object.kind == "shape" || object.kind == "sensor") && child && *child && (*child)->kind == "medium";
  });
  return found;
}

bool is_part_of_media(const std::string& kind) { return kind == "medium" || kind == "phase" || kind == "volume"; }

ShapeMedia read_media(Parameters& shape, bool in_group) {
  const auto medium = [&](const char* name) {
    return std::dynamic_pointer_cast<const Medium>(shape.find_object(name, "medium"));
  };
  const ShapeMedia media{medium("interior"), medium("exterior")};
  if (in_group && (media.interior || media.exterior))
    shape.error("has a medium; shapes of a shapegroup cannot have one, those that stand at top level can");
  return media;
}

void use_media(const ShapeMedia& media, Parameters& parameters, Shape& shape, bool no_bsdf, SceneParts& parts) {
  if (!media.interior && !media.exterior) return;
  if (no_bsdf)
    parameters.warn("has a medium and no bsdf, so it is diffuse, as in Mitsuba; <bsdf type=\"null\"/> lets light in");
  if (parts.first_medium.empty()) parts.first_medium = place_of_medium(parameters.object());
  for (const MediumPtr& medium : {media.interior, media.exterior}) parts.media_emit |= medium && medium->emits();
  shape.set_media(media.interior, media.exterior);
}

void use_camera_medium(const MediumPtr& medium, const ObjectDescription& sensor, SceneParts& parts) {
  parts.camera_medium = medium;
  if (parts.first_medium.empty()) parts.first_medium = place_of_medium(sensor);
  parts.media_emit |= medium && medium->emits();
}

}  // namespace covary
