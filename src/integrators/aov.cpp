// SPDX-License-Identifier: Apache-2.0
#include "integrators/aov.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <span>
#include <vector>

#include "core/arena.h"
#include "core/parallel.h"
#include "integrators/medium_flight.h"
#include "integrators/path_steps.h"

namespace covary {
namespace {

constexpr size_t kImages = std::size(kAuxiliaryImages);
/// The image P, in scene units.
constexpr size_t kPosition = 2;
/// Samples between checks whether the standard errors of a pixel's means are small enough (measured:
/// docs/notes/denoising.md).
constexpr uint32_t kRound = 16;
constexpr float kTolerance = 0.01f;

/// Contribution of one camera ray to each image.
using AuxiliarySample = std::array<Vec3, kImages>;

Vec3 to_vec(const Spectrum& colour) { return {colour.r, colour.g, colour.b}; }

/// Continues from `hit`, while it is mirror or glass, to the surface behind, and multiplies `throughput` along the way;
/// false if the ray leaves the scene.
bool follow(const Scene& scene, const PathRandom& random, Arena& arena, Ray ray, SurfaceHit& hit,
            Spectrum& throughput) {
  for (int bounce = 0; bounce < kFollowedBounces && !(hit.bsdf_flags & kSmooth); ++bounce) {
    arena.reset();
    const Vec3 wo = hit.frame.to_local(-ray.d);
    const BsdfClosure* bsdf = hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, arena);
    const uint32_t vertex = kDeltaVertices + bounce;
    const BsdfSample next =
        bsdf->sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
    if (!next.valid()) return true;  // a surface that reflects nothing ends the path
    throughput *= next.weight;
    const Vec3 wi = hit.frame.to_world(next.wi);
    ray = Ray{offset_origin(hit, wi), wi, kInfinity};
    if (!scene.intersect(ray, hit)) return false;
  }
  return true;
}

/// With media: continues to the first surface that is more than a boundary, like the sample's path, or to a collision
/// before it. At a collision, sets the values (scattering albedo, no normal, position) and returns true. Otherwise
/// returns false, and `ray` is the one to that surface, or leaves the scene.
bool ends_in_medium(const Scene& scene, const PathRandom& random, Ray& ray, AuxiliarySample& values) {
  const Medium* medium = scene.camera_medium();
  const int channel = channel_of(random);
  FlightNumbers numbers(random, 0);
  SpectralWeights weights;
  SurfaceHit hit;
  for (;;) {
    const bool found = scene.intersect(ray, hit);
    const float far = found ? hit.t : ray.t_max;
    if (const float t = medium ? fly(*medium, ray, far, channel, numbers, weights, nullptr) : kInfinity;
        t < kInfinity) {
      values[2] = ray.at(t);
      const Medium::Coefficients here = medium->at(values[2]);
      for (int c = 0; c < 3; ++c)
        values[0][c] = here.extinction[c] > 0 ? std::clamp(here.scattering[c] / here.extinction[c], 0.0f, 1.0f) : 0;
      values[3] = values[0];
      return true;
    }
    if (!found || hit.bsdf_flags != kNullTransmission) return false;
    if (hit.shape->bounds_medium()) medium = hit.shape->medium_towards(hit.ng, ray.d);
    ray = Ray{offset_origin(hit, ray.d), ray.d, kInfinity};
  }
}

/// Values of a camera ray that hits a surface: those of the first one, and of the one behind mirrors and glass.
AuxiliarySample surface_sample(const Scene& scene, const PathRandom& random, const Ray& ray, SurfaceHit& hit,
                               Arena& arena) {
  AuxiliarySample values{};
  values[0] = values[3] = to_vec(hit.bsdf->albedo(hit));
  values[1] = values[4] = hit.frame.n;
  values[kPosition] = hit.p;
  if (hit.bsdf_flags & kSmooth) return values;
  Spectrum throughput(1);
  if (!follow(scene, random, arena, ray, hit, throughput)) {
    values[3] = values[4] = {};
    return values;
  }
  const Spectrum albedo = throughput * hit.bsdf->albedo(hit);
  for (int c = 0; c < 3; ++c) values[3][c] = std::clamp(albedo[c], 0.0f, 1.0f);
  values[4] = hit.frame.n;
  return values;
}

/// Samples begin … end - 1 of a pixel, at most kRound, whose camera rays are traced together.
class Round {
 public:
  Round(const Scene& scene, const PassSettings& settings) : scene_(scene), settings_(settings) {}

  /// Valid until the next call.
  std::span<const AuxiliarySample> trace(int x, int y, uint32_t begin, uint32_t end) {
    const size_t n = end - begin;
    randoms_.clear();
    for (size_t i = 0; i < n; ++i) {
      const CameraSample sample = camera_sample(scene_, settings_, x, y, begin + i);
      randoms_.push_back(sample.random);
      rays_[i] = sample.ray, values_[i] = {};
    }
    if (!scene_.has_media()) scene_.nearest(std::span(rays_).first(n), std::span(hits_).first(n), true);
    for (size_t i = 0; i < n; ++i) {
      SurfaceHit hit;
      if (scene_.has_media()) {
        if (ends_in_medium(scene_, randoms_[i], rays_[i], values_[i]) || !scene_.intersect(rays_[i], hit)) continue;
      } else {
        if (!hits_[i].found()) continue;
        scene_.resolve(rays_[i], hits_[i], hit);
      }
      values_[i] = surface_sample(scene_, randoms_[i], rays_[i], hit, arena_);
    }
    return std::span(values_).first(n);
  }

 private:
  const Scene& scene_;
  const PassSettings& settings_;
  Arena arena_;
  std::vector<PathRandom> randoms_;
  std::array<Ray, kRound> rays_;
  std::array<RayHit, kRound> hits_;
  std::array<AuxiliarySample, kRound> values_;
};

/// Means over the samples of a pixel: `most`, or as many rounds as it takes to reach kTolerance.
AuxiliarySample auxiliary_means(Round& round, int x, int y, uint32_t most) {
  AuxiliarySample sums{}, squares{};
  float largest = kInfinity;  // variance of the means, over albedos and normals
  uint32_t n = 0;
  while (n < most && largest > sqr(kTolerance)) {
    const uint32_t end = std::min(most, n + kRound);
    for (const AuxiliarySample& values : round.trace(x, y, n, end))
      for (size_t i = 0; i < kImages; ++i) sums[i] += values[i], squares[i] += values[i] * values[i];
    n = end;
    largest = 0;
    const auto count = static_cast<float>(n);
    for (size_t i = 0; i < kImages; ++i)
      for (int c = 0; c < 3 && i != kPosition; ++c)
        largest = std::max(largest, (squares[i][c] - sqr(sums[i][c]) / count) / sqr(count));
  }
  for (Vec3& sum : sums) sum *= 1 / static_cast<float>(n);
  return sums;
}

}  // namespace

void render_aovs(const Scene& scene, const PassSettings& pass, uint32_t most, Film& film,
                 const std::atomic<bool>* stop) {
  PassSettings settings = pass;
  settings.sampler = Sampler::kSobol, settings.groups = 1;
  std::array<Image, kImages> images;
  for (Image& image : images) image = Image(film.width(), film.height(), 3);
  const auto stopped = [&] { return stop && stop->load(std::memory_order_relaxed); };
  std::atomic<uint64_t> n_done = 0;
  const auto width = static_cast<uint64_t>(film.width()), n_pixels = width * static_cast<uint64_t>(film.height());
  parallel_for(film.height(), [&](int y) {
    if (stopped()) return;
    Round round(scene, settings);
    for (int x = 0; x < film.width(); ++x) {
      const AuxiliarySample means = auxiliary_means(round, film.crop().x + x, film.crop().y + y, most);
      for (size_t i = 0; i < kImages; ++i)
        for (int c = 0; c < 3; ++c) images[i].pixel(x, y)[c] = means[i][c];
    }
    if (pass.progress) pass.progress(n_done += width, n_pixels);
  });
  if (stopped()) return;
  for (size_t i = 0; i < kImages; ++i) film.aovs[kAuxiliaryImages[i]] = std::move(images[i]);
}

}  // namespace covary
