// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/rough_transmittance.h"

#include <map>
#include <mutex>
#include <tuple>
#include <vector>

#include "bsdfs/fresnel.h"

namespace covary {
namespace {

/// Nodes in (0, 1) and weights (sum 1) of Gauss-Legendre quadrature.
struct GaussLegendre {
  std::vector<double> x, weight;
  explicit GaussLegendre(int n) : x(n), weight(n) {
    for (int i = 0; i < n; ++i) {
      // Newton's method for the roots of the Legendre polynomial P_n, starting from the classical asymptotic estimate.
      double z = std::cos(M_PI * (i + 0.75) / (n + 0.5)), derivative = 1;
      for (int step = 0; step < 8; ++step) {
        double p = 1, previous = 0;
        for (int k = 1; k <= n; ++k) {
          const double next = ((2 * k - 1) * z * p - (k - 1) * previous) / k;
          previous = p, p = next;
        }
        derivative = n * (z * p - previous) / (z * z - 1);
        z -= p / derivative;
      }
      x[i] = 0.5 * (1 + z);
      weight[i] = 1 / ((1 - z * z) * derivative * derivative);
    }
  }
};

}  // namespace

RoughTransmittance::RoughTransmittance(const Microfacet& normals, float eta) {
  // Keeps the error of the mean reflectance, which has a kink at total internal reflection, below 1e-4.
  const GaussLegendre rule(normals.type() == MicrofacetType::kGgx ? 48 : 32);
  double internal = 0;
  for (int i = 0; i < kSize; ++i) {
    const float mu = std::max(1e-6f, static_cast<float>(i) / (kSize - 1));
    const Vec3 w{std::sqrt(1 - mu * mu), 0, mu};
    // Fraction of the power from w that single scattering transmits (from outside) or reflects (from inside): the
    // mean over visible normals of (1 - F) G1(w') or F G1(w').
    double transmitted = 0, reflected = 0;
    for (size_t j = 0; j < rule.x.size(); ++j)
      for (size_t k = 0; k < rule.x.size(); ++k) {
        const Vec3 m = normals.sample(w, {static_cast<float>(rule.x[j]), static_cast<float>(rule.x[k])}).m;
        const float wm = dot(w, m);
        const double weight = rule.weight[j] * rule.weight[k];
        const DielectricFresnel f = fresnel_dielectric(wm, eta);
        const Vec3 t = refract(w, m, f.cos_theta_t, f.eta_ti), r = reflect(w, m);
        if (t.z < 0) transmitted += weight * (1 - f.reflectance) * normals.smith_g1(t, m);
        if (r.z > 0) reflected += weight * fresnel_dielectric(wm, 1 / eta).reflectance * normals.smith_g1(r, m);
      }
    external_[i] = static_cast<float>(transmitted);
    internal += reflected * mu;
  }
  // The plain mean over the entries is 1 to 2 % below the integral, but it is what Mitsuba does and scenes are tuned
  // for.
  internal_reflectance_ = static_cast<float>(2 * internal / kSize);
}

std::shared_ptr<const RoughTransmittance> shared_transmittance(const Microfacet& normals, float eta) {
  static std::mutex mutex;
  static std::map<std::tuple<MicrofacetType, float, float>, std::weak_ptr<const RoughTransmittance>> known;
  const std::lock_guard lock(mutex);
  std::weak_ptr<const RoughTransmittance>& place = known[{normals.type(), normals.alpha_u(), eta}];
  std::shared_ptr<const RoughTransmittance> table = place.lock();
  if (!table) place = table = std::make_shared<const RoughTransmittance>(normals, eta);
  return table;
}

}  // namespace covary
