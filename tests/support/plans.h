// SPDX-License-Identifier: Apache-2.0
// Small scenes and plans that run quickly.
#pragma once

#include <atomic>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <variant>

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
inline Method average_estimator() {
  Method method;
  method.name = method.text = "average";
  method.min_groups = 3;
  PassPair pair;
  pair.image = [](const GroupedImage& crn, const GroupedImage& independent, const MethodSettings&) {
    EstimatorResult result;
    result.estimate = Image(crn.width, crn.height, 3);
    for (int y = 0; y < crn.height; ++y)
      for (int x = 0; x < crn.width; ++x)
        for (int c = 0; c < 3; ++c)
          result.estimate.pixel(x, y)[c] = 0.5f * (crn.pixel(x, y)[c] + independent.pixel(x, y)[c]);
    return result;
  };
  method.passes = pair;
  return method;
}
inline Plan average_plan() { return pair_plan(average_estimator()); }

/// The plan of a pair with another image: `make` gets a function that makes the usual one, and its settings.
inline Plan with_image(const Plan& plan,
                       const std::function<EstimatorResult(const std::function<EstimatorResult()>& usual,
                                                           const MethodSettings& settings)>& make) {
  Method method = *plan.method;
  PassPair& pair = std::get<PassPair>(method.passes);
  pair.image = [make, usual = pair.image](const GroupedImage& crn, const GroupedImage& independent,
                                          const MethodSettings& settings) {
    return make([&] { return usual(crn, independent, settings); }, settings);
  };
  Plan result = plan;
  result.method = std::make_shared<const Method>(method);
  return result;
}

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
