// SPDX-License-Identifier: Apache-2.0
// Open Image Denoise [OIDN], a neural denoiser, as a comparator and an optional last step. The library is loaded at run
// time if it is installed; nothing else needs it.
//
// Claim: biased, of unknown size, and not consistent.
#pragma once

#include <memory>
#include <string>

#include "film/film.h"

namespace covary {

struct DenoiseOptions {
  /// The library's file, its folder, or a folder above it in the Python wheel `pyoidn`, up to the root of the
  /// environment that holds the wheel. "": tries the path in the environment variable COVARY_OIDN, then beside covary
  /// if pip installed both, the loader's path, and the wheel's usual places ($VIRTUAL_ENV, $CONDA_PREFIX, the user's
  /// and the system's packages).
  std::string library;
  /// The device of CUDA on which it runs, where the library has what that needs; -1: the processor.
  int cuda_device = -1;
};

/// The library and its device, loaded once for any number of images. On one machine, the same input gives the same
/// bits, and did so for every number of threads tried (docs/methods/denoising.md). On a device of CUDA, images are
/// copied there and back, and the library's arithmetic is another (half precision).
class Denoiser {
 public:
  struct Library;
  /// Throws Error(kUsage), with how to get the library, if it is missing, and Error(kIo) if it fails.
  explicit Denoiser(const DenoiseOptions& options = {});
  ~Denoiser();
  Denoiser(const Denoiser&) = delete;
  Denoiser& operator=(const Denoiser&) = delete;

  /// Denoises `rgb` (linear, 3 channels, high dynamic range). `albedo` in [0, 1] and `normal` in [-1, 1] are
  /// features that preserve texture and edges: 3 channels, the same size, or null; the normal only together with the
  /// albedo. They may be noisy unless `clean_features` is set. Values of `rgb` that cannot be used are replaced first
  /// (filters/stray_values.h), those of features that are not finite set to zero. Throws
  /// Error(kInput) if sizes differ, and Error(kIo) if the library fails. Inside run_stoppable() it returns at once when
  /// stopped; the library's own work ends in the background at its next step (core/detached_work.h).
  Image denoise(Image rgb, const Image* albedo, const Image* normal, bool clean_features = false);
  /// The same without copies of features whose values are finite; the library may hold them after it was stopped.
  Image denoise(Image rgb, std::shared_ptr<const Image> albedo, std::shared_ptr<const Image> normal,
                bool clean_features = false);
  /// Prefilters a feature for use with `clean_features`. `name`: "albedo" or "normal".
  Image denoise_feature(const std::string& name, Image feature);
  /// Number of images and features denoised so far.
  int runs() const { return runs_; }

 private:
  std::shared_ptr<Library> library_;
  int runs_ = 0;
};

/// Throws Error(kInput) if a feature has a non-finite value, which would spread over the image. `name` is for the
/// message.
void check_feature(const std::string& name, const Image& feature);

/// A single call of Denoiser::denoise().
Image denoise(const Image& rgb, const Image* albedo, const Image* normal, const DenoiseOptions& options = {});

/// Describes a loaded denoiser.
struct DenoiserInfo {
  std::string path;     ///< of the library
  std::string version;  ///< "2.5.1"
};
/// Loads the denoiser. Throws like Denoiser().
DenoiserInfo denoiser_info(const DenoiseOptions& options = {});

/// Whether the library, which must be there, can run on options.cuda_device: its part for CUDA is installed, and takes
/// the device.
bool runs_on_cuda(const DenoiseOptions& options);

/// Path of the library that denoise() would load; "" if there is none.
std::string find_denoiser(const DenoiseOptions& options = {});
/// Throws Error(kUsage) if the environment variable COVARY_OIDN names a library that is not there, and it is to be
/// loaded: a picture would be denoised without it.
void check_named_denoiser(const DenoiseOptions& options);

}  // namespace covary
