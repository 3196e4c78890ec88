// SPDX-License-Identifier: Apache-2.0
#include "core/memory_limit.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string_view>

#include "core/error.h"
#include "core/number_text.h"

namespace covary {
namespace {

constexpr const char* kVariable = "COVARY_MEMORY";
constexpr double kShare = 0.75;      // of the machine
constexpr double kUnlimited = 1e18;  // a control group without a limit reports "max", or a number of this size

double page_bytes() { return static_cast<double>(sysconf(_SC_PAGESIZE)); }

/// Resident memory of the program, in bytes.
double held_bytes() {
  std::ifstream file("/proc/self/statm");
  double size = 0, resident = 0;
  file >> size >> resident;
  return file ? resident * page_bytes() : 0;
}

}  // namespace

double machine_memory() {
  static const double kMemory = [] {
    double memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * page_bytes();
    for (const char* path : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
      std::ifstream file(path);
      double limit = 0;
      if (file >> limit && limit > 0 && limit < kUnlimited) memory = std::min(memory, limit);
    }
    return memory;
  }();
  return kMemory;
}

double memory_limit() {
  const char* given = std::getenv(kVariable);
  if (!given || !*given) return kShare * machine_memory();
  const std::string_view text = given;
  const double gigabytes = parse_real(text).value_or(0);
  if (!(gigabytes * 1e9 >= kMinMemoryLimit && gigabytes < 1e9))
    throw Error(ErrorCode::kUsage, fmt::format("the environment variable {} is '{}'; expected a number of GB, at "
                                               "least {:g}",
                                               kVariable, text, kMinMemoryLimit / 1e9));
  return gigabytes * 1e9;
}

void require_memory(const std::string& file, const std::string& what, double bytes) {
  const double held = held_bytes(), limit = memory_limit();
  if (held + bytes <= limit) return;
  throw Error(ErrorCode::kInput, fmt::format("{}: {} needs {} of memory in addition to the {} in use; {}", file, what,
                                             bytes_text(bytes), bytes_text(held), memory_limit_text()));
}

std::string memory_limit_text() {
  return fmt::format("the limit is {}: use less, or raise it by the environment variable {} (GB; the machine has {})",
                     bytes_text(memory_limit()), kVariable, bytes_text(machine_memory()));
}

std::string bytes_text(double bytes) {
  if (bytes >= 1e12) return fmt::format("{:.1f} TB", bytes / 1e12);
  if (bytes >= 1e9) return fmt::format("{:.1f} GB", bytes / 1e9);
  if (bytes >= 1e6) return fmt::format("{:.1f} MB", bytes / 1e6);
  return fmt::format("{:.1f} kB", bytes / 1e3);
}

}  // namespace covary
