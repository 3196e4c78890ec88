// SPDX-License-Identifier: Apache-2.0
// Animations of glTF files.
#pragma once

#include "gltf/gltf_file.h"

namespace covary {

/// Moves the nodes to where the file's animations put them at `time`, in seconds: translation, rotation, scale and
/// weights of morph targets. Before its first key and after its last, nothing moves. Of several animations of one
/// property of a node, the first counts; the others are alternatives, which a warning names.
void move_gltf_nodes(GltfFile& file, double time);

}  // namespace covary
