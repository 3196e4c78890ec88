// SPDX-License-Identifier: Apache-2.0
// roughplastic: a diffuse base under a rough dielectric coating, on the side of the normal; black from the other side.
//
// | name                 | type           | default       | meaning                                                |
// |----------------------|----------------|---------------|--------------------------------------------------------|
// | diffuse_reflectance  | colour/texture | 0.5           | reflectance of the base                                |
// | nonlinear            | bool           | false         | colour shift by multiple scattering inside the coating |
// | int_ior              | number/string  | polypropylene | index of refraction of the coating                     |
// | ext_ior              | number/string  | air           | index of refraction outside; must differ from int_ior  |
// | specular_reflectance | colour/texture | 1             | factor on the coating's reflection                     |
// | distribution         | string         | beckmann      | distribution of microfacet normals: beckmann or ggx    |
// | alpha, alpha_u, alpha_v, sample_visible |  |            | see roughness.h                                        |
//
// Like plastic.cpp, with the transmittance T of the rough interface in place of 1 - F:
//     f_diffuse = T(wi) T(wo) rho / (pi eta^2 (1 - rho Ri)).
// T(cos) is tabulated at construction by quadrature over the visible normals; Ri is the mean internal reflectance, by
// the same quadrature. Models with the same interface share a table. Where alpha varies, or differs along u and v, T is
// that of the nearest of 16 isotropic ones.
#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <tuple>
#include <vector>

#include "bsdfs/coated.h"
#include "bsdfs/fresnel.h"
#include "bsdfs/registry.h"

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

/// Directional transmittance of a rough dielectric interface from outside, and its mean reflectance from inside.
class RoughTransmittance {
 public:
  RoughTransmittance(const Microfacet& normals, float eta) {
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
  /// `cos_theta` in [0, 1].
  float operator()(float cos_theta) const {
    const float x = cos_theta * (kSize - 1);
    const int i = std::min(static_cast<int>(x), kSize - 2);
    return lerp(x - static_cast<float>(i), external_[i], external_[i + 1]);
  }
  float internal_reflectance() const { return internal_reflectance_; }

 private:
  static constexpr int kSize = 64;

  std::array<float, kSize> external_;
  float internal_reflectance_;
};

/// The table of an interface, shared while any user is alive. Thread-safe.
std::shared_ptr<const RoughTransmittance> shared_transmittance(const Microfacet& normals, float eta) {
  static std::mutex mutex;
  static std::map<std::tuple<MicrofacetType, float, float>, std::weak_ptr<const RoughTransmittance>> known;
  const std::lock_guard lock(mutex);
  std::weak_ptr<const RoughTransmittance>& place = known[{normals.type(), normals.alpha_u(), eta}];
  std::shared_ptr<const RoughTransmittance> table = place.lock();
  if (!table) place = table = std::make_shared<const RoughTransmittance>(normals, eta);
  return table;
}

class RoughPlasticClosure final : public CoatedClosure<RoughPlasticClosure> {
 public:
  /// `base`: rho / (pi eta^2 (1 - rho Ri)).
  RoughPlasticClosure(const RoughSurface& surface, const RoughTransmittance& transmittance, float eta,
                      float specular_weight, const Spectrum& base, const Spectrum& specular)
      : CoatedClosure(surface),
        transmittance_(transmittance),
        eta_(eta),
        specular_weight_(specular_weight),
        base_(base),
        specular_(specular) {}

  /// From the coating's directional reflectance and the mean colours.
  float specular_pmf(float cos_o) const { return specular_pmf_of(transmittance_(cos_o)); }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (!(wo.z > 0 && wi.z > 0)) return {};
    const Vec3 m = normalize(wo + wi);
    const Microfacet& normals = surface_.normals;
    const float om = dot(wo, m), t_o = transmittance_(wo.z), pmf = specular_pmf_of(t_o);
    const float d_g1 = normals.eval(m) * normals.smith_g1(wo, m) / (4 * wo.z);
    const float coating = fresnel_dielectric(om, eta_).reflectance * d_g1 * normals.smith_g1(wi, m);
    const float pdf = surface_.sample_visible ? d_g1 : surface_.pdf(wo, m) / (4 * om);
    return {specular_ * coating + base_ * (wi.z * t_o * transmittance_(wi.z)),
            pmf * pdf + (1 - pmf) * warp::cosine_hemisphere_pdf_solid_angle(wi.z)};
  }

 private:
  float specular_pmf_of(float t_o) const {
    const float specular = (1 - t_o) * specular_weight_, diffuse = t_o * (1 - specular_weight_);
    return specular + diffuse > 0 ? specular / (specular + diffuse) : 1;
  }

  const RoughTransmittance& transmittance_;
  float eta_, specular_weight_;
  Spectrum base_, specular_;
};

class RoughPlastic final : public CoatedBsdf {
 public:
  RoughPlastic(RoughnessInput roughness, Parameters& p)
      : CoatedBsdf(p),
        roughness_(std::move(roughness)),
        varies_(!roughness_.alpha_u.is_constant() || !roughness_.alpha_v.is_constant()),
        surface_(varies_ ? RoughSurface{Microfacet(roughness_.type, 0.1f, 0.1f), true} : roughness_.eval({})),
        eta_(get_relative_ior(p, "polypropylene")),
        nonlinear_(p.get_bool("nonlinear", false)) {
    check_index(eta_, p);
    if (eta_ == 1) return;
    if (!varies_ && !roughness_.anisotropic) {
      tables_ = {shared_transmittance(surface_.normals, eta_)};
      return;
    }
    for (int i = 0; i < kTables; ++i) {
      const float alpha = (static_cast<float>(i) + 0.5f) / kTables;
      tables_.push_back(shared_transmittance(Microfacet(surface_.normals.type(), alpha, alpha), eta_));
    }
  }

  uint32_t flags() const override { return kGlossyReflection | kDiffuseReflection; }
  bool needs_derivatives() const override { return roughness_.anisotropic; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    const RoughSurface surface = varies_ ? roughness_.eval(hit) : surface_;
    const RoughTransmittance& transmittance = table(surface.normals);
    const Spectrum rho = diffuse_.eval(hit);
    const float internal = transmittance.internal_reflectance();
    const Spectrum trapped = nonlinear_ ? rho * internal : Spectrum(internal);
    const Spectrum base = rho * kInvPi / ((Spectrum(1) - trapped) * sqr(eta_));
    return arena.make<RoughPlasticClosure>(surface, transmittance, eta_, specular_weight_, base, specular_.eval(hit));
  }

 private:
  static constexpr int kTables = 16;

  const RoughTransmittance& table(const Microfacet& normals) const {
    if (tables_.size() == 1) return *tables_[0];
    const float alpha = std::sqrt(normals.alpha_u() * normals.alpha_v());
    return *tables_[static_cast<size_t>(std::clamp(static_cast<int>(alpha * kTables), 0, kTables - 1))];
  }

  RoughnessInput roughness_;
  bool varies_;
  RoughSurface surface_;  // unless it varies
  std::vector<std::shared_ptr<const RoughTransmittance>> tables_;
  float eta_;
  bool nonlinear_;
};

}  // namespace

std::shared_ptr<Bsdf> make_roughplastic(Parameters& parameters) {
  return std::make_shared<RoughPlastic>(get_roughness(parameters), parameters);
}

}  // namespace covary
