// SPDX-License-Identifier: Apache-2.0
// Feeds arbitrary bytes to readers. Each target returns whether the input was accepted; false: rejected with an Error
// that blames the input. Anything else (another exception, Error(kInternal), a sanitizer report) is a finding.
#pragma once

#include <cstddef>
#include <span>

namespace covary::fuzz {

using Bytes = std::span<const std::byte>;

/// A scene file: XML, then the objects it describes. Names of files lead nowhere.
bool scene(Bytes input);
/// The same of pbrt.
bool pbrt(Bytes input);
/// The same of glTF, JSON or binary, with images in the file.
bool gltf(Bytes input);
/// A tensor file, as of a measured material.
bool tensor(Bytes input);
bool ply(Bytes input);
bool obj(Bytes input);
bool serialized(Bytes input);
/// An EXR file as a film of covary.
bool film(Bytes input);
/// An EXR file of any renderer as groups of samples, as `covary combine` reads it.
bool grouped(Bytes input);
/// An image file in any format: as a texture, and as images are read for comparison.
bool image(Bytes input);
/// A suite of experiments.
bool suite(Bytes input);
/// What the samples of a kept film cost.
bool costs(Bytes input);

/// A training file, and the table behind its header alone, which no checksum protects.
bool training(Bytes input);

/// Name and function of every target; the name is also that of its folder in tests/fuzz/corpus.
struct Target {
  const char* name;
  bool (*run)(Bytes input);
};
std::span<const Target> targets();

}  // namespace covary::fuzz
