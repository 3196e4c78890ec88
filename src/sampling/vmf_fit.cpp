// SPDX-License-Identifier: Apache-2.0
#include "sampling/vmf_fit.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <utility>

#include "core/warp.h"

namespace covary {
namespace {

constexpr int kMax = VmfLobes::kMax;
constexpr size_t kBlock = 256;  // samples summed in single precision

/// Sums over the samples, each weighted by the lobe's responsibility γ. Directions are relative to the lobe's mean: all
/// terms are small if the lobe is narrow.
struct alignas(32) BlockSums {
  float weight[kMax] = {}, dx[kMax] = {}, dy[kMax] = {}, dz[kMax] = {}, squared[kMax] = {}, inverse[kMax] = {};
};
struct LobeSums {
  double weight = 0, dx = 0, dy = 0, dz = 0, squared = 0, inverse = 0;
};

void add_block(const BlockSums& block, int n, std::array<LobeSums, kMax>& sums) {
  for (int k = 0; k < n; ++k) {
    LobeSums& s = sums[k];
    s.weight += block.weight[k], s.inverse += block.inverse[k], s.squared += block.squared[k];
    s.dx += block.dx[k], s.dy += block.dy[k], s.dz += block.dz[k];
  }
}

/// The lobe most likely to have produced a direction for which all densities underflow.
int nearest_lobe(const VmfLobes& lobes, const Vec3& w) {
  int nearest = 0;
  float best = -kInfinity;
  for (int k = 0; k < lobes.n; ++k) {
    const float exponent = -0.5f * lobes.kappa[k] * length_squared(w - lobes.lobe(k).mean);
    if (lobes.weight[k] > 0 && exponent > best) best = exponent, nearest = k;
  }
  return nearest;
}

/// Writes the responsibilities of the lobes for `w`, which sum to 1; returns the density of the mixture.
float responsibilities(const VmfLobes& lobes, const Vec3& w, float* gamma) {
  const float density = lobes.pdfs(w, gamma);
  if (density > 1e-30f) {
    const float scale = 1 / density;
    for (int k = 0; k < lobes.padded(); ++k) gamma[k] *= scale;
    return density;
  }
  for (int k = 0; k < lobes.padded(); ++k) gamma[k] = 0;
  gamma[nearest_lobe(lobes, w)] = 1;
  return 1e-30f;
}

/// log v(mean) of a lobe; double precision.
double log_peak(double kappa) { return kappa - vmf::log_integral_of_exponential(kappa); }

/// The lobe with the mean direction and mean cosine of two lobes together.
Vmf merged(const Vmf& a, double weight_a, const Vmf& b, double weight_b) {
  const double ra = weight_a * (1 - vmf::one_minus_mean_cosine(a.kappa));
  const double rb = weight_b * (1 - vmf::one_minus_mean_cosine(b.kappa));
  const Vec3 sum = a.mean * static_cast<float>(ra) + b.mean * static_cast<float>(rb);
  const float l = length(sum);
  if (!(l > 0)) return {a.mean, 0};
  // (W − |R|) / W, from W − Ra − Rb and Ra + Rb − |R| = Ra Rb |a − b|² / (Ra + Rb + |R|), without cancellation.
  const double missing = weight_a * vmf::one_minus_mean_cosine(a.kappa) +
                         weight_b * vmf::one_minus_mean_cosine(b.kappa) +
                         ra * rb * length_squared(a.mean - b.mean) / (ra + rb + l);
  return {sum * (1 / l), static_cast<float>(vmf::kappa_of(missing / (weight_a + weight_b)))};
}

/// ∫ a b / c over the sphere.
double integral_of_ratio(const Vmf& a, const Vmf& b, const Vmf& c) {
  const auto natural = [](const Vmf& lobe) -> Eigen::Vector3d {
    return lobe.kappa * Eigen::Vector3d(lobe.mean.x, lobe.mean.y, lobe.mean.z).normalized();
  };
  const Eigen::Vector3d k = natural(a) + natural(b) - natural(c);
  return std::exp(log_peak(a.kappa) - a.kappa + log_peak(b.kappa) - b.kappa - log_peak(c.kappa) + c.kappa +
                  vmf::log_integral_of_exponential(k.norm()));
}

/// χ² divergence of two lobes from the lobe that would replace them, ∫ (wa a + wb b)² / (w c) − w, w = wa + wb.
double merge_cost(const VmfLobes& lobes, int i, int j) {
  const double wa = lobes.weight[i], wb = lobes.weight[j], w = wa + wb;
  if (!(wa > 0 && wb > 0)) return 0;
  const Vmf a = lobes.lobe(i), b = lobes.lobe(j), c = merged(a, wa, b, wb);
  if (c.kappa <= 0) return std::numeric_limits<double>::infinity();
  return (wa * wa * integral_of_ratio(a, a, c) + 2 * wa * wb * integral_of_ratio(a, b, c) +
          wb * wb * integral_of_ratio(b, b, c)) /
             w -
         w;
}

}  // namespace

VmfMixture uniform_lobes(int n_lobes, float kappa, const Vec3& pivot) {
  VmfMixture mixture;
  mixture.pivot = pivot;
  mixture.lobes.n = n_lobes;
  constexpr float kGolden = 0.61803398875f;
  for (int k = 0; k < n_lobes; ++k) {
    const float at = (static_cast<float>(k) + 0.5f) / static_cast<float>(n_lobes);
    const float turns = static_cast<float>(k) * kGolden;
    mixture.lobes.set(k, 1 / static_cast<float>(n_lobes),
                      {warp::square_to_sphere({turns - std::floor(turns), at}), kappa});
  }
  mixture.lobes.pad();
  return mixture;
}

VmfFit::VmfFit(std::span<const GuidingSample> samples, const Vec3& pivot, const VmfFitSettings& settings)
    : settings_(settings), pivot_(pivot), n_samples_(static_cast<double>(samples.size())) {
  double sum = 0, sum_squares = 0;
  for (const GuidingSample& s : samples) {
    if (!(s.weight > 0)) continue;
    // The light's origin is position + direction / inverse_distance.
    const Vec3 to_light = s.direction + (s.position - pivot) * s.inverse_distance;
    const float distance = length(to_light);  // relative to the sample's distance
    const bool usable = distance > 1e-3f;
    directions_.push_back(usable ? to_light * (1 / distance) : s.direction);
    inverse_distances_.push_back(usable ? s.inverse_distance / distance : s.inverse_distance);
    weights_.push_back(s.weight), pdfs_.push_back(s.pdf);
    sum += s.weight, sum_squares += static_cast<double>(s.weight) * s.weight;
  }
  if (directions_.empty()) return;
  scaled_sum_ = std::min(sum * (sum / sum_squares), static_cast<double>(weights_.size()));
  for (float& weight : weights_) weight = static_cast<float>(weight * (scaled_sum_ / sum));
}

double VmfFit::penalty(const VmfLobes& lobes) const {
  double sum = 0;
  for (int k = 0; k < lobes.n; ++k)
    sum += settings_.weight_prior * std::log(std::max(lobes.weight[k], 1e-30f)) +
           settings_.mean_cosine_prior * (log_peak(lobes.kappa[k]) - lobes.kappa[k]);
  return sum;
}

double VmfFit::step(VmfMixture& mixture) const {
  VmfLobes& lobes = mixture.lobes;
  const int end = lobes.padded();
  std::array<LobeSums, kMax> sums;
  double likelihood = penalty(lobes);
  for (size_t first = 0; first < directions_.size(); first += kBlock) {
    BlockSums block;
    for (size_t i = first; i < std::min(first + kBlock, directions_.size()); ++i) {
      const Vec3 w = directions_[i];
      const float weight = weights_[i], inverse = inverse_distances_[i];
      alignas(32) float gamma[kMax];
      likelihood += weight * std::log(static_cast<double>(responsibilities(lobes, w, gamma)));
      for (int k = 0; k < end; ++k) {
        const float g = weight * gamma[k];
        const float dx = w.x - lobes.x[k], dy = w.y - lobes.y[k], dz = w.z - lobes.z[k];
        block.weight[k] += g, block.inverse[k] += g * inverse;
        block.dx[k] += g * dx, block.dy[k] += g * dy, block.dz[k] += g * dz;
        block.squared[k] += g * (dx * dx + dy * dy + dz * dz);
      }
    }
    add_block(block, lobes.n, sums);
  }

  const double total = scaled_sum_ + lobes.n * settings_.weight_prior;
  for (int k = 0; k < lobes.n; ++k) {
    const LobeSums& s = sums[k];
    const double weight = (s.weight + settings_.weight_prior) / total;
    Vmf lobe = lobes.lobe(k);
    if (s.weight > 0) {
      const Vec3 offset = Vec3{static_cast<float>(s.dx / s.weight), static_cast<float>(s.dy / s.weight),
                               static_cast<float>(s.dz / s.weight)};
      const Vec3 mean = lobe.mean + offset;
      const double squared = s.squared / s.weight, length = covary::length(mean);
      // 1 − |R|² / W² = mean of |w − μ|² − |mean of w − μ|², for unit vectors.
      const double missing = std::max(squared - length_squared(offset), 0.0) / (1 + length);
      if (length > 1e-6) lobe.mean = normalize(mean);
      const double b = settings_.mean_cosine_prior;
      lobe.kappa = static_cast<float>(vmf::kappa_of((s.weight * missing + b) / (s.weight + b)));
      mixture.inverse_distance[k] = static_cast<float>(s.inverse / s.weight);
    }
    lobes.set(k, static_cast<float>(weight), lobe);
  }
  return likelihood / scaled_sum_;
}

int VmfFit::converge(VmfMixture& mixture) const {
  double before = -std::numeric_limits<double>::infinity();
  for (int i = 1; i <= settings_.max_steps; ++i) {
    const double now = step(mixture);
    if (now - before < settings_.tolerance) return i;
    before = now;
  }
  return settings_.max_steps;
}

int VmfFit::merge(VmfMixture& mixture) const {
  VmfLobes& lobes = mixture.lobes;
  int n_merged = 0;
  std::array<std::array<double, kMax>, kMax> cost;
  for (int i = 0; i < lobes.n; ++i)
    for (int j = 0; j < i; ++j) cost[i][j] = merge_cost(lobes, i, j);
  while (lobes.n > 1) {
    int a = 1, b = 0;
    for (int i = 0; i < lobes.n; ++i)
      for (int j = 0; j < i; ++j)
        if (cost[i][j] < cost[a][b]) a = i, b = j;
    if (!(cost[a][b] < settings_.merge_below)) break;
    const float wa = lobes.weight[a], wb = lobes.weight[b], w = wa + wb;
    mixture.inverse_distance[b] = w > 0 ? (wa * mixture.inverse_distance[a] + wb * mixture.inverse_distance[b]) / w : 0;
    lobes.set(b, w, merged(lobes.lobe(a), wa, lobes.lobe(b), wb));
    const int last = --lobes.n;
    lobes.set(a, lobes.weight[last], lobes.lobe(last));
    mixture.inverse_distance[a] = mixture.inverse_distance[last];
    for (int k = 0; k < lobes.n; ++k) {
      if (k != b) cost[std::max(k, b)][std::min(k, b)] = merge_cost(lobes, std::max(k, b), std::min(k, b));
      if (k != a && a < lobes.n)
        cost[std::max(k, a)][std::min(k, a)] = merge_cost(lobes, std::max(k, a), std::min(k, a));
    }
    lobes.set(last, 0, Vmf());
    ++n_merged;
  }
  lobes.pad();
  return n_merged;
}

int VmfFit::split(VmfMixture& mixture) const {
  VmfLobes& lobes = mixture.lobes;
  // χ² of lobe k: ∫ γ_k (t − V)² / V of target t and mixture V = Σ_i γ w² p / V · n / (Σ w)² − weight.
  std::array<double, kMax> chi2 = {};
  std::array<Eigen::Matrix3d, kMax> spread;
  spread.fill(Eigen::Matrix3d::Zero());
  std::array<double, kMax> weights = {};
  for (size_t i = 0; i < directions_.size(); ++i) {
    alignas(32) float gamma[kMax];
    const float density = responsibilities(lobes, directions_[i], gamma);
    const double squared = static_cast<double>(weights_[i]) * weights_[i] * pdfs_[i] / density;
    for (int k = 0; k < lobes.n; ++k) {
      if (gamma[k] < 1e-4f) continue;
      chi2[k] += gamma[k] * squared;
      const Vec3 d = directions_[i] - lobes.lobe(k).mean;
      const Eigen::Vector3d offset(d.x, d.y, d.z);
      spread[k] += gamma[k] * weights_[i] * offset * offset.transpose();
      weights[k] += gamma[k] * weights_[i];
    }
  }
  for (int k = 0; k < lobes.n; ++k) chi2[k] = chi2[k] * n_samples_ / (scaled_sum_ * scaled_sum_) - lobes.weight[k];

  int n_split = 0;
  for (const int n = lobes.n; lobes.n < settings_.max_lobes && n_split < n;) {
    const int k = static_cast<int>(std::max_element(chi2.begin(), chi2.begin() + n) - chi2.begin());
    if (!(chi2[k] > settings_.split_above && weights[k] > 0)) break;
    chi2[k] = 0;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread[k] / weights[k]);
    const Eigen::Vector3d axis = axes.eigenvectors().col(2) * std::sqrt(std::max(axes.eigenvalues()[2], 1e-12)) * 0.7;
    const Vec3 offset = {static_cast<float>(axis.x()), static_cast<float>(axis.y()), static_cast<float>(axis.z())};
    const Vmf lobe = lobes.lobe(k);
    const float kappa = std::min(1.5f * lobe.kappa, kMaxKappa), half = 0.5f * lobes.weight[k];
    lobes.set(k, half, {normalize(lobe.mean + offset), kappa});
    lobes.set(lobes.n, half, {normalize(lobe.mean - offset), kappa});
    mixture.inverse_distance[lobes.n++] = mixture.inverse_distance[k];
    ++n_split;
  }
  lobes.pad();
  return n_split;
}

VmfMixture VmfFit::fit(VmfMixture start) const {
  if (!has_light()) {
    start.lobes.n = 0, start.pivot = pivot_;
    return start;
  }
  if (start.lobes.n == 0) start = uniform_lobes(settings_.n_lobes, settings_.initial_kappa, pivot_);
  converge(start);
  for (int round = 0; round < settings_.max_rounds; ++round) {
    const int n_merged = merge(start), n_split = split(start);
    if (n_merged + n_split == 0) break;
    converge(start);
  }
  return start;
}

}  // namespace covary
