// SPDX-License-Identifier: Apache-2.0
// The devices of this machine that run kernels, and how they fail.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/error.h"

namespace covary::device {

enum class Api { kCuda, kOpenCl };

struct DeviceInfo {
  Api api = Api::kOpenCl;
  int number = 0;  ///< among the devices of its interface
  std::string name;
  std::string driver;         ///< versions of the interface and the driver
  bool is_processor = false;  ///< the CPU, by OpenCL
  uint64_t memory = 0;        ///< bytes
  uint64_t largest_buffer = 0;
  uint64_t local_memory = 0;    ///< bytes for a work group
  uint32_t largest_group = 0;   ///< items
  uint32_t units = 0;           ///< multiprocessors or cores
  bool stops_long_work = true;  ///< its driver may stop kernels that take seconds; OpenCL does not tell

  std::string id() const;    ///< "cuda:0"
  std::string text() const;  ///< "cuda:0 (NVIDIA H100)"
};

/// All devices: CUDA's, if its driver and NVRTC are there, then those of OpenCL. `notes`, if not null, receives a line
/// for each of the two that has none.
std::vector<DeviceInfo> devices(std::vector<std::string>* notes = nullptr);

enum class FailureKind {
  kUnavailable,  ///< there is no such device or driver
  kCompile,      ///< the driver cannot compile a kernel
  kMemory,       ///< not enough memory
  kLost,         ///< the device, or a command, failed
};

/// An error of a device or its driver, in one line; log() has what the driver says of it, lines of any number.
class Failure : public Error {
 public:
  Failure(FailureKind kind, const std::string& message, std::string log = {})
      : Error(kind == FailureKind::kUnavailable ? ErrorCode::kUsage : ErrorCode::kIo, message),
        kind_(kind),
        log_(std::move(log)) {}
  FailureKind kind() const { return kind_; }
  const std::string& log() const { return log_; }

 private:
  FailureKind kind_;
  std::string log_;
};

/// The failure to compile a kernel by `compiler`, whose `log` is of any length: the message has its first error.
Failure cannot_compile(const std::string& compiler, const std::string& log);

}  // namespace covary::device
