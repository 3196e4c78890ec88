// SPDX-License-Identifier: Apache-2.0
#include "denoising/mixture.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "filters/filter_input.h"
#include "filters/guided_cells.h"
#include "filters/mixture_weights.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

using namespace lanes;

/// Sums of normal equations, a pixel per lane; the last is v, the variance of the halves' U_p, summed over p.
using Sums = std::array<vfloat, n_normal_sums(kMaxCandidates)>;

/// Adds the normal equations of one pixel to `sums`, in 1 / (squared radiance).
void add_pixel(const MixtureInput& in, int m, int x, int y, float* sums) {
  std::array<std::array<float, 3>, kMaxCandidates> u[2];
  std::array<float, 3> residual[2], base[2];
  float weight[2];
  for (int half : {0, 1}) {
    const CandidateSet& set = *in.halves[half];
    const float* f = set.base.pixel(x, y);
    weight[half] = in.counts[half] ? *in.counts[half]->pixel(x, y) : relative_weight(f);
    for (int c = 0; c < 3; ++c) {
      base[half][c] = f[c];
      residual[half][c] = in.independent[1 - half]->mean.row(c, y)[x] - f[c];
      for (int p = 0; p < m; ++p) u[half][p][c] = set.candidates[p].pixel(x, y)[c] - f[c];
    }
  }
  // The halves' squared error minus (1 - 1 / bias_share) variance, that is, squared bias + variance / bias_share.
  const float variance = 0.25f * (weight[0] + weight[1]);
  // For a mean, a firefly has a small weight in its own half and a large one in the other, which would overrate the
  // noise. So the smaller weight counts.
  const float certain = in.counts[0] ? 0.5f * std::min(weight[0], weight[1]) : variance;
  const float removed = (1 - 1 / in.bias_share) * certain;
  int plane = 0;
  for (int p = 0; p < m; ++p)
    for (int q = p; q < m; ++q, ++plane)
      for (int c = 0; c < 3; ++c) {
        for (int half : {0, 1}) sums[plane] += 0.5f * weight[half] * u[half][p][c] * u[half][q][c];
        sums[plane] -= removed * (u[0][p][c] - u[1][p][c]) * (u[0][q][c] - u[1][q][c]);
      }
  for (int p = 0; p < m; ++p, ++plane)
    for (int c = 0; c < 3; ++c) {
      for (int half : {0, 1}) sums[plane] += 0.5f * weight[half] * u[half][p][c] * residual[half][c];
      sums[plane] += removed * (u[0][p][c] - u[1][p][c]) * (base[0][c] - base[1][c]);
    }
  for (int p = 0; p < m; ++p)
    for (int c = 0; c < 3; ++c) sums[plane] += variance * sqr(u[0][p][c] - u[1][p][c]);
}

/// base + sum_p x_p (candidate_p - base) at valid pixels, otherwise base.
Image mixed(const CandidateSet& set, const std::vector<Image>& weights, const std::vector<unsigned char>& valid) {
  Image result = set.base;
  parallel_for(result.height, 8, [&](int y) {
    for (int x = 0; x < result.width; ++x) {
      if (!valid[static_cast<size_t>(y) * result.width + x]) continue;
      const float* base = set.base.pixel(x, y);
      for (int c = 0; c < 3; ++c) {
        float sum = base[c];
        for (size_t p = 0; p < weights.size(); ++p)
          sum += weights[p].pixel(x, y)[0] * (set.candidates[p].pixel(x, y)[c] - base[c]);
        result.pixel(x, y)[c] = sum;
      }
    }
  });
  return result;
}

int n_candidates(const MixtureInput& in) { return static_cast<int>(in.halves[0]->candidates.size()); }

}  // namespace

std::vector<SampledRows> sampled_rows(int width, int height) {
  if (static_cast<double>(width) * height <= kMaxSampledPixels) return {{0, height}};
  const double all = kMaxSampledPixels / width;
  const int n_blocks = all < kSampledBlocks * kMinBlockRows ? 2 : kSampledBlocks;
  const double rows = std::max(1.0, std::round(all / n_blocks));
  std::vector<SampledRows> blocks;
  for (int i = 0; i < n_blocks; ++i) {
    const int first = static_cast<int>((i + 0.5) * height / n_blocks - rows / 2);
    blocks.push_back({std::max(0, first), std::min(height, first + static_cast<int>(rows))});
  }
  return blocks;
}

std::vector<NormalRow> normal_rows(const MixtureInput& in, int first, int end) {
  std::vector<NormalRow> rows(static_cast<size_t>(end - first));
  const int width = in.halves[0]->base.width, m = n_candidates(in);
  parallel_for(end - first, 8, [&](int i) {
    const int y = first + i;
    for (int x = 0; x < width; ++x)
      if ((*in.valid)[static_cast<size_t>(y) * width + x]) add_pixel(in, m, x, y, rows[static_cast<size_t>(i)].data());
  });
  return rows;
}

std::vector<float> weights_everywhere(const MixtureInput& in, int m, const std::vector<NormalRow>& rows) {
  Sums sums{};
  for (int i = 0; i < n_normal_sums(m); ++i) {
    double sum = 0;
    for (const NormalRow& row : rows) sum += row[static_cast<size_t>(i)];
    sums[i] = splat(static_cast<float>(sum));
  }
  std::array<vfloat, kMaxCandidates + 1> x;
  std::vector<float> typical(kMaxCandidates), weights(kMaxCandidates);
  std::copy(in.typical.begin(), in.typical.end(), typical.begin());
  solve_mixture(m, sums.data(), typical.data(), in.typical_count, x.data());
  for (int p = 0; p < m; ++p) weights[p] = x[p][0];
  return weights;
}

Image disagreement(const CandidateSet& set, const Image& guide, const Image& image,
                   const std::vector<unsigned char>& valid) {
  constexpr int kWindow = 5;
  constexpr double kMin = 1.0 / 30;
  const int width = image.width, height = image.height;
  const size_t m = set.n_made();
  std::vector<Planes> means;
  for (size_t p = 0; p < m; ++p) {
    const Image& candidate = set.candidates[p];
    Planes of_pixels(width, height, 1, 0, 0);
    parallel_for(height, 8, [&](int y) {
      for (int x = 0; x < width; ++x) {
        float sum = 0;
        for (int c = 0; c < 3; ++c) sum += sqr(candidate.pixel(x, y)[c] - image.pixel(x, y)[c]);
        of_pixels.row(0, y)[x] = sum / 3 * relative_weight(guide.pixel(x, y));
      }
    });
    means.push_back(box_mean(of_pixels, valid, kWindow, 0, 0));
  }
  Image result(width, height, 1);
  parallel_for(height, 8, [&](int y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0, product = 1;
      for (const Planes& mean : means) sum += mean.row(0, y)[x];
      const double least = kMin * sum / static_cast<double>(m);
      for (const Planes& mean : means) product *= std::max<double>(mean.row(0, y)[x], least);
      *result.pixel(x, y) = static_cast<float>(std::pow(product, 1.0 / static_cast<double>(m)));
    }
  });
  return result;
}

Mixture mix(const MixtureInput& input) {
  const int m = static_cast<int>(input.whole->candidates.size());
  const int width = input.guide->width, height = input.guide->height;
  COVARY_CHECK(m >= 1 && m <= kMaxCandidates, "between one and kMaxCandidates candidates");
  COVARY_CHECK(input.typical_count == 0 || std::ssize(input.typical) == m, "a typical weight for each candidate");
  const GuidedCells cells(*input.guide, *input.valid, n_normal_sums(m),
                          [&](int x, int y, float* sums) { add_pixel(input, m, x, y, sums); });
  Mixture mixture;
  mixture.weights.assign(m, Image(width, height, 1));
  std::vector<float> everywhere = input.everywhere;
  if (everywhere.empty() && input.prior > 0) {
    std::vector<NormalRow> rows;
    for (const auto& [first, end] : sampled_rows(width, height)) {
      const std::vector<NormalRow> block = normal_rows(input, first, end);
      rows.insert(rows.end(), block.begin(), block.end());
    }
    everywhere = weights_everywhere(input, m, rows);
  }
  everywhere.resize(kMaxCandidates);
  for_each_batch(width, height, [&](int x, int y, int n) {
    Sums sums;
    cells.sum(x, y, sums.data());
    std::array<vfloat, kMaxCandidates + 1> weights;
    solve_mixture(m, sums.data(), everywhere.data(), input.prior, weights.data());
    for (int p = 0; p < m; ++p)
      for (int l = 0; l < n; ++l) mixture.weights[p].pixel(x + l, y)[0] = weights[p][l];
  });
  mixture.image = mixed(*input.whole, mixture.weights, *input.valid);
  for (int half : {0, 1}) mixture.halves[half] = mixed(*input.halves[half], mixture.weights, *input.valid);
  return mixture;
}

}  // namespace covary
