// SPDX-License-Identifier: Apache-2.0
// `polarizer`, `circular`, `retarder`: filters that act on polarisation. This renderer is unpolarised; like Mitsuba's
// unpolarised variants, polarisers transmit half of the light and retarders all of it, straight through, times the
// transmittance.
//
// | name          | of         | type           | default | meaning                   |
// |---------------|------------|----------------|---------|---------------------------|
// | transmittance | all        | colour/texture | 1       | factor                    |
// | theta         | all but circular | number/texture | 0 | accepted, no effect       |
// | delta         | retarder   | number/texture | 90      | accepted, no effect       |
// | polarizing    | polarizer  | bool           | true    | accepted, no effect       |
// | left_handed   | circular   | bool           | false   | accepted, no effect       |
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class FilterClosure final : public BsdfClosure {
 public:
  explicit FilterClosure(const Spectrum& transmittance) : transmittance_(transmittance) {}
  uint32_t flags() const override { return kNullTransmission; }
  BsdfValue eval(const Vec3&, const Vec3&) const override { return {}; }
  BsdfSample sample(const Vec3& wo, float, Vec2) const override {
    return {.wi = -wo, .weight = transmittance_, .pdf = 1, .eta = 1, .flags = kNullTransmission};
  }
  NullPassage null_passage(const Vec3&) const override { return {transmittance_, 1}; }
  int n_lobes() const override { return 1; }
  void lobe_pmfs(const Vec3&, float* pmfs) const override { pmfs[0] = 1; }
  void lobe_pdfs(const Vec3&, const Vec3&, float* pdfs) const override { pdfs[0] = 0; }

 private:
  Spectrum transmittance_;
};

class Filter final : public Bsdf {
 public:
  Filter(float factor, Parameters& p) : factor_(factor), transmittance_(p, "transmittance", 1) {}
  uint32_t flags() const override { return kNullTransmission; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    return arena.make<FilterClosure>(transmittance_.eval(hit) * factor_);
  }
  Spectrum albedo(const SurfaceHit& hit) const override { return clamp01(transmittance_.eval(hit) * factor_); }

 private:
  float factor_;
  ColourInput transmittance_;
};

}  // namespace

std::shared_ptr<Bsdf> make_polarizer(Parameters& parameters) {
  parameters.find_texture("theta", SpectrumRole::kEmission);
  parameters.get_bool("polarizing", true);
  return std::make_shared<Filter>(0.5f, parameters);
}

std::shared_ptr<Bsdf> make_circular(Parameters& parameters) {
  parameters.get_bool("left_handed", false);
  return std::make_shared<Filter>(0.5f, parameters);
}

std::shared_ptr<Bsdf> make_retarder(Parameters& parameters) {
  parameters.find_texture("theta", SpectrumRole::kEmission);
  parameters.find_texture("delta", SpectrumRole::kEmission);
  return std::make_shared<Filter>(1.0f, parameters);
}

}  // namespace covary
