// SPDX-License-Identifier: Apache-2.0
// The files that a render writes.
#pragma once

#include <string>

#include "plans/render.h"

namespace covary {

/// "a/b.png" for "a/b.exr".
std::string preview_path(const std::string& output);

/// What render() checks of RenderRequest::output before anything else, for callers that have work before it. Throws
/// Error(kUsage) for a name that does not end in .exr, and Error(kIo) if the file cannot be written.
void check_output(const std::string& path);

/// Writes the image with its attributes, and the preview if requested. For an interrupted render, the image so far.
/// Writes nothing if the request names no output.
void write_result_files(const Plan& plan, const RenderRequest& request, RenderResult& result);

}  // namespace covary
