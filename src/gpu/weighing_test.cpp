// SPDX-License-Identifier: Apache-2.0
#include "gpu/weighing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gpu/comparison.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;

const WeighingNetwork& network() {
  const std::vector<std::string> names = {"regression", "sharp", "smooth", "demodulated"};
  return *WeighingNetwork::find(names);
}

/// An image without a pattern that repeats.
Image image_of(int width, int height, float seed) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] =
            1 + 0.5f * std::sin(seed + 0.3f * static_cast<float>(x) + 0.41f * static_cast<float>(y * (c + 1)));
  return image;
}

struct Example {
  Image mean, std_error, albedo, normal, second_albedo, second_normal;
  std::vector<Image> candidates;
  Buffer<float> images[6], made;

  Example(int width, int height)
      : mean(image_of(width, height, 1)),
        std_error(image_of(width, height, 2)),
        albedo(image_of(width, height, 3)),
        normal(image_of(width, height, 4)),
        second_albedo(image_of(width, height, 5)),
        second_normal(image_of(width, height, 6)) {
    std::vector<float> all;
    for (const float seed : {1.1f, 1.2f, 1.5f, 0.9f}) {
      candidates.push_back(image_of(width, height, seed));
      all.insert(all.end(), candidates.back().data.begin(), candidates.back().data.end());
    }
    all.resize(all.size() + mean.data.size());
    made = test_device().upload(std::span(std::as_const(all)));
    size_t i = 0;
    for (const Image* image : {&mean, &std_error, &albedo, &normal, &second_albedo, &second_normal})
      images[i++] = test_device().upload(std::span(image->data));
  }

  std::vector<float> on_device(SurfaceBuffers surfaces, bool planted_bug = false) {
    const WeighingBuffers in{mean.width, mean.height, &images[0], &made, &images[1], surfaces, planted_bug};
    Weighing(test_device(), network()).add_weighed(in);
    std::vector<float> result(mean.data.size());
    test_device().read(made, result, 4 * result.size());
    return result;
  }
  std::vector<float> here(WeighingSurfaces surfaces) const {
    const WeighingInput in{&mean, candidates, &std_error, surfaces};
    return weighed(in, network().shares(in)).data;
  }
};

TEST(GpuWeighing, IsThatOfTheProcessor) {
  for (const auto& [width, height] : {std::pair(45, 31), {64, 33}, {1, 2}}) {
    SCOPED_TRACE(width);
    Example e(width, height);
    EXPECT_TRUE(agree(e.here({}), e.on_device({})));
    EXPECT_TRUE(agree(e.here({&e.albedo, &e.normal, &e.albedo, &e.normal}),
                      e.on_device({.normal = &e.images[3], .albedo = &e.images[2]})));
    EXPECT_TRUE(agree(e.here({&e.albedo, &e.normal, &e.second_albedo, &e.second_normal}),
                      e.on_device({&e.images[3], &e.images[5], &e.images[2], &e.images[4]})));
  }
}

TEST(GpuWeighing, NoticesAWrongFeature) {
  Example e(45, 31);
  EXPECT_FALSE(agree(e.here({}), e.on_device({}, true)));
}

}  // namespace
}  // namespace covary::gpu
