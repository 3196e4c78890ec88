// SPDX-License-Identifier: Apache-2.0
// Control variates on guiding lobes for single integrals [Hua2023] (Figs. 3, 5 and 6): the irradiance of a diffuse
// plane under the skies of scenes/skies, with half of the directions from the BSDF. Lobes and coefficients are each
// learnt from 49,152 samples. Noise is the mean over 1,024 pixels of the squared difference of two renders, so a ratio
// of noises has a standard error of about 6 %; seeds are fixed.
#include <memory>
#include <string>

#include "integrators/guided_path.h"
#include "unbiased_images.h"

namespace covary {
namespace {

double noise_under(const std::string& sky, ControlKind control) {
  GuideSettings guide;
  guide.nee = false, guide.leaf_samples = 300000, guide.train_spp = 48;
  guide.control = control, guide.control_train_spp = 48;
  LoadOptions options;
  options.defines = {{"sky", sky}};
  options.make_integrator = [&](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    return std::make_shared<GuidedPath>(read_settings<PathLengthSettings>(parameters), guide);
  };
  const TestScene scene = load_file(std::string(COVARY_SOURCE_DIR) + "/scenes/plane-under-sky.xml", options);
  auto& integrator = dynamic_cast<GuidedPath&>(*scene.loaded.integrator);
  EXPECT_TRUE(train(scene.scene(), integrator, {{0, 0, kSide, kSide}, scene.loaded.filter}));
  EXPECT_EQ(integrator.field().n_leaves(), 1u);
  return noise(scene);
}

TEST(GuidingIntegrals, ControlTakesAwayColourNoise) {
  const double mixture = noise_under("colours", ControlKind::kOff);
  EXPECT_LT(noise_under("colours", ControlKind::kRgb), 0.35 * mixture);   // published: 0.32
  EXPECT_LT(noise_under("colours", ControlKind::kMono), 1.05 * mixture);  // published: 0.93
  EXPECT_LT(noise_under("sea", ControlKind::kRgb), 0.35 * noise_under("sea", ControlKind::kOff));
}

TEST(GuidingIntegrals, ControlRestoresThePerfectTechnique) {
  const double mixture = noise_under("uniform", ControlKind::kOff);
  EXPECT_LT(noise_under("uniform", ControlKind::kRgb), 0.005 * mixture);  // published: 0
  EXPECT_LT(noise_under("uniform", ControlKind::kMono), 0.35 * mixture);  // published: 0.31
}

TEST(GuidingIntegrals, ControlEasesOversampling) {
  const double mixture = noise_under("sun", ControlKind::kOff);
  EXPECT_LT(noise_under("sun", ControlKind::kRgb), 0.67 * mixture);   // published: 0.62
  EXPECT_LT(noise_under("sun", ControlKind::kMono), 0.74 * mixture);  // published: 0.67
}

}  // namespace
}  // namespace covary
