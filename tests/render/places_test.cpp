// SPDX-License-Identifier: Apache-2.0
// A picture does not depend on where the scene stands, nor on its unit of length: thin glass, coats, contact shadows,
// shaded lamps, instances and the boundary of a medium, moved and scaled, with every integrator.
//
// Student's t-test as in unbiased_images.h, on 16 blocks and the whole image; a difference of 3 % of the whole image is
// detected with power 0.99. Rays that started 9e-5 of the distance from the origin off their surface, as once here,
// fail it by 10 % and more from a distance of 60 on.
#include <fmt/format.h>

#include "unbiased_images.h"

namespace covary {
namespace {

struct Place {
  double distance, scale;
  double gap;  // in the scene's own unit
};

/// Positions are multiples of 1/64, so that they are floats at every distance up to 1e5.
class SceneAt {
 public:
  explicit SceneAt(const Place& place) : place_(place) {}

  std::string text(const std::string& integrator) const {
    const double g = place_.gap;
    const std::string shapes =
        shape("rectangle", "<rotate x='1' angle='-90'/>", 4, 0, 0, 0, kGrey) +
        shape("cube", "", 0.25, -1, 0.25 + g, 0, kGrey) +
        shape("cube", fmt::format("<scale x='1' y='1' z='{}'/>", g), 0.5, 0.75, 0.75, 0.5, kGlass) +
        shape("sphere", "", 0.25, 0.75, 0.5, -0.5, kGrey) +
        shape("sphere", fmt::format("<scale value='{}'/>", 1 + 4 * g), 0.25, 0.75, 0.5, -0.5, kGlass) +
        shape("rectangle", "<rotate x='1' angle='90'/>", 0.5, 0, 2.5, 0,
              "<bsdf type='diffuse'/><emitter type='area'><rgb name='radiance' value='8'/></emitter>") +
        shape("disk", "<rotate x='1' angle='90'/>", 0.25, 0.25, 2.5 - g, 0, kBothSides) +
        shape("cylinder", "", 0.25, -1, 0, 1, kBothSides) +
        fmt::format("<shape type='linearcurve'><string name='filename' value='{}'/>{}{}</shape>", curve_file(),
                    to_world("", 1, 0, 0, 0), kGrey) +
        fmt::format(
            "<shape type='shapegroup' id='group'><shape type='cube'><transform name='to_world'><scale x='0.25' "
            "y='0.25' z='{}'/></transform><bsdf type='dielectric'/></shape></shape><shape type='instance'>"
            "<ref id='group'/>{}</shape>",
            g, to_world("<rotate x='1' y='2' z='3' angle='40'/>", 1, -1, 1.25, 0)) +
        "<emitter type='constant'><rgb name='radiance' value='0.2'/></emitter>";
    std::string text = scene_text(
        shapes, kSide, kSide, 8,
        fmt::format("<float name='fov' value='50'/><float name='near_clip' value='{}'/><transform name='to_world'>"
                    "<lookat origin='{}' target='{}' up='0, 1, 0'/></transform>",
                    0.01 * place_.scale, point(0, 1.5, 4), point(0, 0.75, 0)));
    return text.replace(text.find("'path'"), 6, "'" + integrator + "'");
  }

 private:
  static constexpr const char* kGrey = "<bsdf type='diffuse'><rgb name='reflectance' value='0.5, 0.6, 0.7'/></bsdf>";
  static constexpr const char* kGlass = "<bsdf type='dielectric'/>";
  static constexpr const char* kBothSides = "<bsdf type='twosided'><bsdf type='diffuse'/></bsdf>";

  std::string point(double x, double y, double z) const { return fmt::format("{}, {}, {}", at(x), at(y), at(z)); }
  double at(double x) const { return place_.distance + x * place_.scale; }
  std::string to_world(const std::string& first, double size, double x, double y, double z) const {
    return fmt::format("<transform name='to_world'>{}<scale value='{}'/><translate value='{}'/></transform>", first,
                       size * place_.scale, point(x, y, z));
  }
  std::string shape(const char* type, const std::string& first, double size, double x, double y, double z,
                    const std::string& content) const {
    return fmt::format("<shape type='{}'>{}{}</shape>", type, to_world(first, size, x, y, z), content);
  }
  std::string curve_file() const {
    const std::string file = test_support::test_file("places_curve.txt");
    std::ofstream(file) << "0 0 1 " << 0.03125 * place_.scale << "\n0.5 0.5 1 " << 0.03125 * place_.scale << "\n";
    return file;
  }

  Place place_;
};

void expect_same_everywhere(const std::string& integrator, std::initializer_list<Place> places, uint32_t spp) {
  const TestScene first = load_text(SceneAt(*places.begin()).text(integrator));
  for (const Place& place : places) {
    SCOPED_TRACE(fmt::format("{}, {} away, {} large", integrator, place.distance, place.scale));
    const TestScene moved = load_text(SceneAt(place).text(integrator));
    const Differences blocks = differences(first, moved, spp, 1000);
    EXPECT_EQ(n_biased(blocks), 0);
    EXPECT_LT(detectable(blocks), 0.03 * image_mean(render(first, spp, 0)));
  }
}

TEST(Places, PicturesAreTheSameEverywhere) {
  for (const char* integrator : {"path", "bdpt"}) {
    expect_same_everywhere(integrator, {{0, 1, 1.0 / 64}, {60, 1, 1.0 / 64}, {1000, 1, 1.0 / 64}}, 32);
    expect_same_everywhere(integrator, {{0, 1, 1.0 / 1024}, {0, 1e-3, 1.0 / 1024}, {0, 1e3, 1.0 / 1024}}, 32);
  }
  expect_same_everywhere("path", {{0, 1, 0.25}, {1e5, 1, 0.25}}, 32);
}

}  // namespace
}  // namespace covary
