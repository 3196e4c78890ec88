// SPDX-License-Identifier: Apache-2.0
#include "integrators/aov.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "core/arena.h"
#include "core/parallel.h"
#include "integrators/path_steps.h"

namespace covary {
namespace {

constexpr size_t kImages = std::size(kAuxiliaryImages);

/// What one camera ray adds to each image.
using AuxiliarySample = std::array<Vec3, kImages>;

Vec3 to_vec(const Spectrum& colour) { return {colour.r, colour.g, colour.b}; }

/// Goes on from `hit`, as long as it is mirror or glass, to the surface behind. Returns what the way there lets
/// through; false where the ray leaves the scene.
bool follow(const Scene& scene, const PathRandom& random, Arena& arena, Ray ray, SurfaceHit& hit,
            Spectrum& throughput) {
  for (int bounce = 0; bounce < kFollowedBounces && !(hit.bsdf_flags & kSmooth); ++bounce) {
    arena.reset();
    const Vec3 wo = hit.frame.to_local(-ray.d);
    const BsdfClosure* bsdf = hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, arena);
    const uint32_t vertex = kDeltaVertices + bounce;
    const BsdfSample next =
        bsdf->sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
    if (!next.valid()) return true;  // a surface that reflects nothing ends the way
    throughput *= next.weight;
    const Vec3 wi = hit.frame.to_world(next.wi);
    ray = Ray{offset_origin(hit, wi), wi, kInfinity};
    if (!scene.intersect(ray, hit)) return false;
  }
  return true;
}

AuxiliarySample auxiliary_sample(const Scene& scene, const CameraSample& sample, Arena& arena) {
  AuxiliarySample values{};
  SurfaceHit hit;
  if (!scene.intersect(sample.ray, hit)) return values;
  values[0] = values[3] = to_vec(hit.bsdf->albedo(hit));
  values[1] = values[4] = hit.frame.n;
  values[2] = hit.p;
  if (hit.bsdf_flags & kSmooth) return values;
  Spectrum throughput(1);
  if (!follow(scene, sample.random, arena, sample.ray, hit, throughput)) {
    values[3] = values[4] = {};
    return values;
  }
  const Spectrum albedo = throughput * hit.bsdf->albedo(hit);
  for (int c = 0; c < 3; ++c) values[3][c] = std::clamp(albedo[c], 0.0f, 1.0f);
  values[4] = hit.frame.n;
  return values;
}

}  // namespace

void render_aovs(const Scene& scene, const PassSettings& settings, uint32_t spp, Film& film,
                 const std::atomic<bool>* stop) {
  std::array<Image, kImages> images;
  for (Image& image : images) image = Image(film.width(), film.height(), 3);
  const auto stopped = [&] { return stop && stop->load(std::memory_order_relaxed); };
  parallel_for(film.height(), [&](int y) {
    if (stopped()) return;
    Arena arena;
    for (int x = 0; x < film.width(); ++x) {
      AuxiliarySample sums{};
      for (uint32_t s = 0; s < spp; ++s) {
        const CameraSample sample = camera_sample(scene, settings, film.crop().x + x, film.crop().y + y, s);
        const AuxiliarySample values = auxiliary_sample(scene, sample, arena);
        for (size_t i = 0; i < kImages; ++i) sums[i] += values[i];
      }
      const float scale = 1 / static_cast<float>(spp);
      for (size_t i = 0; i < kImages; ++i)
        for (int c = 0; c < 3; ++c) images[i].pixel(x, y)[c] = sums[i][c] * scale;
    }
  });
  if (stopped()) return;
  for (size_t i = 0; i < kImages; ++i) film.aovs[kAuxiliaryImages[i]] = std::move(images[i]);
}

}  // namespace covary
