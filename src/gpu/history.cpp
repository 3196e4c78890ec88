// SPDX-License-Identifier: Apache-2.0
#include "gpu/history.h"

#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "core/error.h"
#include "denoising/mixture.h"
#include "gpu/launch.h"

namespace covary::gpu {
namespace {

constexpr int kPlanesOfCells = 12;  // of light_cells in kernels/history.cl

}  // namespace

FrameHistory::FrameHistory(Device& device, const History& history, const Image& std_error, const FrameBuffers& frame)
    : device_(device), frame_(frame), pixels_(static_cast<size_t>(frame.width) * frame.height) {
  if (history.image.width != frame.width || history.image.height != frame.height)
    throw Error(ErrorCode::kInput, "the history has another size than the frame");
  image_ = device_.upload(std::span(history.image.data));
  squared_error_ = device_.upload(std::span(history.squared_error.data));
  known_ = device_.upload(std::span(history.known));
  std_error_ = device_.upload(std::span(std_error.data));
  for (const size_t half : {0, 1})
    if (!history.samples[half].data.empty()) samples_[half] = device_.upload(std::span(history.samples[half].data));
  common_counts_ = device_.make<float>(pixels_);
  device_.launch(kernel("history_weights"), list_of(pixels_), kOfList, image_, known_, *frame_.guide,
                 static_cast<int>(pixels_), common_counts_);
}

device::Kernel FrameHistory::kernel(const char* name) const {
  return device_.kernel("history.cl", name, with_bug({}, frame_.planted_bug == name));
}

/// Per channel, by which images of the history follow the frame's light.
Buffer<float> FrameHistory::factors(const Buffer<float>& past_a, const Buffer<float>& past_b) const {
  const int columns = cells_in(frame_.width), rows = cells_in(frame_.height);
  const auto cells = device_.make<float>(static_cast<size_t>(columns) * rows * kPlanesOfCells);
  device_.launch(kernel("light_cells"), image_of(columns, rows), kOfImage, *frame_.guide, common_counts_, *frame_.valid,
                 known_, *frame_.independent[0], *frame_.independent[1], past_a, past_b, frame_.width, frame_.height,
                 cells);
  auto result = device_.make<float>(3 * pixels_);
  device_.launch(kernel("light_factors"), image_of(frame_.width, frame_.height), kOfImage, cells, *frame_.guide,
                 *frame_.valid, known_, frame_.width, frame_.height, result);
  return result;
}

Buffer<float> FrameHistory::multiplied(const Buffer<float>& factors, const Buffer<float>& image) const {
  auto result = device_.make<float>(3 * pixels_);
  device_.launch(kernel("multiply"), list_of(3 * pixels_), kOfList, factors, image, static_cast<int>(3 * pixels_),
                 result);
  return result;
}

MixedBuffers FrameHistory::mixture_of(int candidates, const CandidateBuffers& whole,
                                      const std::array<CandidateBuffers, 2>& halves,
                                      const std::array<const Buffer<float>*, 2>& counts) const {
  MixtureBuffers in;
  in.width = frame_.width, in.height = frame_.height, in.candidates = candidates;
  in.whole = whole, in.halves = halves;
  in.independent = frame_.independent, in.counts = counts, in.guide = frame_.guide, in.valid = frame_.valid;
  in.bias_share = kShareOfHistory, in.prior = kPriorOfHistory;
  in.of_pair = !frame_.counts[0] && counts[0] != &common_counts_;
  std::vector<NormalRow> all;
  for (const auto& [first, end] : sampled_rows(frame_.width, frame_.height)) {
    const std::vector<NormalRow> rows = normal_rows(device_, in, first, end);
    all.insert(all.end(), rows.begin(), rows.end());
  }
  MixtureInput prior;
  prior.prior = in.prior;
  return mix(device_, in, weights_everywhere(prior, candidates, all));
}

std::array<Buffer<float>, 2> FrameHistory::add_samples(const Buffer<float>& mean,
                                                       const std::array<const Buffer<float>*, 2>& halves) const {
  const Buffer<float> light = factors(samples_[0], samples_[1]);
  const std::array<Buffer<float>, 2> past = {multiplied(light, samples_[0]), multiplied(light, samples_[1])};
  const auto with_samples = [&](const Buffer<float>& own, const Buffer<float>& a, const Buffer<float>& b) {
    auto result = device_.make<float>(3 * pixels_);
    device_.launch(kernel("with_samples"), list_of(pixels_), kOfList, own, a, b, known_, squared_error_, std_error_,
                   static_cast<int>(pixels_), result);
    return result;
  };
  const Buffer<float> of_all = with_samples(mean, past[0], past[1]);
  const std::array<Buffer<float>, 2> of_halves = {with_samples(*halves[0], past[0], past[0]),
                                                  with_samples(*halves[1], past[1], past[1])};
  MixedBuffers mixed = mixture_of(1, {&mean, &of_all}, {{{halves[0], &of_halves[0]}, {halves[1], &of_halves[1]}}},
                                  {&common_counts_, &common_counts_});
  return std::move(mixed.halves);
}

/// C, and behind it D, of the frame's mixture or of a half's.
Buffer<float> FrameHistory::candidates(const Buffer<float>& image, const Buffer<float>& history,
                                       const Buffer<float>& limits, const Buffer<float>* accumulated,
                                       float scale) const {
  auto result = device_.make<float>(3 * pixels_ * (accumulated ? 2 : 1));
  const int n = static_cast<int>(pixels_);
  device_.launch(kernel("history_candidate"), list_of(pixels_), kOfList, image, history, known_, squared_error_,
                 std_error_, limits, scale, n, 0, result);
  if (accumulated)
    device_.launch(kernel("limited_candidate"), list_of(3 * pixels_), kOfList, image, *accumulated, std_error_, limits,
                   scale, 3 * n, 3 * n, result);
  return result;
}

void FrameHistory::add_history(const MixedBuffers* accumulated, int candidates_of_frame, MixedBuffers& frame) const {
  const Buffer<float> history = multiplied(factors(image_, image_), image_);
  const auto limits = device_.make<float>(3 * pixels_);
  device_.launch(kernel("steady_error"), image_of(frame_.width, frame_.height), kOfImage, std_error_, frame.image,
                 frame_.width, frame_.height, limits);
  const int n = accumulated ? 2 : 1;
  const Buffer<float> whole = candidates(frame.image, history, limits, accumulated ? &accumulated->image : nullptr, 1);
  std::array<Buffer<float>, 2> halves, of_pair;
  std::array<const Buffer<float>*, 2> counts = frame_.counts;
  const Buffer<float> no_error = device_.upload(std::span<const float>(std::vector<float>(3 * pixels_)));
  for (const size_t half : {0, 1}) {
    halves[half] = candidates(frame.halves[half], history, limits, accumulated ? &accumulated->halves[half] : nullptr,
                              std::sqrt(2.0f));
    if (counts[half]) continue;
    of_pair[half] = error_weights(device_, frame.halves[half], no_error);
    counts[half] = &of_pair[half];
  }
  MixedBuffers mixed =
      mixture_of(n, {&frame.image, &whole}, {{{&frame.halves[0], &halves[0]}, {&frame.halves[1], &halves[1]}}}, counts);
  device_.launch(kernel("scale_weights"), list_of(pixels_), kOfList, mixed.weights, n, static_cast<int>(pixels_),
                 candidates_of_frame, frame.weights);
  frame.image = std::move(mixed.image);
  frame.halves = std::move(mixed.halves);
}

}  // namespace covary::gpu
