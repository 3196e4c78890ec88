// SPDX-License-Identifier: Apache-2.0
// Small scenes and plans that run quickly.
#pragma once

#include <atomic>
#include <cstring>
#include <string>

#include "film/image_file.h"
#include "plans/estimator_plans.h"
#include "plans/integrator_choice.h"
#include "plans/render.h"

namespace covary {

/// The scene at `path` with another film size and its own integrator.
inline LoadedScene load_sized(const std::string& path, int width = 40, int height = 30) {
  LoadOptions options;
  options.width = width, options.height = height;
  options.make_integrator = integrator_maker({});
  return load_scene(path, options);
}

inline RenderRequest request_of(uint32_t spp) {
  RenderRequest request;
  request.spp = spp;
  request.seed = 5;
  return request;
}

/// Of a CRN and an independent image: the average of the first group of each.
inline Estimator average_estimator() {
  Estimator method;
  method.name = method.text = "average";
  method.fewest_groups = 3;
  method.apply = [](const GroupedImage& crn, const GroupedImage& independent, const PairSettings&) {
    EstimatorResult result;
    result.estimate = Image(crn.width, crn.height, 3);
    for (int y = 0; y < crn.height; ++y)
      for (int x = 0; x < crn.width; ++x)
        for (int c = 0; c < 3; ++c)
          result.estimate.pixel(x, y)[c] = 0.5f * (crn.pixel(x, y)[c] + independent.pixel(x, y)[c]);
    return result;
  };
  return method;
}
inline Plan average_plan() { return pair_plan(average_estimator()); }

/// Stops a render after a number of tiles.
struct StopAfter {
  explicit StopAfter(int tiles) : left(tiles) {
    callbacks.stop = &stop;
    callbacks.progress = [this](uint64_t, uint64_t) {
      if (--left <= 0) stop = true;
    };
  }
  std::atomic<bool> stop{false};
  std::atomic<int> left;
  RenderCallbacks callbacks;
};

/// The attribute covary:NAME of an image file, or "none".
inline std::string attribute_of(const std::string& path, const std::string& name) {
  for (const auto& [key, value] : inspect_image(path).attributes)
    if (key == "covary:" + name) return value;
  return "none";
}

inline bool same_bits(const Film& a, const Film& b) {
  return a.counts() == b.counts() && a.data().size() == b.data().size() &&
         std::memcmp(a.data().data(), b.data().data(), a.data().size() * sizeof(float)) == 0;
}

}  // namespace covary
