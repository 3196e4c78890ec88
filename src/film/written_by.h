// SPDX-License-Identifier: Apache-2.0
// Which program wrote an image, as its attributes say, and how one changes a setting there.
#pragma once

#include <map>
#include <string>

namespace covary {

enum class Renderer { kUnknown, kCovary, kBlender, kLuxCore, kMitsuba, kPbrt };

/// By `covary:…` of covary; `cycles.…` and `BlenderMultiChannel` of Blender; `generatedBy` of Mitsuba;
/// `samplesPerPixel` and `renderTimeSeconds` of pbrt. Files of LuxCore do not tell.
Renderer written_by(const std::map<std::string, std::string>& attributes);

enum class RenderSetting {
  kSeed,
  kNoDenoiser,
  kSamples,  ///< the same number in every pixel and render
  kFloats,   ///< 32-bit floats, linear, not clamped
};

/// Where the setting is in this program: "in Blender scene.cycles.seed"; if it is unknown, in each that is known,
/// separated by commas.
std::string where_to_set(RenderSetting setting, Renderer renderer);

}  // namespace covary
