// SPDX-License-Identifier: Apache-2.0
// Interface between the program and libcovary_imageio.so. Only image_io.cpp and oiio_module.cpp include this.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "imageio/image_io.h"

namespace covary {

/// No function throws: `problem` is "" or describes the failure in one line.
class ImageModule {
 public:
  virtual ~ImageModule() = default;
  virtual std::unique_ptr<ImageReader> open(const std::string& path, OtherColours colours,
                                            std::string& problem) const = 0;
  virtual std::vector<unsigned char> encode(const std::string& extension, const ImageToEncode& image,
                                            std::string& problem) const = 0;
};

/// Name of the module's only function, which returns a `const ImageModule*` valid for the life of the program. Increase
/// the number whenever the classes in these headers change, so that a program never uses a module of another build.
inline constexpr const char* kImageModuleEntry = "covary_image_module_3";
inline constexpr const char* kImageModuleFile = "libcovary_imageio.so";

}  // namespace covary
