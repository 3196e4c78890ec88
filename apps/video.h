// SPDX-License-Identifier: Apache-2.0
// Converts frames to a video with ffmpeg, if it is installed.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// Whether the name ends in .mp4, .mkv, .mov or .webm.
bool is_video_name(const std::string& path);

/// Whether the shell would find ffmpeg.
bool is_ffmpeg_installed();

/// Frames are sent to ffmpeg's input one by one as 8-bit sRGB; the video gets its name only when complete.
class VideoWriter {
 public:
  /// `rate`: frames per second.
  VideoWriter(const std::string& path, double rate);
  /// Ends ffmpeg, and removes its output unless finish() succeeded.
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Linear RGB. Throws Error(kInput) if the size differs from the first frame's, and Error(kIo) if ffmpeg
  /// cannot be started or has ended.
  void add(const Image& frame);
  /// Throws Error(kIo) if ffmpeg failed or there was no frame.
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
