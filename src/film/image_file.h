// SPDX-License-Identifier: Apache-2.0
// Images of any renderer: EXR by OpenEXR, all other formats by imageio/image_io.h.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/srgb.h"
#include "film/exr.h"

namespace covary {

/// What a file holds, without its pixels.
struct ImageInfo {
  std::string format;       ///< "openexr", or OpenImageIO's name
  std::string compression;  ///< "" when unknown
  ImagePlace place;
  std::vector<ExrFile::Channel> channels;
  std::map<std::string, std::string> attributes;
};

struct PlacedImage {
  ImagePlace place;
  Image image;                     ///< linear RGB
  bool low_dynamic_range = false;  ///< the file held 8- or 16-bit integers
};

/// Throws Error(kIo) when the file cannot be opened and Error(kInput) when it is damaged or of an unknown format.
ImageInfo inspect_image(const std::string& path, ChecksumPolicy checksums = ChecksumPolicy::kCheck);

struct ImageHeader;
/// The same of a file that OpenImageIO has opened.
ImageInfo info_of(const ImageHeader& header);

/// Whether OpenEXR reads the file, whatever it is called; OpenImageIO reads all others. Throws Error(kInput) where the
/// file is empty.
bool is_exr_image(const std::string& path);

/// Reads all of a file that covary wrote, for nothing but its checksums; throws Error(kInput) where it is not as it was
/// written. Files without checksums pass unread.
void check_image(const std::string& path);

/// Throws where a file's pixels are more than memory_limit.h permits.
void require_image_memory(const std::string& path, int width, int height, double bytes_per_pixel);

/// Reads three channels as linear RGB (integer files are decoded from sRGB). `layer` chooses among the channels of a
/// file: "N" for N.X N.Y N.Z, "group03" for group03.R/G/B, or a single channel's whole name, shown grey; "" is the
/// picture (find_picture), or Y, or the only layer there is. Throws like inspect_image; an unknown layer is
/// Error(kInput) that names those there are.
PlacedImage read_image(const std::string& path, const std::string& layer = "",
                       ChecksumPolicy checksums = ChecksumPolicy::kCheck);
/// Several layers, which share no channel, of one reading of the file, in the file's window; throws like read_image.
std::vector<Image> read_layers(const std::string& path, std::span<const std::string> layers);
/// `n_rows` of their rows from `first_row` of the window on; checksums are looked at where these are all rows.
std::vector<Image> read_layers(const ExrFile& file, const std::string& path, std::span<const std::string> layers,
                               int first_row, int n_rows);

/// The three channels (one for grey, given three times) that `layer` means among `channels`; throws like read_image.
std::vector<std::string> layer_channels(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                                        const std::string& layer);

/// Three channels of one colour image in a file.
struct ColourLayer {
  std::string name;  ///< "" for R G B
  std::array<std::string, 3> channels;
};

/// Layers of red, green and blue in the file's order: R G B, as covary, Mitsuba, pbrt and Blender name them, r g b
/// (RenderMan), red green blue (V-Ray).
std::vector<ColourLayer> colour_layers(const std::vector<ExrFile::Channel>& channels);

/// Which of them is the picture, where no layer is named: the one without a name, the only one, or the only one that
/// some renderer calls its picture: Combined (Blender), Ci (RenderMan), C, RGBA, rgb, beauty. Null where none is.
const ColourLayer* find_picture(std::span<const ColourLayer> layers);

/// The last part of a layer's name: "Combined" of "ViewLayer.Combined".
std::string_view last_part(std::string_view name);

/// Every layer that read_image takes from these channels, in their order: "" for R G B, names of three channels that
/// belong together ("N"), then each channel that is in none of these by its whole name.
std::vector<std::string> image_layers(const std::vector<ExrFile::Channel>& channels);

}  // namespace covary
