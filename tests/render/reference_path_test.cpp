// SPDX-License-Identifier: Apache-2.0
// Every integrator that makes pictures against the reference: the rendering equation as it is written.
//
// Statistical cases, as in unbiased_images.h. Each asserts that it would detect 5 % of the image mean, and detects a
// planted bug.
#include "reference_path.h"

#include "integrators/registry.h"
#include "passes/training.h"
#include "unbiased_images.h"

namespace covary::reference_path_test {
namespace {

constexpr int kDepth = 5;  // of everything()

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TestScene reference_of(const std::string& xml, bool null_counts = true) {
  return load_text(xml, 0, [=](const PathLengthSettings& lengths) {
    return std::make_shared<ReferencePath>(lengths.max_depth, null_counts);
  });
}

/// The scene with another integrator, which is trained if it learns.
TestScene with_integrator(const std::string& xml, const std::string& type) {
  TestScene scene = load_text(replaced(xml, "<integrator type='path'>", "<integrator type='" + type + "'>"));
  const LoadedScene& l = scene.loaded;
  Integrator& integrator = dynamic_cast<Integrator&>(*scene.loaded.integrator);
  LearningIntegrator* const learning = integrator.learning();
  if (learning) {
    EXPECT_TRUE(train(scene.scene(), *learning, {{l.crop_x, l.crop_y, l.crop_width, l.crop_height}, l.filter}));
  }
  return scene;
}

/// Images of the reference for each seed of differences().
class ReferenceImages {
 public:
  ReferenceImages(const std::string& xml, uint32_t spp, bool null_counts = true) : spp_(spp) {
    const TestScene reference = reference_of(xml, null_counts);
    for (uint64_t seed = 0; seed < 16; ++seed) images_.push_back(render(reference, spp, 100 + seed).mean_image());
  }

  Differences differences(const TestScene& scene) const {
    return covary::differences([&](uint64_t seed) { return render(scene, spp_, seed).mean_image(); },
                               [&](uint64_t seed) { return images_[seed]; });
  }

  void expect_same(const TestScene& scene) const {
    const Differences found = differences(scene);
    EXPECT_EQ(n_biased(found), 0);
    EXPECT_LT(detectable(found), 0.05 * block_mean(images_[0], kBlocks * kBlocks));
  }

 private:
  uint32_t spp_;
  std::vector<Image> images_;
};

TEST(ReferencePath, IsEveryIntegratorOnSurfaces) {
  const ReferenceImages reference(everything(), 12);
  for (const char* const type : {"path", "bdpt", "controlled-path", "guided-path"}) {
    SCOPED_TRACE(type);
    reference.expect_same(with_integrator(everything(), type));
  }
  const std::string shorter = replaced(everything(), "name='max_depth' value='5'", "name='max_depth' value='4'");
  EXPECT_GT(n_biased(reference.differences(load_text(shorter))), 0) << "a planted bug";
}

TEST(ReferencePath, IsDirectLight) {
  const std::string two_edges = replaced(everything(), "name='max_depth' value='5'", "name='max_depth' value='2'");
  ReferenceImages(two_edges, 12).expect_same(with_integrator(everything(), "direct"));
}

// Media are seen by one only, and refused by the others.
TEST(ReferencePath, MeetsAllIntegrators) {
  std::vector<std::string> see_media;
  for (const std::string& name : integrator_names()) {
    Settings settings;
    if (make_integrator(*find_integrator(name), settings)->sees_media()) see_media.push_back(name);
  }
  EXPECT_EQ(see_media, (std::vector<std::string>{"auto", "depth", "path"}));
  EXPECT_EQ(integrator_names(),
            (std::vector<std::string>{"auto", "bdpt", "controlled-path", "depth", "direct", "guided-path", "path"}))
      << "a new integrator needs a test here; 'auto' stands for others, 'depth' makes no picture of light";
}

// Light through fog, glass and a mask, with a lamp inside of the fog.
const std::string kFog =
    "<medium type='homogeneous' name='interior'><rgb name='sigma_t' value='.4,.3,.2'/><rgb name='albedo' "
    "value='.9,.6,.8'/><phase type='hg'><float name='g' value='.4'/></phase></medium>";

std::string foggy() {
  return scene_text(
      kFloor + kMeshLight +
          "<shape type='cube'><transform name='to_world'><scale value='2.5'/><translate z='6'/></transform>"
          "<bsdf type='null'/>" +
          kFog + "</shape>" + sphere("x='0' y='-1' z='6'", "<bsdf type='dielectric'/>") +
          sphere("x='-1' y='1' z='6'",
                 "<float name='radius' value='.5'/><emitter type='area'>"
                 "<rgb name='radiance' value='4,5,6'/></emitter>") +
          rectangle("<scale value='0.7'/><rotate y='1' angle='180'/><translate x='1' z='5'/>",
                    "<bsdf type='mask'><float name='opacity' value='0.5'/><bsdf type='twosided'>"
                    "<bsdf type='diffuse'/></bsdf></bsdf>") +
          "<emitter type='constant'><rgb name='radiance' value='0.3,0.4,0.6'/></emitter>"
          "<emitter type='point'><point name='position' x='1' y='2' z='3'/></emitter>",
      kSide, kSide, kDepth, kWide, "<integer name='rr_depth' value='3'/>");
}

TEST(ReferencePath, IsPathInMedia) {
  const ReferenceImages reference(foggy(), 16, false);
  reference.expect_same(load_text(foggy()));
  EXPECT_GT(n_biased(reference.differences(load_text(replaced(foggy(), ".9,.6,.8", ".5,.2,.4")))), 0)
      << "a planted bug";
}

}  // namespace
}  // namespace covary::reference_path_test
