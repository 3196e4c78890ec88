// SPDX-License-Identifier: Apache-2.0
// What tests and measurements change or learn of work on a device.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/stopwatch.h"
#include "device/device.h"

namespace covary::gpu {

struct Trial {
  std::string planted_bug;  ///< a kernel file that shall be slightly wrong
  int rows_at_once = 0;     ///< height of bands; 0: what the device's memory allows
  /// Receives each stage and its seconds; commands then wait for each other. Stages of transfers begin with "copy".
  std::function<void(const std::string& stage, double seconds)> timing;
};

/// Calls stages, and measures them if asked to.
class Stages {
 public:
  Stages(device::Device& device, const Trial& trial) : device_(device), trial_(trial) {}

  template <typename Work>
  void run(const std::string& stage, const Work& work) {
    if (!trial_.timing) return work();
    device_.finish();
    const Stopwatch watch;
    work();
    device_.finish();
    trial_.timing(stage, watch.seconds());
  }

  /// A kernel of a file, with its planted bug if that is wanted.
  device::Kernel kernel(const std::string& file, const std::string& name, std::vector<std::string> definitions) {
    if (trial_.planted_bug == file) definitions.emplace_back("PLANTED_BUG=1");
    return device_.kernel(file, name, definitions);
  }

 private:
  device::Device& device_;
  const Trial& trial_;
};

}  // namespace covary::gpu
