// SPDX-License-Identifier: Apache-2.0
// `environments`: several lights from all around at once, as pbrt has them; one of them is sampled in proportion to its
// power. Not in Mitsuba, which allows one.
//
// | parameter | type     | default  | meaning                                    |
// |-----------|----------|----------|--------------------------------------------|
// | (child)   | emitters | required | `constant`, `envmap`, `sunsky`: their sum  |
#include "core/distribution.h"
#include "emitters/registry.h"

namespace covary {
namespace {

class Environments final : public Emitter {
 public:
  explicit Environments(std::vector<std::shared_ptr<const Emitter>> parts) : parts_(std::move(parts)) {
    for (const auto& part : parts_) power_ = power_ + part->power();
    std::vector<float> powers;
    for (const auto& part : parts_) powers.push_back(luminance(part->power()));
    if (luminance(power_) <= 0) powers.assign(parts_.size(), 1);
    choice_ = Discrete(powers);
  }

  std::shared_ptr<const Emitter> in_scene(const Bounds3& bounds) const override {
    return changed([&](const Emitter& part) { return part.in_scene(bounds); });
  }
  bool is_environment() const override { return true; }
  std::shared_ptr<const Emitter> mis_compensated() const override {
    return changed([](const Emitter& part) { return part.mis_compensated(); });
  }

  EnvironmentLight environment(const Vec3& d) const override {
    EnvironmentLight sum;
    for (uint32_t i = 0; i < parts_.size(); ++i) {
      const EnvironmentLight part = parts_[i]->environment(d);
      sum.radiance = sum.radiance + part.radiance;
      sum.pdf_solid_angle += choice_.pmf(i) * part.pdf_solid_angle;
    }
    return sum;
  }

  EmitterSample sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const override {
    const auto chosen = choice_.sample(u.x);
    EmitterSample sample = parts_[chosen.index]->sample_towards(reference, {chosen.remapped, u.y}, u_primitive);
    const EnvironmentLight all = environment(sample.wi);
    sample.radiance = all.radiance;
    if (sample.pdf_solid_angle > 0) sample.pdf_solid_angle = all.pdf_solid_angle;
    return sample;
  }

  EmissionSample sample_emission(Vec2 u_position, Vec2 u_direction, float u_primitive) const override {
    const auto chosen = choice_.sample(u_direction.x);
    EmissionSample sample =
        parts_[chosen.index]->sample_emission(u_position, {chosen.remapped, u_direction.y}, u_primitive);
    const EnvironmentLight all = environment(-sample.ray.d);
    sample.radiance = all.radiance;
    if (sample.pdf_direction > 0) sample.pdf_direction = all.pdf_solid_angle;
    return sample;
  }

  EmissionPdf pdf_emission(const SurfaceHit& hit, const Vec3& w) const override {
    return {parts_[0]->pdf_emission(hit, w).position, environment(-w).pdf_solid_angle};
  }

  Spectrum power() const override { return power_; }

 private:
  /// The sum with the parts that `change` returns, or null if it changes none.
  template <typename Change>
  std::shared_ptr<const Emitter> changed(const Change& change) const {
    std::vector<std::shared_ptr<const Emitter>> parts = parts_;
    bool any = false;
    for (auto& part : parts)
      if (const std::shared_ptr<const Emitter> other = change(*part)) part = other, any = true;
    return any ? std::make_shared<Environments>(std::move(parts)) : nullptr;
  }

  std::vector<std::shared_ptr<const Emitter>> parts_;
  Discrete choice_;
  Spectrum power_;
};

}  // namespace

std::shared_ptr<Emitter> make_environments(Parameters& parameters) {
  const auto parts = parameters.children<Emitter>("emitter");
  for (const auto& part : parts)
    if (!part->is_environment()) {
      parameters.error("holds an emitter that does not shine from all around; expected 'constant', 'envmap', 'sunsky'");
      return nullptr;
    }
  if (parts.empty()) {
    parameters.error("holds no emitters");
    return nullptr;
  }
  return std::make_shared<Environments>(parts);
}

}  // namespace covary
