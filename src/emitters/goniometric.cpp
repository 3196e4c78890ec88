// SPDX-License-Identifier: Apache-2.0
// `goniometric`: a point light whose power per unit solid angle is given by an image of all directions, after pbrt.
//
// | parameter | type      | default  | meaning                                                                     |
// |-----------|-----------|----------|-----------------------------------------------------------------------------|
// | filename  | string    | required | the image                                                                   |
// | mapping   | string    | equal_area | or `latitude_longitude`, as of `envmap`                                   |
// | intensity | colour    | 1        | factor                                                                      |
// | grey      | boolean   | true     | use the mean of red, green and blue                                         |
// | power     | float     | none     | luminance of the emitted power for an intensity of 1, instead of the image's |
// | to_world  | transform | identity | the light stands at the image of the origin                                 |
#include "emitters/environment_image.h"
#include "emitters/equal_area_image.h"
#include "emitters/point_source.h"
#include "emitters/registry.h"

namespace covary {
namespace {

/// `Image`: EqualAreaImage, or a class with the same interface.
template <typename Image>
class GoniometricLight final : public Emitter {
 public:
  GoniometricLight(Image image, const PointFrame& frame, const Spectrum& intensity)
      : image_(std::move(image)), frame_(frame), intensity_(intensity) {}

  bool is_delta_position() const override { return true; }
  EmitterSample sample_towards(const Vec3& reference, Vec2, float) const override {
    return sample_point(frame_.position, reference,
                        [&](const Vec3& d) { return image_.lookup(frame_.rotation.to_local(d)).value * intensity_; });
  }
  /// In proportion to the image's luminance.
  EmissionSample sample_emission(Vec2, Vec2 u_direction, float) const override {
    const typename Image::Sample from = image_.sample(u_direction);
    return emit_from_point(frame_.position, frame_.rotation.to_world(from.d), from.value * intensity_,
                           from.pdf_solid_angle);
  }
  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3& w) const override {
    return {1, image_.lookup(frame_.rotation.to_local(w)).pdf_solid_angle};
  }
  Spectrum power() const override { return image_.integral() * intensity_; }

 private:
  Image image_;
  PointFrame frame_;
  Spectrum intensity_;
};

template <typename Image>
std::shared_ptr<Emitter> make(TexelImage texels, const PointFrame& frame, Spectrum intensity, float power) {
  Image image(std::move(texels), 1, false);
  if (const float given = luminance(image.integral()); power > 0 && given > 0) intensity = intensity * (power / given);
  return std::make_shared<GoniometricLight<Image>>(std::move(image), frame, intensity);
}

}  // namespace

std::shared_ptr<Emitter> make_goniometric(Parameters& p) {
  const std::string path = p.require_file("filename");
  const bool equal_area = p.get_choice("mapping", "equal_area", {"latitude_longitude", "equal_area"}) == "equal_area";
  const bool grey = p.get_bool("grey", true);
  const PointFrame frame = get_point_frame(p);
  const Spectrum intensity = p.get_spectrum("intensity", Spectrum(1), SpectrumRole::kEmission);
  const float power = p.get_float("power", 0, 0);
  if (path.empty()) return nullptr;  // already reported
  try {
    TexelImage texels = read_linear_rgb(path);
    for (size_t i = 0; grey && i < texels.floats.size(); i += 3) {
      const float mean = (texels.floats[i] + texels.floats[i + 1] + texels.floats[i + 2]) / 3;
      std::fill_n(texels.floats.begin() + static_cast<std::ptrdiff_t>(i), 3, mean);
    }
    return equal_area ? make<EqualAreaImage>(std::move(texels), frame, intensity, power)
                      : make<EnvironmentImage>(std::move(texels), frame, intensity, power);
  } catch (const Error& error) {
    p.error_at("filename", std::string("cannot be used: ") + error.what());
    return nullptr;
  }
}

}  // namespace covary
