// SPDX-License-Identifier: Apache-2.0
#include "imageio/exr_image.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTestFile.h>

#include <algorithm>
#include <array>
#include <exception>

namespace covary {
namespace Imf = OPENEXR_IMF_NAMESPACE;
namespace {

constexpr int kMaxSize = 1 << 18;  // in one direction; more is left to OpenImageIO

/// The file's channels in the order of ImageHeader; empty where they are others than open_plain_exr() takes.
std::vector<std::string> plain_channels(const Imf::ChannelList& channels) {
  std::vector<std::string> names;
  for (const char* name : {"R", "G", "B", "Y", "A"})
    if (channels.findChannel(name)) names.emplace_back(name);
  const bool colours = names.size() >= 3 && names[2] == "B" && (names.size() == 3 || names[3] == "A");
  const bool grey = !names.empty() && names[0] == "Y" && (names.size() == 1 || names[1] == "A");
  size_t n_channels = 0;
  const Imf::PixelType type = channels.begin() == channels.end() ? Imf::UINT : channels.begin().channel().type;
  for (auto c = channels.begin(); c != channels.end(); ++c, ++n_channels) {
    const Imf::Channel& channel = c.channel();
    if (channel.type != type || channel.xSampling != 1 || channel.ySampling != 1) return {};
  }
  return (colours || grey) && n_channels == names.size() && type != Imf::UINT ? names : std::vector<std::string>{};
}

bool has_plain_size(const Imath::Box2i& window) {
  const auto fits = [](int64_t low, int64_t high) { return high >= low && high - low < kMaxSize; };
  return fits(window.min.x, window.max.x) && fits(window.min.y, window.max.y);
}

class PlainExr final : public ImageReader {
 public:
  /// `file` is plain.
  PlainExr(const std::string& path, std::unique_ptr<Imf::InputFile> file, std::vector<std::string> channels)
      : file_(std::move(file)) {
    const Imf::Header& header = file_->header();
    const Imath::Box2i &data = header.dataWindow(), &frame = header.displayWindow();
    path_ = path;
    has_rows_ = true;
    header_.format = "openexr";
    header_.width = data.max.x - data.min.x + 1, header_.height = data.max.y - data.min.y + 1;
    header_.x = data.min.x - frame.min.x, header_.y = data.min.y - frame.min.y;
    header_.frame_width = frame.max.x - frame.min.x + 1, header_.frame_height = frame.max.y - frame.min.y + 1;
    header_.type = header.channels().begin().channel().type == Imf::HALF ? "half" : "float";
    header_.floating_point = true;
    if (channels.back() == "A") header_.alpha_channel = static_cast<int>(channels.size()) - 1;
    header_.channels = std::move(channels);
    for (auto a = header.begin(); a != header.end(); ++a)
      if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute()))
        header_.attributes[a.name()] = text->value();
  }

 private:
  bool read(const Part& part, float* values, std::string& problem) override {
    try {
      Imath::Box2i window = file_->header().dataWindow();
      window.min.y += part.first_row;
      window.max.y = window.min.y + part.n_rows - 1;
      const auto stride = sizeof(float) * static_cast<size_t>(part.last - part.first);
      Imf::FrameBuffer buffer;
      for (int c = part.first; c < part.last; ++c)
        buffer.insert(header_.channels[static_cast<size_t>(c)],
                      Imf::Slice::Make(Imf::FLOAT, values + (c - part.first), window, stride,
                                       stride * static_cast<size_t>(header_.width)));
      file_->setFrameBuffer(buffer);
      file_->readPixels(window.min.y, window.max.y);
      return true;
    } catch (const std::exception& error) {
      problem = error.what();
      std::ranges::replace(problem, '\n', ' ');
      return false;
    }
  }
  bool read(const Part&, uint8_t*, std::string& problem) override {
    problem = "its values are no bytes";
    return false;
  }

  std::unique_ptr<Imf::InputFile> file_;
};

}  // namespace

std::unique_ptr<ImageReader> open_plain_exr(const std::string& path) {
  try {
    bool tiled = false, deep = false, several_parts = false;
    if (!Imf::isOpenExrFile(path.c_str(), tiled, deep, several_parts) || deep || several_parts) return nullptr;
    auto file = std::make_unique<Imf::InputFile>(path.c_str(), 0);
    const Imf::Header& header = file->header();
    std::vector<std::string> channels = plain_channels(header.channels());
    const bool plain =
        !channels.empty() && has_plain_size(header.dataWindow()) && has_plain_size(header.displayWindow()) && !tiled;
    return plain ? std::make_unique<PlainExr>(path, std::move(file), std::move(channels)) : nullptr;
  } catch (const std::exception&) {
    return nullptr;
  }
}

}  // namespace covary
