// SPDX-License-Identifier: Apache-2.0
#include "film/auxiliary_features.h"

namespace covary {
namespace {

// Sources: docs/other-renderers.md.
constexpr std::string_view kAlbedoNames[] = {
    "Albedo",            // covary, pbrt-v4
    "albedo",            // Mitsuba 3 by our example, RenderMan, Karma
    "ALBEDO",            // LuxCore
    "VRayDiffuseFilter"  // V-Ray
};
constexpr std::string_view kNormalNames[] = {
    "Ns",                  // pbrt-v4: shading normal
    "N",                   // covary, Arnold, Karma; pbrt-v4: geometric normal
    "sh_normal",           // Mitsuba 3
    "normal",              // RenderMan
    "AVG_SHADING_NORMAL",  // LuxCore
    "bump_normals",        // V-Ray
    "normals"              // V-Ray
};
constexpr std::string_view kPositionNames[] = {
    "P",         // covary, pbrt-v4, Arnold
    "Position",  // Blender
    "position"   // Mitsuba 3 by our example
};
constexpr std::string_view kDenoisingAlbedoNames[] = {
    "DenoisingAlbedo",   // covary
    "Denoising Albedo",  // Blender
    "denoise_albedo",    // Arnold
    "Denoise Albedo"     // Octane
};
constexpr std::string_view kDenoisingNormalNames[] = {
    "DenoisingNormal",   // covary
    "Denoising Normal",  // Blender
    "Denoise Normal"     // Octane
};

}  // namespace

constexpr std::array<AuxiliaryFeature, feature::kCount> kAuxiliaryFeatures = {{
    {"the albedo", "Albedo", true, kAlbedoNames, feature::kDenoisingAlbedo},
    {"the normal", "N", false, kNormalNames, feature::kDenoisingNormal},
    {"the position", "P", false, kPositionNames},
    {"the albedo behind glass", "DenoisingAlbedo", true, kDenoisingAlbedoNames},
    {"the normal behind glass", "DenoisingNormal", false, kDenoisingNormalNames},
}};

}  // namespace covary
