// SPDX-License-Identifier: Apache-2.0
// Scenes of pbrt written by a test, and what a ray down the z axis finds in them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "core/arena.h"
#include "io/load_scene.h"
#include "support/files.h"

namespace covary::test_support {

class PbrtScenes : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_.file(name), std::ios::binary) << bytes;
  }
  LoadedScene load(const std::string& text) {
    write("scene.pbrt", text);
    return load_scene(folder_.file("scene.pbrt"));
  }
  /// The world, seen by the default camera.
  LoadedScene world(const std::string& text) { return load("Camera \"perspective\"\nWorldBegin\n" + text); }
  std::string warnings(const LoadedScene& scene) {
    std::string all;
    for (const std::string& warning : scene.warnings) all += warning + "\n";
    return all;
  }
  std::string errors(const std::string& text) {
    return message_of([&] { load(text); });
  }
  /// Where a ray down the z axis meets the scene; -1000 without a hit.
  static float height(const LoadedScene& scene, float x, float y, float from = 100) {
    SurfaceHit hit;
    return scene.scene->intersect({{x, y, from}, {0, 0, -1}}, hit) ? hit.p.z : -1000;
  }
  /// Value of the BSDF where that ray hits, for a direction `wi`, over its cosine.
  static Spectrum brdf(const LoadedScene& scene, float x, float y, const Vec3& wi) {
    SurfaceHit hit;
    if (!scene.scene->intersect({{x, y, 100}, {0, 0, -1}}, hit)) return Spectrum(-1);
    const Vec3 wo = hit.frame.to_local({0, 0, 1}), in = hit.frame.to_local(normalize(wi));
    Arena arena;
    return hit.shape->bsdf()->bind(hit, wo.z > 0, TransportMode::kRadiance, arena)->eval(wo, in).value / std::abs(in.z);
  }

  TemporaryFolder folder_;
};

}  // namespace covary::test_support
