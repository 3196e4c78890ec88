// SPDX-License-Identifier: Apache-2.0
#include "next_frame.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "core/error.h"
#include "core/memory_limit.h"
#include "film/grouped_image.h"

namespace covary {

GroupedSource FrameFile::source() const {
  GroupedSource source = source_of(file_);
  if (whole_) source.rows = [whole = *whole_](int first, int n) { return rows_of(whole, first, n); };
  return source;
}

void FrameFile::read_all() {
  constexpr double kOfGroup = 3 * sizeof(float), kOfPixel = 2 * sizeof(float), kShare = 1.0 / 8;
  const double bytes = (kOfGroup * file_.groups() + kOfPixel) * file_.width() * file_.height();
  if (bytes > kShare * memory_limit()) return;
  file_.read_rows(0, file_.height(), rows_);
  whole_ = file_.view(rows_, file_.height());
}

void NextFrame::begin(const std::vector<std::string>& paths, const std::string& layer) {
  reading_ = {};  // waits
  std::error_code ignored;
  if (!std::ranges::all_of(paths, [&](const auto& path) { return std::filesystem::exists(path, ignored); })) return;
  paths_ = paths, layer_ = layer;
  reading_ = std::async(std::launch::async, [paths, layer]() -> std::shared_ptr<const FrameFile> {
    try {
      const auto frame = std::make_shared<FrameFile>(paths, layer);
      frame->read_all();
      return frame;
    } catch (const Error&) {
      return nullptr;  // told when its turn comes
    }
  });
}

std::shared_ptr<const FrameFile> NextFrame::take(const std::vector<std::string>& paths, const std::string& layer) {
  if (reading_.valid() && paths == paths_ && layer == layer_)
    if (std::shared_ptr<const FrameFile> frame = reading_.get()) return frame;
  return std::make_shared<const FrameFile>(paths, layer);
}

}  // namespace covary
