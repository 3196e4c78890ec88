// SPDX-License-Identifier: Apache-2.0
#include "imageio/image_io.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include "core/error.h"
#include "core/git_lfs.h"
#include "core/memory_limit.h"
#include "imageio/exr_image.h"
#include "imageio/image_module.h"
#include "imageio/plain_rows.h"
#include "imageio/png.h"

namespace covary {
namespace {

constexpr size_t kMaxPixels = size_t{1} << 30;
/// Upper bound on values per byte of file in any format (deflate: about 1032).
constexpr size_t kMaxCompression = 10000;

/// The module, or the reason it could not be loaded.
struct LoadedModule {
  const ImageModule* module = nullptr;
  std::string problem;
};

/// Loads the module from the folders in the program's DT_RPATH (the build folder or, when installed, ../lib/covary),
/// then from the loader's default paths.
const LoadedModule& find_image_module() {
  static const LoadedModule loaded = []() -> LoadedModule {
    void* library = dlopen(kImageModuleFile, RTLD_NOW | RTLD_LOCAL);
    if (!library)
      return {
          nullptr,
          fmt::format("without OpenImageIO only EXR, PNG, JPEG and HDR are read, EXR and PNG written (module {}: {})",
                      kImageModuleFile, dlerror())};
    using Entry = const ImageModule* (*)();
    const auto entry = reinterpret_cast<Entry>(dlsym(library, kImageModuleEntry));
    if (!entry) return {nullptr, fmt::format("the module {} belongs to another version of covary", kImageModuleFile)};
    return {entry(), ""};
  }();
  return loaded;
}

const ImageModule& image_module() {
  const LoadedModule& loaded = find_image_module();
  if (!loaded.module) throw Error(ErrorCode::kIo, loaded.problem);
  return *loaded.module;
}

/// Opens PNG, JPEG and HDR textures; nullptr for other formats and for variants that only OpenImageIO reads.
std::unique_ptr<ImageReader> open_plain_image(const std::string& path) {
  for (const auto open : {open_plain_png, open_plain_jpeg, open_plain_hdr})
    if (auto reader = open(path)) return reader;
  return nullptr;
}

/// Size of the file in bytes; throws if it is not a regular file or cannot be opened.
size_t size_of_readable(const std::string& path) {
  std::error_code status;
  if (!std::filesystem::is_regular_file(path, status)) {
    const bool exists = std::filesystem::exists(path, status);
    throw Error(ErrorCode::kIo,
                fmt::format("cannot read {}: {}", path, exists ? "not a regular file" : "no such file"));
  }
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (!file) throw Error(ErrorCode::kIo, fmt::format("cannot read {}: {}", path, std::strerror(errno)));
  std::fclose(file);
  if (const std::string problem = git_lfs_problem(path); !problem.empty()) throw Error(ErrorCode::kInput, problem);
  return std::filesystem::file_size(path, status);
}

void check_size(const ImageHeader& header, size_t file_bytes, const std::string& path) {
  const size_t n_channels = header.channels.size();
  if (header.width < 1 || header.height < 1 || n_channels < 1)
    throw Error(ErrorCode::kInput, fmt::format("{}: an empty image: {} x {} pixels, {} channels", path, header.width,
                                               header.height, n_channels));
  const size_t n_pixels = static_cast<size_t>(header.width) * static_cast<size_t>(header.height);
  if (n_pixels > kMaxPixels || n_pixels * n_channels / kMaxCompression > file_bytes)
    throw Error(ErrorCode::kInput,
                fmt::format("{}: claims {} x {} pixels of {} channels in {} bytes; at most {} pixels are "
                            "accepted, and {} values per byte of the file",
                            path, header.width, header.height, n_channels, file_bytes, kMaxPixels, kMaxCompression));
}

/// Portable float map, which OpenImageIO 2.4 cannot write: three lines of text, then rows of little-endian floats from
/// bottom to top.
std::vector<unsigned char> encode_pfm(const ImageToEncode& image) {
  static_assert(std::endian::native == std::endian::little);
  const std::string head =
      fmt::format("{}\n{} {}\n-1.0\n", image.channels == 1 ? "Pf" : "PF", image.width, image.height);
  std::vector<unsigned char> content(head.begin(), head.end());
  const size_t n_values = static_cast<size_t>(image.width) * static_cast<size_t>(image.channels);
  for (int y = image.height - 1; y >= 0; --y) {
    const auto* row = reinterpret_cast<const unsigned char*>(image.floats + n_values * static_cast<size_t>(y));
    content.insert(content.end(), row, row + n_values * sizeof(float));
  }
  return content;
}

}  // namespace

template <typename T>
std::vector<T> ImageReader::read_part(const Part& part) {
  COVARY_CHECK(part.first >= 0 && part.first < part.last && part.last <= static_cast<int>(header_.channels.size()),
               "channels exist");
  const bool is_whole = part.first_row == 0 && part.n_rows == header_.height;
  COVARY_CHECK(is_whole || (has_rows_ && part.first_row >= 0 && part.n_rows > 0 &&
                            part.first_row + part.n_rows <= header_.height),
               "rows are there");
  const size_t n_values = static_cast<size_t>(header_.width) * static_cast<size_t>(part.n_rows) *
                          static_cast<size_t>(part.last - part.first);
  require_memory(path_, fmt::format("an image of {} x {} pixels", header_.width, header_.height),
                 static_cast<double>(n_values) * sizeof(T));
  std::vector<T> values(n_values);
  std::string problem;
  if (!read(part, values.data(), problem))
    throw Error(ErrorCode::kInput, fmt::format("{}: damaged or incomplete image: {}", path_, problem));
  return values;
}

std::vector<float> ImageReader::read_floats(int first, int last, int first_row, int n_rows) {
  return read_part<float>({first, last, first_row, n_rows});
}
std::vector<uint8_t> ImageReader::read_bytes(int first, int last, int first_row, int n_rows) {
  return read_part<uint8_t>({first, last, first_row, n_rows});
}

std::unique_ptr<ImageReader> open_image(const std::string& path, OtherColours colours) {
  const size_t file_bytes = size_of_readable(path);
  std::unique_ptr<ImageReader> reader;
  if (is_exr(path)) {
    check_exr_header(path);
    reader = open_exr(path);
  } else if (colours == OtherColours::kKeep || !find_image_module().module) {
    reader = open_plain_image(path);
  }
  std::string problem;
  if (!reader) reader = image_module().open(path, colours, problem);
  if (!reader) throw Error(ErrorCode::kInput, fmt::format("{}: not an image that can be read: {}", path, problem));
  check_size(reader->header(), file_bytes, path);
  return reader;
}

std::vector<unsigned char> encode_image(const std::string& extension, const ImageToEncode& image) {
  COVARY_CHECK(!image.bytes != !image.floats && image.width > 0 && image.height > 0, "an image to encode");
  if (extension == "pfm" && image.floats) return encode_pfm(image);
  std::string problem;
  std::vector<unsigned char> content = image_module().encode(extension, image, problem);
  if (!problem.empty())
    throw Error(ErrorCode::kIo, fmt::format("cannot write images with the extension '.{}': {}", extension, problem));
  return content;
}

}  // namespace covary
