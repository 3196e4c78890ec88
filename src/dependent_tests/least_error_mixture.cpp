// SPDX-License-Identifier: Apache-2.0
#include "dependent_tests/least_error_mixture.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "filters/mixture_weights.h"

namespace covary {
namespace {

using namespace lanes;

constexpr int kBrightnessWindow = 7;  // side of the window over which brightness is averaged for the weights
constexpr float kOffset = 0.01f;      // added to squared brightness, as in relMSE
constexpr int kBlock = 32;            // rows processed together

/// 1 / (brightness^2 + 0.01) of each pixel, 0 for pixels left out.
Planes error_weights(const FilterInput& input, std::vector<unsigned char> used, const Planes* brightest) {
  Planes brightness(input.width(), input.height(), 1, 0, 0);
  parallel_for(input.height(), 8, [&](int y) {
    for (int x = 0; x < input.width(); ++x) {
      if (input.count.row(0, y)[x] <= 0) used[static_cast<size_t>(y) * input.width() + x] = 0;
      for (int c = 0; c < 3; ++c) brightness.row(0, y)[x] += input.independent.row(c, y)[x] / 3;
    }
  });
  Planes weights = box_mean(brightness, used, kBrightnessWindow, 0, 0);
  parallel_for(input.height(), 8, [&](int y) {
    for (int x = 0; x < input.width(); ++x) {
      float& weight = weights.row(0, y)[x];
      if (brightest) weight = std::min(weight, brightest->row(0, y)[x]);
      weight = used[static_cast<size_t>(y) * input.width() + x] ? 1 / (weight * weight + kOffset) : 0.0f;
    }
  });
  return weights;
}

/// Computes the n_normal_sums() sums, and the weights from them.
class Mixer {
 public:
  Mixer(const FilterInput& input, const Planes& noise, const Planes& weights,
        std::span<const MixtureCandidate> candidates, int window)
      : input_(input),
        noise_(noise),
        weights_(weights),
        candidates_(candidates),
        radius_(window / 2),
        n_(static_cast<int>(candidates.size())),
        n_sums_(n_normal_sums(n_)) {}

  void mix_rows(int first, int last, Image& result) const {
    const int top = std::max(0, first - radius_), bottom = std::min(input_.height(), last + radius_);
    Planes terms(input_.width(), bottom - top, n_sums_, radius_, 0);
    for (int y = top; y < bottom; ++y)
      for (int x = 0; x < input_.width(); ++x) set_terms(x, y, terms, y - top);
    Planes columns(input_.width(), 1, n_sums_, radius_, 0);
    for (int y = first; y < last; ++y) {
      for (int i = 0; i < n_sums_; ++i)
        add_columns(terms, i, std::max(top, y - radius_) - top, std::min(bottom, y + radius_ + 1) - top, columns);
      mix_row(y, columns, result);
    }
  }

 private:
  void set_terms(int x, int y, Planes& terms, int row) const {
    const float weight = weights_.row(0, y)[x];
    if (weight == 0) return;
    float difference[kMixtureCandidates][3];
    for (int j = 0; j < n_; ++j)
      for (int c = 0; c < 3; ++c)
        difference[j][c] = candidates_[j].colour->pixel(x, y)[c] - input_.independent.row(c, y)[x];
    int i = 0;
    for (int j = 0; j < n_; ++j)
      for (int k = j; k < n_; ++k) {
        float product = 0;
        for (int c = 0; c < 3; ++c) product += difference[j][c] * difference[k][c];
        terms.row(i++, row)[x] = weight * product;
      }
    for (int j = 0; j < n_; ++j) {
      const float own = candidates_[j].own_weight ? candidates_[j].own_weight->pixel(x, y)[0] : 0.0f;
      terms.row(i++, row)[x] = weight * noise_.row(0, y)[x] * (1 - own);
    }
  }

  /// Column sums over rows first … last - 1, borders included.
  void add_columns(const Planes& terms, int i, int first, int last, Planes& columns) const {
    for (int x = 0; x < input_.width(); x += kLanes) {
      vfloat sum{};
      for (int y = first; y < last; ++y) sum += load(terms.row(i, y) + x);
      store(columns.row(i, 0) + x, sum);
    }
    std::fill_n(columns.row(i, 0) + input_.width(), radius_, 0.0f);
  }

  void mix_row(int y, const Planes& columns, Image& result) const {
    std::array<vfloat, n_normal_sums(kMixtureCandidates)> sums;
    std::array<vfloat, kMixtureCandidates + 1> weights;
    for (int x = 0; x < input_.width(); x += kLanes) {
      for (int i = 0; i < n_sums_; ++i) {
        sums[i] = vfloat{};
        for (int dx = -radius_; dx <= radius_; ++dx) sums[i] += load(columns.row(i, 0) + x + dx);
      }
      solve_mixture(n_, sums.data(), nullptr, 0, weights.data());
      for (int l = 0; l < std::min(kLanes, input_.width() - x); ++l) write(x + l, y, weights.data(), l, result);
    }
  }

  void write(int x, int y, const vfloat* weights, int lane, Image& result) const {
    float* out = result.pixel(x, y);
    for (int c = 0; c < 3; ++c) {
      const float own = input_.independent.row(c, y)[x];
      out[c] = own;
      for (int j = 0; weights_.row(0, y)[x] > 0 && j < n_; ++j)
        out[c] += weights[j][lane] * (candidates_[j].colour->pixel(x, y)[c] - own);
    }
  }

  const FilterInput& input_;
  const Planes &noise_, &weights_;
  std::span<const MixtureCandidate> candidates_;
  int radius_, n_, n_sums_;
};

}  // namespace

Image least_error_mixture(const FilterInput& input, const Planes& noise, const std::vector<unsigned char>& valid,
                          std::span<const MixtureCandidate> candidates, int window, const Planes* brightest) {
  COVARY_CHECK(!candidates.empty() && candidates.size() <= kMixtureCandidates, "one to three candidates");
  Image result(input.width(), input.height(), 3);
  const Planes weights = error_weights(input, valid, brightest);
  const Mixer mixer(input, noise, weights, candidates, window);
  parallel_for((input.height() + kBlock - 1) / kBlock, 1, [&](int block) {
    mixer.mix_rows(block * kBlock, std::min(input.height(), (block + 1) * kBlock), result);
  });
  return result;
}

int least_error_mixture_halo(int window) { return window / 2 + kBrightnessWindow / 2; }

}  // namespace covary
