// SPDX-License-Identifier: Apache-2.0
// Compiled kernels in the user's cache folder.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace covary::device {

/// $COVARY_KERNEL_CACHE, or else covary/kernels in $XDG_CACHE_HOME or ~/.cache; empty if none of them is set, or if the
/// first one is set to nothing: then nothing is kept.
std::filesystem::path cache_folder();

/// What was stored under `key` (letters and digits); nothing if there is none or the file is damaged.
std::optional<std::string> cached_binary(const std::filesystem::path& folder, const std::string& key);

/// Writes a file of another name first, and renames it, so that other processes see all of it or nothing. A folder that
/// cannot be written is no error: the kernels are compiled again next time.
void store_binary(const std::filesystem::path& folder, const std::string& key, const std::string& binary);

}  // namespace covary::device
