// SPDX-License-Identifier: Apache-2.0
// twosided: makes a one-sided reflection model reflect on both sides.
//
// | name               | type   | default | meaning                                                              |
// |--------------------|--------|---------|----------------------------------------------------------------------|
// | (nested)           | bsdf   |         | one model for both sides, or two: first the side of the normal       |
// | allow_transmission | bool   | false   | accept nested models that transmit light                             |
//
// The model on the back sees directions mirrored about the surface.
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

/// A closure seen from the other side.
class MirroredClosure final : public BsdfClosure {
 public:
  explicit MirroredClosure(const BsdfClosure* nested) : nested_(nested) {}

  uint32_t flags() const override { return nested_->flags(); }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override { return nested_->eval(mirror(wo), mirror(wi)); }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    BsdfSample s = nested_->sample(mirror(wo), u_lobe, u);
    s.wi.z = -s.wi.z;
    return s;
  }
  int n_lobes() const override { return nested_->n_lobes(); }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override { nested_->lobe_pmfs(mirror(wo), pmfs); }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    nested_->lobe_pdfs(mirror(wo), mirror(wi), pdfs);
  }

 private:
  static Vec3 mirror(const Vec3& w) { return {w.x, w.y, -w.z}; }
  const BsdfClosure* nested_;
};

class TwoSided final : public Bsdf {
 public:
  TwoSided(BsdfPtr front, BsdfPtr back) : front_(std::move(front)), back_(std::move(back)) {}

  uint32_t flags() const override { return front_->flags() | back_->flags(); }
  const BsdfClosure* bind(const SurfaceHit& hit, bool wo_front, TransportMode mode, Arena& arena) const override {
    if (wo_front) return front_->bind(hit, true, mode, arena);
    return arena.make<MirroredClosure>(back_->bind(hit, true, mode, arena));
  }
  bool needs_derivatives() const override { return front_->needs_derivatives() || back_->needs_derivatives(); }
  const Texture* main_texture() const override { return front_->main_texture(); }
  Spectrum albedo(const SurfaceHit& hit) const override { return front_->albedo(hit); }

 private:
  BsdfPtr front_, back_;
};

}  // namespace

std::shared_ptr<Bsdf> make_twosided(Parameters& parameters) {
  const bool allow_transmission = parameters.get_bool("allow_transmission", false);
  const std::vector<BsdfPtr> nested = get_nested_bsdfs(parameters, 1, 2);
  if (nested.empty()) return nullptr;
  auto result = std::make_shared<TwoSided>(nested.front(), nested.back());
  if (!allow_transmission && (result->flags() & kTransmission)) {
    parameters.error(
        "a nested model transmits light; accepted: models that only reflect, or any with 'allow_transmission'");
    return nullptr;
  }
  return result;
}

}  // namespace covary
