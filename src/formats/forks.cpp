// SPDX-License-Identifier: Apache-2.0
#include "formats/forks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace covary {
namespace {

using Names = std::initializer_list<std::string_view>;

bool contains(Names names, std::string_view name) { return std::find(names.begin(), names.end(), name) != names.end(); }

/// Removes the named parameters, nested objects excepted; `why` says why the picture stays the same.
void drop(ObjectDescription& object, Names names, const char* why, Diagnostics& diagnostics) {
  std::erase_if(object.properties, [&](const Property& p) {
    if (!contains(names, p.name) || std::holds_alternative<ObjectPtr>(p.value)) return false;
    diagnostics.warn_shared(
        p.where, fmt::format("parameter '{}' of {} '{}' is ignored: {}", p.name, object.kind, object.type, why));
    return true;
  });
}

template <typename T>
bool is(const ObjectDescription& object, std::string_view name, const T& expected) {
  return std::any_of(object.properties.begin(), object.properties.end(), [&](const Property& p) {
    const T* value = std::get_if<T>(&p.value);
    return p.name == name && value && *value == expected;
  });
}

/// Films of light in flight (mitransient, MitsubaToFRenderer, StatMitsuba): the usual picture is the sum over time.
void adopt_film(ObjectDescription& film, Diagnostics& diagnostics) {
  if (film.type == "transient_hdr_film") {
    diagnostics.warn_shared(
        film.where, "film 'transient_hdr_film' is read as 'hdrfilm': the picture of all light, whenever it arrives");
    film.type = "hdrfilm";
    std::erase_if(film.properties, [](const Property& p) {
      return contains({"temporal_bins", "bin_width_opl", "start_opl", "auto_detect_bins"}, p.name);
    });
  }
  if (is(film, "transformation", int64_t{0}))
    drop(film, {"lambda", "transformation"}, "samples are not transformed", diagnostics);
  if (is(film, "decomposition", std::string("none")))
    drop(film, {"decomposition", "min_bound", "max_bound", "bin_width"}, "nothing is decomposed", diagnostics);
}

}  // namespace

void adopt_forms_of_forks(ObjectDescription& object, bool old, Diagnostics& diagnostics) {
  constexpr const char* kSampling = "it belongs to a sampling method and does not change the picture";
  constexpr const char* kSmooth = "this model is smooth, and Mitsuba 0.x does not read it either";
  if (object.kind == "film") {
    adopt_film(object, diagnostics);
    if (old && object.type == "hdrfilm") drop(object, {"gamma"}, "the film is linear", diagnostics);
  } else if (object.kind == "bsdf") {
    drop(object, {"sdmm_filename", "use_path_guiding"}, kSampling, diagnostics);
    const bool smooth = contains({"conductor", "dielectric", "plastic", "thindielectric"}, object.type);
    if (old && smooth) drop(object, {"alpha", "distribution"}, kSmooth, diagnostics);
  } else if (object.kind == "medium") {
    drop(object, {"medium_sampling_weight", "sampling_density", "strategy"}, kSampling, diagnostics);
  } else if (object.kind == "scene" && old) {
    std::erase_if(object.properties, [&](const Property& p) {
      if (p.name.empty() || std::holds_alternative<ObjectPtr>(p.value)) return false;
      diagnostics.warn_shared(p.where, fmt::format("parameter '{}' of <scene> is ignored: no object holds it", p.name));
      return true;
    });
  }
}

}  // namespace covary
