// SPDX-License-Identifier: Apache-2.0
// Free-flight sampling in media. If the extinction varies, flights are sampled for its majorant, and null collisions
// fill in the difference [Novak2018] (delta tracking, ratio tracking). Colour channels share paths: distances are
// sampled for one channel, and each channel is weighted by the mean of the three channels' densities for the same path,
// which is the balance heuristic over channels [Miller2019]. Random numbers are addressed by the vertex before the
// flight and the number of collisions since.
#pragma once

#include <atomic>
#include <cmath>

#include "core/random.h"
#include "scene/medium.h"

namespace covary {

/// A path's throughput and densities per channel, up to a common factor.
struct SpectralWeights {
  Spectrum throughput{1};
  Spectrum pdf_path{1};   ///< density of the path as sampled
  Spectrum pdf_light{1};  ///< same, if its last edges were a connection to a light
  /// Divides all three by the same number, which changes no estimate and keeps them within the range of float.
  void normalise() {
    const float scale = 1 / mean(pdf_path);
    throughput *= scale, pdf_path *= scale, pdf_light *= scale;
  }
};

/// The random numbers of flights between two scattering vertices.
class FlightNumbers {
 public:
  /// `vertex`: number of such vertices before.
  FlightNumbers(const PathRandom& path, uint32_t vertex) : random_(path.subpath(Subpath::kCamera, vertex + 1)) {}
  float distance(Event event) const { return random_.get_1d(step_, event); }
  float collision() { return random_.get_1d(step_++, Event::kCollision); }
  void next() { ++step_; }

 private:
  PathRandom random_;
  uint32_t step_ = 0;
};

/// The channel by which a path samples its distances; 0 … 2.
inline int channel_of(const PathRandom& path) {
  return std::min(static_cast<int>(3 * path.get_1d(0, Event::kCollision)), 2);
}

inline Spectrum transmittance(const Spectrum& extinction, float distance) {
  const auto part = [&](float sigma) { return sigma > 0 ? std::exp(-sigma * distance) : 1; };
  return {part(extinction.r), part(extinction.g), part(extinction.b)};
}

inline float free_distance(float extinction, float u) {
  return extinction > 0 ? -std::log1p(-u) / extinction : kInfinity;
}

/// The majorant minus the extinction, at least 0.
inline Spectrum null_extinction(const Spectrum& majorant, const Spectrum& extinction) {
  const Spectrum rest = majorant - extinction;
  return {std::max(rest.r, 0.0f), std::max(rest.g, 0.0f), std::max(rest.b, 0.0f)};
}

/// The light that a homogeneous medium emits towards the origin of a ray of this length.
inline Spectrum emission_along(const Medium& medium, const Ray& ray, float length) {
  const Medium::Coefficients here = medium.at(ray.o);
  const Spectrum emission = medium.emission(ray.o, here);
  Spectrum sum;
  for (int c = 0; c < 3; ++c)
    if (emission[c] > 0) sum[c] = emission[c] * -std::expm1(-here.extinction[c] * length) / here.extinction[c];
  return sum;
}

/// Flies along `ray` up to `far`, sampling for `channel`. Returns the distance at which light scatters; infinity if it
/// passes through, or `stop` became true. Unless it is null, an estimate of the light that the medium emits on the way
/// is added to `glow`: exact if the medium is homogeneous, otherwise from all collisions [Novak2018].
inline float sample_flight(const Medium& medium, const Ray& ray, float far, int channel, FlightNumbers& numbers,
                           SpectralWeights& weights, const std::atomic<bool>* stop, Spectrum* glow = nullptr) {
  float t = 0;
  if (!medium.clip(ray, t, far)) return kInfinity;
  const Spectrum& majorant = medium.majorant();
  if (glow && medium.homogeneous())
    *glow += weights.throughput * emission_along(medium, ray, far) * (1 / mean(weights.pdf_path));
  while (!(stop && stop->load(std::memory_order_relaxed))) {
    const float step = free_distance(majorant[channel], numbers.distance(Event::kDistance));
    if (!(t + step < far)) {
      numbers.next();
      const Spectrum through = transmittance(majorant, far - t);
      const float pdf = 1 / through[channel];
      weights.throughput *= through * pdf, weights.pdf_path *= through * pdf;
      weights.pdf_light *= medium.homogeneous() ? Spectrum(pdf) : through * pdf;
      break;
    }
    t += step;
    const Spectrum through = transmittance(majorant, step);
    const Medium::Coefficients medium_here = medium.at(ray.at(t));
    const float u = numbers.collision();
    const Spectrum& extinction = medium_here.extinction;
    if (glow && !medium.homogeneous())
      *glow += weights.throughput * through * medium.emission(ray.at(t), medium_here) *
               (1 / mean(weights.pdf_path * through * majorant));
    if (medium.homogeneous() || u * majorant[channel] < extinction[channel]) {
      const float pdf = 1 / (through[channel] * extinction[channel]);
      weights.throughput *= through * medium_here.scattering * pdf;
      weights.pdf_path *= through * extinction * pdf;
      weights.normalise();
      return t;
    }
    const Spectrum null = null_extinction(majorant, extinction);
    const float pdf = 1 / (through[channel] * null[channel]);
    weights.throughput *= through * null * pdf;
    weights.pdf_path *= through * null * pdf;
    weights.pdf_light *= through * majorant * pdf;
    weights.normalise();
  }
  weights.normalise();
  return kInfinity;
}

/// Estimates the transmittance from 0 to `far`; exact if the extinction is constant. Here `pdf_path` is the density of
/// sample_flight(), `pdf_light` that of this function.
inline void attenuate(const Medium& medium, const Ray& ray, float far, int channel, FlightNumbers& numbers,
                      SpectralWeights& weights, const std::atomic<bool>* stop) {
  float t = 0;
  if (!medium.clip(ray, t, far)) return;
  const Spectrum& majorant = medium.majorant();
  if (medium.homogeneous()) {
    const Spectrum through = transmittance(majorant, far - t);
    weights.throughput *= through, weights.pdf_path *= through;
    return;
  }
  while (!(stop && stop->load(std::memory_order_relaxed)) && !is_black(weights.throughput)) {
    const float step = free_distance(majorant[channel], numbers.distance(Event::kShadowDistance));
    numbers.next();
    if (!(t + step < far)) {
      const Spectrum through = transmittance(majorant, far - t);
      const Spectrum factor = through * (1 / through[channel]);
      weights.throughput *= factor, weights.pdf_path *= factor, weights.pdf_light *= factor;
      return;
    }
    t += step;
    const Spectrum through = transmittance(majorant, step);
    const Spectrum null = null_extinction(majorant, medium.at(ray.at(t)).extinction);
    const float pdf = 1 / (through[channel] * majorant[channel]);
    weights.throughput *= through * null * pdf;
    weights.pdf_path *= through * null * pdf;
    weights.pdf_light *= through * majorant * pdf;
  }
}

}  // namespace covary
