// SPDX-License-Identifier: Apache-2.0
// Renders small scenes given as text, for tests of the whole renderer.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <string>

#include "integrators/registry.h"
#include "io/load_scene.h"
#include "passes/render_pass.h"
#include "scene/property_source.h"
#include "support/files.h"

namespace covary {

/// A scene read from XML text, with its integrator.
struct TestScene {
  LoadedScene loaded;
  const Scene& scene() const { return *loaded.scene; }
  const Integrator& integrator() const { return dynamic_cast<const Integrator&>(*loaded.integrator); }
};

/// Loads a scene and prepares its integrator.
inline TestScene load_file(const std::string& file, const LoadOptions& options) {
  TestScene scene{load_scene(file, options)};
  dynamic_cast<Integrator&>(*scene.loaded.integrator).prepare(scene.scene());
  return scene;
}

/// The integrator that a scene specifies, with the scene's settings.
inline std::shared_ptr<Integrator> scene_integrator(Parameters& parameters, const PathLengthSettings& lengths) {
  for (const IntegratorPlugin& plugin : integrator_plugins())
    if (parameters.type() == plugin.name) {
      PropertySource source(parameters);
      Settings settings(source);
      return plugin.make(settings, lengths);
    }
  return nullptr;
}
inline std::shared_ptr<Integrator> scene_integrator(Parameters& parameters) {
  return scene_integrator(parameters, read_settings<PathLengthSettings>(parameters));
}

using MakeIntegrator = std::function<std::shared_ptr<Integrator>(const PathLengthSettings&)>;

/// `min_depth` as on the command line. `make`, if given, makes an integrator to use instead of the scene's.
inline TestScene load_text(const std::string& xml, int min_depth = 0, const MakeIntegrator& make = nullptr) {
  const std::string file = test_support::test_file("scene.xml");
  std::ofstream(file) << xml;
  LoadOptions options;
  options.make_integrator = [&](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    PathLengthSettings lengths = read_settings<PathLengthSettings>(parameters);
    lengths.min_depth = min_depth;
    return make ? make(lengths) : scene_integrator(parameters, lengths);
  };
  return load_file(file, options);
}

/// A scene around `body`: path integrator, box filter, and a camera at the origin that looks along +z unless `sensor`
/// says otherwise.
inline std::string scene_text(const std::string& body, int width, int height, int max_depth = -1,
                              const std::string& sensor = "", const std::string& integrator = "") {
  return "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='" +
         std::to_string(max_depth) + "'/>" + integrator + "</integrator><sensor type='perspective'>" + sensor +
         "<film type='hdrfilm'><integer name='width' value='" + std::to_string(width) +
         "'/><integer name='height' value='" + std::to_string(height) + "'/><rfilter type='box'/></film></sensor>" +
         body + "</scene>";
}

inline Film new_film(const TestScene& scene, int groups = 1) {
  const LoadedScene& l = scene.loaded;
  return Film(l.width, l.height, {l.crop_x, l.crop_y, l.crop_width, l.crop_height}, groups);
}

inline Film render(const TestScene& scene, uint32_t spp, uint64_t seed, Sampling sampling = Sampling::kIndependent,
                   int groups = 1, Sampler sampler = Sampler::kIndependent) {
  Film film = new_film(scene, groups);
  PassSettings settings;
  settings.sampling = sampling, settings.seed = seed, settings.spp = spp, settings.filter = scene.loaded.filter;
  settings.sampler = sampler, settings.groups = groups;
  const PassResult result = render_pass(scene.scene(), scene.integrator(), settings, film);
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(result.n_not_finite + result.n_negative, 0u);
  return film;
}

/// Mean over all pixels and channels.
inline double image_mean(const Film& film) {
  double sum = 0;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) sum += mean(film.mean(x, y));
  return sum / (static_cast<double>(film.width()) * film.height());
}

inline bool same_bits(const Film& a, const Film& b) {
  return a.counts() == b.counts() && a.data().size() == b.data().size() &&
         std::memcmp(a.data().data(), b.data().data(), a.data().size() * sizeof(float)) == 0;
}

}  // namespace covary
