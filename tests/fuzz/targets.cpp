// SPDX-License-Identifier: Apache-2.0
#include "fuzz/targets.h"

#include <string_view>

#include "core/error.h"
#include "io/load_scene.h"
#include "io/mesh_file.h"

namespace covary::fuzz {
namespace {

template <typename Read>
bool accepts(Read&& read) {
  try {
    read();
    return true;
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kInput && error.code() != ErrorCode::kIo) throw;
    return false;
  }
}

std::string_view text_of(Bytes input) { return {reinterpret_cast<const char*>(input.data()), input.size()}; }

/// What a mesh goes through on its way into the scene.
void place(MeshFile file) {
  size_t n_repaired = 0;
  const TriangleMesh mesh(place_mesh(std::move(file), {}, n_repaired));
}

}  // namespace

bool scene(Bytes input) {
  return accepts([&] { load_scene_text(text_of(input), "/no/such/folder/scene.xml"); });
}
bool ply(Bytes input) {
  return accepts([&] { place(read_ply(input)); });
}
bool obj(Bytes input) {
  return accepts([&] { place(read_obj(text_of(input))); });
}
bool serialized(Bytes input) {
  const bool first = accepts([&] { place(read_serialized(input, 0)); });
  const bool second = accepts([&] { place(read_serialized(input, 1)); });
  return first && second;
}

}  // namespace covary::fuzz
