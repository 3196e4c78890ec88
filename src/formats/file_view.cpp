// SPDX-License-Identifier: Apache-2.0
#include "formats/file_view.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace covary {

FileView::FileView(const std::string& path) {
  const auto fail = [&](const std::string& reason) {
    throw Error(ErrorCode::kIo, "cannot read '" + path + "': " + reason);
  };
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
}

FileView::~FileView() {
  if (data_) munmap(data_, size_);
}

}  // namespace covary
