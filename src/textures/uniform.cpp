// SPDX-License-Identifier: Apache-2.0
// `uniform`: one colour everywhere.
//
// | parameter | type   | default | meaning                         |
// |-----------|--------|---------|---------------------------------|
// | value     | colour | 1       | number, rgb or spectrum         |
#include "textures/registry.h"

namespace covary {

std::shared_ptr<Texture> make_uniform(Parameters& parameters) {
  return std::make_shared<ConstantTexture>(parameters.get_spectrum("value", Spectrum(1), SpectrumRole::kReflectance));
}

}  // namespace covary
