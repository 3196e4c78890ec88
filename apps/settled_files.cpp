// SPDX-License-Identifier: Apache-2.0
#include "settled_files.h"

#include <system_error>

#include "core/error.h"
#include "film/image_file.h"
#include "imageio/exr_image.h"
#include "plans/made_of.h"

namespace covary {

bool is_finished_exr(const std::string& path) { return is_complete_exr(path) && made_file(path).complete; }

std::string damage_of(const std::string& path) {
  try {
    check_image(path);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

bool SettledFiles::is_settled(const std::string& path) {
  std::error_code no_size, no_time;
  const auto now = std::chrono::steady_clock::now();
  const Seen found{std::filesystem::file_size(path, no_size), std::filesystem::last_write_time(path, no_time), now};
  if (no_size || no_time) {
    seen_.erase(path);
    return false;
  }
  Seen& seen = seen_.try_emplace(path, found).first->second;
  if (seen.size != found.size || seen.written != found.written) seen = found;
  return now - seen.since >= kSettled && is_finished_exr(path);
}

}  // namespace covary
