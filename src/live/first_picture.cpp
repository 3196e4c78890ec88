// SPDX-License-Identifier: Apache-2.0
#include "live/first_picture.h"

#include <algorithm>

#include "core/stopwatch.h"
#include "integrators/registry.h"
#include "passes/render_pass.h"
#include "plans/budget.h"
#include "plans/integrator_choice.h"
#include "plans/light_plan.h"

namespace covary {
namespace {

constexpr double kSeconds = 0.25;    // for the samples, at most
constexpr double kMinPixels = 4000;  // of the picture that measures the speed
constexpr uint64_t kOtherSeed = 0x6c697665;

/// The render's integrator, or path tracing in place of one that has to be chosen or trained first.
RenderRequest request_of_first(const LoadedScene& scene, const RenderRequest& request) {
  RenderRequest first;
  first.crop = request.crop, first.filter = request.filter;
  first.integrator = request.integrator;
  const Integrator& own = integrator_of(scene, request);
  if (!own.choices().empty()) first.integrator = own.choices()[0];
  if (first.integrator ? first.integrator->learning() : own.learning()) {
    Settings settings;
    first.integrator = make_integrator(*find_integrator("path"), settings);
  }
  return first;
}

/// One sample in each square of stride x stride pixels of the window, as an image of as many pixels.
Image one_sample_image(const LoadedScene& scene, const Integrator& integrator, const RenderRequest& request, int stride,
                       const std::atomic<bool>* stop) {
  const CropWindow window = window_of(scene, request);
  PassSettings settings;
  settings.seed = kOtherSeed;
  settings.filter = request.filter.value_or(scene.filter);
  settings.spp = one_in_each_square(window, stride, 1);
  settings.stop = stop;
  Film film(scene.width, scene.height, window, 1);
  render_pass(*scene.scene, integrator, settings, film);
  const auto n = [&](int size) { return std::max(1, (size - stride / 2 + stride - 1) / stride); };
  Image image(n(window.width), n(window.height), 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const auto at = [&](int i, int size) { return std::min(i * stride + stride / 2, size - 1); };
      const Spectrum value = film.mean(at(x, window.width), at(y, window.height));
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = value[c];
    }
  return image;
}

}  // namespace

FirstPicture first_picture_of(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                              const std::atomic<bool>* stop) {
  const RenderRequest first = request_of_first(scene, request);
  const std::shared_ptr<Integrator> integrator = prepared_integrator(scene, plan, first);
  const CropWindow window = window_of(scene, request);
  const double area = static_cast<double>(window.width) * window.height;
  FirstPicture picture{{}, kMaxStride};
  while (picture.stride > 1 && area / (picture.stride * picture.stride) < kMinPixels) picture.stride /= 2;
  const Stopwatch watch;
  picture.image = one_sample_image(scene, *integrator, first, picture.stride, stop);
  const double per_pixel = watch.seconds() / (area / (picture.stride * picture.stride));
  int finer = picture.stride;
  while (finer > 1 && per_pixel * area / (finer * finer / 4.0) < kSeconds) finer /= 2;
  if (finer < picture.stride) picture = {one_sample_image(scene, *integrator, first, finer, stop), finer};
  return picture;
}

}  // namespace covary
