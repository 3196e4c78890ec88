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

constexpr size_t kImages = feature::kCount;
/// The image P, in scene units.
constexpr size_t kPosition = feature::kPosition;
/// Samples between checks whether the standard errors of a pixel's means are small enough (measured:
/// docs/notes/denoising.md).
constexpr uint32_t kRound = 16;
constexpr float kTolerance = 0.01f;
/// Surfaces that a pixel's rays may meet, per ray that it may have. Through much glass this is the limit: more rays
/// lower the error of the denoised image less than the time that they take (docs/notes/denoising.md, "Features without
/// noise").
constexpr size_t kSurfacesPerRay = 3;

/// Contribution of one camera ray to each image.
struct AuxiliarySample : std::array<Vec3, kImages> {
  float alpha = 0;
};

Vec3 to_vec(const Spectrum& colour) { return {colour.r, colour.g, colour.b}; }

/// The albedo of a surface seen along `direction`, the darker the more it shines itself: a denoiser that takes a lamp
/// for the ceiling around it spreads its light (docs/notes/denoising.md, "Lamps that reflect").
Spectrum albedo_seen(const SurfaceHit& hit, const Vec3& direction) {
  const Spectrum albedo = hit.bsdf->albedo(hit);
  if (!hit.emitter) return albedo;
  const Spectrum emitted = hit.emitter->surface_radiance(hit, -direction);
  const float reflects = max_component(albedo), shines = max_component(emitted);
  return shines > 0 ? albedo * (sqr(reflects) / (sqr(reflects) + sqr(shines))) : albedo;
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
    if (const float t = medium ? sample_flight(*medium, ray, far, channel, numbers, weights, nullptr) : kInfinity;
        t < kInfinity) {
      values[kPosition] = ray.at(t);
      const Medium::Coefficients here = medium->at(values[kPosition]);
      for (int c = 0; c < 3; ++c)
        values[feature::kAlbedo][c] =
            here.extinction[c] > 0 ? std::clamp(here.scattering[c] / here.extinction[c], 0.0f, 1.0f) : 0;
      values[feature::kDenoisingAlbedo] = values[feature::kAlbedo];
      values.alpha = 1;
      return true;
    }
    if (!found || hit.bsdf_flags != kNullTransmission) return false;
    if (hit.shape->bounds_medium()) medium = hit.shape->medium_towards(hit.ng, ray.d);
    ray = Ray{offset_origin(hit, ray.d), ray.d, kInfinity};
  }
}

/// Samples of a pixel, at most kRound at a time, whose rays are traced together.
class Round {
 public:
  Round(const Scene& scene, const PassSettings& settings) : scene_(scene), settings_(settings) {}

  /// Samples begin … end - 1; valid until the next call.
  std::span<const AuxiliarySample> trace(int x, int y, uint32_t begin, uint32_t end) {
    const size_t n = end - begin;
    n_met_ = 0;
    randoms_.clear(), ways_.clear();
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
      meet(i, rays_[i], hit);
    }
    for (int bounce = 0; bounce < kFollowedBounces && !ways_.empty(); ++bounce) follow(bounce);
    for (const Way& way : ways_) end_at(way.sample, way.hit, -way.wo, way.throughput);
    return std::span(values_).first(n);
  }

  /// Surfaces that the rays of the last call met.
  size_t n_met() const { return n_met_; }

 private:
  /// A sample whose ray met nothing but mirrors and glass, and its surface.
  struct Way {
    size_t sample;
    Spectrum throughput;  ///< of the surfaces before
    Vec3 wo;              ///< to where the ray comes from
    SurfaceHit hit;
  };

  /// Values of the first surface of a sample, and, unless that is mirror or glass, of the one behind.
  void meet(size_t sample, const Ray& ray, const SurfaceHit& hit) {
    values_[sample] = {{to_vec(albedo_seen(hit, ray.d)), hit.frame.n, hit.p, {}, {}}, 1};
    ++n_met_;
    if (hit.bsdf_flags & kSmooth)
      end_at(sample, hit, ray.d, Spectrum(1));
    else
      ways_.push_back({sample, Spectrum(1), -ray.d, hit});
  }

  /// Values of the surface behind mirrors and glass of this throughput.
  void end_at(size_t sample, const SurfaceHit& hit, const Vec3& direction, const Spectrum& throughput) {
    const Spectrum albedo = throughput * albedo_seen(hit, direction);
    for (int c = 0; c < 3; ++c) values_[sample][feature::kDenoisingAlbedo][c] = std::clamp(albedo[c], 0.0f, 1.0f);
    values_[sample][feature::kDenoisingNormal] = hit.frame.n;
  }

  /// Continues all ways by one edge; those that end, at a surface with more than delta lobes, at one that reflects
  /// nothing, or outside of the scene, are removed.
  void follow(int bounce) {
    size_t n = 0;
    for (Way& way : ways_) {
      arena_.reset();
      const Vec3 wo = way.hit.frame.to_local(way.wo);
      const BsdfClosure* bsdf = way.hit.bsdf->bind(way.hit, wo.z > 0, TransportMode::kRadiance, arena_);
      const PathRandom& random = randoms_[way.sample];
      const uint32_t vertex = kDeltaVertices + bounce;
      const BsdfSample next =
          bsdf->sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
      if (!next.valid()) {
        end_at(way.sample, way.hit, -way.wo, way.throughput);
        continue;
      }
      way.throughput *= next.weight;
      const Vec3 wi = way.hit.frame.to_world(next.wi);
      way.wo = -wi;
      rays_[n] = Ray{offset_origin(way.hit, wi), wi, kInfinity};
      if (&ways_[n] != &way) ways_[n] = way;
      ++n;
    }
    scene_.nearest(std::span(rays_).first(n), std::span(hits_).first(n), true);
    size_t n_left = 0;
    for (size_t i = 0; i < n; ++i) {
      Way& way = ways_[i];
      if (!hits_[i].found()) continue;
      scene_.resolve(rays_[i], hits_[i], way.hit);
      ++n_met_;
      if (way.hit.bsdf_flags & kSmooth)
        end_at(way.sample, way.hit, -way.wo, way.throughput);
      else if (n_left++ != i)
        ways_[n_left - 1] = way;
    }
    ways_.resize(n_left);
  }

  const Scene& scene_;
  const PassSettings& settings_;
  Arena arena_;
  std::vector<PathRandom> randoms_;
  std::array<Ray, kRound> rays_;
  std::array<RayHit, kRound> hits_;
  std::vector<Way> ways_;
  std::array<AuxiliarySample, kRound> values_;
  size_t n_met_ = 0;
};

/// Means over the samples of a pixel: `most`, or as many rounds as it takes to reach kTolerance or kSurfacesPerRay;
/// those of alpha, if asked for, always over `most`, as a silhouette may be missed by the first.
AuxiliarySample auxiliary_means(Round& round, int x, int y, uint32_t most, bool alpha) {
  AuxiliarySample sums{}, squares{};
  float largest = kInfinity;  // variance of the means, over albedos and normals
  uint32_t n = 0;
  size_t n_met = 0;
  while (n < most && n_met < kSurfacesPerRay * most && largest > sqr(kTolerance)) {
    const uint32_t end = std::min(most, n + kRound);
    for (const AuxiliarySample& values : round.trace(x, y, n, end)) {
      sums.alpha += values.alpha;
      for (size_t i = 0; i < kImages; ++i) sums[i] += values[i], squares[i] += values[i] * values[i];
    }
    n = end, n_met += round.n_met();
    largest = 0;
    const auto count = static_cast<float>(n);
    for (size_t i = 0; i < kImages; ++i)
      for (int c = 0; c < 3 && i != kPosition; ++c)
        largest = std::max(largest, (squares[i][c] - sqr(sums[i][c]) / count) / sqr(count));
  }
  for (Vec3& sum : sums) sum *= 1 / static_cast<float>(n);
  for (uint32_t end = n; alpha && n < most; n = end) {
    end = std::min(most, n + kRound);
    for (const AuxiliarySample& values : round.trace(x, y, n, end)) sums.alpha += values.alpha;
  }
  sums.alpha /= static_cast<float>(n);
  return sums;
}

}  // namespace

void render_aovs(const Scene& scene, const PassSettings& pass, uint32_t most, Film& film, const std::atomic<bool>* stop,
                 bool alpha) {
  PassSettings settings = pass;
  settings.sampler = Sampler::kSobol, settings.groups = 1;
  std::array<Image, kImages> images;
  for (Image& image : images) image = Image(film.width(), film.height(), 3);
  Image alphas(film.width(), film.height(), 1);
  const auto stopped = [&] { return stop && stop->load(std::memory_order_relaxed); };
  std::atomic<uint64_t> n_done = 0;
  const auto width = static_cast<uint64_t>(film.width()), n_pixels = width * static_cast<uint64_t>(film.height());
  parallel_for(film.height(), [&](int y) {
    if (stopped()) return;
    Round round(scene, settings);
    for (int x = 0; x < film.width(); ++x) {
      const AuxiliarySample means = auxiliary_means(round, film.crop().x + x, film.crop().y + y, most, alpha);
      for (size_t i = 0; i < kImages; ++i)
        for (int c = 0; c < 3; ++c) images[i].pixel(x, y)[c] = means[i][c];
      *alphas.pixel(x, y) = means.alpha;
    }
    if (pass.progress) pass.progress(n_done += width, n_pixels);
  });
  if (stopped()) return;
  for (size_t i = 0; i < kImages; ++i) film.aovs[kAuxiliaryFeatures[i].layer] = std::move(images[i]);
  if (alpha) film.aovs[kAlpha] = std::move(alphas);
}

}  // namespace covary
