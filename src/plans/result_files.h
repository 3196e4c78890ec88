// SPDX-License-Identifier: Apache-2.0
// The files that a render leaves.
#pragma once

#include <string>

#include "plans/render.h"

namespace covary {

/// "a/b.png" for "a/b.exr".
std::string preview_path(const std::string& output);

/// Writes the image with its attributes, and the preview where it is asked for. Of an interrupted render, it is the
/// image so far. Nothing where the request names no output.
void write_result_files(const Plan& plan, const RenderRequest& request, RenderResult& result);

}  // namespace covary
