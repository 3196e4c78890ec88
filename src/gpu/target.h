// SPDX-License-Identifier: Apache-2.0
// Where the work on images runs: a device, or the processor when there is none or it fails.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "device/device.h"
#include "estimators/estimator_result.h"

namespace covary::gpu {

/// Names that `device` takes, beside those with a number, "cuda:1"; help of the option.
inline constexpr const char *kProcessor = "cpu", *kAutomatic = "auto";
inline constexpr const char* kDeviceHelp =
    "Where images are estimated and denoised: cpu; auto, the first GPU, and the processor if there is none or it "
    "fails; "
    "cuda or opencl, or one of these devices, opencl:1 (covary info --devices)";

/// What is wrong with a name of a device; empty if nothing is.
std::string wrong_device_name(const std::string& name);

/// A device that images are made on, opened. Thread-safe; one piece of work at a time.
class Target {
 public:
  /// Null for "cpu", and for "auto" without a GPU. Throws Error(kUsage) for other names without a device. The same one
  /// for the same name, as long as anybody uses it.
  static std::shared_ptr<Target> open(const std::string& name);
  /// For tests. `is_automatic`: the processor takes over when the device fails.
  Target(device::Device device, bool is_automatic) : device_(std::move(device)), is_automatic_(is_automatic) {}

  /// work(device), whose images must be finite. If the device fails or they are not: what `otherwise` makes on the
  /// processor, whose note says so, as from then on; or, for a device that was named, Error(kIo).
  template <typename Work, typename Otherwise>
  auto run(const Work& work, const Otherwise& otherwise) {
    {
      const std::lock_guard lock(mutex_);
      if (!failed_) {
        try {
          auto result = work(device_);
          check_finite(images_of(result));
          used_ = true;
          return result;
        } catch (const device::Failure& failure) {
          fail(failure);
        }
      }
    }
    auto result = otherwise();
    add_note(images_of(result));
    return result;
  }

  /// Whether the processor takes over what the device cannot do.
  bool is_automatic() const { return is_automatic_; }
  const device::DeviceInfo& info() const { return device_.info(); }
  /// "cuda:0 (NVIDIA H100)" if images were made there; empty otherwise.
  std::string made_by() const { return used_ && !failed_ ? info().text() : ""; }

 private:
  static EstimatorResult& images_of(EstimatorResult& result) { return result; }
  template <typename Denoised>
  static EstimatorResult& images_of(Denoised& denoised) {
    if constexpr (std::is_base_of_v<EstimatorResult, Denoised>)
      return denoised;
    else
      return denoised.result;
  }
  void check_finite(const EstimatorResult& result) const;
  /// Remembers the failure, or throws it for a device that was named.
  void fail(const device::Failure& failure);
  void add_note(EstimatorResult& result) const;

  device::Device device_;
  const bool is_automatic_;
  bool used_ = false;
  std::optional<std::string> failed_;
  std::mutex mutex_;
};

}  // namespace covary::gpu
