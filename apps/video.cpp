// SPDX-License-Identifier: Apache-2.0
#include "video.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/shell_text.h"
#include "core/srgb.h"
#include "film/image_writer.h"
#include "film/outputs.h"

namespace covary {

bool is_video_name(const std::string& path) {
  constexpr std::array<std::string_view, 4> kEndings = {".mp4", ".mkv", ".mov", ".webm"};
  return std::find(kEndings.begin(), kEndings.end(), lower_extension(path)) != kEndings.end();
}

bool is_ffmpeg_installed() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (access(((folder.empty() ? "." : folder) + "/ffmpeg").c_str(), X_OK) == 0) return true;
  return false;
}

VideoWriter::VideoWriter(const std::string& path, double rate) : path_(path), rate_(rate) {
  const std::filesystem::path whole(path);
  temporary_ = (whole.parent_path() / (".unfinished-" + whole.filename().string())).string();
}

VideoWriter::~VideoWriter() {
  if (pipe_) pclose(pipe_);
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void VideoWriter::start(int width, int height) {
  if (!is_ffmpeg_installed())
    throw Error(ErrorCode::kIo, "videos need the program ffmpeg, which is not installed (Debian: apt install ffmpeg)");
  width_ = width, height_ = height;
  // Codecs need even sizes: adds a black column or row. All players support half-resolution chroma (yuv420p).
  const std::string command = shell_text({"ffmpeg",
                                          "-loglevel",
                                          "error",
                                          "-f",
                                          "rawvideo",
                                          "-pixel_format",
                                          "rgb24",
                                          "-video_size",
                                          fmt::format("{}x{}", width, height),
                                          "-framerate",
                                          fmt::format("{}", rate_),
                                          "-i",
                                          "-",
                                          "-vf",
                                          "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                                          "-pix_fmt",
                                          "yuv420p",
                                          "-metadata",
                                          fmt::format("comment={}", kMadeByCovary),
                                          "-y",
                                          temporary_});
  std::signal(SIGPIPE, SIG_IGN);  // reported as a write error if ffmpeg ends early
  pipe_ = popen(command.c_str(), "w");
  if (!pipe_) throw Error(ErrorCode::kIo, "cannot start ffmpeg");
}

void VideoWriter::add(const Image& frame) {
  if (!pipe_) start(frame.width, frame.height);
  if (frame.width != width_ || frame.height != height_)
    throw Error(ErrorCode::kInput, fmt::format("a frame of {} x {} pixels; those before have {} x {}", frame.width,
                                               frame.height, width_, height_));
  bytes_.resize(frame.data.size());
  std::transform(frame.data.begin(), frame.data.end(), bytes_.begin(), [](float linear) {
    const float value = linear > 0 ? std::min(linear, 1.0f) : 0;  // NaN becomes 0, too
    return static_cast<unsigned char>(std::lround(255 * linear_to_srgb(value)));
  });
  if (std::fwrite(bytes_.data(), 1, bytes_.size(), pipe_) != bytes_.size()) finish();
}

void VideoWriter::finish() {
  if (!pipe_) throw Error(ErrorCode::kIo, fmt::format("there are no frames for '{}'", path_));
  const int status = pclose(std::exchange(pipe_, nullptr));
  if (status != 0) throw Error(ErrorCode::kIo, fmt::format("ffmpeg could not write '{}'", path_));
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) throw Error(ErrorCode::kIo, fmt::format("cannot write '{}': {}", path_, error.message()));
}

}  // namespace covary
