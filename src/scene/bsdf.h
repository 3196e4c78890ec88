// SPDX-License-Identifier: Apache-2.0
// Reflectance models (BSDFs). A Bsdf is what a scene file describes. Bound to a surface point, it gives a BsdfClosure:
// all textures looked up, wrappers (two-sided, mask, bump map) resolved, ready to be evaluated and sampled many times.
//
// Conventions. All directions are unit vectors in the local shading frame (z = shading normal) and point away from the
// surface: `wo` towards where the path came from (the camera, for paths from the camera), `wi` towards where it
// continues. Values always include the cosine: eval = f(wo, wi) |cos theta_i|.
//
// Densities are available per technique: a closure is a mixture of n_lobes() lobes; lobe l is chosen with probability
// pmf_l(wo) and has density pdf_l(wi | wo) per unit solid angle; the density of sample() is sum_l pmf_l pdf_l. Control
// variates are built from exactly these.
#pragma once

#include <cstdint>
#include <memory>

#include "core/arena.h"
#include "scene/object.h"
#include "scene/surface_hit.h"
#include "scene/texture.h"

namespace covary {

/// Kinds of lobes; a closure's flags are the union over its lobes.
enum LobeFlags : uint32_t {
  kDiffuseReflection = 1,
  kDiffuseTransmission = 2,
  kGlossyReflection = 4,
  kGlossyTransmission = 8,
  kDeltaReflection = 16,
  kDeltaTransmission = 32,
  kNullTransmission = 64,  ///< straight through, as if the surface were absent
  kReflection = kDiffuseReflection | kGlossyReflection | kDeltaReflection,
  kTransmission = kDiffuseTransmission | kGlossyTransmission | kDeltaTransmission | kNullTransmission,
  kDelta = kDeltaReflection | kDeltaTransmission | kNullTransmission,
  kSmooth = kDiffuseReflection | kDiffuseTransmission | kGlossyReflection | kGlossyTransmission,
};

/// The quantity the path transports: radiance (traced from the camera) or importance (traced from a light). Refraction
/// scales radiance by the squared ratio of indices, but not importance. Values for importance are the adjoint of those
/// for radiance, f*(wo, wi) = f(wi, wo), so that paths from both ends estimate the same image.
enum class TransportMode : uint8_t { kRadiance, kImportance };

/// Factor on eval() and on the weights of sample() when the shading normal `ns` differs from the geometric normal `ng`:
/// 1 for radiance. For importance it corrects that eval() has the cosine of wi, towards the camera, where the path from
/// the camera has that of wo, towards the light, both with `ns` [Veach1997] §5.3. All are unit vectors in one frame; 0
/// if a direction lies in one of the two planes. Perturbed normals (bump and normal maps) are part of the closure: `ns`
/// is the frame's normal.
inline float shading_normal_factor(const Vec3& wo, const Vec3& wi, const Vec3& ns, const Vec3& ng, TransportMode mode) {
  if (mode == TransportMode::kRadiance) return 1;
  const float denominator = std::abs(dot(ng, wo) * dot(ns, wi));
  return denominator > 0 ? std::abs(dot(ns, wo) * dot(ng, wi)) / denominator : 0;
}

struct BsdfValue {
  Spectrum value;             ///< f(wo, wi) |cos theta_i|; zero for delta lobes
  float pdf_solid_angle = 0;  ///< density of sample() at wi, delta lobes excluded
};

struct BsdfSample {
  Vec3 wi;
  Spectrum weight;     ///< f |cos theta_i| / pdf; zero when sampling failed
  float pdf = 0;       ///< per unit solid angle; for a delta lobe, the discrete probability of the direction
  float eta = 1;       ///< relative index crossed: eta on the side of wi over that on the side of wo; 1 for reflection
  uint32_t flags = 0;  ///< the LobeFlags of the chosen lobe
  uint32_t lobe = 0;   ///< its index
  bool valid() const { return pdf > 0; }
  bool is_delta() const { return (flags & kDelta) != 0; }
};

/// Null transmission: the fraction of light passing a surface as if it were absent, and the probability with which
/// BsdfClosure::sample() lets a path pass.
struct NullPassage {
  Spectrum transmittance{0};
  float pmf = 0;
};

/// Maximum number of lobes of any closure, nested models included.
inline constexpr int kMaxLobes = 8;

/// A reflectance model at one surface point. Lives in an Arena; trivially destructible.
class BsdfClosure {
 public:
  /// Union of the flags of the lobes.
  virtual uint32_t flags() const = 0;
  /// Value and mixture density of the smooth lobes; {0, 0} if both are zero.
  virtual BsdfValue eval(const Vec3& wo, const Vec3& wi) const = 0;
  /// Samples wi. `u_lobe` and `u` are independent and uniform in [0,1) and [0,1)^2. Includes delta lobes.
  virtual BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const = 0;

  virtual int n_lobes() const = 0;
  /// Writes n_lobes() selection probabilities. They sum to 1, or to less if sample() fails with the remaining
  /// probability (a nested model that is black from this side).
  virtual void lobe_pmfs(const Vec3& wo, float* pmfs) const = 0;
  /// Writes n_lobes() densities per unit solid angle of wi; 0 for delta lobes.
  virtual void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const = 0;

  /// The sum of the null lobes for a path that arrives from wo.
  virtual NullPassage null_passage(const Vec3& /*wo*/) const { return {}; }

  // For the opposite end of a bidirectional path, which meets the same pair of directions with swapped roles and in the
  // opposite transport mode. Its densities, without binding the model again:
  /// Density per unit solid angle with which a path of the opposite mode arriving from wi is scattered to wo, without
  /// delta lobes. The reverse of eval(wo, wi).pdf_solid_angle.
  virtual float reverse_pdf(const Vec3& wo, const Vec3& wi) const { return eval(wi, wo).pdf_solid_angle; }
  /// Same for `s`, which this closure sampled for wo from a delta lobe: the discrete probability that the opposite mode
  /// samples wo for s.wi from that lobe; 0 if it cannot.
  virtual float reverse_pmf(const Vec3& /*wo*/, const BsdfSample& s) const {
    float pmfs[kMaxLobes];
    lobe_pmfs(s.wi, pmfs);
    return pmfs[s.lobe];
  }

 protected:
  ~BsdfClosure() = default;
};

class Bsdf : public SceneObject {
 public:
  /// Union of the flags of all lobes this model can have anywhere.
  virtual uint32_t flags() const = 0;
  /// Binds the model to a point. `wo_front`: whether wo is on the side of the shading normal (two-sided models choose
  /// by it). The closure lives until the arena is reset.
  virtual const BsdfClosure* bind(const SurfaceHit& hit, bool wo_front, TransportMode mode, Arena& arena) const = 0;
  /// True if bind() uses `wo_front`.
  virtual bool depends_on_side() const { return false; }
  /// True if bind() reads hit.dp_du or hit.dp_dv, or needs the frame aligned with dp_du (anisotropy, bump maps).
  virtual bool needs_derivatives() const { return false; }
  /// A texture that bind() looks up and that is worth prefetching; or null.
  virtual const Texture* main_texture() const { return nullptr; }
  /// Approximate directional albedo for the auxiliary image `Albedo`: reflectance for diffuse parts, Fresnel-free
  /// specular colour otherwise; in [0, 1].
  virtual Spectrum albedo(const SurfaceHit& hit) const = 0;
};

using BsdfPtr = std::shared_ptr<const Bsdf>;

}  // namespace covary
