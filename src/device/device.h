// SPDX-License-Identifier: Apache-2.0
// A device that runs kernels: a GPU by CUDA, or anything by OpenCL. Neither is needed to build or to start the program:
// their libraries are loaded when a device is asked for.
//
//     Device device = Device::open("auto");
//     Buffer<float> values = device.upload(std::span(host)), result = device.make<float>(1);
//     device.launch(device.kernel("sum.cl", "sum", {"GROUP=256"}), {256}, {256}, values, int(values.size()), result);
//     const std::vector<float> sum = device.download(result);
//
// Commands run in the order in which they are given; launch() does not wait. An object is for one thread at a time.
// Every function throws Failure (device_info.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "device/backend.h"
#include "device/device_info.h"
#include "device/memory_pool.h"

namespace covary::device {

class LaunchPace;

/// Memory of a device, given back with the object, which keeps the device open. Later buffers of the same size may have
/// it (memory_pool.h), so its content is undefined at first.
class RawBuffer {
 public:
  RawBuffer() = default;
  RawBuffer(std::shared_ptr<MemoryPool> pool, size_t bytes);
  /// Memory of another owner, which stays its own.
  RawBuffer(uint64_t handle, size_t bytes) : handle_(handle), bytes_(bytes) {}
  ~RawBuffer() { reset(); }
  RawBuffer(RawBuffer&& other) noexcept { swap(other); }
  RawBuffer& operator=(RawBuffer&& other) noexcept {
    swap(other);
    return *this;
  }
  size_t bytes() const { return bytes_; }
  uint64_t handle() const { return handle_; }
  explicit operator bool() const { return handle_ != 0; }
  void reset() noexcept;

 private:
  void swap(RawBuffer& other) noexcept {
    std::swap(pool_, other.pool_);
    std::swap(handle_, other.handle_);
    std::swap(bytes_, other.bytes_);
  }
  std::shared_ptr<MemoryPool> pool_;
  uint64_t handle_ = 0;
  size_t bytes_ = 0;
};

/// Memory of `size()` elements.
template <typename T>
class Buffer : public RawBuffer {
 public:
  Buffer() = default;
  Buffer(std::shared_ptr<MemoryPool> pool, size_t size) : RawBuffer(std::move(pool), size * sizeof(T)) {}
  Buffer(uint64_t handle, size_t size) : RawBuffer(handle, size * sizeof(T)) {}
  size_t size() const { return bytes() / sizeof(T); }
};

/// Local memory of each work group, for the last argument of a kernel (LOCAL_ARGUMENT in kernels/portable.h).
struct LocalMemory {
  size_t bytes;
};

/// Sizes in up to three dimensions, in items.
struct Range {
  uint32_t x = 1, y = 1, z = 1;
};

/// Valid as long as its device.
struct Kernel {
  uint64_t handle = 0;
  std::string name;  ///< for messages
};

namespace detail {

template <typename T>
Argument argument(const T& value) {
  if constexpr (std::is_base_of_v<RawBuffer, T>) {
    return {Argument::Kind::kBuffer, value.handle(), nullptr, 0};
  } else if constexpr (std::is_same_v<T, LocalMemory>) {
    return {Argument::Kind::kLocalMemory, 0, nullptr, value.bytes};
  } else {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T> && !std::is_same_v<T, bool>);
    return {Argument::Kind::kValue, 0, &value, sizeof value};
  }
}

}  // namespace detail

class Device {
 public:
  /// `name`: "auto", the first GPU, of CUDA if it has one; "cuda" or "opencl", the first of these, GPUs before
  /// processors; "cuda:1", "opencl:2", a certain one. Throws Failure(kUnavailable), which names all devices.
  static Device open(const std::string& name);
  /// For tests: a device whose driver is this.
  explicit Device(std::shared_ptr<Backend> backend);
  Device(Device&&) noexcept;
  Device& operator=(Device&&) noexcept;
  ~Device();

  const DeviceInfo& info() const { return backend_->info(); }

  template <typename T>
  Buffer<T> make(size_t size) {
    return Buffer<T>(pool_, size);
  }
  /// Memory that another program of this process has on the device, `size` elements: with CUDA a device pointer of the
  /// primary context, as PyTorch and CuPy have them; with OpenCL a cl_mem of this device's context. It is not copied,
  /// stays its owner's, and must outlive the buffer. What its owner does with it must be finished.
  template <typename T>
  Buffer<T> borrow(uint64_t handle, size_t size) {
    return Buffer<T>(handle, size);
  }
  /// Copies to and from a buffer, from element `first` of it on. The source may be changed after write() has returned.
  template <typename T>
  void write(Buffer<T>& to, std::span<const std::type_identity_t<T>> from, size_t first = 0) {
    write_bytes(to, first * sizeof(T), from.data(), from.size_bytes());
  }
  template <typename T>
  void read(const Buffer<T>& from, std::span<std::type_identity_t<T>> to, size_t first = 0) {
    read_bytes(from, first * sizeof(T), to.data(), to.size_bytes());
  }
  template <typename T>
  Buffer<std::remove_const_t<T>> upload(std::span<T> values) {
    auto buffer = make<std::remove_const_t<T>>(values.size());
    write(buffer, values);
    return buffer;
  }
  template <typename T>
  std::vector<T> download(const Buffer<T>& buffer) {
    std::vector<T> values(buffer.size());
    read(buffer, values);
    return values;
  }

  /// A kernel of device/kernels/FILE with definitions "NAME=value". Compiled at first use, and kept: in this object,
  /// and in the user's cache folder (binary_cache.h).
  Kernel kernel(const std::string& file, const std::string& name, const std::vector<std::string>& definitions = {});
  /// Same, of a source text.
  Kernel kernel_of(const std::string& source, const std::string& name, const std::vector<std::string>& definitions);

  /// Runs at least `global` items, in whole groups of `group` items: kernels check whether an item has work. Arguments
  /// are buffers, numbers and structs of them, and LocalMemory. Long work is launched in parts (launch_pace.h).
  template <typename... Arguments>
  void launch(const Kernel& kernel, Range global, Range group, const Arguments&... arguments) {
    const std::array<Argument, sizeof...(Arguments)> all{detail::argument(arguments)...};
    launch_with(kernel, global, group, all);
  }
  /// Waits for all commands.
  void finish();

 private:
  struct Programs;
  void write_bytes(const RawBuffer& to, size_t offset, const void* from, size_t bytes);
  void read_bytes(const RawBuffer& from, size_t offset, void* to, size_t bytes);
  void launch_with(const Kernel& kernel, Range global, Range group, std::span<const Argument> arguments);
  void launch_in_parts(const Kernel& kernel, const Grid& whole, LaunchPace& pace, std::span<const Argument> arguments);

  std::shared_ptr<Backend> backend_;
  std::shared_ptr<MemoryPool> pool_;
  std::unique_ptr<Programs> programs_;
};

/// Copies memory that another program has on a device of CUDA, of the primary context, here; needs no compiler of
/// kernels. What its owner does with it in the usual stream is waited for. Throws Failure.
void read_from_cuda(int number, uint64_t from, void* to, size_t bytes);

}  // namespace covary::device
