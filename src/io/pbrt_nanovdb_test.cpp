// SPDX-License-Identifier: Apache-2.0
// Media of NanoVDB files, where the build has its headers.
#include "pbrt/pbrt_nanovdb.h"

#include <gtest/gtest.h>

#if __has_include(<nanovdb/util/IO.h>)
#define COVARY_NANOVDB
#include <nanovdb/util/GridBuilder.h>
#include <nanovdb/util/IO.h>
#endif

#include <fstream>

#include "io/load_scene.h"
#include "support/files.h"

namespace covary::pbrt_nanovdb_test {
namespace {

using test_support::contains;
using test_support::message_of;

class NanoVdb : public ::testing::Test {
 protected:
  LoadedScene load(const std::string& file) {
    std::ofstream(folder_.file("scene.pbrt"))
        << R"(WorldBegin
Translate 10 0 0
MakeNamedMedium "smoke" "string type" "nanovdb" "string filename" ")"
        << file << R"(" "rgb sigma_a" [ 1 1 1 ] "rgb sigma_s" [ 3 3 3 ] "float scale" 2
MediumInterface "smoke" ""
Material "interface"
Shape "sphere" "float radius" 5
)";
    return load_scene(folder_.file("scene.pbrt"));
  }
  test_support::TemporaryFolder folder_;
};

#ifdef COVARY_NANOVDB

/// Voxel (i, j, k) is centred at its index times the voxel's size; between voxels, values are interpolated.
TEST_F(NanoVdb, VoxelsLieAtTheirIndices) {
  nanovdb::GridBuilder<float> builder(0.0f);
  auto accessor = builder.getAccessor();
  accessor.setValue(nanovdb::Coord(0, 0, 0), 1.0f);
  accessor.setValue(nanovdb::Coord(2, 0, 0), 3.0f);
  const auto handle = builder.getHandle<>(0.5, nanovdb::Vec3d(1, 0, 0), "density", nanovdb::GridClass::FogVolume);
  nanovdb::io::writeGrid(folder_.file("a.nvdb"), handle);
  const LoadedScene scene = load("a.nvdb");
  SurfaceHit hit;
  ASSERT_TRUE(scene.scene->intersect({{10, 0, 100}, {0, 0, -1}}, hit));
  const Medium* smoke = hit.shape->medium_towards(hit.ng, {0, 0, -1});
  ASSERT_TRUE(smoke);
  const auto density = [&](float x) { return smoke->at({11 + x, 0, 0}).extinction.g / (2 * 4); };
  EXPECT_NEAR(density(0), 1, 1e-5f);
  EXPECT_NEAR(density(1), 3, 1e-5f);
  EXPECT_NEAR(density(0.25f), 0.5f, 1e-5f);
  EXPECT_NEAR(density(0.75f), 1.5f, 1e-5f);
  EXPECT_EQ(density(1.3f), 0);
  EXPECT_NEAR(smoke->at({11, 0, 0}).scattering.g, 2 * 3, 1e-5f);
  std::ofstream(folder_.file("bad.nvdb")) << "NanoVDB0 is not this";
  EXPECT_TRUE(contains(message_of([&] { load("bad.nvdb"); }), "cannot be read as a NanoVDB file"));
}

#else

TEST_F(NanoVdb, WithoutItsHeadersItsFilesAreRefused) {
  std::ofstream(folder_.file("a.nvdb")) << "x";
  EXPECT_TRUE(contains(message_of([&] { load("a.nvdb"); }), "was built without NanoVDB"));
}

#endif

}  // namespace
}  // namespace covary::pbrt_nanovdb_test
