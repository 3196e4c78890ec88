// SPDX-License-Identifier: Apache-2.0
// The pixels of a scene: an image, or the frames of a sequence stacked vertically, so that errors over all pixels are
// those of the sequence.
#pragma once

#include <string>
#include <vector>

#include "lab/plan.h"
#include "metrics/metrics.h"
#include "metrics/sequence_errors.h"

namespace covary::lab {

/// The pixels in a scene's window, from an image of any size that covers it or from all frames; of `layer`, or the
/// scene's layer if that is empty. Throws Error(kInput) if an image does not cover the window.
Image read_window(const std::string& path, const SceneInstance& scene, const std::string& layer = "");

/// Splits such pixels into the images they consist of.
std::vector<Image> images_of(const Image& pixels, const SceneInstance& scene);

/// One or two references of a scene, and what relative errors are relative to (compute_metric()): of two references,
/// these denoised.
struct SceneReferences {
  std::vector<Image> images, denominators;
};
/// Throws like read_window().
SceneReferences read_references(const std::vector<std::string>& files, const SceneInstance& scene);

/// The mean of a metric over the scene's images.
double mean_metric(Metric metric, const Image& pixels, const SceneReferences& references, const SceneInstance& scene);

/// Errors of frames; empty for a single image.
std::vector<FrameErrors> frame_errors(const Image& pixels, const SceneReferences& references,
                                      const SceneInstance& scene);

}  // namespace covary::lab
