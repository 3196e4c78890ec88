// SPDX-License-Identifier: Apache-2.0
// Denoises two renders in memory, arrays of floats with albedo and normals, and tells the error that is left.
//
//     denoise_arrays RENDER.exr OTHER_SEED.exr OUT.exr
//
// The two files, which have layers Albedo and N, stand for a renderer of your own. Ctrl-C ends it soon.
#include <covary/combine/combine.h>
#include <covary/combine/registry.h>
#include <covary/combine/result_file.h>
#include <covary/denoising/denoising_choice.h>
#include <covary/denoising/render_features.h>
#include <covary/film/image_file.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <vector>

using covary::Image;  // width, height, channels, and the floats in `data`: [y][x][channel]

std::atomic<bool> stop{false};

int main(int argc, char** argv) try {
  if (argc != 4) return std::fprintf(stderr, "denoise_arrays RENDER.exr OTHER_SEED.exr OUT.exr\n"), 2;
  const auto layer = [&](int file, const char* name) { return covary::read_image(argv[file], name).image; };
  const Image renders[] = {layer(1, ""), layer(2, "")};  // linear RGB
  // Of each render: the noise of their mean, which is that of the picture's own samples, would pass for detail.
  covary::RenderFeatures features;
  for (const int file : {1, 2}) {
    features.add(covary::feature::kAlbedo, argv[file], layer(file, "Albedo"), &renders[file - 1]);
    features.add(covary::feature::kNormal, argv[file], layer(file, "N"));
  }

  // [y][x][render][rgb]: of each pixel the means of all renders, of equal numbers of samples.
  const int width = renders[0].width, height = renders[0].height;
  std::vector<float> samples;
  for (size_t i = 0; i < renders[0].data.size(); i += 3)
    for (const Image& render : renders)
      for (size_t c = i; c < i + 3; ++c) samples.push_back(render.data.at(c));

  covary::CombineRequest request;  // refers to these arrays
  request.independent = covary::source_of({width, height, 2, samples.data()}, {.name = "my renders"});
  request.estimator = covary::make_default_estimator(false, {}, {covary::DenoisingChoice::kAuto});
  request.settings.std_error = true;  // and the predicted error with it
  request.settings.features = features.view();
  request.checked = [](const covary::InputFindings& found) {
    for (const covary::Finding& finding : found.findings)
      if (finding.severity == covary::Finding::Severity::kWarning)
        std::fprintf(stderr, "warning: %s\n", finding.text.c_str());
  };
  request.stop = &stop;
  std::signal(SIGINT, [](int) { stop = true; });  // or any other thread
  covary::CombinedImage combined = covary::combine(request);
  if (combined.interrupted) return std::fprintf(stderr, "denoise_arrays: stopped\n"), 130;

  if (!combined.image.note.empty()) std::printf("%s\n", combined.image.note.c_str());
  if (const auto& error = combined.predicted) {
    std::printf("predicted relMSE %.3g", error->relmse);
    if (error->bounds) std::printf(" (80 %%: %.3g to %.3g)", error->bounds->low, error->bounds->high);
    std::printf("%s%s\n", error->doubt.empty() ? "" : ", but ", error->doubt.c_str());  // why it may be wrong
  }
  covary::write_result(argv[3], request.independent.origin.place, {{"covary:estimator", request.estimator.text}},
                       combined.image, combined.layers);
  return 0;  // the picture is combined.image.estimate, its standard error combined.image.std_error
} catch (const std::exception& error) {
  std::fprintf(stderr, "denoise_arrays: %s\n", error.what());
  return 1;
}
