// SPDX-License-Identifier: Apache-2.0
// The textures by the name scene files use; each plugin's file documents its parameters. A new texture: one line here,
// one in registry.cpp, one in CMake.
#pragma once

#include <memory>
#include <span>

#include "scene/parameters.h"
#include "scene/texture.h"

namespace covary {

/// All textures, sorted by name.
std::span<const Plugin<Texture>> texture_plugins();

// Each returns null after recording an error.
std::shared_ptr<Texture> make_bitmap(Parameters& parameters);
std::shared_ptr<Texture> make_checkerboard(Parameters& parameters);
std::shared_ptr<Texture> make_mesh_attribute(Parameters& parameters);
std::shared_ptr<Texture> make_rawconstant(Parameters& parameters);
std::shared_ptr<Texture> make_scaled(Parameters& parameters);
std::shared_ptr<Texture> make_uniform(Parameters& parameters);
std::shared_ptr<Texture> make_vertex_colour(Parameters& parameters);

}  // namespace covary
