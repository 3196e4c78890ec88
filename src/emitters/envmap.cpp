// SPDX-License-Identifier: Apache-2.0
// `envmap`: image-based light at infinity, usually in latitude-longitude format; see environment_image.h for the
// mapping and the sampling.
//
// | parameter        | type      | default  | meaning                                                              |
// |------------------|-----------|----------|----------------------------------------------------------------------|
// | filename         | string    | required | image, as for the texture `bitmap`; the top row lies around +y       |
// | scale            | float     | 1        | factor, not negative                                                 |
// | to_world         | transform | identity | rotation of the map                                                  |
// | mapping          | string    | see      | latitude_longitude, or equal_area: pbrt-v4's (equal_area_image.h)    |
// | mis_compensation | boolean   | false    | sample only what exceeds the mean; only valid for                    |
// |                  |           |          | integrators that combine it with BSDF sampling                       |
#include "emitters/environment_image.h"
#include "emitters/equal_area_image.h"
#include "emitters/registry.h"
#include "emitters/rotation.h"
#include "emitters/scene_sphere.h"
#include "scene/embedded_data.h"
#include "textures/image.h"

namespace covary {
namespace {

/// `Image`: EnvironmentImage, or a class with the same interface.
template <typename Image>
class EnvironmentMap final : public Emitter {
 public:
  EnvironmentMap(Image image, const Rotation& rotation)
      : image_(std::make_shared<const Image>(std::move(image))), rotation_(rotation) {}

  std::shared_ptr<const Emitter> in_scene(const Bounds3& bounds) const override {
    auto placed = std::make_shared<EnvironmentMap>(*this);
    placed->scene_ = SceneSphere(bounds);
    return placed;
  }
  bool is_environment() const override { return true; }
  std::shared_ptr<const Emitter> mis_compensated() const override {
    if (image_->is_compensated()) return nullptr;
    auto result = std::make_shared<EnvironmentMap>(*this);
    result->image_ = std::make_shared<const Image>(image_->compensated());
    return result;
  }

  EnvironmentLight environment(const Vec3& d) const override {
    const typename Image::Lookup found = image_->lookup(rotation_.to_local(d));
    return {found.value, found.pdf_solid_angle};
  }
  EmitterSample sample_towards(const Vec3&, Vec2 u, float) const override {
    const typename Image::Sample from = image_->sample(u);
    EmitterSample sample;
    sample.wi = rotation_.to_world(from.d);
    sample.radiance = from.value;
    sample.pdf_solid_angle = from.pdf_solid_angle;
    return sample;
  }

  bool sample_environment(EnvironmentSamples& samples) const override {
    if constexpr (std::is_same_v<Image, EnvironmentImage>) {
      image_->sample(samples);
      for (int l = 0; l < samples.size; ++l) {
        const Vec3 wi = rotation_.to_world({samples.wi_x[l], samples.wi_y[l], samples.wi_z[l]});
        samples.wi_x[l] = wi.x, samples.wi_y[l] = wi.y, samples.wi_z[l] = wi.z;
      }
      return true;
    }
    return false;
  }

  EmissionSample sample_emission(Vec2 u_position, Vec2 u_direction, float) const override {
    const typename Image::Sample from = image_->sample(u_direction);
    return scene_.emission(-rotation_.to_world(from.d), u_position, from.value, from.pdf_solid_angle);
  }

  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3& w) const override {
    return {1 / scene_.disk_area(), image_->lookup(rotation_.to_local(-w)).pdf_solid_angle};
  }

  Spectrum power() const override { return image_->integral() * scene_.disk_area(); }

 private:
  std::shared_ptr<const Image> image_;  // large; shared by copies
  Rotation rotation_;
  SceneSphere scene_;
};

}  // namespace

std::shared_ptr<Emitter> make_envmap(Parameters& parameters) {
  const std::string* data = find_embedded(parameters);
  const std::string path = data ? "" : parameters.require_file("filename");
  const float scale = parameters.get_float("scale", 1, 0);
  const bool equal_area =
      parameters.get_choice("mapping", "latitude_longitude", {"latitude_longitude", "equal_area"}) == "equal_area";
  const bool mis_compensation = parameters.get_bool("mis_compensation", false);
  Rotation rotation;
  const Transform to_world = parameters.get_transform("to_world");
  try {
    rotation = Rotation(to_world);
    if (rotation.is_nearest()) parameters.warn("'to_world' scales axes unevenly; it is read as the nearest rotation");
  } catch (const Error& error) {
    parameters.error_at("to_world", error.what());
  }
  if (path.empty() && !data) return nullptr;  // already reported
  try {
    const TexelImage image = data ? read_embedded_image(*data) : read_linear_rgb(path);
    if (equal_area)
      return std::make_shared<EnvironmentMap<EqualAreaImage>>(EqualAreaImage(image, scale, mis_compensation), rotation);
    return std::make_shared<EnvironmentMap<EnvironmentImage>>(EnvironmentImage(image, scale, mis_compensation),
                                                              rotation);
  } catch (const Error& error) {
    parameters.error_at("filename", std::string("cannot be used: ") + error.what());
    return nullptr;
  }
}

}  // namespace covary
