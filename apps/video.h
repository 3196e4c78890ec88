// SPDX-License-Identifier: Apache-2.0
// Frames to a video, by the program ffmpeg where it is installed.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// Whether the name ends in .mp4, .mkv, .mov or .webm.
bool is_video_name(const std::string& path);

/// Frames go to ffmpeg's input one by one as 8-bit sRGB; the video has its name only when it is whole.
class VideoWriter {
 public:
  /// `rate`: frames per second. Throws Error(kIo) where the program cannot be started.
  VideoWriter(const std::string& path, double rate);
  /// Ends ffmpeg, and removes what it wrote unless finish() did its work.
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Linear RGB. Throws Error(kInput) where the size is not that of the first frame, and Error(kIo) where ffmpeg has
  /// ended.
  void add(const Image& frame);
  /// Throws Error(kIo) where ffmpeg failed or there was no frame.
  void finish();

 private:
  void start(int width, int height);

  std::string path_, temporary_;
  double rate_;
  int width_ = 0, height_ = 0;
  std::FILE* pipe_ = nullptr;
  std::vector<unsigned char> bytes_;
};

}  // namespace covary
