// SPDX-License-Identifier: Apache-2.0
// OpenEXR input and output. Input from any renderer: scan lines or tiles, half, float or uint, single- or multi-part.
// Output: scan lines, ZIP or uncompressed. Both use as many threads as `tbb::global_control` allows.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "film/colour_space.h"
#include "film/film.h"
#include "imageio/checksums.h"

namespace covary {

/// One channel in memory: contiguous rows of `width` pixels, `pixel_stride` bytes from pixel to pixel.
struct ExrPlane {
  enum class Type { kFloat, kUint };
  std::string name;
  Type type = Type::kFloat;
  void* base = nullptr;
  size_t pixel_stride = 0;
};

/// Appends the channels of `image`: `name` if it has one channel; `name`.R, .G, .B if it has three, or .X, .Y, .Z for N
/// and DenoisingNormal (normals), P (position) and Motion; R, G, B if `name` is empty. The planes point into the image.
void add_image_planes(const std::string& name, Image& image, std::vector<ExrPlane>& planes);

/// Position of an image: the full frame, and the pixel window a file holds, relative to the frame's corner.
struct ImagePlace {
  int frame_width = 0, frame_height = 0;
  CropWindow window;
  bool operator==(const ImagePlace&) const = default;
};

enum class ExrCompression { kZip, kNone };

/// Writes the planes (read only) with string attributes and checksums; the file appears under its name only when
/// complete. Throws Error(kIo).
void write_exr(const std::string& path, const ImagePlace& place, const std::map<std::string, std::string>& attributes,
               std::span<const ExrPlane> planes, ExrCompression compression = ExrCompression::kZip);

/// Whether to reject files of covary whose contents do not match their checksums.
enum class ChecksumPolicy { kCheck, kIgnore };

class ExrFile {
 public:
  struct Channel {
    std::string name;  ///< prefixed with the part's name in multi-part files
    std::string type;  ///< "half", "float" or "uint"
    std::string view;  ///< "left", "right" …; "" for channels of no view, or of all
  };

  /// Opens the file and checks its header. Throws Error(kIo) when it cannot be opened; Error(kInput) when it is not an
  /// EXR file, is damaged, absurdly large or has no channels that can be read, or when its header does not match its
  /// checksum. `unreadable_too`: do not throw if it has only deep or sub-sampled channels.
  explicit ExrFile(const std::string& path, ChecksumPolicy checksums = ChecksumPolicy::kCheck,
                   bool unreadable_too = false);
  ~ExrFile();

  /// The window may extend beyond the frame. It holds the windows of all parts; where a part has no pixels, its
  /// channels are 0.
  const ImagePlace& place() const { return place_; }
  const std::vector<Channel>& channels() const { return channels_; }
  /// Channels that cannot be read; their types say why ("half, deep", "half, 2 x 2 sub-sampled").
  const std::vector<Channel>& unreadable() const { return unreadable_; }
  const Channel* find(const std::string& name) const;
  const std::map<std::string, std::string>& attributes() const { return attributes_; }  ///< string attributes only
  const std::string& compression() const { return compression_; }
  /// By the attribute `chromaticities`, of an ACES container, or by name; Rec. 709 without any of them.
  const ColourSpace& colours() const { return colours_; }

  /// Reads the named channels, all of which must exist; values are converted to the plane's type. Throws Error(kInput)
  /// when the file is truncated, its pixels are damaged, or they do not match the checksums of these channels.
  void read(std::span<const ExrPlane> planes) const;
  /// Reads the named channels only to verify their checksums, in little memory; throws like read(). Does nothing if the
  /// file has no checksums.
  void check(std::span<const std::string> channels) const;
  /// The checksums of the named channels, of halves those of their values as floats, in little memory; throws like
  /// read().
  std::vector<uint32_t> checksums_of(std::span<const std::string> channels) const;
  /// Reads `n_rows` rows of the window, starting at `first_row`, without verifying checksums; planes hold these rows
  /// only.
  void read_rows(std::span<const ExrPlane> planes, int first_row, int n_rows) const;

 private:
  struct Handle;
  /// Lists the channels of a part.
  void add_part(int part);
  /// Takes over text attributes; throws if the checksums are no text.
  void add_attributes(int part, ChecksumPolicy checksums);
  /// Throws if the header declares more pixels than fit in memory or than the file can hold.
  void check_pixels() const;
  /// Reads these rows of the file's window from a part with a smaller one.
  void read_from_other_window(int part, std::span<const ExrPlane> planes, int first_row, int n_rows) const;
  /// Reads the file's checksums, if any; throws if the header does not match.
  void check_header();
  /// Throws if the channel's checksum differs from the stored one.
  void check_channel(const std::string& name, uint32_t crc) const;
  std::string shape_text() const;
  std::string path_;
  std::unique_ptr<Handle> handle_;
  ImagePlace place_;
  std::vector<Channel> channels_, unreadable_;
  std::map<std::string, std::string> attributes_;
  std::string compression_;
  ColourSpace colours_;
  std::optional<Checksums> checksums_;  // to be verified; empty if there are none or they are ignored
};

}  // namespace covary
