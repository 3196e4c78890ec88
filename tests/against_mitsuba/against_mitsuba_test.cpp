// SPDX-License-Identifier: Apache-2.0
// Whole renders of small scenes against block means of Mitsuba 3's renders, stored as JSON by
//     benchmarks/against_mitsuba/against_mitsuba.py store scenes/room.xml scenes/materials.xml
//         tests/against_mitsuba/lights.xml --to tests/against_mitsuba --pixels 2304 --spp 1024 --seeds 16
// The independent unit is the render. Per scene: N = 32 renders of 32 samples per pixel with seeds 0 ... 31 (2304 to
// 3456 pixels, 54 or 36 blocks), the reference's own noise included; Welch's t-test over renders on the image mean and
// on the 8 x 8 block means, per channel; alpha = test_alpha() = 5e-7 for each of the two families, Sidak within a
// family. At power 0.99 that finds 1.5 % of the image mean and 15 % of a typical (median) block; the test asserts these
// two numbers. Planted bugs: the image scaled by 1.02, and one block 1.3 times as bright, must be rejected.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "integrators/registry.h"
#include "io/load_scene.h"
#include "passes/render_pass.h"
#include "scene/property_source.h"
#include "statistics/p_values.h"

namespace covary {
namespace {

using Values = std::vector<double>;

constexpr int kRenders = 32;
constexpr uint32_t kSpp = 32;
constexpr double kPower = 0.99;

std::string source_path(const std::string& name) { return std::string(COVARY_SOURCE_DIR) + "/" + name; }

nlohmann::json read_reference(const std::string& name) {
  std::ifstream file(source_path("tests/against_mitsuba/" + name + ".json"));
  if (!file) throw Error(ErrorCode::kIo, "no stored reference for scene '" + name + "'");
  return nlohmann::json::parse(file);
}

/// One render as per-channel means: of the image (3 values), and of its blocks (rows, columns, channels).
struct Means {
  Values image, blocks;
};

Means means_of(const Film& film, int block) {
  const int columns = film.width() / block, rows = film.height() / block;
  Means means{Values(3), Values(static_cast<size_t>(rows) * columns * 3)};
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) {
      const Spectrum value = film.mean(x, y);
      for (int c = 0; c < 3; ++c) {
        means.image[c] += value[c] / (film.width() * film.height());
        means.blocks[(static_cast<size_t>(y / block) * columns + x / block) * 3 + c] += value[c] / (block * block);
      }
    }
  return means;
}

std::vector<Means> render(const std::string& scene_path, const nlohmann::json& reference) {
  LoadOptions options;
  options.width = reference["width"], options.height = reference["height"];
  options.make_integrator = [](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    const IntegratorPlugin* plugin = find_integrator(parameters.type());
    if (!plugin) throw Error(ErrorCode::kInput, "no integrator '" + parameters.type() + "'");
    PropertySource source(parameters);
    Settings settings(source);
    return make_integrator(*plugin, settings);
  };
  const LoadedScene loaded = load_scene(scene_path, options);
  auto& integrator = dynamic_cast<Integrator&>(*loaded.integrator);
  integrator.prepare(*loaded.scene);
  std::vector<Means> renders;
  for (int seed = 0; seed < kRenders; ++seed) {
    Film film(loaded.width, loaded.height, {0, 0, loaded.width, loaded.height}, 1);
    PassSettings settings;
    settings.seed = static_cast<uint64_t>(seed);
    settings.spp = kSpp;
    const PassResult result = render_pass(*loaded.scene, integrator, settings, film);
    EXPECT_EQ(result.n_not_finite + result.n_negative, 0u);
    renders.push_back(means_of(film, reference["block"]));
  }
  return renders;
}

/// A family of Welch tests: its p-value and, per test, the relative error found with power kPower.
struct Comparison {
  double p_value = 1;
  Values detectable;
};

Comparison compare(const std::vector<Means>& renders, Values Means::*part, const Values& expected,
                   const Values& expected_errors, int expected_renders) {
  Comparison comparison;
  double smallest = 1;
  const double each = statistics::sidak(statistics::test_alpha(), static_cast<int>(expected.size()));
  for (size_t i = 0; i < expected.size(); ++i) {
    statistics::Moments moments;
    for (const Means& means : renders) moments.add((means.*part)[i]);
    // float32 sums round: less than 2e-6 of the value is no difference.
    const double rounding = 2e-6 * expected[i];
    const double v1 = expected_errors[i] * expected_errors[i] + rounding * rounding;
    const double v2 = moments.variance_of_mean() + rounding * rounding;
    if (v1 + v2 == 0) continue;  // black in all renders of both
    const double dof = (v1 + v2) * (v1 + v2) / (v1 * v1 / (expected_renders - 1) + v2 * v2 / (kRenders - 1));
    const double error = std::sqrt(v1 + v2);
    smallest = std::min(smallest, statistics::student_t_p_value((moments.mean() - expected[i]) / error, dof));
    comparison.detectable.push_back((statistics::normal_quantile(1 - each / 2) + statistics::normal_quantile(kPower)) *
                                    error / expected[i]);
  }
  comparison.p_value = -std::expm1(static_cast<double>(expected.size()) * std::log1p(-std::min(smallest, 1 - 1e-16)));
  std::sort(comparison.detectable.begin(), comparison.detectable.end());
  return comparison;
}

/// Both families accept? Their p-values are recorded under `what`.
bool agree(const std::string& what, const std::vector<Means>& renders, const nlohmann::json& reference) {
  const Comparison image =
      compare(renders, &Means::image, reference["mean"], reference["mean_errors"], reference["seeds"]);
  const Comparison blocks =
      compare(renders, &Means::blocks, reference["blocks"], reference["block_errors"], reference["seeds"]);
  ::testing::Test::RecordProperty(what + "_image_p", std::to_string(image.p_value));
  ::testing::Test::RecordProperty(what + "_blocks_p", std::to_string(blocks.p_value));
  EXPECT_LT(image.detectable.back(), 0.015);
  EXPECT_LT(blocks.detectable[blocks.detectable.size() / 2], 0.15);
  return image.p_value >= statistics::test_alpha() && blocks.p_value >= statistics::test_alpha();
}

void check(const std::string& name, const std::string& scene_path) {
  const nlohmann::json reference = read_reference(name);
  const std::vector<Means> renders = render(source_path(scene_path), reference);
  EXPECT_TRUE(agree("own", renders, reference))
      << "to see where: benchmarks/against_mitsuba/against_mitsuba.py agree " << source_path(scene_path);

  std::vector<Means> brighter = renders;
  for (Means& means : brighter) {
    for (double& value : means.image) value *= 1.02;
    for (double& value : means.blocks) value *= 1.02;
  }
  EXPECT_FALSE(agree("planted_factor", brighter, reference)) << "a planted factor of 1.02 was not seen";

  const Values& values = renders[0].blocks;
  const size_t middle = values.size() / 6 * 3;  // first channel of a block near the middle of the frame
  std::vector<Means> patched = renders;
  for (Means& means : patched)
    for (size_t c = 0; c < 3; ++c) means.blocks[middle + c] *= 1.3;
  EXPECT_FALSE(agree("planted_block", patched, reference)) << "a planted bright block was not seen";
}

TEST(AgainstMitsuba, Room) { check("room", "scenes/room.xml"); }
TEST(AgainstMitsuba, Materials) { check("materials", "scenes/materials.xml"); }
TEST(AgainstMitsuba, Lights) { check("lights", "tests/against_mitsuba/lights.xml"); }
/// The reference is of scalar_rgb, 512 samples per pixel.
TEST(AgainstMitsuba, Plugins) { check("plugins", "tests/against_mitsuba/plugins.xml"); }

/// Sides that meshes emit and reflect on. Made as the others are, with --pixels 1792.
TEST(AgainstMitsuba, Sides) { check("sides", "tests/against_mitsuba/sides.xml"); }

TEST(AgainstMitsuba, MissingReferenceFails) {
  try {
    read_reference("no-such-scene");
    FAIL() << "a missing reference was accepted";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "no stored reference for scene 'no-such-scene'");
  }
}

}  // namespace
}  // namespace covary
