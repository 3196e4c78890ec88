// SPDX-License-Identifier: Apache-2.0
// Readers fed with arbitrary bytes. Each target returns whether the input was accepted; false: rejected with an Error
// of the input's fault. Anything else (another exception, Error(kInternal), a sanitizer's report) is a finding.
#pragma once

#include <cstddef>
#include <span>

namespace covary::fuzz {

using Bytes = std::span<const std::byte>;

/// A scene file: XML, then the objects it describes. Names of files lead nowhere.
bool scene(Bytes input);
bool ply(Bytes input);
bool obj(Bytes input);
bool serialized(Bytes input);

}  // namespace covary::fuzz
