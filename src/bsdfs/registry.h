// SPDX-License-Identifier: Apache-2.0
// The reflectance models by the name scene files use. A new model: one line here, one in registry.cpp, one in CMake.
#pragma once

#include <span>

#include "scene/bsdf.h"
#include "scene/parameters.h"

namespace covary {

/// All models, sorted by name.
std::span<const Plugin<Bsdf>> bsdf_plugins();

// Each returns null after recording an error.
std::shared_ptr<Bsdf> make_blendbsdf(Parameters& parameters);
std::shared_ptr<Bsdf> make_bumpmap(Parameters& parameters);
std::shared_ptr<Bsdf> make_circular(Parameters& parameters);
std::shared_ptr<Bsdf> make_conductor(Parameters& parameters);
std::shared_ptr<Bsdf> make_dielectric(Parameters& parameters);
std::shared_ptr<Bsdf> make_diffuse(Parameters& parameters);
std::shared_ptr<Bsdf> make_hair(Parameters& parameters);
std::shared_ptr<Bsdf> make_mask(Parameters& parameters);
std::shared_ptr<Bsdf> make_measured(Parameters& parameters);
std::shared_ptr<Bsdf> make_normalmap(Parameters& parameters);
std::shared_ptr<Bsdf> make_null(Parameters& parameters);
std::shared_ptr<Bsdf> make_plastic(Parameters& parameters);
std::shared_ptr<Bsdf> make_polarizer(Parameters& parameters);
std::shared_ptr<Bsdf> make_pplastic(Parameters& parameters);
std::shared_ptr<Bsdf> make_principled(Parameters& parameters);
std::shared_ptr<Bsdf> make_principledthin(Parameters& parameters);
std::shared_ptr<Bsdf> make_retarder(Parameters& parameters);
std::shared_ptr<Bsdf> make_roughconductor(Parameters& parameters);
std::shared_ptr<Bsdf> make_roughdielectric(Parameters& parameters);
std::shared_ptr<Bsdf> make_roughplastic(Parameters& parameters);
std::shared_ptr<Bsdf> make_thindielectric(Parameters& parameters);
std::shared_ptr<Bsdf> make_twosided(Parameters& parameters);

}  // namespace covary
