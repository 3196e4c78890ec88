// SPDX-License-Identifier: Apache-2.0
// Limit on the memory that input files may take, checked from their headers before any is allocated: a small file can
// describe a huge number of pixels.
#pragma once

#include <string>

namespace covary {

/// Smallest accepted limit, in bytes.
inline constexpr double kMinMemoryLimit = 200e6;

/// Memory of the machine in bytes, or of the program's control group (container) if that is less.
double machine_memory();

/// Bytes that input files may make the program use: three quarters of machine_memory(), or the environment variable
/// COVARY_MEMORY, in GB. Throws Error(kUsage) if that is not a number or below kMinMemoryLimit.
double memory_limit();

/// Throws Error(kInput) if `bytes` plus what the program already uses exceeds memory_limit(): "FILE: WHAT needs 12 GB
/// of memory beside the 140 MB in use; the limit is …".
void require_memory(const std::string& file, const std::string& what, double bytes);

/// The end of such a message: "the limit is 10 GB: use less, or raise it by …".
std::string memory_limit_text();

/// "1.5 GB".
std::string bytes_text(double bytes);

}  // namespace covary
