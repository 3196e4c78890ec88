// SPDX-License-Identifier: Apache-2.0
// hair: fibres of hair and fur after [Chiang2016], for the shape `bsplinecurve`.
//
// | name                   | type           | default | meaning                                                       |
// |------------------------|----------------|---------|---------------------------------------------------------------|
// | eumelanin              | float          | 1.3     | concentration of the brown and black pigment                  |
// | pheomelanin            | float          | 0.2     | concentration of the red pigment                              |
// | sigma_a                | colour/texture |         | absorption per fibre radius, instead of the pigments          |
// | scale                  | float          | 1       | factor on sigma_a                                             |
// | int_ior                | number/string  | amber   | index of refraction of the fibre                              |
// | ext_ior                | number/string  | air     | index of refraction outside; must differ from int_ior         |
// | longitudinal_roughness | float          | 0.3     | beta_m, along the fibre                                       |
// | azimuthal_roughness    | float          | 0.3     | beta_n, around the fibre                                      |
// | scale_tilt             | float          | 2       | alpha, angle of the scales on the fibre's surface, in degrees |
//
// The fibre runs along y of the shading frame. theta is the inclination from the normal plane, phi the azimuth, h the
// offset of the camera's ray from the axis. Light that travels p segments inside the fibre leaves with
//     S_p(theta_o, theta_i, phi, h) = M_p(theta_o, theta_i) A_p(theta_o, h) N_p(phi, h),      value = sum_p S_p,
// p = 0 (R), 1 (TT), 2 (TRT), and all longer paths together, with uniform azimuth. Each is a lobe with density M_p N_p,
// chosen in proportion to the luminance of A_p. Attenuation, offset and tilt are evaluated on the camera's side, so the
// model is not reciprocal: light paths get its adjoint. Roughness is clamped to at least 0.02.
#include <array>
#include <numbers>

#include "bsdfs/fresnel.h"
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"
#include "core/trigonometry.h"

namespace covary {
namespace {

constexpr int kLast = 3;  // the lobe of all longer internal paths
using Lobes = std::array<float, kLast + 1>;

struct FibreShape {
  float eta;
  std::array<float, kLast + 1> v;  ///< variance of theta, by lobe
  float s;                         ///< scale of the logistic distribution of phi
  std::array<SinCos, 3> tilt;      ///< of alpha, 2 alpha, 4 alpha
  float colour_d, azimuthal_mass;  ///< see albedo() and azimuthal()
};

float logistic_distribution(float x, float s) { return 1 / (1 + std::exp(-x / s)); }

FibreShape make_fibre(float eta, float beta_m, float beta_n, float alpha_degrees) {
  FibreShape f{};
  f.eta = eta;
  constexpr float kMin = 0.02f;
  const double m = std::max(beta_m, kMin), n = std::max(beta_n, kMin);
  // [Chiang2016]: variance and scale as functions of perceptually uniform roughness.
  f.v[0] = static_cast<float>(sqr(0.726 * m + 0.812 * m * m + 3.7 * std::pow(m, 20)));
  f.v[1] = 0.25f * f.v[0];
  f.v[2] = f.v[3] = 4 * f.v[0];
  f.s = static_cast<float>(std::sqrt(std::numbers::pi / 8) * (0.265 * n + 1.194 * n * n + 5.372 * std::pow(n, 22)));
  for (int k = 0; k < 3; ++k) {
    const float angle = alpha_degrees * kPi / 180 * static_cast<float>(1 << k);
    f.tilt[k] = {std::sin(angle), std::cos(angle)};
  }
  f.azimuthal_mass = logistic_distribution(kPi, f.s) - logistic_distribution(-kPi, f.s);
  // [Chiang2016]: absorption = (ln colour / D(beta_n))².
  f.colour_d = static_cast<float>(5.969 - 0.215 * n + 2.532 * n * n - 10.73 * std::pow(n, 3) + 5.574 * std::pow(n, 4) +
                                  0.245 * std::pow(n, 5));
  return f;
}

/// Applies `f` to each channel of `a`.
template <typename F>
Spectrum each(const Spectrum& a, F f) {
  return {f(a.r), f(a.g), f(a.b)};
}

/// ln I0(x) of the modified Bessel function, x >= 0.
float log_bessel_i0(float x) {
  if (x > 12) return x - 0.5f * std::log(kTwoPi * x) + std::log1p((1 + 9 / (16 * x)) / (8 * x));  // asymptotic series
  float term = 1, sum = 1;
  for (int i = 1; i < 30; ++i) {
    term *= sqr(x / (2 * static_cast<float>(i)));
    sum += term;
  }
  return std::log(sum);
}

/// M_p per unit sin(theta), for all azimuths together: [EonFrancois2011].
float longitudinal(SinCos in, SinCos out, float v) {
  const float a = in.cos * out.cos / v, b = in.sin * out.sin / v, rcp = 1 / v;
  // 1 / (2 v sinh(1/v)) = exp(-1/v) / (v (1 - exp(-2/v)))
  return std::exp(log_bessel_i0(a) - b - rcp) * rcp / -std::expm1(-2 * rcp);
}

/// The fibre as seen from the camera's direction w.
class FibreView {
 public:
  FibreView(const FibreShape& fibre, const Spectrum& absorption, const Vec3& w) : fibre_(fibre) {
    theta_ = {w.y, std::max(safe_sqrt(1 - w.y * w.y), 1e-6f)};
    phi_ = std::atan2(w.z, w.x);
    const float across = std::sqrt(w.x * w.x + w.z * w.z);
    gamma_o_ = across > 0 ? std::acos(std::clamp(w.z / across, -1.0f, 1.0f)) : 0;
    if (!(w.x < 0)) gamma_o_ = -gamma_o_;
    const float h = std::sin(gamma_o_);
    // Refraction in the fibre's cross section [Marschner2003]: eta' = sqrt(eta² - sin²) / cos.
    const float sin_gamma_t = std::clamp(h * theta_.cos / safe_sqrt(sqr(fibre.eta) - sqr(theta_.sin)), -1.0f, 1.0f);
    gamma_t_ = std::asin(sin_gamma_t);
    const float cos_theta_t = safe_sqrt(1 - sqr(theta_.sin / fibre.eta));
    const float way = 2 * safe_sqrt(1 - sqr(sin_gamma_t)) / std::max(cos_theta_t, 1e-6f);
    set_attenuation(each(absorption, [way](float a) { return std::exp(-a * way); }),
                    fresnel_dielectric(theta_.cos * safe_sqrt(1 - h * h), fibre.eta).reflectance);
  }

  const Lobes& pmfs() const { return pmf_; }

  /// Densities of the lobes at w, per unit solid angle.
  Lobes densities(const Vec3& w) const {
    const SinCos out{w.y, safe_sqrt(1 - w.y * w.y)};
    const float turn = std::atan2(w.z, w.x) - phi_;
    Lobes d;
    for (int p = 0; p <= kLast; ++p)
      d[p] = longitudinal(tilted(p), out, fibre_.v[p]) * (p < kLast ? azimuthal(turn - specular_turn(p)) : kInvPi / 2);
    return d;
  }
  Spectrum value(const Vec3& w) const {
    const Lobes d = densities(w);
    Spectrum sum(0);
    for (int p = 0; p <= kLast; ++p) sum += attenuation_[p] * d[p];
    return sum;
  }
  float pdf(const Vec3& w) const {
    const Lobes d = densities(w);
    float sum = 0;
    for (int p = 0; p <= kLast; ++p) sum += pmf_[p] * d[p];
    return sum;
  }

  /// Samples a direction of lobe p: azimuth from `u_phi`, inclination from `u`.
  Vec3 sample(int p, float u_phi, Vec2 u) const {
    // [EonMarschner2013]: samples the cosine to the mirrored direction, then the position on that cone.
    const float v = fibre_.v[p];
    const float z = std::clamp(1 + v * std::log(u.x + (1 - u.x) * std::exp(-2 / v)), -1.0f, 1.0f);
    const SinCos in = tilted(p);
    const float sin_theta =
        std::clamp(-z * in.sin + safe_sqrt(1 - z * z) * sincos_turns(u.y).cos * in.cos, -1.0f, 1.0f);
    const float phi = phi_ + (p < kLast ? specular_turn(p) + sample_azimuth(u_phi) : kTwoPi * u_phi);
    const float r = safe_sqrt(1 - sin_theta * sin_theta);
    return {r * std::cos(phi), sin_theta, r * std::sin(phi)};
  }

 private:
  /// A_p from the Fresnel reflectance f and the transmittance of one segment; longer paths as a geometric series.
  void set_attenuation(const Spectrum& transmittance, float f) {
    attenuation_[0] = Spectrum(f);
    attenuation_[1] = transmittance * sqr(1 - f);
    attenuation_[2] = attenuation_[1] * transmittance * f;
    attenuation_[3] = attenuation_[2] * transmittance * f / (Spectrum(1) - transmittance * f);
    float sum = 0;
    for (int p = 0; p <= kLast; ++p) sum += pmf_[p] = luminance(attenuation_[p]);
    for (float& pmf : pmf_) pmf /= sum;
  }
  /// Inclination with the tilt of the scales: by 2 alpha, -alpha, -4 alpha.
  SinCos tilted(int p) const {
    if (p == kLast) return theta_;
    const SinCos t = fibre_.tilt[p == 0 ? 1 : p == 1 ? 0 : 2];
    const float s = p == 0 ? -t.sin : t.sin;
    return {theta_.sin * t.cos + theta_.cos * s, std::abs(theta_.cos * t.cos - theta_.sin * s)};
  }
  /// Phi(p, h), the azimuthal change of specular paths.
  float specular_turn(int p) const {
    return 2 * static_cast<float>(p) * gamma_t_ - 2 * gamma_o_ + static_cast<float>(p) * kPi;
  }
  /// N_p: a logistic distribution truncated to [-pi, pi].
  float azimuthal(float turn) const {
    const float x = std::abs(std::remainder(turn, kTwoPi)), e = std::exp(-x / fibre_.s);
    return e / (fibre_.s * sqr(1 + e) * fibre_.azimuthal_mass);
  }
  float sample_azimuth(float u) const {
    const float x = u * fibre_.azimuthal_mass + logistic_distribution(-kPi, fibre_.s);
    return std::clamp(-fibre_.s * std::log(1 / x - 1), -kPi, kPi);
  }

  const FibreShape& fibre_;
  SinCos theta_;
  float phi_, gamma_o_, gamma_t_;
  std::array<Spectrum, kLast + 1> attenuation_;
  Lobes pmf_;
};

class HairClosure final : public BsdfClosure {
 public:
  HairClosure(const FibreShape& fibre, const Spectrum& absorption, TransportMode mode)
      : fibre_(fibre), absorption_(absorption), mode_(mode) {}

  uint32_t flags() const override { return kGlossyReflection | kGlossyTransmission; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    const FibreView view(fibre_, absorption_, wo);
    const float pdf = view.pdf(wi);
    if (mode_ == TransportMode::kRadiance) return {view.value(wi), pdf};
    if (wo.z == 0) return {Spectrum(0), pdf};
    return {FibreView(fibre_, absorption_, wi).value(wo) * std::abs(wi.z / wo.z), pdf};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    const FibreView view(fibre_, absorption_, wo);
    BsdfSample s;
    int p = 0;
    float before = 0;
    while (p < kLast && u_lobe >= before + view.pmfs()[p]) before += view.pmfs()[p++];
    const float u_phi = std::clamp((u_lobe - before) / view.pmfs()[p], 0.0f, kOneMinusEpsilon);
    s.wi = view.sample(p, u_phi, u);
    const BsdfValue v = eval(wo, s.wi);
    if (!(v.pdf_solid_angle > 0)) return s;
    s.pdf = v.pdf_solid_angle;
    s.weight = v.value / s.pdf;
    s.flags = s.wi.z * wo.z > 0 ? kGlossyReflection : kGlossyTransmission;
    s.lobe = static_cast<uint32_t>(p);
    return s;
  }
  int n_lobes() const override { return kLast + 1; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    std::ranges::copy(FibreView(fibre_, absorption_, wo).pmfs(), pmfs);
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    std::ranges::copy(FibreView(fibre_, absorption_, wo).densities(wi), pdfs);
  }

 private:
  const FibreShape& fibre_;
  Spectrum absorption_;
  TransportMode mode_;
};

class Hair final : public Bsdf {
 public:
  Hair(const FibreShape& fibre, ColourInput absorption, float scale)
      : fibre_(fibre), absorption_(std::move(absorption)), scale_(scale) {}

  uint32_t flags() const override { return kGlossyReflection | kGlossyTransmission; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode mode, Arena& arena) const override {
    return arena.make<HairClosure>(fibre_, absorption(hit), mode);
  }
  bool needs_derivatives() const override { return true; }
  const Texture* main_texture() const override { return absorption_.texture(); }
  /// Multiple-scattering albedo of hair: [Chiang2016], inverted.
  Spectrum albedo(const SurfaceHit& hit) const override {
    return each(absorption(hit), [this](float a) { return std::exp(-std::sqrt(a) * fibre_.colour_d); });
  }

 private:
  Spectrum absorption(const SurfaceHit& hit) const {
    return each(absorption_.eval(hit), [this](float a) { return std::max(a * scale_, 0.0f); });
  }

  FibreShape fibre_;
  ColourInput absorption_;
  float scale_;
};

}  // namespace

std::shared_ptr<Bsdf> make_hair(Parameters& parameters) {
  const bool pigments = parameters.has("eumelanin") || parameters.has("pheomelanin");
  if (pigments && parameters.has("sigma_a")) parameters.error("has pigments and 'sigma_a'; expected one of them");
  // [EonFrancois2011] absorption per unit of concentration.
  const Spectrum eumelanin = Spectrum(0.419f, 0.697f, 1.37f) * parameters.get_float("eumelanin", 1.3f, 0);
  const Spectrum pheomelanin = Spectrum(0.187f, 0.4f, 1.05f) * parameters.get_float("pheomelanin", 0.2f, 0);
  TexturePtr absorption = parameters.find_texture("sigma_a", SpectrumRole::kIndex);
  const float scale = parameters.get_float("scale", 1, 0);
  const bool given = absorption != nullptr;
  if (!given) absorption = std::make_shared<ConstantTexture>(eumelanin + pheomelanin);
  const float eta = get_relative_ior(parameters, "amber");
  if (eta == 1) parameters.error("'int_ior' and 'ext_ior' are equal; they must differ");
  const float beta_m = parameters.get_float("longitudinal_roughness", 0.3f, 0, 1);
  const float beta_n = parameters.get_float("azimuthal_roughness", 0.3f, 0, 1);
  const float tilt = parameters.get_float("scale_tilt", 2, -45, 45);
  return std::make_shared<Hair>(make_fibre(eta, beta_m, beta_n, tilt), ColourInput(absorption), given ? scale : 1);
}

}  // namespace covary
