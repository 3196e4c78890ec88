// SPDX-License-Identifier: Apache-2.0
#include "formats/file_resolver.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/git_lfs.h"
#include "core/memory_limit.h"
#include "core/parallel.h"

namespace covary {
namespace fs = std::filesystem;

namespace {

constexpr size_t kMaxEntries = 2000;  // of a folder that are looked at

/// Calls visit(path) for entries of the folder.
template <typename Visit>
void for_entries(const fs::path& folder, const Visit& visit) {
  std::error_code error;
  size_t n = 0;
  for (fs::directory_iterator it(folder.empty() ? fs::path(".") : folder, error), end; !error && it != end;
       it.increment(error)) {
    if (++n > kMaxEntries) break;
    visit(it->path());
  }
}

std::string lower_case(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

/// The file at `path` with letters of another case, as file systems of Windows and macOS find it; "" if there is none,
/// or more than one.
fs::path in_other_case(const fs::path& path) {
  std::error_code ignored;
  fs::path found = path.root_path();
  for (const fs::path& part : path.relative_path()) {
    if (fs::exists(found / part, ignored)) {
      found /= part;
      continue;
    }
    std::vector<fs::path> alike;
    for_entries(found, [&](const fs::path& entry) {
      if (lower_case(entry.filename().string()) == lower_case(part.string())) alike.push_back(entry.filename());
    });
    if (alike.size() != 1) return {};
    found /= alike[0];
  }
  return fs::is_regular_file(found, ignored) ? found : fs::path();
}

}  // namespace

void FileResolver::add_folder(const std::string& folder) { folders_.insert(folders_.begin(), folder); }

std::string FileResolver::resolve(const std::string& name, const SourceLocation& where, Diagnostics& diagnostics) {
  const std::string path = find(name, where, diagnostics);
  if (path.empty()) return "";
  if (const std::string problem = git_lfs_problem(path); !problem.empty()) {
    diagnostics.error(where, problem);
    return "";
  }
  const std::lock_guard lock(mutex_);
  files_.emplace(path, name);
  return path;
}

std::string FileResolver::find(const std::string& name, const SourceLocation& where, Diagnostics& diagnostics) const {
  std::string portable = name;
  std::error_code ignored;
  std::replace(portable.begin(), portable.end(), '\\', '/');
  std::vector<fs::path> candidates;
  for (const std::string& form : {name, portable}) {
    if (fs::path(form).is_absolute()) {
      candidates.emplace_back(form);
    } else {
      for (const std::string& folder : folders_) candidates.push_back(fs::path(folder) / form);
      candidates.push_back(fs::path(where.file).parent_path() / form);
      candidates.emplace_back(form);  // last: from where the program was started
    }
    if (portable == name) break;
  }
  std::string other;  // something of that name that is not a regular file
  for (const fs::path& candidate : candidates) {
    if (fs::is_regular_file(candidate, ignored)) return candidate.string();
    if (other.empty() && fs::exists(candidate, ignored)) other = candidate.string();
  }
  for (const fs::path& candidate : candidates)
    if (const fs::path found = in_other_case(candidate); !found.empty()) {
      diagnostics.warn(where, fmt::format("file '{}' is read as '{}'", name, found.string()));
      return found.string();
    }
  if (!other.empty()) {
    const bool folder = fs::is_directory(other, ignored);
    diagnostics.error(
        where, fmt::format("'{}' is {}; expected a regular file", other, folder ? "a folder" : "a pipe or device"));
    return "";
  }

  // Suggest files in the folder that the name points to.
  std::vector<std::string> neighbours;
  std::string searched;
  for (size_t i = 0; i < candidates.size(); ++i) {
    const fs::path folder = candidates[i].parent_path();
    const std::string shown = folder.empty() ? "." : folder.string();
    if (searched.find("'" + shown + "'") != std::string::npos) continue;
    searched += (searched.empty() ? "'" : ", '") + shown + "'";
    for_entries(folder, [&](const fs::path& entry) { neighbours.push_back(entry.filename().string()); });
  }
  const std::string hint = did_you_mean(fs::path(portable).filename().string(), neighbours);
  diagnostics.error(where, fmt::format("file '{}' not found in {}{}", name, searched, hint),
                    fmt::format("files not found in {}", searched));
  return "";
}

std::map<std::string, std::string> FileResolver::files() const {
  const std::lock_guard lock(mutex_);
  return files_;
}

std::string FileResolver::content_hash(const std::string& scene_hash) const {
  std::vector<std::pair<std::string, std::string>> files;  // name in the scene, path; later: name, hash
  for (const auto& [path, name] : this->files()) files.emplace_back(name, path);
  parallel_for(files.size(), [&](size_t i) {
    try {
      files[i].second = hash_text(hash_bytes(FileView(files[i].second).bytes()));
    } catch (const Error&) {
      files[i].second = "unreadable";  // whoever needed the file has reported why
    }
  });
  std::sort(files.begin(), files.end());
  std::string digest = scene_hash + "\n";
  for (const auto& [name, hash] : files) digest += fmt::format("{}\n{}\n", name, hash);
  return hash_text(hash_bytes(digest));
}

namespace {

/// The content of a gzip file, all its members.
std::string uncompress(const std::string& path, std::string_view bytes) {
  const auto fail = [&](const char* reason) {
    throw Error(ErrorCode::kInput, "cannot read '" + path + "': its compressed content " + reason);
  };
  z_stream stream{};
  if (inflateInit2(&stream, 15 + 16) != Z_OK) fail("cannot be decoded");  // 16: with gzip's header
  const std::unique_ptr<z_stream, int (*)(z_stream*)> owner(&stream, inflateEnd);
  std::string result;
  size_t place = 0;
  int state = Z_OK;
  while (state != Z_STREAM_END || place < bytes.size()) {
    if (state == Z_STREAM_END && inflateReset(&stream) != Z_OK) fail("cannot be decoded");
    const size_t before = result.size(), room = std::max<size_t>(before, size_t{1} << 20);
    if (before > 0) require_memory(path, "its uncompressed content", 2.0 * static_cast<double>(before));
    result.resize(before + room);
    const size_t n_in = std::min<size_t>(bytes.size() - place, size_t{1} << 30);
    const size_t n_out = std::min<size_t>(room, size_t{1} << 30);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + place));
    stream.avail_in = static_cast<uInt>(n_in);
    stream.next_out = reinterpret_cast<Bytef*>(result.data() + before);
    stream.avail_out = static_cast<uInt>(n_out);
    state = inflate(&stream, Z_NO_FLUSH);
    place += n_in - stream.avail_in;
    result.resize(before + n_out - stream.avail_out);
    if (state != Z_OK && state != Z_STREAM_END) fail(place == bytes.size() ? "is cut off" : "is damaged");
  }
  return result;
}

}  // namespace

FileView::FileView(const std::string& path) {
  const auto fail = [&](const std::string& reason) {
    throw Error(ErrorCode::kIo, "cannot read '" + path + "': " + reason);
  };
  if (const std::string pointer = git_lfs_problem(path); !pointer.empty()) throw Error(ErrorCode::kInput, pointer);
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) fail(std::strerror(errno));
  struct stat status {};
  std::string problem;
  if (fstat(file, &status) != 0) {
    problem = std::strerror(errno);
  } else if (!S_ISREG(status.st_mode)) {
    problem = "not a regular file";
  } else if (status.st_size > 0) {
    size_ = static_cast<size_t>(status.st_size);
    data_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE | MAP_POPULATE, file, 0);
    if (data_ == MAP_FAILED) data_ = nullptr, problem = std::strerror(errno);
  }
  close(file);
  if (!problem.empty()) fail(problem);
  if (!path.ends_with(".gz")) return;
  const std::string_view raw = text();
  std::exception_ptr failed;
  try {
    uncompressed_ = uncompress(path, raw);
  } catch (...) {
    failed = std::current_exception();
  }
  if (data_) munmap(data_, size_);
  data_ = nullptr;
  if (failed) std::rethrow_exception(failed);
  is_compressed_ = true;
}

FileView::~FileView() {
  if (data_) munmap(data_, size_);
}

}  // namespace covary
