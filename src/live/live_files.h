// SPDX-License-Identifier: Apache-2.0
// A page that follows files which other programs write: the image and the films of a running render, the films of a
// cluster, frames.
#pragma once

#include <atomic>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "film/film.h"
#include "live/live_page.h"

namespace covary {

class LiveFiles {
 public:
  static constexpr size_t kMax = 9;  ///< files that are shown, the newest

  /// `path`: a file, followed together with the folder of films beside it ("out.passes" of "out.exr"), or a folder,
  /// whose EXR files are followed. Neither needs to exist yet. Throws Error(kIo) if no page can be served.
  LiveFiles(int port, std::string path);

  const LivePage& page() const { return page_; }
  /// That the files are waited for; "" if there are any.
  std::string waiting() const;

  /// Reads what has changed since the last call, and shows it. Files that cannot be read are named on the page.
  void look();
  /// Looks twice a second until the flag is set.
  void run(const std::atomic<bool>& stop);

 private:
  struct Followed {
    std::filesystem::file_time_type changed;
    uintmax_t size = 0;
    std::optional<Film> film;
    Image image, std_error;
    std::map<std::string, std::string> attributes;  ///< with the prefix "covary:"
    std::string problem;
  };
  std::vector<std::filesystem::path> files() const;
  void read(const std::filesystem::path& path, Followed& followed) const;
  void show();
  nlohmann::json show_sum();
  nlohmann::json picture(const std::string& id, const std::string& name, const Image& image, const Image& std_error);
  void say_state();

  const std::string path_;
  std::map<std::filesystem::path, Followed> followed_;
  std::vector<std::string> problems_;
  LivePage page_;
};

}  // namespace covary
