// SPDX-License-Identifier: Apache-2.0
// Integrators of Mitsuba and of its forks whose picture is that of another one.
//
// Wrappers render the integrators that they hold, and write or steer something beside it:
//
// | type                     | adds                                                           |
// |--------------------------|----------------------------------------------------------------|
// | `moment`                 | the mean square of each channel                                |
// | `aov`                    | `aovs` of the first surface hit                                |
// | `multichannel`           | the pictures of several integrators, side by side              |
// | `adaptive`               | other numbers of samples                                       |
// | `irrcache`               | a cache of indirect light                                      |
// | `statistical_integrator` | estimates of the variance (StatMitsuba)                        |
//
// `ptracer` becomes `bdpt`; the others (kSamePicture) sample the same paths of light by other means.
#include "io/nested_integrator.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

namespace covary {
namespace {

/// Wrappers, and what is said of what they add.
constexpr std::pair<std::string_view, const char*> kWrappers[] = {
    {"adaptive", "the numbers of samples do not adapt to the error (--until does)"},
    {"aov", "the channels of 'aovs' are left out (--aovs writes albedo, normals and positions)"},
    {"irrcache", "indirect light is not cached"},
    {"moment", "second moments are left out (the layer StdError of the output has standard errors)"},
    {"multichannel", "other pictures are left out"},
    {"statistical_integrator", "statistics are left out (the layer StdError of the output has standard errors)"},
};

/// Integrators whose pictures, as the number of samples grows, become those of `path` or `direct`.
constexpr std::pair<std::string_view, const char*> kSamePicture[] = {
    // Mitsuba 3, for derivatives
    {"direct_projective", "direct"},
    {"direct_reparam", "direct"},
    {"prb", "path"},
    {"prb_basic", "path"},
    {"prb_projective", "path"},
    {"prb_reparam", "path"},
    {"prb_threepoint", "path"},
    {"prbvolpath", "path"},
    // Mitsuba 0.x
    {"erpt", "path"},
    {"mlt", "path"},
    {"photonmap", "path"},
    {"photonmapper", "path"},
    {"ppm", "path"},
    {"pssmlt", "path"},
    {"sppm", "path"},
    {"volpath_simple", "path"},
    // forks: path guiding, splitting and roulette, gradient-domain rendering, vertex connection, light in flight
    {"gbdpt", "path"},
    {"gpt", "path"},
    {"guided_path", "path"},
    {"recursive_path", "path"},
    {"sdmm", "path"},
    {"transient_path", "path"},
    {"transient_prbvolpath", "path"},
    {"vcm", "path"},
};

template <size_t N>
const char* find_in(const std::pair<std::string_view, const char*> (&table)[N], std::string_view type) {
  for (const auto& [name, text] : table)
    if (name == type) return text;
  return nullptr;
}

/// Renders something else than light, beside a picture.
bool makes_no_picture(const ObjectDescription& integrator) {
  return integrator.type == "field" || integrator.type == "depth";
}

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

/// The only integrator in a wrapper, or the first that makes a picture; null after recording an error.
ObjectPtr nested_integrator(const ObjectDescription& wrapper, Diagnostics& diagnostics) {
  const bool of_mitsuba_3 = wrapper.type == "moment" || wrapper.type == "aov";
  std::vector<ObjectPtr> nested;
  for (const Property& property : wrapper.properties) {
    const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
    if (object && !*object) continue;  // reported while reading
    if (object && (*object)->kind == "integrator") {
      if (of_mitsuba_3 || !makes_no_picture(**object)) nested.push_back(*object);
    } else if (of_mitsuba_3 && !(property.name == "aovs" && wrapper.type == "aov") &&
               property.name != "hide_emitters") {
      diagnostics.error(property.where,
                        property.name.empty()
                            ? fmt::format("integrator '{}' can hold integrators only", wrapper.type)
                            : fmt::format("unknown parameter '{}' of integrator '{}'", property.name, wrapper.type));
    }
  }
  if (nested.empty()) {
    diagnostics.error(wrapper.where, fmt::format("integrator '{}' holds no integrator: there is no image to render; "
                                                 "auxiliary images are written beside one by --aovs",
                                                 wrapper.type));
    return nullptr;
  }
  if (nested.size() > 1)
    diagnostics.warn(wrapper.where, fmt::format("of {} integrators in '{}' only the first, '{}', is rendered",
                                                nested.size(), wrapper.type, nested[0]->type));
  return nested[0];
}

/// Parameters that select paths; all others belong to a method that is not used here.
bool selects_paths(const Property& p) {
  constexpr std::string_view kNames[] = {"hide_emitters", "max_depth", "min_depth", "rr_depth"};
  return std::ranges::find(kNames, p.name) != std::end(kNames);
}

/// Whether the integrator leaves light out that `path` has: mitransient's direct light.
bool leaves_light_out(const ObjectDescription& integrator) {
  return std::ranges::any_of(integrator.properties, [](const Property& p) {
    const bool* on = std::get_if<bool>(&p.value);
    return p.name.starts_with("discard_direct") && on && *on;
  });
}

/// `object` as the integrator `type` with the same picture.
ObjectPtr same_picture(const ObjectDescription& object, const char* type, Diagnostics& diagnostics) {
  auto changed = std::make_shared<ObjectDescription>(object);
  changed->type = type;
  std::string ignored;
  std::erase_if(changed->properties, [&](const Property& p) {
    if (selects_paths(p)) return false;
    if (!p.name.empty()) ignored += (ignored.empty() ? "'" : ", '") + p.name + "'";
    return true;
  });
  diagnostics.warn(object.where, fmt::format("integrator '{}' is read as '{}', whose expected picture is the same{}",
                                             object.type, type, ignored.empty() ? "" : "; ignored: " + ignored));
  return changed;
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
  if (const char* type = find_in(kSamePicture, object->type); type && !leaves_light_out(*object))
    return same_picture(*object, type, diagnostics);
  const char* const left_out = find_in(kWrappers, object->type);
  if (!left_out) return without_execution(object, diagnostics);
  const ObjectPtr changed = without_execution(object, diagnostics);
  const ObjectPtr nested = nested_integrator(*changed, diagnostics);
  if (!nested) return nullptr;
  diagnostics.warn(object->where, fmt::format("of integrator '{}' the image of '{}' is rendered; {}", object->type,
                                              nested->type, left_out));
  return rendered_integrator(nested, diagnostics);  // nesting is finite and acyclic, see xml_reader.cpp
}

}  // namespace covary
