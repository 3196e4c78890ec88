// SPDX-License-Identifier: Apache-2.0
// What one command reads and writes, told before its work begins, so that no file is lost by it: an output is never an
// input of the same command, nor another of its outputs, and its name says what it holds.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace covary {

/// What an output holds; its name must end accordingly, in upper or lower case. Special files (/dev/null, pipes) may
/// hold anything.
enum class OutputKind {
  kFilm,   ///< a film or a result: .exr
  kImage,  ///< what write_image() writes: .exr, .png, .hdr, .pfm, .jpg, .jpeg, .tif, .tiff
  kPng,    ///< .png
  kScene,  ///< .xml
  kPage,   ///< .html, .htm
  kText,   ///< JSON, CSV: any name that is not that of an image, a scene or a page; "" and "-" mean standard output
};

class Outputs {
 public:
  /// A file that the command reads. One that is not there is left to its reader.
  void reads(const std::string& path);
  void reads(const std::vector<std::string>& paths);
  /// A file that the command writes; `option` ("-o", "the preview") names it in messages. Throws Error(kIo) where
  /// nothing can be written there.
  void writes(const std::string& option, const std::string& path, OutputKind kind);
  /// A picture (PNG) whose name was not given but made from another one: it may replace only what covary made. `remedy`
  /// tells what to do instead: "use --no-preview".
  void writes_derived_png(const std::string& option, const std::string& path, const std::string& remedy);
  // All of them throw Error(kUsage) where two files are one, or a name ends wrongly.

 private:
  /// A file by device and inode; one that is not there by its folder's, and its name.
  struct Identity {
    dev_t device = 0;
    ino_t inode = 0;
    std::string name;
    bool operator==(const Identity&) const = default;
  };
  struct Entry {
    std::string option, path;
    Identity identity;
  };
  static bool identify(const std::string& path, Identity& identity);

  std::vector<Entry> inputs_, outputs_;
};

/// Whether both paths lead to one file that is there, through whatever links.
bool is_same_file(const std::string& a, const std::string& b);

}  // namespace covary
