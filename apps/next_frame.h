// SPDX-License-Identifier: Apache-2.0
// Frames whose files are read while the one before is denoised on a device, which leaves the processor idle.
#pragma once

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "combine/grouped_file.h"
#include "combine/grouped_source.h"

namespace covary {

/// The samples of a frame: rows are read when they are wanted, or all at once.
class FrameFile {
 public:
  /// Throws like GroupedFile.
  FrameFile(const std::vector<std::string>& paths, const std::string& layer) : file_(paths, layer) {}
  FrameFile(const FrameFile&) = delete;
  FrameFile& operator=(const FrameFile&) = delete;

  const GroupedFile& file() const { return file_; }
  /// Valid as long as this object.
  GroupedSource source() const;
  /// Reads all rows, if they take at most an eighth of the memory limit.
  void read_all();
  bool is_read() const { return whole_.has_value(); }

 private:
  const GroupedFile file_;
  GroupedFile::Rows rows_;
  std::optional<GroupedImage> whole_;
};

class NextFrame {
 public:
  /// Begins to read these files on another thread. What was read before and not taken is dropped.
  void begin(const std::vector<std::string>& paths, const std::string& layer);
  /// What was read, if it is of these files; otherwise, and if they could not be read, they are read when rows are
  /// wanted. Throws like GroupedFile.
  std::shared_ptr<const FrameFile> take(const std::vector<std::string>& paths, const std::string& layer);

 private:
  std::vector<std::string> paths_;
  std::string layer_;
  std::future<std::shared_ptr<const FrameFile>> reading_;
};

}  // namespace covary
