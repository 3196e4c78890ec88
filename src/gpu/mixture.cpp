// SPDX-License-Identifier: Apache-2.0
#include "gpu/mixture.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "gpu/launch.h"

namespace covary::gpu {
namespace {

constexpr int kPartOfRow = 64;  // pixels whose normal equations an item adds

device::Kernel kernel(Device& device, const char* name, int candidates, bool planted_bug = false) {
  return device.kernel("mixture.cl", name, with_bug({fmt::format("M={}", candidates)}, planted_bug));
}

}  // namespace

Buffer<float> mixture_of(Device& device, const MixtureBuffers& in, const CandidateBuffers& set,
                         const Buffer<float>& weights) {
  auto result = device.make<float>(set.base->size());
  const int pixels = in.width * in.height;
  device.launch(kernel(device, "mix_candidates", in.candidates), list_of(static_cast<size_t>(pixels)), kOfList,
                *set.base, *set.candidates, weights, *in.valid, pixels, result);
  return result;
}

Buffer<float> error_weights(Device& device, const Buffer<float>& guide, const Buffer<float>& std_error) {
  const size_t pixels = std_error.size() / 3;
  auto result = device.make<float>(pixels);
  device.launch(kernel(device, "error_weights", 1), list_of(pixels), kOfList, guide, std_error,
                static_cast<int>(pixels), result);
  return result;
}

std::vector<NormalRow> normal_rows(Device& device, const MixtureBuffers& in, int first, int end) {
  const int n_sums = n_normal_sums(in.candidates), n_parts = (in.width + kPartOfRow - 1) / kPartOfRow;
  const int n = end - first;
  const auto parts = device.make<float>(static_cast<size_t>(n) * n_parts * n_sums);
  device.launch(kernel(device, "normal_parts", in.candidates, in.planted_bug), image_of(n_parts, n), kOfImage,
                *in.halves[0].base, *in.halves[1].base, *in.halves[0].candidates, *in.halves[1].candidates,
                *in.independent[0], *in.independent[1], *in.counts[0], *in.counts[1], *in.valid, in.bias_share,
                int{in.of_pair}, in.width, in.height, first, n, kPartOfRow, parts);
  const std::vector<float> sums = device.download(parts);
  std::vector<NormalRow> rows(static_cast<size_t>(n));
  const float* next = sums.data();
  for (NormalRow& row : rows)
    for (int part = 0; part < n_parts; ++part, next += n_sums)
      for (int k = 0; k < n_sums; ++k) row[static_cast<size_t>(k)] += next[k];
  return rows;
}

MixedBuffers mix(Device& device, const MixtureBuffers& in, const std::vector<float>& everywhere) {
  COVARY_CHECK(in.candidates >= 1 && in.candidates <= kMaxCandidates, "between one and kMaxCandidates candidates");
  const int columns = cells_in(in.width), rows = cells_in(in.height), m = in.candidates;
  const Buffer<float>& guide = in.guide ? *in.guide : *in.whole.candidates;
  const auto cells = device.make<float>(static_cast<size_t>(columns) * rows * (3 + n_normal_sums(m)));
  device.launch(kernel(device, "normal_cells", m, in.planted_bug), image_of(columns, rows), kOfImage, guide,
                *in.halves[0].base, *in.halves[1].base, *in.halves[0].candidates, *in.halves[1].candidates,
                *in.independent[0], *in.independent[1], *in.counts[0], *in.counts[1], *in.valid, in.bias_share,
                int{in.of_pair}, in.width, in.height, cells);
  std::vector<float> prior = everywhere;
  prior.resize(static_cast<size_t>(m));
  const Buffer<float> of_whole = device.upload(std::span(std::as_const(prior)));
  MixedBuffers result;
  result.weights = device.make<float>(static_cast<size_t>(m) * in.width * in.height);
  device.launch(kernel(device, "mixture_weights", m), image_of(in.width, in.height), kOfImage, cells, guide, of_whole,
                in.prior, in.width, in.height, result.weights);
  result.image = mixture_of(device, in, in.whole, result.weights);
  for (const int half : {0, 1}) result.halves[half] = mixture_of(device, in, in.halves[half], result.weights);
  return result;
}

Buffer<float> disagreement(Device& device, const MixtureBuffers& in, const Buffer<float>& mixture) {
  auto result = device.make<float>(static_cast<size_t>(in.width) * in.height);
  device.launch(kernel(device, "disagreement", in.candidates), image_of(in.width, in.height), kOfImage,
                *in.whole.candidates, *in.whole.candidates, mixture, *in.valid, in.width, in.height, result);
  return result;
}

void limit_by_network(Device& device, int width, int height, int n_candidates, const Buffer<float>& estimate,
                      const Buffer<float>& std_error, const Buffer<float>& candidates) {
  device.launch(kernel(device, "limit_by_network", n_candidates), image_of(width, height), kOfImage, estimate,
                std_error, width, height, candidates);
}

}  // namespace covary::gpu
