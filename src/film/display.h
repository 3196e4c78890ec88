// SPDX-License-Identifier: Apache-2.0
// Live preview in tev (https://github.com/Tom94/tev) over its network protocol. A render never waits for the viewer:
// images go to a thread that sends the newest one and drops those the viewer is too slow for.
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
/// Rows from `first_row` on, at most `n_rows`; 3 interleaved channels.
std::vector<uint8_t> update_image(const std::string& name, const Image& image, int first_row, int n_rows);
}  // namespace tev

class Display {
 public:
  /// `address`: "HOST:PORT" or "[IPv6]:PORT". `name`: name of the image in the viewer. Connects in a thread, which
  /// calls `warn`, at most once, when the viewer cannot be reached or the connection is lost; nothing more is sent
  /// then. Throws Error(kUsage) for an address of another form.
  Display(const std::string& address, std::string name, std::function<void(const std::string&)> warn);
  /// Waits at most two seconds for the last image to be sent.
  ~Display();
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;

  /// Whether update() would send something soon: connected or still trying, and no image pending. Saves computing an
  /// image that would be dropped.
  bool ready() const;
  /// Queues a 3-channel image for display and returns at once. All images must have the same size. Replaces an image
  /// that has not been sent yet.
  void update(Image image);

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

}  // namespace covary
