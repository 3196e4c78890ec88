// SPDX-License-Identifier: Apache-2.0
#include "fuzz/targets.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "combine/grouped_file.h"
#include "core/error.h"
#include "film/film_file.h"
#include "film/image_file.h"
#include "io/load_scene.h"
#include "lab/suite.h"
#include "meshes/mesh_file.h"
#include "plans/pass_files.h"
#include "sampling/coefficient_table.h"
#include "sampling/guiding_field.h"
#include "support/leaks.h"
#include "tensors/tensor_file.h"
#include "textures/image.h"

namespace covary::fuzz {
namespace {

template <typename Read>
bool accepts(Read&& read) {
  try {
    read();
    return true;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kInternal) throw;
    return false;
  }
}

std::string_view text_of(Bytes input) { return {reinterpret_cast<const char*>(input.data()), input.size()}; }

/// A file in memory with this content.
class InputFile {
 public:
  explicit InputFile(Bytes input) : file_(memfd_create("input", MFD_CLOEXEC)) {
    COVARY_CHECK(file_ >= 0 && write(file_, input.data(), input.size()) == std::ssize(input), "a file in memory");
  }
  ~InputFile() { close(file_); }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
};

/// What a mesh goes through on its way into the scene.
void place(MeshFile file) {
  size_t n_repaired = 0;
  const TriangleMesh mesh(place_mesh(std::move(file), {}, n_repaired));
}

}  // namespace

bool scene(Bytes input) {
  return accepts([&] { load_scene_text(text_of(input), "/no/such/folder/scene.xml"); });
}
bool pbrt(Bytes input) {
  return accepts([&] { load_scene_text(text_of(input), "/no/such/folder/scene.pbrt"); });
}
bool gltf(Bytes input) {
  LoadOptions options;
  options.view.environment = "auto", options.time = 0.5;
  return accepts([&] { load_scene_text(text_of(input), "/no/such/folder/scene.gltf", options); });
}
bool tensor(Bytes input) {
  const InputFile input_file(input);
  return accepts([&] {
    const TensorFile file(input_file.path());
    for (const char* field : {"phi_i", "theta_i", "ndf", "vndf", "luminance", "rgb"}) file.floats(field);
    file.bytes("jacobian");
  });
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
bool film(Bytes input) {
  const InputFile file(input);
  return accepts([&] { read_film(file.path()); });
}
bool grouped(Bytes input) {
  const InputFile file(input);
  return accepts([&] {
    const GroupedFile groups({file.path()});
    GroupedFile::Rows rows;
    groups.read_rows(0, groups.height(), rows);
  });
}
bool image(Bytes input) {
  const InputFile file(input);
  const test_support::LeaksOfOthers of_openimageio;
  const bool texture = accepts([&] { read_texels(file.path()); });
  const bool image = accepts([&] {
    inspect_image(file.path());
    read_image(file.path());
  });
  return texture && image;
}
bool suite(Bytes input) {
  return accepts([&] { lab::validate(lab::parse_suite(std::string(text_of(input)), "suite.json")); });
}
bool costs(Bytes input) {
  return accepts([&] { parse_pass_costs(text_of(input)); });
}

bool training(Bytes input) {
  const bool file = accepts([&] { CoefficientTable::from_bytes(text_of(input), "scene; settings", "file"); });
  const bool body = accepts([&] {
    const CoefficientTable table = CoefficientTable::from_body(text_of(input), "table");
    for (const Vec3& p : {Vec3(), Vec3(1, 2, 3), Vec3(-1e30f)})
      if (const uint32_t cell = table.find(table.grid().key(p, {0, 0, 1})); cell != CoefficientTable::kNone)
        for (uint32_t light = 0; light < std::min(table.n_lights(), 4u); ++light) table.light(cell, light);
  });
  const bool field = accepts([&] {
    const GuidingField guiding = GuidingField::from_body(text_of(input), "field");
    for (const Vec3& p : {Vec3(), Vec3(1, 2, 3), Vec3(-1e30f)})
      if (const uint32_t leaf = guiding.find(p); leaf != GuidingField::kNone) guiding.leaf(leaf).mixture.at(p);
  });
  return file || body || field;
}

std::span<const Target> targets() {
  static constexpr Target kTargets[] = {
      {"scene", scene}, {"pbrt", pbrt},       {"gltf", gltf},        {"tensor", tensor},         {"ply", ply},
      {"obj", obj},     {"film", film},       {"image", image},      {"serialized", serialized}, {"suite", suite},
      {"costs", costs}, {"grouped", grouped}, {"training", training}};
  return kTargets;
}

}  // namespace covary::fuzz
