// SPDX-License-Identifier: Apache-2.0
// The page that shows images while they change (docs/live.md), for any number of readers: what there is to show, and
// what the readers ask for. Knows nothing about renders.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/stopwatch.h"
#include "film/film.h"
#include "live/server.h"

namespace covary {

/// An image for the page: half floats, little-endian, channel by channel and row by row.
struct LiveImage {
  int width = 0, height = 0, channels = 3;
  int stride = 1;  ///< pixels of the whole image along each side of a pixel of this one
  std::shared_ptr<const std::vector<char>> halves;
};
LiveImage live_image(const Image& image, int stride = 1);

class LivePage {
 public:
  /// Called in the server's thread with what a button asks for: {"do": "stop"}.
  using Act = std::function<void(const nlohmann::json&)>;

  /// Serves the page at a port, 0: any free one. Throws Error(kIo).
  LivePage(int port, const std::string& title, Act act);

  const std::string& address() const { return server_->address(); }
  int port() const { return server_->port(); }

  /// Publishes an image under a name. Thread-safe, like all below.
  void show(const std::string& name, LiveImage image);
  void remove(const std::string& name);
  /// Publishes what the page says beside the images, an object whose members docs/live.md lists; replaces members of
  /// the same names.
  void say(const nlohmann::json& members);

  /// Whether somebody has looked in the last seconds.
  bool is_watched() const;
  /// Whether everybody who has looked in the last seconds, at least one, has all images.
  bool is_seen() const;
  /// Waits until they have all else, too, at most so many seconds; not at all while nobody looks.
  void wait_until_seen(double seconds) const;

 private:
  struct Reader {
    double looked = -1e9;  // seconds of watch_
    int64_t has = -1;      // version
  };
  bool everybody_has(int64_t version) const;  // with mutex_ locked
  LiveAnswer answer(const LiveRequest& request);
  LiveAnswer state(const std::string& body);

  const Act act_;
  const Stopwatch watch_;
  std::shared_ptr<const std::vector<char>> html_;
  mutable std::mutex mutex_;                 // of all below
  int64_t version_ = 0, image_version_ = 0;  // of all, and of the newest image
  nlohmann::json members_ = nlohmann::json::object();
  std::map<std::string, std::pair<int64_t, LiveImage>> images_;  // by name, with their versions
  std::map<std::string, Reader> readers_;
  std::unique_ptr<LiveServer> server_;  // last: its thread uses the others
};

}  // namespace covary
