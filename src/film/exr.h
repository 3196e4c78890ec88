// SPDX-License-Identifier: Apache-2.0
// OpenEXR files in and out. Input from any renderer: scan lines or tiles, half, float or uint, one or several parts.
// Output: scan lines, ZIP or not compressed. Both on as many threads as `tbb::global_control` allows.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "film/film.h"
#include "imageio/checksums.h"

namespace covary {

/// Values of one channel in memory: rows of `width` pixels without gaps, `pixel_stride` bytes from pixel to pixel.
struct ExrPlane {
  enum class Type { kFloat, kUint };
  std::string name;
  Type type = Type::kFloat;
  void* base = nullptr;
  size_t pixel_stride = 0;
};

/// Appends the channels of `image`: `name` where it has one; of three, `name`.R, .G, .B; .X, .Y, .Z for N (normal), P
/// (position) and Motion; R, G, B where `name` is empty. The planes point into the image.
void add_image_planes(const std::string& name, Image& image, std::vector<ExrPlane>& planes);

/// Where an image lies: the full frame, and the window of pixels that a file holds, relative to the frame's corner.
struct ImagePlace {
  int frame_width = 0, frame_height = 0;
  CropWindow window;
  bool operator==(const ImagePlace&) const = default;
};

enum class ExrCompression { kZip, kNone };

/// Writes the planes (which are only read) with string attributes, and their checksums; the file appears under its name
/// only when complete. Throws Error(kIo).
void write_exr(const std::string& path, const ImagePlace& place, const std::map<std::string, std::string>& attributes,
               std::span<const ExrPlane> planes, ExrCompression compression = ExrCompression::kZip);

/// What to do with a file of covary that is not as covary wrote it, by its checksums.
enum class ChecksumPolicy { kCheck, kIgnore };

class ExrFile {
 public:
  struct Channel {
    std::string name;  ///< with the name of the part in front where the file has several parts
    std::string type;  ///< "half", "float" or "uint"
  };

  /// Opens the file and checks its header. Throws Error(kIo) when it cannot be opened, Error(kInput) when it is not an
  /// EXR file, is damaged, absurdly large, of a kind that is not supported (deep or sub-sampled pixels), or its header
  /// does not fit its checksum.
  explicit ExrFile(const std::string& path, ChecksumPolicy checksums = ChecksumPolicy::kCheck);
  ~ExrFile();

  /// The window may stick out of the frame.
  const ImagePlace& place() const { return place_; }
  const std::vector<Channel>& channels() const { return channels_; }
  const Channel* find(const std::string& name) const;
  const std::map<std::string, std::string>& attributes() const { return attributes_; }  ///< those that are strings
  const std::string& compression() const { return compression_; }

  /// Reads the named channels, all of which must exist; values are converted to the plane's type. Throws Error(kInput)
  /// when the file ends early, its pixels are damaged, or do not fit the checksums of these channels.
  void read(std::span<const ExrPlane> planes) const;
  /// Reads the named channels for nothing but their checksums, in little memory; throws like read(). Nothing where the
  /// file has no checksums.
  void check(std::span<const std::string> channels) const;
  /// Reads `n_rows` rows from `first_row` of the window on, whose checksums are not looked at; planes hold these rows
  /// only.
  void read_rows(std::span<const ExrPlane> planes, int first_row, int n_rows) const;

 private:
  struct Handle;
  /// Throws where the header promises more pixels than fit in memory or than the file can hold.
  void check_pixels() const;
  /// Takes the checksums of the file, if it has any; throws where that of the header is another one.
  void check_header();
  /// Throws where a channel has another checksum than the file says.
  void check_channel(const std::string& name, uint32_t crc) const;
  std::string shape_text() const;
  std::string path_;
  std::unique_ptr<Handle> handle_;
  ImagePlace place_;
  std::vector<Channel> channels_;
  std::map<std::string, std::string> attributes_;
  std::string compression_;
  std::optional<Checksums> checksums_;  // those that are to be checked
};

}  // namespace covary
