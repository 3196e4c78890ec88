// SPDX-License-Identifier: Apache-2.0
#include "denoising/history.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/vec.h"

namespace covary {
namespace {

constexpr float kInterval = 1.5f;  // k, in standard errors
/// c: both interpolations have errors in common, which their difference does not tell. With 1, regions of moving edges
/// of light had 1.28 times the error of frames alone, with 10 and more at most 1.01, in a prototype on one sequence
/// with one seed (docs/methods/sequences.md).
constexpr float kOfMoving = 20;
/// How much the weights of the whole image count (MixtureInput::prior).
constexpr float kPrior = 1;
/// MixtureInput::bias_share. Halves have twice the variance of the frame and the same history, so that history counts
/// right for the whole where its error, which for the halves is all bias, counts twice.
constexpr float kShare = 2;

/// C of a frame's image or of that of a half, whose error is `scale` times as large.
Image candidate(const Image& frame, const History& history, const Image& std_error, float scale) {
  Image result = frame;
  parallel_for(frame.height, 8, [&](int y) {
    for (int x = 0; x < frame.width; ++x) {
      if (!history.known[static_cast<size_t>(y) * frame.width + x]) continue;
      const float* s = std_error.pixel(x, y);
      const float variance = sqr(scale) * (sqr(s[0]) + sqr(s[1]) + sqr(s[2])) / 3;
      if (!(variance > 0)) continue;
      const float trust = variance / (variance + kOfMoving * *history.squared_error.pixel(x, y));
      for (int c = 0; c < 3; ++c) {
        const float m = frame.pixel(x, y)[c], most = kInterval * scale * s[c];
        result.pixel(x, y)[c] = m + std::clamp(history.image.pixel(x, y)[c] - m, -most, most) * trust;
      }
    }
  });
  return result;
}

}  // namespace

Image add_history(const History& history, const HistoryInput& input, Mixture& frame) {
  const int width = frame.image.width, height = frame.image.height;
  if (history.image.width != width || history.image.height != height)
    throw Error(ErrorCode::kInput, "the history has another size than the frame");
  const CandidateSet whole{frame.image, {candidate(frame.image, history, *input.std_error, 1)}};
  std::array<CandidateSet, 2> halves;
  for (const int half : {0, 1}) {
    const Image& image = frame.halves[half];
    halves[half] = {image, {candidate(image, history, *input.std_error, std::sqrt(2.0f))}};
  }
  MixtureInput of_history;
  of_history.whole = &whole;
  of_history.halves = {&halves[0], &halves[1]};
  of_history.independent = input.independent;
  of_history.guide = input.guide;
  of_history.valid = input.valid;
  of_history.prior = kPrior;
  of_history.bias_share = kShare;
  of_history.counts = input.counts;
  Mixture mixture = mix(of_history);
  frame.image = std::move(mixture.image);
  frame.halves = std::move(mixture.halves);
  Image weights = std::move(mixture.weights[0]);
  for (Image& own : frame.weights)
    for (size_t i = 0; i < own.data.size(); ++i) own.data[i] *= 1 - weights.data[i];
  return weights;
}

}  // namespace covary
