// SPDX-License-Identifier: Apache-2.0
// The files a command reads and writes, declared before it starts, so that none is lost: an output is never an input of
// the same command, nor another of its outputs, and its name matches its content.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace covary {

/// What an output contains; its name must have a matching extension, in upper or lower case. Special files (/dev/null,
/// pipes) may contain anything.
enum class OutputKind {
  kFilm,   ///< a film or a result: .exr
  kImage,  ///< what write_image() writes: .exr, .png, .hdr, .pfm, .jpg, .jpeg, .tif, .tiff
  kPng,    ///< .png
  kScene,  ///< .xml
  kPage,   ///< JSON, CSV: any name except an image's, a scene's or a page's; "" and "-" mean standard output
  kText,   ///< JSON, CSV: any name that is not that of an image, a scene or a page; "" and "-" mean standard output
};

class Outputs {
 public:
  /// A file that the command reads. A missing one is left to its reader to report.
  void reads(const std::string& path);
  void reads(const std::vector<std::string>& paths);
  /// A file that the command writes; `option` ("-o", "the preview") names it in messages. Throws Error(kIo) if it
  /// cannot be written.
  void writes(const std::string& option, const std::string& path, OutputKind kind);
  /// Same for the result of `command` ("denoise"): an existing file is replaced only if the same command made it
  /// (is_made_by), or if `overwrite` is set.
  void writes_result(const std::string& option, const std::string& path, OutputKind kind, const std::string& command,
                     bool overwrite);
  /// A picture (PNG) whose name was derived from another one: it may replace only what covary made. `remedy` says what
  /// to do instead: "use --no-preview".
  void writes_derived_png(const std::string& option, const std::string& path, const std::string& remedy);
  // All of these throw Error(kUsage) when two files are the same, or a name has the wrong extension.

 private:
  /// A file by device and inode; one that does not exist, by its folder's device and inode, and its name.
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

/// Whether "covary `command` …" made the file, so that it can make it again: according to the attribute covary:command
/// of EXR files; of PNG, JPEG, TIFF and videos, only whether covary did. Other formats, such as HDR and PFM, do not
/// tell: false. Empty files are nobody's: true.
bool is_made_by(const std::string& path, const std::string& command);
/// Whether covary rendered the image, by a command or as a library, according to the attribute of its scene. Empty
/// files are nobody's: true.
bool is_render(const std::string& path);

/// Text in videos of covary.
inline constexpr const char* kMadeByCovary = "made by covary convert";

/// Whether both paths lead to the same existing file, through any links.
bool is_same_file(const std::string& a, const std::string& b);

}  // namespace covary
