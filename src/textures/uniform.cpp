// SPDX-License-Identifier: Apache-2.0
// `uniform`: one colour everywhere.
//
// | parameter | type   | default | meaning                         |
// |-----------|--------|---------|---------------------------------|
// | value     | colour | 1       | number, rgb or spectrum         |
#include "textures/registry.h"

namespace covary {

// Reads the value in the role of emission, which has no upper bound; the user of the texture knows whether it needs
// one.
std::shared_ptr<Texture> make_uniform(Parameters& parameters) {
  return std::make_shared<ConstantTexture>(parameters.get_spectrum("value", Spectrum(1), SpectrumRole::kEmission));
}

}  // namespace covary
