// SPDX-License-Identifier: Apache-2.0
// Files that other programs write, when they are complete, and whether they are whole.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace covary {

/// Whether nothing more will be written to the EXR file: it is whole, and not of an interrupted render that continues.
bool is_finished_exr(const std::string& path);

/// What is wrong with an image by its checksums, header and size; empty if all is well.
std::string damage_of(const std::string& path);

/// Watches files by polling. A file is settled if it is an EXR file that is complete, and its size and time have not
/// changed for kSettled by this machine's clock, whatever that of a file server says.
class SettledFiles {
 public:
  static constexpr std::chrono::milliseconds kSettled{2000};

  /// Looks at the file once more; false for files that do not exist.
  bool is_settled(const std::string& path);

 private:
  struct Seen {
    std::uintmax_t size = 0;
    std::filesystem::file_time_type written;
    std::chrono::steady_clock::time_point since;
  };
  std::map<std::string, Seen> seen_;
};

}  // namespace covary
