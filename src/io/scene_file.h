// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace covary {

/// Whether a file of this name is read as a scene of pbrt-v4.
inline bool is_pbrt_file(std::string_view name) { return name.ends_with(".pbrt"); }
/// Whether a file of this name is a scene, rather than an image or else.
inline bool is_scene_file(std::string_view name) { return name.ends_with(".xml") || is_pbrt_file(name); }

}  // namespace covary
