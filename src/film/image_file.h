// SPDX-License-Identifier: Apache-2.0
// Images of any renderer: EXR by OpenEXR, all other formats by imageio/image_io.h.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/srgb.h"
#include "film/exr.h"

namespace covary {

/// A file's contents, without its pixels.
struct ImageInfo {
  std::string format;       ///< "openexr", or OpenImageIO's name for it
  std::string compression;  ///< "" when unknown
  ImagePlace place;
  std::vector<ExrFile::Channel> channels;
  std::map<std::string, std::string> attributes;
  ColourSpace colours = {};
  std::vector<ExrFile::Channel> unreadable = {};  ///< of EXR: deep and sub-sampled ones
};

struct PlacedImage {
  ImagePlace place;
  Image image;                     ///< linear RGB
  bool low_dynamic_range = false;  ///< the file held 8- or 16-bit integers
};

/// Throws Error(kIo) when the file cannot be opened, Error(kInput) when it is damaged or of an unknown format.
ImageInfo inspect_image(const std::string& path, ChecksumPolicy checksums = ChecksumPolicy::kCheck);

/// The same without any check of checksums, also of files that have only channels that cannot be read.
ImageInfo describe_image(const std::string& path);

struct ImageHeader;
/// Same, for a file already opened by OpenImageIO.
ImageInfo info_of(const ImageHeader& header);

/// Whether to read the file with OpenEXR, judged by its content, not its name; OpenImageIO reads all others. Throws
/// Error(kInput) if the file is empty.
bool is_exr_image(const std::string& path);

/// Reads all of a file written by covary, only to verify its checksums; throws Error(kInput) if they do not match.
/// Files without checksums pass unread.
void check_image(const std::string& path);

/// Throws if the file's pixels exceed the limit of memory_limit.h.
void require_image_memory(const std::string& path, int width, int height, double bytes_per_pixel);

/// Reads three channels as linear RGB (integer files are decoded from sRGB). `layer` selects the channels: "N" for N.X
/// N.Y N.Z, "group03" for group03.R/G/B, or the full name of a single channel, returned as grey; "" is the picture
/// without a layer's name, or the only one (film/pictures.h), or the only layer there is. Colours (holds_colours) are
/// converted to `colours`; none: as stored. Throws like inspect_image; for an unknown layer, throws Error(kInput)
/// listing the existing ones.
PlacedImage read_image(const std::string& path, const std::string& layer = "",
                       ChecksumPolicy checksums = ChecksumPolicy::kCheck,
                       const std::optional<ColourSpace>& colours = ColourSpace::rec709());
/// The alpha of such a layer, 1 channel; empty if it has none. Throws like read_image().
struct Alpha {
  Image values;
  bool straight = false;  ///< the layer's colours are not multiplied by it, as in PNG
};
Alpha read_alpha(const std::string& path, const std::string& layer = "",
                 ChecksumPolicy checksums = ChecksumPolicy::kCheck);
/// Reads several layers, which share no channel, in one pass over the file, in the file's window, as Rec. 709; throws
/// like read_image.
std::vector<Image> read_layers(const std::string& path, std::span<const std::string> layers);
/// Same for `n_rows` rows of the window, starting at `first_row`, as stored; verifies checksums only if these are all
/// its rows.
std::vector<Image> read_layers(const ExrFile& file, const std::string& path, std::span<const std::string> layers,
                               int first_row, int n_rows);

/// The three channels that `layer` selects among `channels` (for grey, one channel three times); throws like
/// read_image.
std::vector<std::string> layer_channels(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                                        const std::string& layer);

/// Whether a layer with these three channels holds colours, to which a file's colour space applies: red, green and blue
/// of anything but directions, positions and identifiers (Cryptomatte); or X, Y and Z without a layer's name.
bool holds_colours(std::span<const std::string> channels);
/// The colour space of such a layer: of the file, or CIE XYZ.
ColourSpace layer_colours(const ColourSpace& of_file, std::span<const std::string> channels);

/// Three channels of one colour image in a file.
struct ColourLayer {
  std::string name;  ///< "" for R G B
  std::array<std::string, 3> channels;
};

/// RGB layers in the file's order: R G B, as covary, Mitsuba, pbrt and Blender name them, r g b (RenderMan), red green
/// blue (V-Ray).
std::vector<ColourLayer> colour_layers(const std::vector<ExrFile::Channel>& channels);

/// The last part of a layer's name: "Combined" of "ViewLayer.Combined".
std::string_view last_part(std::string_view name);

/// Every layer that read_image accepts, in the channels' order: "" for R G B, names of three channels that belong
/// together ("N"), then the full names of all channels not in any of these.
std::vector<std::string> image_layers(const std::vector<ExrFile::Channel>& channels);

}  // namespace covary
