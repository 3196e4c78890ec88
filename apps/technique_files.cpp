// SPDX-License-Identifier: Apache-2.0
#include "technique_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/error.h"
#include "film/image_writer.h"
#include "integrators/technique_images.h"
#include "passes/light_pass.h"
#include "plans/integrator_choice.h"

namespace covary {
namespace {

constexpr int kTileWidth = 240;  // at most, of a technique in a pyramid
constexpr int kGap = 2;

/// Pixels on a side that become one of a tile.
int reduction(const Image& image) { return (image.width + kTileWidth - 1) / kTileWidth; }

void place_tile(const Image& image, int left, int top, Image& pyramid) {
  const int side = reduction(image);
  for (int y = 0; y < image.height / side; ++y)
    for (int x = 0; x < image.width / side; ++x)
      for (int c = 0; c < 3; ++c) {
        float sum = 0;
        for (int i = 0; i < side * side; ++i) sum += image.pixel(x * side + i % side, y * side + i / side)[c];
        pyramid.pixel(left + x, top + y)[c] = sum / static_cast<float>(side * side);
      }
}

Image make_pyramid(const std::vector<TechniqueImage>& techniques, Image TechniqueImage::*which) {
  const Image& first = techniques.front().*which;
  const int width = first.width / reduction(first) + kGap, height = first.height / reduction(first) + kGap;
  int n_rows = 0, n_columns = 0;
  for (const TechniqueImage& technique : techniques)
    n_rows = std::max(n_rows, technique.s + technique.t - 1), n_columns = std::max(n_columns, technique.s + 1);
  Image pyramid(width * n_columns, height * n_rows, 3);
  for (const TechniqueImage& technique : techniques)
    place_tile(technique.*which, width * technique.s, height * (technique.s + technique.t - 2), pyramid);
  return pyramid;
}

/// The last pass of camera samples.
const Pass& camera_pass(const RenderResult& result) {
  const auto pass = std::find_if(result.passes.rbegin(), result.passes.rend(),
                                 [](const Pass& p) { return p.settings.pass < kLightPass; });
  COVARY_CHECK(pass != result.passes.rend(), "a render has camera samples");
  return *pass;
}

}  // namespace

void check_technique_folder(const std::string& folder, const LoadedScene& scene) {
  if (!has_techniques(integrator_of(scene)))
    throw Error(ErrorCode::kUsage,
                "--debug-strategies shows the techniques of the integrator 'bdpt', which does not render this scene");
  std::error_code error;
  if (std::filesystem::exists(folder, error) &&
      (!std::filesystem::is_directory(folder, error) || !std::filesystem::is_empty(folder, error)))
    throw Error(ErrorCode::kUsage, fmt::format("--debug-strategies '{}' is not an empty folder", folder));
}

void write_techniques(const std::string& folder, const LoadedScene& scene, const RenderResult& result,
                      const std::atomic<bool>* stop) {
  const Pass& pass = camera_pass(result);
  PassSettings settings = pass.settings;
  settings.stop = stop;
  const std::vector<TechniqueImage> techniques =
      render_techniques(*scene.scene, *pass.integrator, settings, pass.film.crop());
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Error(ErrorCode::kIo, fmt::format("cannot make the folder '{}': {}", folder, error.message()));
  const auto path = [&](const std::string& name) { return (std::filesystem::path(folder) / name).string(); };
  const ImagePlace place{pass.film.frame_width(), pass.film.frame_height(), pass.film.crop()};
  for (const TechniqueImage& technique : techniques) {
    const std::string name = fmt::format("s{}_t{}", technique.s, technique.t);
    write_image(path(name + ".exr"), technique.weighted, place, {});
    write_image(path(name + "_unweighted.exr"), technique.unweighted, place, {});
  }
  if (techniques.empty()) return;  // a black image
  write_png(path("pyramid.png"), make_pyramid(techniques, &TechniqueImage::weighted));
  write_png(path("pyramid_unweighted.png"), make_pyramid(techniques, &TechniqueImage::unweighted));
}

}  // namespace covary
