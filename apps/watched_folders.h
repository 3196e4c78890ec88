// SPDX-License-Identifier: Apache-2.0
// `denoise --watch FOLDER`: images of any name that other programs write into folders.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "frame_files.h"

namespace covary {

/// Whether the inputs are folders. Throws Error(kUsage) if some are and others are not, without --watch, for options of
/// frames, and if the output is a file or one of the inputs.
bool are_folders(const FrameOptions& options, const std::vector<std::string>& inputs, const std::string& output);

/// Waits for EXR files in the folders, and calls `run` once for each that is complete, with its path in every folder
/// (files of the same name are renders of one picture) and the path of the result, which has this name, too; `run`
/// returns what to say. Leaves out hidden files, results of `covary denoise` and, with --resume, files whose result is
/// there. Makes the output folder. Ends after --idle seconds without work, naming files that were never complete; an
/// image whose call throws Error(kInput) is reported and left out. Throws Error(kInput) naming these in the end, and
/// Error(kIo) if the output folder cannot be made.
void for_each_image(
    const FrameOptions& options, const std::vector<std::string>& inputs, const std::string& output,
    const std::function<std::string(const std::vector<std::string>& paths, const std::string& result)>& run);

}  // namespace covary
