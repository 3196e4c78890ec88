// SPDX-License-Identifier: Apache-2.0
#include "sampling/vmf_mixture.h"

namespace covary {
namespace {

/// Concentration of the lobe whose mean cosine is that of the density cos θ / π: coth κ − 1/κ = 2/3.
constexpr float kCosineKappa = 2.9515f;
const float kCosinePeak = vmf::peak(kCosineKappa);

}  // namespace

void VmfLobes::set(int k, float new_weight, const Vmf& lobe) {
  weight[k] = new_weight, kappa[k] = lobe.kappa, peak[k] = vmf::peak(lobe.kappa);
  x[k] = lobe.mean.x, y[k] = lobe.mean.y, z[k] = lobe.mean.z;
}

void VmfLobes::pad() {
  for (int k = n; k < padded(); ++k) set(k, 0, Vmf());
}

float VmfLobes::pdf(const Vec3& w) const {
  alignas(32) float parts[kMax];
  return pdfs(w, parts);
}

float VmfLobes::pdfs(const Vec3& w, float* parts) const {
  const int end = padded();
  for (int k = 0; k < end; ++k) {
    const float dx = w.x - x[k], dy = w.y - y[k], dz = w.z - z[k];
    parts[k] = weight[k] * peak[k] * vmf::exp_nonpositive(-0.5f * kappa[k] * (dx * dx + dy * dy + dz * dz));
  }
  float sum = 0;
  for (int k = 0; k < n; ++k) sum += parts[k];
  return sum;
}

int VmfLobes::choose(float u) const {
  int chosen = 0;
  float sum = 0;
  for (int k = 0; k < n; ++k) {
    if (weight[k] > 0 && u >= sum) chosen = k;  // the last one with weight, if rounding leaves a remainder
    sum += weight[k];
  }
  return chosen;
}

void VmfLobes::multiply_by_cosine(const Vec3& normal) {
  const int end = padded();
  // N(κ) e^{κ μ·w − κ} N(c) e^{c n·w − c} = [N(κ) N(c) / N(κ') e^{κ' − κ − c}] N(κ') e^{κ' μ'·w − κ'}
  // with κ' μ' = κ μ + c n.
  for (int k = 0; k < end; ++k) {
    const float kx = kappa[k] * x[k] + kCosineKappa * normal.x, ky = kappa[k] * y[k] + kCosineKappa * normal.y,
                kz = kappa[k] * z[k] + kCosineKappa * normal.z;
    const float length = std::sqrt(kx * kx + ky * ky + kz * kz), scale = 1 / std::max(length, 1e-6f);
    const float dx = x[k] - normal.x, dy = y[k] - normal.y, dz = z[k] - normal.z;
    // κ' − κ − c without cancellation: κ'² − (κ + c)² = −κ c |μ − n|².
    const float exponent =
        -kappa[k] * kCosineKappa * (dx * dx + dy * dy + dz * dz) / (length + kappa[k] + kCosineKappa);
    const float product_peak = vmf::peak(length);
    weight[k] = weight[k] * peak[k] * kCosinePeak / product_peak * vmf::exp_nonpositive(exponent);
    kappa[k] = length, peak[k] = product_peak;
    x[k] = kx * scale, y[k] = ky * scale, z[k] = kz * scale;
  }
  float sum = 0;
  for (int k = 0; k < n; ++k) sum += weight[k];
  for (int k = 0; k < end; ++k) weight[k] *= 1 / sum;
}

void VmfMixture::see_from(const Vec3& p, VmfLobes& written) const {
  VmfLobes& __restrict seen = written;  // __restrict is needed for vectorisation
  const Vec3 d = pivot - p;
  const int end = lobes.padded();
  seen.n = lobes.n;
  for (int k = 0; k < end; ++k) {
    const float dx = lobes.x[k] + d.x * inverse_distance[k], dy = lobes.y[k] + d.y * inverse_distance[k],
                dz = lobes.z[k] + d.z * inverse_distance[k];
    const float squared = dx * dx + dy * dy + dz * dz;
    const float scale = 1 / std::sqrt(std::max(squared, 1e-12f));
    const bool far = squared > 1e-8f;  // at the light itself, any direction would do
    seen.x[k] = far ? dx * scale : lobes.x[k];
    seen.y[k] = far ? dy * scale : lobes.y[k];
    seen.z[k] = far ? dz * scale : lobes.z[k];
    seen.weight[k] = lobes.weight[k], seen.kappa[k] = lobes.kappa[k], seen.peak[k] = lobes.peak[k];
  }
}

VmfLobes VmfMixture::at(const Vec3& p) const {
  VmfLobes seen;
  see_from(p, seen);
  return seen;
}

VmfMixture VmfMixture::moved_to(const Vec3& new_pivot) const {
  VmfMixture moved;
  moved.lobes = at(new_pivot);
  moved.pivot = new_pivot;
  for (int k = 0; k < lobes.n; ++k) {
    const Vec3 to_light = Vec3{lobes.x[k], lobes.y[k], lobes.z[k]} + (pivot - new_pivot) * inverse_distance[k];
    moved.inverse_distance[k] = inverse_distance[k] / std::max(length(to_light), 1e-4f);
  }
  return moved;
}

}  // namespace covary
