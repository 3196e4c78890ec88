// SPDX-License-Identifier: Apache-2.0
// Mitsuba's integrators that render a nested one and write additional channels:
//
// | type     | adds                                  | parameters besides the nested integrator |
// |----------|---------------------------------------|-------------------------------------------|
// | `moment` | the mean square of each channel       |                                           |
// | `aov`    | `aovs` of the first surface hit       | `aovs`                                    |
//
// and `ptracer`, which becomes `bdpt`.
#include "io/nested_integrator.h"

#include <fmt/format.h>

#include <algorithm>

namespace covary {
namespace {

bool wraps(const ObjectDescription& object) { return object.type == "moment" || object.type == "aov"; }

/// Removes parameters that every Mitsuba integrator accepts and that do not affect the image.
ObjectPtr without_execution(const ObjectPtr& object, Diagnostics& diagnostics) {
  auto changed = std::make_shared<ObjectDescription>(*object);
  const auto has_no_effect = [&](const Property& p) {
    if (p.name == "timeout") {
      diagnostics.warn(p.where,
                       fmt::format("parameter 'timeout' of integrator '{}' has no effect; see --time", object->type));
      return true;
    }
    return p.name == "samples_per_pass" || p.name == "block_size";
  };
  if (std::erase_if(changed->properties, has_no_effect) == 0) return object;
  return changed;
}

/// The only integrator in a wrapper; null after recording an error.
ObjectPtr nested_integrator(const ObjectDescription& wrapper, Diagnostics& diagnostics) {
  ObjectPtr nested;
  size_t n_nested = 0;
  for (const Property& property : wrapper.properties) {
    const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
    if (object && !*object) continue;  // reported while reading
    if (object && (*object)->kind == "integrator") {
      if (n_nested++ == 0) nested = *object;
    } else if (!(property.name == "aovs" && wrapper.type == "aov") && property.name != "hide_emitters") {
      diagnostics.error(property.where,
                        property.name.empty()
                            ? fmt::format("integrator '{}' can hold integrators only", wrapper.type)
                            : fmt::format("unknown parameter '{}' of integrator '{}'", property.name, wrapper.type));
    }
  }
  if (!nested) {
    diagnostics.error(wrapper.where, fmt::format("integrator '{}' holds no integrator: there is no image to render; "
                                                 "auxiliary images are written beside one by --aovs",
                                                 wrapper.type));
  } else if (n_nested > 1) {
    diagnostics.warn(wrapper.where, fmt::format("of {} integrators in '{}' only the first, '{}', is rendered", n_nested,
                                                wrapper.type, nested->type));
  }
  return nested;
}

/// `ptracer` (light tracing) becomes `bdpt`, which includes that strategy.
ObjectPtr light_tracing(const ObjectDescription& object, Diagnostics& diagnostics) {
  auto changed = std::make_shared<ObjectDescription>(object);
  changed->type = "bdpt";
  diagnostics.warn(object.where,
                   "integrator 'ptracer' is read as 'bdpt': paths from the lights together with paths from the camera, "
                   "which also show what light paths cannot reach (mirrors and glass before the camera)");
  return without_execution(changed, diagnostics);
}

}  // namespace

ObjectPtr rendered_integrator(const ObjectPtr& object, Diagnostics& diagnostics) {
  if (object->type == "ptracer") return light_tracing(*object, diagnostics);
  if (!wraps(*object)) return without_execution(object, diagnostics);
  const ObjectPtr changed = without_execution(object, diagnostics);
  const ObjectPtr nested = nested_integrator(*changed, diagnostics);
  if (!nested) return nullptr;
  const std::string left_out =
      object->type == "moment" ? "second moments are left out (the layer StdError of the output has standard errors)"
                               : "the channels of 'aovs' are left out (--aovs writes albedo, normals and positions)";
  diagnostics.warn(object->where, fmt::format("of integrator '{}' the image of '{}' is rendered; {}", object->type,
                                              nested->type, left_out));
  return rendered_integrator(nested, diagnostics);  // nesting is finite and acyclic, see xml_reader.cpp
}

}  // namespace covary
