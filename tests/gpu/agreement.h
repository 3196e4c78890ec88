// SPDX-License-Identifier: Apache-2.0
// Images made on a device against those of the processor.
#pragma once

#include <cmath>

#include "device/device.h"
#include "film/film.h"

namespace covary::test_support {

/// The device of all tests of a program: OpenCL's on the processor, or a GPU if there is one.
inline device::Device& test_device() {
  static device::Device device = device::Device::open("opencl");
  return device;
}

/// The fraction of values that differ by at most `relative` times |expected| + 0.01; 0 for images of other sizes.
inline double agreeing(const Image& found, const Image& expected, double relative = 1e-4) {
  if (found.data.size() != expected.data.size() || expected.data.empty()) return 0;
  size_t n = 0;
  for (size_t i = 0; i < expected.data.size(); ++i) {
    const double e = expected.data[i];
    if (std::abs(found.data[i] - e) <= relative * (std::abs(e) + 0.01)) ++n;
  }
  return static_cast<double>(n) / static_cast<double>(expected.data.size());
}

}  // namespace covary::test_support
