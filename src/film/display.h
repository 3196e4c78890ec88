// SPDX-License-Identifier: Apache-2.0
// Live preview in tev (https://github.com/Tom94/tev) by its network protocol. A render never waits for the viewer:
// images are handed to a thread, which sends the newest one; what the viewer is too slow for is left out.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// Packets of tev's protocol, little-endian:
///   uint32 length of the whole packet, uint8 type, then by type, with strings ended by a zero byte
///   CreateImage (4):   uint8 grab focus, string name, int32 width, height, n channels, n strings: channel names
///   UpdateImageV3 (6): uint8 grab focus, string name, int32 n channels, n strings: channel names, int32 x, y, width,
///                      height, n int64 offsets, n int64 strides [both in floats], floats
namespace tev {
std::vector<uint8_t> create_image(const std::string& name, int width, int height);
/// The rows from `first_row` on, at most `n_rows`; 3 channels, interleaved.
std::vector<uint8_t> update_image(const std::string& name, const Image& image, int first_row, int n_rows);
}  // namespace tev

class Display {
 public:
  /// `address`: "HOST:PORT" or "[IPv6]:PORT". `name`: of the image in the viewer. Connects in a thread; `warn` is
  /// called from there, at most once, when the viewer cannot be reached or is lost; then nothing more is sent. Throws
  /// Error(kUsage) when the address is not of this form.
  Display(const std::string& address, std::string name, std::function<void(const std::string&)> warn);
  /// Waits for the last image to be sent, at most two seconds.
  ~Display();
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;

  /// Whether update() would send something soon: connected, or not yet given up, and no image is waiting. Saves making
  /// an image that would be left out.
  bool ready() const;
  /// Hands over an image of 3 channels to show; returns at once. All images must have one size. An image that has not
  /// been sent yet is replaced.
  void update(Image image);

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

}  // namespace covary
