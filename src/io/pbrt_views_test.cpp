// SPDX-License-Identifier: Apache-2.0
// pbrt's cameras, filters and glowing media by the formulas of pbrt-v4's cameras.cpp, filters.h and media.h.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/equal_area.h"
#include "io/load_scene.h"
#include "support/files.h"
#include "support/pbrt_scenes.h"

namespace covary::pbrt_views_test {
namespace {

using test_support::contains;
using test_support::message_of;

float difference(const Vec3& a, const Vec3& b) { return length(a - b); }
float difference(const Spectrum& a, const Spectrum& b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

class PbrtViews : public test_support::PbrtScenes {};

const std::string kFilm = "Film \"rgb\" \"integer xresolution\" 40 \"integer yresolution\" 20\n";
const std::string kBall = "WorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\n";

/// SphericalCamera::GenerateRay.
TEST_F(PbrtViews, SphericalCamerasSeeAllDirections) {
  for (const bool equal_area : {false, true}) {
    for (const std::string& place : {std::string(), std::string("Scale -2 2 2\nRotate 30 0 1 0\nTranslate 1 2 3\n")}) {
      const LoadedScene scene = load(place + "Camera \"spherical\" " +
                                     (equal_area ? "" : "\"string mapping\" \"equirectangular\" ") + kFilm + kBall);
      const LoadedScene perspective = load(place + "Camera \"perspective\"\n" + kFilm + kBall);
      const Camera &camera = scene.scene->camera(), &straight = perspective.scene->camera();
      const Vec3 eye = straight.ray({20, 10}, {}).at(0);
      const Vec3 z = straight.ray({20, 10}, {}).d;  // pbrt's camera space: z along the view, x to the right, y up
      const Vec3 right = straight.ray({40, 10}, {}).d - straight.ray({0, 10}, {}).d;
      const Vec3 x = normalize(right), down = straight.ray({20, 20}, {}).d - straight.ray({20, 0}, {}).d;
      const Vec3 y = -normalize(down);
      for (const Vec2 film : {Vec2{3, 4}, Vec2{20, 10}, Vec2{31, 17}, Vec2{38.5f, 0.5f}}) {
        const Vec2 uv{film.x / 40, film.y / 20};
        const float theta = kPi * uv.y, phi = 2 * kPi * uv.x;
        const Vec3 square = equal_area_direction(uv);
        const Vec3 d = equal_area
                           ? Vec3{square.x, square.z, square.y}
                           : Vec3{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
        const Ray ray = camera.ray(film, {});
        EXPECT_LT(difference(ray.d, x * d.x + y * d.y + z * d.z), 1e-4) << equal_area << place;
        EXPECT_LT(difference(ray.at(0), eye), 1e-4);
        EXPECT_NEAR(camera.project(eye, ray.d).x, film.x, 1e-2);
        EXPECT_NEAR(camera.project(eye, ray.d).y, film.y, 1e-2);
      }
    }
  }
  EXPECT_TRUE(contains(message_of([&] { load("Camera \"spherical\" \"string mapping\" \"cube\"\n" + kBall); }),
                       "has the mapping 'cube'; supported: 'equalarea' and 'equirectangular'"));
}

/// A thin biconvex lens: 1/f = (n - 1) (1/R1 - 1/R2), so f = 50 mm; the aperture in its plane is the pupil.
TEST_F(PbrtViews, RealisticCamerasAreThinLenses) {
  std::ofstream(folder_.file("lens.dat")) << "# radius thickness index aperture\n50 0 1.5 40\n0 0 0 40\n-50 0 1 40\n";
  const LoadedScene scene = load(
      "Film \"rgb\" \"integer xresolution\" 30 \"integer yresolution\" 20 \"float diagonal\" "
      "43.2666\nCamera \"realistic\" \"string lensfile\" \"lens.dat\" \"float "
      "aperturediameter\" 10 \"float focusdistance\" 2\n" +
      kBall);
  const CameraSettings& settings = scene.scene->camera().settings();
  // Object and image are 2 m apart: s s' = f (s + s').
  const double behind = (2 - std::sqrt(4 - 4 * 0.05 * 2)) / 2;
  EXPECT_NEAR(settings.aperture_radius, 0.005, 1e-6);
  EXPECT_NEAR(settings.focus_distance, 2 - behind, 1e-4);
  EXPECT_NEAR(settings.fov_degrees, 2 * std::atan(0.012 / behind) * 180 / kPi, 1e-2);  // a film of 36 mm x 24 mm
  EXPECT_NEAR(settings.to_world.point({0, 0, 0}).z, behind, 1e-5);
  SurfaceHit hit;
  const EnvironmentLight light = scene.scene->environment()->environment({0, 1, 0});
  EXPECT_NEAR(light.radiance.g, kPi * std::pow(0.005 / behind, 2), 1e-5);  // irradiance of the film per radiance
  EXPECT_TRUE(contains(warnings(scene), "is a thin lens here, of the same field of view, focus and aperture"));
  EXPECT_TRUE(contains(message_of([&] { load("Camera \"realistic\" \"string lensfile\" \"no.dat\"\n" + kBall); }),
                       "needs the lens file 'no.dat'"));
}

TEST_F(PbrtViews, FiltersWithNegativeLobesAreReal) {
  const LoadedScene mitchell =
      load("PixelFilter \"mitchell\" \"float B\" 0.5 \"float C\" 0.25\nCamera \"perspective\"\n" + kBall);
  EXPECT_EQ(mitchell.filter.lobed->text(), LobedFilter::mitchell(0.5f, 0.25f).text());
  EXPECT_EQ(warnings(mitchell), "");
  const LoadedScene sinc = load(
      "PixelFilter \"sinc\" \"float xradius\" 2 \"float yradius\" 2 \"float tau\" "
      "2\nCamera \"perspective\"\n" +
      kBall);
  EXPECT_EQ(sinc.filter.lobed->text(), LobedFilter::lanczos(2).text());
  EXPECT_EQ(warnings(sinc), "");
  EXPECT_TRUE(contains(warnings(load("PixelFilter \"sinc\"\nCamera \"perspective\"\n" + kBall)),
                       "goes on to 4 pixels; here it ends where its window is 0, at 3"));
}

class PbrtGlow : public PbrtViews {
 protected:
  /// The emission at a point of the medium that the camera is in, per unit length.
  Spectrum emission(const std::string& medium, const Vec3& p, const std::string& film = "") {
    const LoadedScene scene =
        load("MakeNamedMedium \"m\" " + medium + "\nMediumInterface \"\" \"m\"\nCamera \"perspective\"\n" + film +
             "Integrator \"volpath\"\nWorldBegin\nShape \"sphere\"\n");
    EXPECT_EQ(warnings(scene), "");
    const Medium* camera = scene.scene->camera_medium();
    return camera && camera->emits() ? camera->emission(p, camera->at(p)) : Spectrum(-1);
  }
};

TEST_F(PbrtGlow, LeIsMultipliedByTheAbsorption) {
  const std::string glow = "\"rgb Le\" [ 1 2 4 ] \"float Lescale\" 3 ";
  EXPECT_LT(
      difference(emission("\"string type\" \"homogeneous\" \"rgb sigma_a\" [ 0.5 1 0.25 ] \"rgb sigma_s\" [ 1 1 1 ] "
                          "\"float scale\" 2 " +
                              glow,
                          {}),
                 Spectrum(3, 12, 6)),
      1e-4);
  EXPECT_LT(difference(emission("\"string type\" \"homogeneous\" " + glow, {}, "Film \"rgb\" \"float iso\" 200\n"),
                       Spectrum(6, 12, 24)),
            1e-3);
  // GridMedium::SamplePoint: density, absorption, and the grid of factors.
  EXPECT_LT(
      difference(
          emission("\"string type\" \"uniformgrid\" \"integer nx\" 2 \"float density\" [ 1 0.5 ] \"rgb sigma_a\" [ "
                   "2 2 2 ] \"rgb Le\" [ 1 2 4 ] \"float Lescale\" [ 3 5 ]",
                   {0.25f, 0.5f, 0.5f}),
          Spectrum(6, 12, 24)),
      1e-3);
}

/// Le = Lescale * B(T), B scaled to a maximum of 1 and T = (t - offset) * scale; the sensor sums B y over nanometres.
TEST_F(PbrtGlow, TemperaturesAreBlackBodies) {
  const auto planck = [](double nm, double t) { return std::pow(nm, -5) / std::expm1(1.438777e7 / (nm * t)); };
  const Spectrum glow = emission(
      "\"string type\" \"uniformgrid\" \"float density\" 1 \"rgb sigma_s\" [ 0 0 0 ] \"float temperature\" 12 \"float "
      "temperaturescale\" 500 \"float temperatureoffset\" 2 \"float Lescale\" 0.5",
      {0.5f, 0.5f, 0.5f});
  // The CIE's y by the multi-lobe fit of Wyman et al. 2013, to 1 %.
  const auto lobe = [](double x, double mean, double below, double above) {
    const double t = (x - mean) / (x < mean ? below : above);
    return std::exp(-0.5 * t * t);
  };
  double sum = 0;
  for (int nm = 360; nm <= 830; ++nm)
    sum += planck(nm, 5000) / planck(2.8977721e6 / 5000, 5000) *
           (0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1));
  EXPECT_NEAR(luminance(glow), 0.5 * sum, 0.01 * 0.5 * sum);
  EXPECT_GT(glow.r, glow.b);
  EXPECT_EQ(emission("\"string type\" \"uniformgrid\" \"float density\" 1 \"float temperature\" 90", {}), Spectrum(-1));
}

/// RGBGridMedium: Lescale * Le under D65, whose luminance is not divided out.
TEST_F(PbrtGlow, GridsOfColoursAreInPbrtsUnits) {
  EXPECT_LT(
      difference(emission("\"string type\" \"rgbgrid\" \"rgb sigma_a\" [ 1 2 4 ] \"rgb Le\" [ 1 0.5 0.25 ] \"float "
                          "Lescale\" 2",
                          {0.5f, 0.5f, 0.5f}),
                 Spectrum(1, 1, 1) * (2 * 106.8569f)),
      1e-2);
}

}  // namespace
}  // namespace covary::pbrt_views_test
