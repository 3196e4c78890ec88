// SPDX-License-Identifier: Apache-2.0
#include "denoising/history.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/vec.h"

namespace covary {
namespace {

constexpr float kInterval = 3;   // k, in standard errors
constexpr int kErrorWindow = 5;  // side, pixels
/// c: both interpolations have errors in common, which their difference does not tell. With 1, regions of moving edges
/// of light had 1.28 times the error of frames alone, with 10 and more at most 1.01, in a prototype on one sequence
/// with one seed (docs/methods/sequences.md).
constexpr float kOfMoving = 20;
/// How much the weights of the whole image count (MixtureInput::prior).
constexpr float kPrior = 1;
/// MixtureInput::bias_share. Halves have twice the variance of the frame and the same history, so that history counts
/// right for the whole where its error, which for the halves is all bias, counts twice.
constexpr float kShare = 2;

/// How far what was moved by parts of a pixel is to be trusted, beside a frame's image with an error `scale` times as
/// large as that of the whole.
float trust_at(const History& history, const Image& std_error, float scale, int x, int y) {
  if (!history.known[static_cast<size_t>(y) * history.image.width + x]) return 0;
  const float* s = std_error.pixel(x, y);
  const float variance = sqr(scale) * (sqr(s[0]) + sqr(s[1]) + sqr(s[2])) / 3;
  return variance > 0 ? variance / (variance + kOfMoving * *history.squared_error.pixel(x, y)) : 0;
}

/// Medians of the standard error over windows. That of a pixel alone is small where its samples happen to be dark and
/// large where they are bright, so that history, limited by it, would darken frames: by 1.2 % of a still room with 8
/// samples. Means would let what glints widen the intervals of all around it.
Image steady(const Image& std_error) {
  Image result = std_error;
  const int radius = kErrorWindow / 2;
  parallel_for(result.height, 8, [&](int y) {
    std::vector<float> window;
    for (int x = 0; x < result.width; ++x)
      for (int c = 0; c < result.channels; ++c) {
        window.clear();
        for (int j = std::max(y - radius, 0); j <= std::min(y + radius, result.height - 1); ++j)
          for (int i = std::max(x - radius, 0); i <= std::min(x + radius, result.width - 1); ++i)
            window.push_back(std_error.pixel(i, j)[c]);
        const auto middle = window.begin() + static_cast<std::ptrdiff_t>(window.size() / 2);
        std::nth_element(window.begin(), middle, window.end());
        result.pixel(x, y)[c] = *middle;
      }
  });
  return result;
}

/// C of a frame's image or of that of a half, whose error is `scale` times as large. `limits`: steady(std_error).
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

/// Most of R that R' is made of, so that new samples always count.
constexpr float kMostOfSamples = 0.9f;

/// Y with the most of R.
Image with_samples(const Image& own, const Image& before, const Image& trust) {
  Image result = own;
  parallel_for(result.data.size(), 4096, [&](size_t i) {
    result.data[i] += kMostOfSamples * trust.data[i / 3] * (before.data[i] - own.data[i]);
  });
  return result;
}

Mixture mixture_of(const HistoryInput& input, const CandidateSet& whole, const std::array<CandidateSet, 2>& halves) {
  MixtureInput of_history;
  of_history.whole = &whole;
  of_history.halves = {&halves[0], &halves[1]};
  of_history.independent = input.independent;
  of_history.guide = input.guide;
  of_history.valid = input.valid;
  of_history.prior = kPrior;
  of_history.bias_share = kShare;
  of_history.counts = input.counts;
  return mix(of_history);
}

void check_size(const Image& before, const Image& now) {
  if (before.width != now.width || before.height != now.height)
    throw Error(ErrorCode::kInput, "the history has another size than the frame");
}

}  // namespace

void add_samples(const History& history, const HistoryInput& input, Image& mean, std::array<Image, 2>& halves) {
  std::array<CandidateSet, 2> sets;
  Image before = history.samples[0];
  check_size(before, mean);
  for (size_t i = 0; i < before.data.size(); ++i) before.data[i] = 0.5f * (before.data[i] + history.samples[1].data[i]);
  Image trust(mean.width, mean.height, 1);
  parallel_for(mean.height, 8, [&](int y) {
    for (int x = 0; x < mean.width; ++x) *trust.pixel(x, y) = trust_at(history, *input.std_error, 1, x, y);
  });
  for (const int half : {0, 1}) sets[half] = {halves[half], {with_samples(halves[half], history.samples[half], trust)}};
  Mixture mixture = mixture_of(input, {mean, {with_samples(mean, before, trust)}}, sets);
  mean = std::move(mixture.image);
  halves = std::move(mixture.halves);
}

Image add_history(const History& history, const HistoryInput& input, const Mixture* accumulated, Mixture& frame) {
  check_size(history.image, frame.image);
  const Image limits = steady(*input.std_error);
  CandidateSet whole{frame.image, {candidate(frame.image, history, *input.std_error, limits, 1)}};
  std::array<CandidateSet, 2> halves;
  for (const int half : {0, 1}) {
    const Image& image = frame.halves[half];
    halves[half] = {image, {candidate(image, history, *input.std_error, limits, std::sqrt(2.0f))}};
    if (accumulated) halves[half].candidates.push_back(accumulated->halves[half]);
  }
  if (accumulated) whole.candidates.push_back(accumulated->image);
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
