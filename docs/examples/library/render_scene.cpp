// SPDX-License-Identifier: Apache-2.0
// Renders a scene (Mitsuba XML) by the default, which denoises.
//
//     render_scene SCENE.xml OUT.exr
#include <covary/combine/registry.h>
#include <covary/plans/estimator_plans.h>
#include <covary/plans/integrator_choice.h>
#include <covary/plans/render.h>

#include <cstdio>
#include <exception>
#include <string>

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "render_scene SCENE.xml OUT.exr\n"), 2;
  covary::LoadOptions load;
  load.width = 120, load.height = 80;                   // override the scene's size
  load.make_integrator = covary::integrator_maker({});  // the scene's integrator
  const covary::LoadedScene scene = covary::load_scene(argv[1], load);

  const covary::Plan plan = covary::estimator_plan(covary::make_default_estimator());
  covary::RenderRequest request;
  request.spp = 24;
  request.output = argv[2];
  covary::RenderCallbacks callbacks;
  callbacks.warning = [](const std::string& text) { std::fprintf(stderr, "warning: %s\n", text.c_str()); };
  const covary::RenderResult result = covary::render(scene, plan, request, callbacks);

  std::printf("%g samples per pixel in %.2f s, predicted relMSE %.3g\n", result.samples_per_pixel(),
              result.render_seconds(), result.predicted ? result.predicted->relmse : 0.0);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "render_scene: %s\n", error.what());
  return 1;
}
