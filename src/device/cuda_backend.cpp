// SPDX-License-Identifier: Apache-2.0
// Devices of CUDA, by the driver's interface alone; kernels are compiled by NVRTC.
#include <fmt/format.h>

#include <array>
#include <functional>
#include <map>
#include <memory>

#include "device/backend.h"
#include "device/cuda_api.h"
#include "device/device.h"

namespace covary::device {
namespace {

using namespace cuda;

[[noreturn]] void fail(const Driver& cu, const std::string& device, int code, const std::string& what) {
  const char* name = nullptr;
  cu.error_name(code, &name);
  throw Failure(code == kOutOfMemory ? FailureKind::kMemory : FailureKind::kLost,
                fmt::format("{} failed: {}: {}", device, what, name ? name : std::to_string(code)));
}

int attribute(const Driver& cu, int what, DeviceNumber device) {
  int value = 0;
  cu.device_attribute(&value, what, device);
  return value;
}

DeviceInfo info_of(const Driver& cu, int number) {
  DeviceNumber device = 0;
  cu.device_get(&device, number);
  DeviceInfo info;
  info.api = Api::kCuda;
  info.number = number;
  char name[256] = {};
  cu.device_name(name, sizeof name - 1, device);
  info.name = name;
  size_t memory = 0;
  cu.device_memory(&memory, device);
  info.memory = info.largest_buffer = memory;
  info.local_memory = static_cast<uint64_t>(
      std::max(attribute(cu, kLocalMemory, device), attribute(cu, kLocalMemoryOnRequest, device)));
  info.largest_group = static_cast<uint32_t>(attribute(cu, kLargestGroup, device));
  info.units = static_cast<uint32_t>(attribute(cu, kUnits, device));
  info.stops_long_work = attribute(cu, kTimeLimit, device) != 0;
  int version = 0, major = 0, minor = 0;
  cu.version(&version);
  if (const Compiler* nvrtc = compiler(nullptr)) nvrtc->version(&major, &minor);
  info.driver = fmt::format("CUDA {}.{}, NVRTC {}.{}, sm_{}{}", version / 1000, version % 1000 / 10, major, minor,
                            attribute(cu, kMajor, device), attribute(cu, kMinor, device));
  return info;
}

class CudaBackend final : public Backend {
 public:
  explicit CudaBackend(int number) : cu_(*driver(nullptr)), info_(info_of(cu_, number)) {
    check(cu_.device_get(&device_, number), "cuDeviceGet");
    check(cu_.retain_context(&context_, device_), "cuDevicePrimaryCtxRetain");
    enter();
    const int code = cu_.create_stream(&stream_, 0);
    if (code != kSuccess) cu_.release_context(device_);
    check(code, "cuStreamCreate");
  }
  ~CudaBackend() override {
    cu_.set_context(context_);
    cu_.synchronise(stream_);
    cu_.destroy_stream(stream_);
    cu_.release_context(device_);
  }

  const DeviceInfo& info() const override { return info_; }

  uint64_t allocate(size_t bytes) override {
    enter();
    Address address = 0;
    check(cu_.allocate(&address, bytes), fmt::format("a buffer of {} MB", bytes >> 20));
    return address;
  }
  void release(uint64_t buffer) noexcept override {
    cu_.set_context(context_);
    cu_.free(buffer);
  }

  void write(uint64_t buffer, size_t offset, const void* from, size_t bytes) override {
    enter();
    check(cu_.write(buffer + offset, from, bytes, stream_), "cuMemcpyHtoDAsync");
    finish();  // the source may be changed from now on
  }
  void read(uint64_t buffer, size_t offset, void* to, size_t bytes) override {
    enter();
    check(cu_.read(to, buffer + offset, bytes, stream_), "cuMemcpyDtoHAsync");
    finish();
  }
  void finish() override {
    enter();
    check(cu_.synchronise(stream_), "cuStreamSynchronize");
  }

  std::string compile(const std::string& source, const std::vector<std::string>& definitions) override {
    const std::string architecture =
        fmt::format("sm_{}{}", attribute(cu_, kMajor, device_), attribute(cu_, kMinor, device_));
    return cuda::compile(source, definitions, architecture);
  }
  uint64_t load(const std::string& binary) override {
    enter();
    Module module = nullptr;
    check(cu_.load(&module, binary.data()), "cuModuleLoadData");
    const uint64_t program = reinterpret_cast<uintptr_t>(module);
    size_t size = 0;
    FirstGroup& first = first_groups_[program];
    if (cu_.get_global(&first.address, &size, module, "first_group") != kSuccess) first_groups_.erase(program);
    return program;
  }
  void unload(uint64_t program) noexcept override {
    cu_.set_context(context_);
    cu_.unload(reinterpret_cast<Module>(static_cast<uintptr_t>(program)));
    first_groups_.erase(program);
  }
  uint64_t kernel(uint64_t program, const std::string& name) override {
    enter();
    Function function = nullptr;
    check(cu_.get_function(&function, reinterpret_cast<Module>(static_cast<uintptr_t>(program)), name.c_str()),
          "kernel " + name);
    const uint64_t kernel = reinterpret_cast<uintptr_t>(function);
    programs_[kernel] = program;
    return kernel;
  }

  void launch(uint64_t kernel, const Grid& grid, std::span<const Argument> arguments) override {
    enter();
    set_first_group(programs_.at(kernel), grid.first);
    const auto function = reinterpret_cast<Function>(static_cast<uintptr_t>(kernel));
    std::vector<void*> pointers;
    unsigned local_memory = 0;
    for (const Argument& a : arguments) {
      if (a.kind == Argument::Kind::kLocalMemory)
        local_memory = static_cast<unsigned>(a.bytes);
      else
        pointers.push_back(a.kind == Argument::Kind::kBuffer ? const_cast<uint64_t*>(&a.buffer)
                                                             : const_cast<void*>(a.value));
    }
    constexpr unsigned kWithoutRequest = 48 << 10;
    if (local_memory > kWithoutRequest)
      check(cu_.set_attribute(function, kLocalMemoryAttribute, static_cast<int>(local_memory)), "cuFuncSetAttribute");
    check(cu_.launch(function, grid.groups[0], grid.groups[1], grid.groups[2], grid.items[0], grid.items[1],
                     grid.items[2], local_memory, stream_, pointers.data(), nullptr),
          "cuLaunchKernel");
  }

 private:
  /// The variable first_group of kernels/portable.h.
  struct FirstGroup {
    Address address = 0;
    std::array<uint32_t, 3> value = {};
  };

  /// Kernels of a source without that variable cannot be launched in parts.
  void set_first_group(uint64_t program, const std::array<uint32_t, 3>& value) {
    const auto found = first_groups_.find(program);
    const bool is_known = found != first_groups_.end();
    if (value == (is_known ? found->second.value : std::array<uint32_t, 3>{})) return;
    if (!is_known)
      throw Failure(FailureKind::kLost, info_.text() + " failed: cuModuleGetGlobal finds no variable first_group");
    write(found->second.address, 0, value.data(), sizeof value);
    found->second.value = value;
  }

  /// Makes the context that of this thread.
  void enter() { check(cu_.set_context(context_), "cuCtxSetCurrent"); }

  void check(int code, const std::string& what) const {
    if (code != kSuccess) fail(cu_, info_.text(), code, what);
  }

  const Driver& cu_;
  const DeviceInfo info_;
  DeviceNumber device_ = 0;
  Context context_ = nullptr;
  Stream stream_ = nullptr;
  std::map<uint64_t, FirstGroup> first_groups_;  ///< of programs
  std::map<uint64_t, uint64_t> programs_;        ///< of kernels
};

}  // namespace

std::vector<DeviceInfo> cuda_devices(std::string* why) {
  const Driver* cu = driver(why);
  if (!cu || !compiler(why)) return {};
  int n = 0;
  cu->device_count(&n);
  std::vector<DeviceInfo> infos;
  for (int i = 0; i < n; ++i) infos.push_back(info_of(*cu, i));
  if (infos.empty() && why) *why = "its driver finds no device";
  return infos;
}

void read_from_cuda(int number, uint64_t from, void* to, size_t bytes) {
  std::string why;
  const Driver* cu = driver(&why);
  if (!cu) throw Failure(FailureKind::kUnavailable, "cuda: " + why);
  const auto check = [&](int code, const char* what) {
    if (code != kSuccess) fail(*cu, fmt::format("cuda:{}", number), code, what);
  };
  DeviceNumber device = 0;
  Context context = nullptr;
  check(cu->device_get(&device, number), "cuDeviceGet");
  check(cu->retain_context(&context, device), "cuDevicePrimaryCtxRetain");
  const std::unique_ptr<const Driver, std::function<void(const Driver*)>> release(
      cu, [device](const Driver* owner) { owner->release_context(device); });
  check(cu->set_context(context), "cuCtxSetCurrent");
  check(cu->read(to, from, bytes, nullptr), "cuMemcpyDtoHAsync");
  check(cu->synchronise(nullptr), "cuStreamSynchronize");
}

std::unique_ptr<Backend> open_cuda(int number) { return std::make_unique<CudaBackend>(number); }

}  // namespace covary::device
