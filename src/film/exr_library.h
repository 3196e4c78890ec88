// SPDX-License-Identifier: Apache-2.0
// What reading and writing EXR files share of OpenEXR. Only included by the files exr*.cpp.
#pragma once

#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfPixelType.h>

#include <string>
#include <vector>

#include "film/exr.h"
#include "imageio/output_file.h"

namespace covary {
namespace Imf = OPENEXR_IMF_NAMESPACE;

/// An image larger than this in either direction is taken as damage.
inline constexpr int kMaxExrSize = 1 << 18;

/// Configures OpenEXR: limits, and as many threads as the rest of the program may use now.
void prepare_exr_library();

/// OutputFile as an OpenEXR stream. OpenEXR ignores errors in its last write, the line offset table; OutputFile
/// remembers them for commit().
class ExrStream : public Imf::OStream {
 public:
  ExrStream(OutputFile& file, const std::string& name) : Imf::OStream(name.c_str()), file_(file) {}
  void write(const char c[], int n) override { file_.write(c, static_cast<size_t>(n)); }
  uint64_t tellp() override { return file_.position(); }
  void seekp(uint64_t position) override { file_.seek(position); }

 private:
  OutputFile& file_;
};

const char* exr_type_name(Imf::PixelType type);
Imf::PixelType exr_pixel_type(const ExrPlane& plane);
/// The plane, which holds the pixels of `window`.
Imf::Slice exr_slice(const ExrPlane& plane, const Imath::Box2i& window);

/// Windows and channels (each "name type") as hashed for the header's checksum.
std::string exr_shape_text(const ImagePlace& place, const std::vector<std::string>& channels);

}  // namespace covary
