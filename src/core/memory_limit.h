// SPDX-License-Identifier: Apache-2.0
// How much memory files may take, known from their headers before any of it is taken: a small file can stand for very
// many pixels.
#pragma once

#include <string>

namespace covary {

/// Bytes: no limit is smaller.
inline constexpr double kLeastMemoryLimit = 200e6;

/// Bytes of the machine, or of the control group (container) that the program runs in, if that has less.
double machine_memory();

/// Bytes that the program may take for what files say: three quarters of machine_memory(), or what the environment
/// variable COVARY_MEMORY says, in GB. Throws Error(kUsage) where that is not a number, or less than the least.
double memory_limit();

/// Throws Error(kInput) where `bytes` together with what the program already holds are more than memory_limit():
/// "FILE: WHAT needs 12 GB of memory beside the 140 MB in use; the limit is …".
void require_memory(const std::string& file, const std::string& what, double bytes);

/// The end of such a message: "the limit is 10 GB: use less, or raise it by …".
std::string memory_limit_text();

/// "1.5 GB".
std::string bytes_text(double bytes);

}  // namespace covary
