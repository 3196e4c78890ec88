// SPDX-License-Identifier: Apache-2.0
#include "integrators/guide_settings.h"

#include <algorithm>
#include <limits>

namespace covary {

GuidingSettings GuideSettings::field() const {
  GuidingSettings settings;
  settings.fit.n_lobes = static_cast<int>(lobes);
  settings.fit.max_lobes = std::min(2 * settings.fit.n_lobes, VmfLobes::kMax);
  settings.leaf_samples = leaf_samples;
  settings.learn_fraction = learns_fraction();
  return settings;
}

CacheSettings GuideSettings::cache() const {
  CacheSettings settings;
  settings.pyramid = false;  // lobes of one leaf are not those of another
  settings.monochrome = control == ControlKind::kMono;
  settings.memory_limit = std::numeric_limits<size_t>::max();  // leaves have no wider ones
  return settings;
}

}  // namespace covary
