// SPDX-License-Identifier: Apache-2.0
#include "film/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "core/error.h"

namespace covary {
namespace fs = std::filesystem;

OutputFile::OutputFile(const std::string& path) : path_(path), target_(path) {
  std::error_code ignored;
  if (fs::is_symlink(path, ignored)) {
    const fs::path real = fs::canonical(path, ignored);
    if (!ignored) target_ = real.string();
  }
  const fs::file_status status = fs::status(target_, ignored);
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw Error(ErrorCode::kIo, fmt::format("cannot write {}: it exists and is not a regular file", path));
  const fs::path name = fs::path(target_).filename(), folder = fs::path(target_).parent_path();
  if (name.empty()) throw Error(ErrorCode::kIo, fmt::format("cannot write '{}': it names no file", path));
  if (!folder.empty() && !fs::is_directory(folder, ignored))
    throw Error(ErrorCode::kIo, fmt::format("cannot write {}: there is no folder {}", path, folder.string()));
  // The name is unique among processes and threads; a long file name is cut so that the temporary one is valid, too.
  static std::atomic<unsigned> counter{0};
  temporary_ = (folder / fmt::format(".{}.{}-{}.part", name.string().substr(0, 200), getpid(), counter++)).string();
  const int descriptor = open(temporary_.c_str(), O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0666);
  if (descriptor < 0) throw Error(ErrorCode::kIo, fmt::format("cannot write {}: {}", path, std::strerror(errno)));
  file_ = fdopen(descriptor, "w+b");
}

OutputFile::~OutputFile() {
  if (!file_) return;
  std::fclose(file_);
  unlink(temporary_.c_str());
}

void OutputFile::fail(const char* what) {
  if (!failure_) failure_ = errno ? errno : EIO;
  throw Error(ErrorCode::kIo, fmt::format("cannot {} {}: {}", what, path_, std::strerror(failure_)));
}

void OutputFile::write(const void* data, size_t size) {
  errno = 0;
  if (std::fwrite(data, 1, size, file_) != size) fail("write");
}

uint64_t OutputFile::position() {
  errno = 0;
  const off_t position = ftello(file_);
  if (position < 0) fail("write");
  return static_cast<uint64_t>(position);
}

void OutputFile::seek(uint64_t position) {
  errno = 0;
  if (fseeko(file_, static_cast<off_t>(position), SEEK_SET) != 0) fail("write");
}

void OutputFile::commit() {
  errno = failure_;
  if (failure_ || std::fflush(file_) != 0 || fsync(fileno(file_)) != 0) fail("write");
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail("put in place");
  std::fclose(file_);
  file_ = nullptr;
  // Makes the rename itself durable; a file system that cannot do this is no reason to fail.
  const std::string folder = fs::path(target_).parent_path().string();
  const int descriptor = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) {
    fsync(descriptor);
    close(descriptor);
  }
}

void write_text_file(const std::string& path, const std::string& text) {
  OutputFile file(path);
  file.write(text.data(), text.size());
  file.commit();
}

}  // namespace covary
