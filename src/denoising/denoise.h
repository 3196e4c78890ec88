// SPDX-License-Identifier: Apache-2.0
// Open Image Denoise [OIDN], a neural denoiser, as a comparator and an optional last step. The library is loaded at run
// time, where there is one; nothing else needs it.
//
// Claim: biased, and not consistent unless the network happens to be; the size of its bias is not known.
#pragma once

#include <memory>
#include <string>

#include "film/film.h"

namespace covary {

struct DenoiseOptions {
  /// The library's file, its folder, or a folder above it in Python's wheel `pyoidn`, up to the root of the environment
  /// that holds the wheel; "": the environment variable COVARY_OIDN (likewise), beside covary where pip installed both,
  /// the loader's path, and the places where the wheel puts it (of $VIRTUAL_ENV, $CONDA_PREFIX, the user, the system).
  std::string library;
};

/// The library with its device, loaded once for any number of images. The same input gives the same bits on one
/// machine, with other numbers of threads, too, where this was measured (docs/methods/denoising.md).
class Denoiser {
 public:
  struct Library;
  /// Throws Error(kUsage) when the library is missing, with how to get it, and Error(kIo) when it refuses to work.
  explicit Denoiser(const DenoiseOptions& options = {});
  ~Denoiser();
  Denoiser(const Denoiser&) = delete;
  Denoiser& operator=(const Denoiser&) = delete;

  /// Denoises `rgb` (linear, 3 channels, high dynamic range) on the processor. `albedo` in [0, 1] and `normal` in
  /// [-1, 1] (3 channels, the same size; the normal only together with the albedo) or null: guides that keep texture
  /// and edges; they may be noisy unless `clean_guides` says that they are not. Values that are not finite become zero
  /// before. Throws Error(kInput) when sizes differ, and Error(kIo) when the library refuses to work. Inside of
  /// run_stoppable() it ends at once; the library's own work is left behind until its next step (core/detached_work.h).
  Image denoise(const Image& rgb, const Image* albedo, const Image* normal, bool clean_guides = false);
  /// The same of a guide alone, which makes it clean. `name`: "albedo" or "normal".
  Image denoise_guide(const std::string& name, const Image& guide);
  /// Images and guides denoised so far.
  int runs() const { return runs_; }

 private:
  std::shared_ptr<Library> library_;
  int runs_ = 0;
};

/// Throws Error(kInput) where a guide has a value that is not finite, which would spread over the image. `name` stands
/// in the message.
void check_guide(const std::string& name, const Image& guide);

/// Denoiser::denoise() once.
Image denoise(const Image& rgb, const Image* albedo, const Image* normal, const DenoiseOptions& options = {});

/// What a loaded denoiser is.
struct DenoiserInfo {
  std::string path;     ///< of the library
  std::string version;  ///< "2.5.1"
};
/// Loads the denoiser to find out. Throws like Denoiser().
DenoiserInfo denoiser_info(const DenoiseOptions& options = {});

/// Path of the library that denoise() would load; "" when there is none.
std::string find_denoiser(const DenoiseOptions& options = {});

}  // namespace covary
