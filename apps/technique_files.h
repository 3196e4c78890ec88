// SPDX-License-Identifier: Apache-2.0
// `covary render --debug-strategies`: the techniques of bidirectional path tracing as files.
#pragma once

#include <string>

#include "plans/render.h"

namespace covary {

/// Throws Error(kUsage) where `folder` holds files, or the scene's integrator has no techniques to show.
void check_technique_folder(const std::string& folder, const LoadedScene& scene);

/// Renders each technique (s, t) with the samples of the result's last pass of camera samples, and writes into `folder`
/// `s2_t3.exr` and `s2_t3_unweighted.exr`, and two pyramids of all of them as PNG: rows for the length of paths, in
/// each from s = 0 on. Throws Error(kIo).
void write_techniques(const std::string& folder, const LoadedScene& scene, const RenderResult& result,
                      const std::atomic<bool>* stop);

}  // namespace covary
