// SPDX-License-Identifier: Apache-2.0
#include "device/binary_cache.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <system_error>

#include "core/content_hash.h"

namespace covary::device {

namespace fs = std::filesystem;

fs::path cache_folder() {
  if (const char* own = std::getenv("COVARY_KERNEL_CACHE")) return own;
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache) return fs::path(cache) / "covary/kernels";
  if (const char* home = std::getenv("HOME"); home && *home) return fs::path(home) / ".cache/covary/kernels";
  return {};
}

// A file is the binary and its hash.

std::optional<std::string> cached_binary(const fs::path& folder, const std::string& key) {
  if (folder.empty()) return std::nullopt;
  std::ifstream file(folder / key, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(file), {}};
  constexpr size_t kHash = 16;
  if (content.size() <= kHash) return std::nullopt;
  const std::string hash = content.substr(content.size() - kHash);
  content.resize(content.size() - kHash);
  if (hash != hash_text(hash_bytes(content))) return std::nullopt;
  return content;
}

void store_binary(const fs::path& folder, const std::string& key, const std::string& binary) {
  if (folder.empty()) return;
  static std::atomic<int> number{0};
  std::error_code ignored;
  fs::create_directories(folder, ignored);
  const fs::path temporary = folder / fmt::format("{}.{}.{}", key, getpid(), number++);
  bool written;
  {
    std::ofstream file(temporary, std::ios::binary);
    file << binary << hash_text(hash_bytes(binary));
    file.close();
    written = file.good();
  }
  if (written) fs::rename(temporary, folder / key, ignored);
  if (!written || ignored) fs::remove(temporary, ignored);
}

}  // namespace covary::device
