// SPDX-License-Identifier: Apache-2.0
// What a driver does for device.h. One object per opened device.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "device/device_info.h"

namespace covary::device {

/// An argument of a kernel: a buffer, the bytes of a value, or local memory of a size.
struct Argument {
  enum class Kind { kBuffer, kValue, kLocalMemory };
  Kind kind;
  uint64_t buffer = 0;          ///< as allocate() returned it
  const void* value = nullptr;  ///< valid until launch() returns
  size_t bytes = 0;             ///< of the value or the local memory
};

/// Work groups first … first + groups - 1 of `items` items each, in three dimensions; as if those before were part of
/// the same launch.
struct Grid {
  std::array<uint32_t, 3> first = {}, groups = {1, 1, 1}, items = {1, 1, 1};
};

class Backend {
 public:
  virtual ~Backend() = default;

  virtual const DeviceInfo& info() const = 0;

  /// Buffers and kernels are numbers other than 0. Commands run one after another; read() waits for them.
  virtual uint64_t allocate(size_t bytes) = 0;
  virtual void release(uint64_t buffer) noexcept = 0;
  virtual void write(uint64_t buffer, size_t offset, const void* from, size_t bytes) = 0;
  virtual void read(uint64_t buffer, size_t offset, void* to, size_t bytes) = 0;
  virtual void finish() = 0;

  /// The binary of a source text with definitions "NAME=value"; throws Failure(kCompile) with the compiler's log.
  virtual std::string compile(const std::string& source, const std::vector<std::string>& definitions) = 0;
  /// Throws if the driver refuses the binary, such as that of another version.
  virtual uint64_t load(const std::string& binary) = 0;
  virtual void unload(uint64_t program) noexcept = 0;
  /// Valid as long as the program.
  virtual uint64_t kernel(uint64_t program, const std::string& name) = 0;
  virtual void launch(uint64_t kernel, const Grid& grid, std::span<const Argument> arguments) = 0;
};

/// Devices of one interface and how to open them. Empty without a driver; `why` then says what is missing.
std::vector<DeviceInfo> cuda_devices(std::string* why);
std::unique_ptr<Backend> open_cuda(int number);
std::vector<DeviceInfo> opencl_devices(std::string* why);
std::unique_ptr<Backend> open_opencl(int number);

}  // namespace covary::device
