// SPDX-License-Identifier: Apache-2.0
// Renders a scene without denoising, in groups of samples that tell the noise, and denoises it afterwards.
//
//     denoise_render SCENE.xml NOISY.exr OUT.exr
#include <covary/combine/combine.h>
#include <covary/combine/registry.h>
#include <covary/combine/result_file.h>
#include <covary/denoising/denoising_choice.h>
#include <covary/plans/estimator_plans.h>
#include <covary/plans/integrator_choice.h>
#include <covary/plans/render.h>

#include <cstdio>
#include <exception>

int main(int argc, char** argv) try {
  if (argc != 4) return std::fprintf(stderr, "denoise_render SCENE.xml NOISY.exr OUT.exr\n"), 2;
  covary::LoadOptions load;
  load.width = 120, load.height = 80;
  load.make_integrator = covary::integrator_maker({});
  const covary::LoadedScene scene = covary::load_scene(argv[1], load);

  covary::RenderRequest request;
  request.spp = 24;
  request.aovs = true;  // albedo, normals, … to guide the denoising
  request.output = argv[2];
  const covary::Plan plan = covary::estimator_plan(covary::make_estimator(covary::kNoEstimator), {.groups = 12});
  const covary::RenderResult render = covary::render(scene, plan, request);

  covary::CombineRequest denoising;  // refers to the film and the auxiliary images
  denoising.independent = covary::source_of(render.passes[0].film, "my render");
  denoising.estimator = covary::make_default_estimator(false, {}, {covary::DenoisingChoice::kAuto});
  denoising.settings.std_error = true;
  denoising.settings.features = covary::features_among(render.aovs);
  covary::CombinedImage denoised = covary::combine(denoising);

  if (denoised.predicted) std::printf("predicted relMSE %.3g\n", denoised.predicted->relmse);
  covary::write_result(argv[3], denoising.independent.origin.place, {{"covary:estimator", denoising.estimator.text}},
                       denoised.image, denoised.layers);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "denoise_render: %s\n", error.what());
  return 1;
}
