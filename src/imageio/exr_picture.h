// SPDX-License-Identifier: Apache-2.0
// Which channels of an EXR file are its picture, for textures and environment maps.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace covary {

/// Whether the name of a layer or part, after its last dot, is one that renderers give their picture
/// (docs/other-renderers.md): "Combined", "Ci", "C", "RGBA", "beauty", "default", in upper or lower case.
bool names_picture(std::string_view name);
/// Of several such names, the picture is the one with the lowest number; kNoPicture for other names.
int rank_as_picture(std::string_view name);
inline constexpr int kNoPicture = 1000;

struct ExrPart {
  struct Channel {
    std::string name;
    bool subsampled = false;
  };
  std::string name;  ///< "" in most files of one part
  std::vector<Channel> channels;
  bool deep = false;
};

/// Red, green and blue, or one grey channel.
struct ExrPicture {
  int part = 0;
  std::vector<std::string> channels;
};

/// The picture of a file: the colours without a layer's name, else those of a layer ("beauty.R"), else luminance Y,
/// else the first channel of the only part if it has one or two, and the first is not alpha. If there are several
/// colours of a kind, it is the one with a name that renderers give their picture, such as "rgba", "beauty",
/// "Combined". Deep parts and channels of lower resolution do not count. Throws Error(kInput), naming `path` and
/// listing parts and channels, if there is none or no single one.
ExrPicture find_exr_picture(std::span<const ExrPart> parts, const std::string& path);

}  // namespace covary
