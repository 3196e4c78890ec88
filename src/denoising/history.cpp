// SPDX-License-Identifier: Apache-2.0
#include "denoising/history.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/vec.h"
#include "filters/guided_cells.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

constexpr float kInterval = 3;      // k, in standard errors
constexpr int kErrorWindow = 5;     // side, pixels
constexpr float kMinScale = 0.02f;  // added to colours that divide standard errors
/// The most by which features may change a history, relative to its colour.
constexpr float kMaxOfColour = 0.2f;

/// 1 / (1 + e / s'^2): trust in resampled history beside an image of the frame whose standard error is `scale` times
/// that of the whole; 0 without history.
float trust_at(const History& history, const Image& std_error, float scale, int x, int y) {
  if (!history.known[static_cast<size_t>(y) * history.image.width + x]) return 0;
  const float* s = std_error.pixel(x, y);
  const float variance = sqr(scale) * (sqr(s[0]) + sqr(s[1]) + sqr(s[2])) / 3;
  return variance > 0 ? variance / (variance + *history.squared_error.pixel(x, y)) : 0;
}

/// s*: medians of relative standard errors over windows, times the picture. The error of a single pixel is small where
/// its samples happen to be dark and large where they are bright, so that clamping to it would darken frames: by 1.2 %
/// in a still room with 8 samples. Means would let a glint widen the intervals of all pixels around it, and absolute
/// errors those of dark pixels among bright ones, where a reflection has moved on.
Image steady(const Image& std_error, const Image& picture) {
  const auto scale = [&](int x, int y, int c) { return std::abs(picture.pixel(x, y)[c]) + kMinScale; };
  Image result = std_error;
  const int radius = kErrorWindow / 2;
  parallel_for(result.height, 8, [&](int y) {
    std::vector<float> window;
    for (int x = 0; x < result.width; ++x)
      for (int c = 0; c < result.channels; ++c) {
        window.clear();
        for (int j = std::max(y - radius, 0); j <= std::min(y + radius, result.height - 1); ++j)
          for (int i = std::max(x - radius, 0); i <= std::min(x + radius, result.width - 1); ++i)
            window.push_back(std_error.pixel(i, j)[c] / scale(i, j, c));
        const auto middle = window.begin() + static_cast<std::ptrdiff_t>(window.size() / 2);
        std::nth_element(window.begin(), middle, window.end());
        result.pixel(x, y)[c] = *middle * scale(x, y, c);
      }
  });
  return result;
}

/// C of a frame's image, or of a half's, whose error is `scale` times as large. `limits`: from steady().
Image candidate(const Image& frame, const History& history, const Image& std_error, const Image& limits, float scale) {
  Image result = frame;
  parallel_for(frame.height, 8, [&](int y) {
    for (int x = 0; x < frame.width; ++x) {
      const float trust = trust_at(history, std_error, scale, x, y);
      if (!(trust > 0)) continue;
      const float* s = limits.pixel(x, y);
      for (int c = 0; c < 3; ++c) {
        const float m = frame.pixel(x, y)[c], most = kInterval * scale * s[c];
        result.pixel(x, y)[c] = m + std::clamp(history.image.pixel(x, y)[c] - m, -most, most) * trust;
      }
    }
  });
  return result;
}

/// D of the whole or of a half, clamped to the interval of the frame; other arguments as for candidate().
Image limited(const Image& frame, const Image& accumulated, const Image& std_error, const Image& limits, float scale) {
  Image result = frame;
  for (size_t i = 0; i < frame.data.size(); ++i) {
    const float most = kInterval * scale * std::max(std_error.data[i], limits.data[i]);
    result.data[i] += std::clamp(accumulated.data[i] - frame.data[i], -most, most);
  }
  return result;
}

/// The largest weight of R in R', so that new samples always count.
constexpr float kMaxOfSamples = 0.9f;

/// Range of the factors that scale history.
constexpr float kMinFactor = 0.1f, kMaxFactor = 10;

/// Factors per channel that make two images of the history follow the frame's light:
///
///     f = 1 + max(0, 1 - v / d^2) d / r.
///
/// Over pixels that look alike, d sums the frame's samples minus history, with variance v, which follows from the
/// halves, and r sums history. The shrinkage is James and Stein's [JamesStein1961]: where d is only noise, f is near 1.
Image light_factors(const History& history, const HistoryInput& input, const std::array<const Image*, 2>& before) {
  const Image& counts = *input.common_counts;
  std::vector<unsigned char> valid = *input.valid;
  for (size_t i = 0; i < valid.size(); ++i) valid[i] = valid[i] && history.known[i];
  constexpr int kPlanes = 9;  // d, r and v of three channels
  const GuidedCells cells(*input.guide, valid, kPlanes, [&](int x, int y, float* sums) {
    const float count = std::sqrt(*counts.pixel(x, y));
    for (int c = 0; c < 3; ++c) {
      const float own[2] = {input.independent[0]->mean.row(c, y)[x], input.independent[1]->mean.row(c, y)[x]};
      const float past[2] = {before[0]->pixel(x, y)[c], before[1]->pixel(x, y)[c]};
      const float d[2] = {own[0] - past[0], own[1] - past[1]};
      sums[c] += count * (d[0] + d[1]) / 2;
      sums[3 + c] += count * (past[0] + past[1]) / 2;
      sums[6 + c] += sqr(count * (d[0] - d[1])) / 4;
    }
  });
  Image factors(counts.width, counts.height, 3);
  std::fill(factors.data.begin(), factors.data.end(), 1.0f);
  for_each_batch(counts.width, counts.height, [&](int x, int y, int n) {
    std::array<lanes::vfloat, kPlanes> sums;
    cells.sum(x, y, sums.data());
    for (int l = 0; l < n; ++l)
      for (int c = 0; c < 3; ++c) {
        const float d = sums[c][l], r = sums[3 + c][l], v = sums[6 + c][l];
        if (!valid[static_cast<size_t>(y) * counts.width + x + l] || !(r > 0) || !(sqr(d) > v)) continue;
        factors.pixel(x + l, y)[c] = std::clamp(1 + (1 - v / sqr(d)) * d / r, kMinFactor, kMaxFactor);
      }
  });
  return factors;
}

void multiply(const Image& factors, Image& image) {
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] *= factors.data[i];
}

/// R' with b = 1. `trust`: trust_at() of each pixel.
Image with_samples(const Image& own, const Image& before, const Image& trust) {
  Image result = own;
  parallel_for(result.data.size(), 4096,
               [&](size_t i) { result.data[i] += kMaxOfSamples * trust.data[i / 3] * (before.data[i] - own.data[i]); });
  return result;
}

Mixture mixture_of(const HistoryInput& input, const CandidateSet& whole, const std::array<CandidateSet, 2>& halves) {
  MixtureInput of_history;
  of_history.whole = &whole;
  of_history.halves = {&halves[0], &halves[1]};
  of_history.independent = input.independent;
  of_history.guide = input.guide;
  of_history.valid = input.valid;
  of_history.prior = kPriorOfHistory;
  of_history.bias_share = kShareOfHistory;
  of_history.counts = input.counts;
  return mix(of_history);
}

}  // namespace

void follow_features(History& history, const Image& albedo, const Image& normal) {
  if (history.features.data.empty()) return;
  for (const Image* image : {&albedo, &normal})
    if (image->data.size() != history.image.data.size())
      throw Error(ErrorCode::kInput, "the auxiliary features have another size than the history");
  parallel_for(history.known.size(), 1024, [&](size_t i) {
    if (!history.known[i]) return;
    const float* const before = &history.features.data[kHistoryFeatures * i];
    const float* const slopes = &history.slopes.data[3 * kHistoryFeatures * i];
    float squares = 0;
    for (size_t c = 0; c < 3; ++c) {
      float& colour = history.image.data[3 * i + c];
      float change = 0;
      for (size_t f = 0; f < kHistoryFeatures; ++f)
        change += slopes[3 * f + c] * ((f < 3 ? albedo : normal).data[3 * i + f % 3] - before[f]);
      squares += sqr(change) / 3;
      const float most = kMaxOfColour * (std::abs(colour) + kMinScale);
      change = std::isfinite(change) ? std::clamp(change, -most, most) : 0;
      colour += change;
      for (Image& half : history.samples)
        if (!half.data.empty()) half.data[3 * i + c] += change;
    }
    history.squared_error.data[i] += squares;
  });
}

Image counts_of(const History& history, const Image& guide) {
  if (history.image.width != guide.width || history.image.height != guide.height)
    throw Error(ErrorCode::kInput, "the history has another size than the frame");
  Image counts(guide.width, guide.height, 1);
  for (size_t i = 0; i < counts.data.size(); ++i) {
    std::array<float, 3> mean;
    for (size_t c = 0; c < 3; ++c) {
      const float now = guide.data[3 * i + c];
      mean[c] = history.known[i] ? 0.5f * (now + history.image.data[3 * i + c]) : now;
    }
    counts.data[i] = relative_weight(mean.data());
  }
  return counts;
}

void add_samples(const History& history, const HistoryInput& input, Image& mean, std::array<Image, 2>& halves) {
  std::array<Image, 2> samples = history.samples;
  const Image factors = light_factors(history, input, {&samples[0], &samples[1]});
  for (Image& half : samples) multiply(factors, half);
  Image before = samples[0];
  for (size_t i = 0; i < before.data.size(); ++i) before.data[i] = 0.5f * (before.data[i] + samples[1].data[i]);
  Image trust(mean.width, mean.height, 1);
  parallel_for(mean.height, 8, [&](int y) {
    for (int x = 0; x < mean.width; ++x) *trust.pixel(x, y) = trust_at(history, *input.std_error, 1, x, y);
  });
  std::array<CandidateSet, 2> sets;
  for (const int half : {0, 1}) sets[half] = {halves[half], {with_samples(halves[half], samples[half], trust)}};
  HistoryInput counted = input;
  counted.counts = {input.common_counts, input.common_counts};
  Mixture mixture = mixture_of(counted, {mean, {with_samples(mean, before, trust)}}, sets);
  mean = std::move(mixture.image);
  halves = std::move(mixture.halves);
}

Image add_history(const History& before, const HistoryInput& input, const Mixture* accumulated, Mixture& frame) {
  History history{before.image, before.squared_error, before.known, {}};
  multiply(light_factors(before, input, {&before.image, &before.image}), history.image);
  const Image limits = steady(*input.std_error, frame.image);
  CandidateSet whole{frame.image, {candidate(frame.image, history, *input.std_error, limits, 1)}};
  std::array<CandidateSet, 2> halves;
  for (const int half : {0, 1}) {
    const Image& image = frame.halves[half];
    halves[half] = {image, {candidate(image, history, *input.std_error, limits, std::sqrt(2.0f))}};
    if (accumulated)
      halves[half].candidates.push_back(
          limited(image, accumulated->halves[half], *input.std_error, limits, std::sqrt(2.0f)));
  }
  if (accumulated) whole.candidates.push_back(limited(frame.image, accumulated->image, *input.std_error, limits, 1));
  Mixture mixture = mixture_of(input, whole, halves);
  frame.image = std::move(mixture.image);
  frame.halves = std::move(mixture.halves);
  Image weights = std::move(mixture.weights[0]);
  if (accumulated)
    for (size_t i = 0; i < weights.data.size(); ++i) weights.data[i] += mixture.weights[1].data[i];
  for (Image& own : frame.weights)
    for (size_t i = 0; i < own.data.size(); ++i) own.data[i] *= 1 - weights.data[i];
  return weights;
}

}  // namespace covary
