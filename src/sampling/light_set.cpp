// SPDX-License-Identifier: Apache-2.0
#include "sampling/light_set.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "sampling/light_selection.h"

namespace covary {
namespace {

constexpr uint32_t kSteps = 1u << 24;  // number of distinct random numbers
constexpr uint32_t kMaxLights = 1u << 22;

std::vector<double> weights_by_power(const LargeVector<Light>& lights) {
  std::vector<LightPower> powers;
  for (const Light& light : lights)
    powers.push_back({mean(light.emitter->part_power(light.part)), light.emitter->knows_power()});
  return weights_by_power(powers);
}

std::vector<double> weights_by_triangle(const LargeVector<Light>& lights) {
  std::vector<double> weights;
  for (const Light& light : lights) {
    const Shape* shape = light.emitter->shape();
    weights.push_back(shape ? shape->triangles_per_part() : 1);
  }
  return weights;
}

std::vector<double> weights_by_area(const LargeVector<Light>& lights) {
  std::vector<double> weights;
  for (const Light& light : lights) {
    const Shape* shape = light.emitter->shape();
    weights.push_back(shape && shape->n_parts() > 1 ? double{shape->part_area(light.part)} / shape->area() : 1);
  }
  return weights;
}

/// Unnormalised weights.
std::vector<double> weights_of(const LargeVector<Light>& lights, LightSelection selection) {
  switch (selection) {
    case LightSelection::kTriangle:
      return weights_by_triangle(lights);
    case LightSelection::kShape:
      return weights_by_area(lights);
    case LightSelection::kPower:
    case LightSelection::kLearned:
      return weights_by_power(lights);
  }
  throw Error(ErrorCode::kInternal, "unknown selection of lights");
}

/// Normalised weights rounded to multiples of 2^-24, at least one step for each positive weight, so that the
/// probability with which a random number selects a light exactly equals the factor in the light's density.
std::vector<float> whole_steps(const std::vector<double>& weights) {
  const auto n_positive =
      static_cast<double>(std::count_if(weights.begin(), weights.end(), [](double weight) { return weight > 0; }));
  double sum = 0, rest = 0;
  for (const double weight : weights) sum += weight;
  std::vector<float> steps;
  size_t largest = 0;
  double n_used = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    double n = 0;
    if (weights[i] > 0) {
      const double exact = weights[i] / sum * (kSteps - n_positive) + rest;  // rounding remainder of the previous one
      n = std::floor(std::max(exact, 0.0));
      rest = exact - n;
      n += 1;
    }
    steps.push_back(static_cast<float>(n));
    n_used += n;
    if (weights[i] > weights[largest]) largest = i;
  }
  steps[largest] += static_cast<float>(kSteps - n_used);
  return steps;
}

}  // namespace

std::string name_of(LightSelection selection) {
  switch (selection) {
    case LightSelection::kTriangle:
      return "triangle";
    case LightSelection::kShape:
      return "shape";
    case LightSelection::kPower:
      return "power";
    case LightSelection::kLearned:
      return "learned";
  }
  throw Error(ErrorCode::kInternal, "unknown selection of lights");
}

LightSet::LightSet(const Scene& scene, LightSelection selection) {
  for (const auto& emitter : scene.emitters()) {
    if (emitter->is_environment()) continue;
    emitters_.insert(key_of(*emitter));
    first_.push_back(size());
    const uint32_t n = emitter->n_parts();
    if (n > kMaxLights - size())
      throw Error(ErrorCode::kInput, "the scene has more than " + std::to_string(kMaxLights) +
                                         " lights, which controlled-path cannot tell "
                                         "apart; use the integrator path");
    for (uint32_t part = 0; part < n; ++part) lights_.push_back({emitter.get(), part, 0});
  }
  if (lights_.empty()) return;
  change(weights_of(lights_, selection));
}

void LightSet::change(const std::vector<double>& weights) {
  COVARY_CHECK(weights.size() == lights_.size(), "a weight for each light");
  selection_ = Discrete(whole_steps(weights));
  for (uint32_t i = 0; i < size(); ++i) lights_[i].pmf = selection_.pmf(i);
}

namespace {

ClusterLight cluster_light(const Light& light, const Bounds3& scene) {
  ClusterLight result;
  result.power = luminance(light.emitter->part_power(light.part));
  if (const Shape* shape = light.emitter->shape()) {
    result.bounds = shape->part_bounds(light.part);
    const Vec3 normal = shape->part_normal(light.part);
    if (length_squared(normal) > 0 && !light.emitter->emits_on_both_sides())
      result.axis = normal, result.cos_half_angle = 1;
    return result;
  }
  const Vec3 centre = scene.center();
  const EmitterSample sample = light.emitter->sample_towards(centre, {0.5f, 0.5f}, 0.5f);
  if (sample.distance == kInfinity) {
    result.bounds = scene, result.axis = -sample.wi, result.cos_half_angle = 1;
  } else {
    const Vec3 p = centre + sample.wi * sample.distance;
    result.bounds = {p, p};
  }
  return result;
}

}  // namespace

LightClusters cluster_light_set(const LightSet& lights, const Bounds3& scene, uint32_t limit) {
  if (lights.size() > limit) {
    std::vector<ClusterLight> all;
    for (uint32_t i = 0; i < lights.size(); ++i) all.push_back(cluster_light(lights[i], scene));
    return cluster_lights(all, limit, 2 * scene.radius());
  }
  LightClusters each{std::vector<uint32_t>(lights.size()), lights.size()};
  std::iota(each.cluster_of.begin(), each.cluster_of.end(), 0u);
  return each;
}

std::vector<float> expected_samples(const LightClusters& clusters, const LightSet& lights) {
  std::vector<double> counts(clusters.n_clusters);
  for (uint32_t i = 0; i < lights.size(); ++i) counts[clusters.cluster_of[i]] += lights[i].pmf;
  return {counts.begin(), counts.end()};
}

}  // namespace covary
