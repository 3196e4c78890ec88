// SPDX-License-Identifier: Apache-2.0
// constvolume: one value everywhere.
//
// | name     | type      | default  | meaning                              |
// |----------|-----------|----------|--------------------------------------|
// | value    | colour    | 1        |                                      |
// | to_world | transform | identity | moves the unit cube, which is its box |
#include "media/constant_volume.h"
#include "media/registry.h"

namespace covary {

std::shared_ptr<Volume> make_constvolume(Parameters& p) {
  const Spectrum value = p.get_spectrum("value", Spectrum(1), SpectrumRole::kIndex);
  return std::make_shared<ConstantVolume>(value, p.get_transform("to_world"));
}

}  // namespace covary
