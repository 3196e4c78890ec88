// SPDX-License-Identifier: Apache-2.0
#include "integrators/control_settings.h"

#include <algorithm>

#include "passes/render_pass.h"

namespace covary {

ControlSettings ControlSettings::published() {
  ControlSettings settings;
  settings.paper = true;
  settings.lights = LightSelection::kTriangle;
  settings.grid = 64;
  settings.train_spp = 8;
  settings.clusters = 5000;
  settings.albedo = false;
  return settings;
}

bool ControlSettings::learns_lights() const {
  for (uint32_t begin = 0, end = 0; begin < train_spp; begin = end) {
    end = wave_end(begin, 1);
    if (begin >= pilot_spp() && ends_selection(end)) return true;
  }
  return false;
}

CacheSettings ControlSettings::cache(uint32_t resolution) const {
  CacheSettings settings;
  if (paper || per_pixel())
    settings = CacheSettings::published(resolution);
  else
    settings.resolution = resolution;
  settings.monochrome = kind == ControlKind::kMono;
  settings.by_channel = solves_once();
  settings.memory_limit = memory_limit();
  return settings;
}

}  // namespace covary
