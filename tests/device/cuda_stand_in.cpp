// SPDX-License-Identifier: Apache-2.0
// libcuda.so.1 and NVRTC for tests: the functions that src/device/cuda_api.h binds, made with OpenCL on the processor.
// So src/device/cuda_backend.cpp, what kernels are given, and memory that another program has on a device are tested
// without a GPU. Kernels are compiled as OpenCL C, not as CUDA C++: tests/device/cuda_kernels.py compiles them so.
//
// An address is one of shared virtual memory, which the processor reads and writes as well.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

#include "device/library.h"
#include "device/opencl_api.h"

namespace {

using namespace covary::device;
using namespace covary::device::opencl;

constexpr int kInvalidValue = 1, kOutOfMemory = 2, kNotFound = 500, kLaunchFailed = 719;  // cuda.h
constexpr int kCompilationFailed = 6;                                                     // nvrtc.h
constexpr size_t kMemory = size_t{1} << 30;
constexpr const char* kOptions = "-cl-std=CL1.2 -cl-fp32-correctly-rounded-divide-sqrt -cl-kernel-arg-info";

/// The functions of OpenCL 1.2 and 2.0 that src/device does without.
struct More {
  int (*kernel_info)(KernelObject, uint32_t, size_t, void*, size_t*);
  int (*argument_info)(KernelObject, uint32_t, uint32_t, size_t, void*, size_t*);
  int (*set_pointer)(KernelObject, uint32_t, const void*);
  void* (*allocate)(Context, uint64_t flags, size_t, uint32_t alignment);
  void (*free)(Context, void*);
};
constexpr uint32_t kArgumentCount = 0x1191, kAddressSpace = 0x1196, kGlobal = 0x119B, kLocal = 0x119C;

struct ModuleText {
  std::string options, source;
};

struct Module {
  Program program = nullptr;
  std::array<int, 3> first_group = {};
  bool has_first_group = false;
};
struct Function {
  KernelObject kernel = nullptr;
  Module* module = nullptr;
};

class Processor {
 public:
  static Processor& get() {
    static Processor processor;
    return processor;
  }
  bool is_there() const { return queue_ != nullptr; }

  Program build(const ModuleText& text, std::string& log) const {
    const char* source = text.source.c_str();
    const size_t length = text.source.size();
    int code = 0;
    const Program program = cl_->create_from_source(context_, 1, &source, &length, &code);
    if (cl_->build(program, 1, &device_, (kOptions + text.options).c_str(), nullptr, nullptr) == opencl::kSuccess)
      return program;
    size_t size = 0;
    cl_->get_build_info(program, device_, kBuildLog, 0, nullptr, &size);
    log.resize(size);
    cl_->get_build_info(program, device_, kBuildLog, size, log.data(), nullptr);
    cl_->release_program(program);
    return nullptr;
  }

  void* allocate(size_t bytes) {
    if (used_ + bytes > kMemory) return nullptr;
    void* const memory = more_.allocate(context_, kReadWrite, bytes, 0);
    const std::lock_guard lock(mutex_);
    if (memory) used_ += bytes, sizes_[memory] = bytes;
    return memory;
  }
  bool release(void* memory) {
    const std::lock_guard lock(mutex_);
    const auto found = sizes_.find(memory);
    if (found == sizes_.end()) return false;
    used_ -= found->second;
    sizes_.erase(found);
    more_.free(context_, memory);
    return true;
  }

  KernelObject kernel(Program program, const char* name) const {
    int code = 0;
    return cl_->create_kernel(program, name, &code);
  }
  /// `values`: a pointer to each argument, as cuLaunchKernel() takes them, without the local memory.
  bool launch(const Function& function, const std::array<unsigned, 3>& groups, const std::array<unsigned, 3>& items,
              unsigned local_memory, void** values) const {
    uint32_t n = 0;
    more_.kernel_info(function.kernel, kArgumentCount, sizeof n, &n, nullptr);
    for (uint32_t i = 0; i < n; ++i) {
      uint32_t space = 0;
      more_.argument_info(function.kernel, i, kAddressSpace, sizeof space, &space, nullptr);
      const bool is_set = space == kLocal    ? cl_->set_argument(function.kernel, i, local_memory, nullptr) == 0
                          : space == kGlobal ? set_pointer(function.kernel, i, *static_cast<void**>(*values++))
                                             : set_value(function.kernel, i, *values++);
      if (!is_set) return false;
    }
    std::array<size_t, 3> offset, global, local;
    for (size_t d = 0; d < 3; ++d) {
      local[d] = items[d];
      global[d] = size_t{groups[d]} * items[d];
      offset[d] = static_cast<size_t>(function.module->first_group[d]) * items[d];
    }
    return cl_->launch(queue_, function.kernel, 3, offset.data(), global.data(), local.data(), 0, nullptr, nullptr) ==
           opencl::kSuccess;
  }
  bool finish() const { return cl_->finish(queue_) == opencl::kSuccess; }

 private:
  Processor() : cl_(functions(nullptr)) {
    std::string why;
    const Library library({"libOpenCL.so.1"}, why);
    if (!cl_ || !library || !library.bind("clGetKernelInfo", more_.kernel_info, why) ||
        !library.bind("clGetKernelArgInfo", more_.argument_info, why) ||
        !library.bind("clSetKernelArgSVMPointer", more_.set_pointer, why) ||
        !library.bind("clSVMAlloc", more_.allocate, why) || !library.bind("clSVMFree", more_.free, why))
      return;
    Platform platform = nullptr;
    uint32_t n = 0;
    int code = 0;
    if (cl_->get_platforms(1, &platform, &n) != 0 || cl_->get_devices(platform, kProcessor, 1, &device_, &n) != 0)
      return;
    context_ = cl_->create_context(nullptr, 1, &device_, nullptr, nullptr, &code);
    queue_ = cl_->create_queue(context_, device_, 0, &code);
  }

  bool set_pointer(KernelObject kernel, uint32_t i, void* memory) const {
    return more_.set_pointer(kernel, i, memory) == opencl::kSuccess;
  }
  /// The size of a value is what OpenCL takes: CUDA gives none.
  bool set_value(KernelObject kernel, uint32_t i, const void* value) const {
    for (size_t size = 4; size <= 256; size += 4)
      if (cl_->set_argument(kernel, i, size, value) == opencl::kSuccess) return true;
    return false;
  }

  const Functions* cl_;
  More more_ = {};
  DeviceId device_ = nullptr;
  Context context_ = nullptr;
  Queue queue_ = nullptr;
  std::mutex mutex_;
  size_t used_ = 0;
  std::map<void*, size_t> sizes_;
};

/// What NVRTC makes of a source: the definitions in the first line, then the text.
struct Source {
  ModuleText text;
  std::string log;
  std::string binary() const { return text.options + "\n" + text.source; }
};

}  // namespace

extern "C" {

int cuInit(unsigned) { return Processor::get().is_there() ? 0 : 100; }
int cuDriverGetVersion(int* version) { return *version = 12040, 0; }
int cuDeviceGetCount(int* count) { return *count = 1, 0; }
int cuDeviceGet(int* device, int number) { return *device = number, number == 0 ? 0 : kInvalidValue; }
int cuDeviceGetName(char* name, int size, int) { return std::strncpy(name, "a stand-in for tests", size), 0; }
int cuDeviceTotalMem_v2(size_t* bytes, int) { return *bytes = kMemory, 0; }
int cuDeviceGetAttribute(int* value, int what, int) {
  const std::map<int, int> known = {{1, 1024}, {8, 48 << 10}, {16, 2}, {17, 1}, {75, 9}, {76, 0}, {97, 96 << 10}};
  return *value = known.at(what), 0;
}
int cuDevicePrimaryCtxRetain(void** context, int) { return *context = &Processor::get(), 0; }
int cuDevicePrimaryCtxRelease_v2(int) { return 0; }
int cuCtxSetCurrent(void* context) { return context == &Processor::get() ? 0 : kInvalidValue; }
int cuStreamCreate(void** stream, unsigned) { return *stream = &Processor::get(), 0; }
int cuStreamDestroy_v2(void*) { return 0; }
int cuStreamSynchronize(void*) { return Processor::get().finish() ? 0 : kLaunchFailed; }

int cuMemAlloc_v2(uint64_t* address, size_t bytes) {
  void* const memory = Processor::get().allocate(bytes);
  return *address = reinterpret_cast<uintptr_t>(memory), memory ? 0 : kOutOfMemory;
}
int cuMemFree_v2(uint64_t address) {
  Processor::get().finish();
  return Processor::get().release(reinterpret_cast<void*>(address)) ? 0 : kInvalidValue;
}
/// Of all copies to the device.
size_t stand_in_bytes_written = 0;
int cuMemcpyHtoDAsync_v2(uint64_t to, const void* from, size_t bytes, void*) {
  Processor::get().finish();
  stand_in_bytes_written += bytes;
  return std::memcpy(reinterpret_cast<void*>(to), from, bytes), 0;
}
int cuMemcpyDtoHAsync_v2(void* to, uint64_t from, size_t bytes, void*) {
  Processor::get().finish();
  return std::memcpy(to, reinterpret_cast<const void*>(from), bytes), 0;
}

int cuModuleLoadData(void** result, const void* binary) {
  std::istringstream text{std::string(static_cast<const char*>(binary))};
  ModuleText parts;
  std::getline(text, parts.options);
  parts.source.assign(std::istreambuf_iterator<char>(text), {});
  std::string log;
  auto module = std::make_unique<Module>();
  module->program = Processor::get().build(parts, log);
  module->has_first_group = parts.source.find("first_group") != std::string::npos;
  if (!module->program) return kInvalidValue;
  return *result = module.release(), 0;
}
int cuModuleUnload(void*) { return 0; }  // kernels are kept until the process ends
int cuModuleGetFunction(void** result, void* module, const char* name) {
  auto* const in = static_cast<Module*>(module);
  const KernelObject kernel = Processor::get().kernel(in->program, name);
  if (!kernel) return kNotFound;
  return *result = new Function{kernel, in}, 0;
}
int cuModuleGetGlobal_v2(uint64_t* address, size_t* bytes, void* module, const char* name) {
  auto* const in = static_cast<Module*>(module);
  if (std::string(name) != "first_group" || !in->has_first_group) return kNotFound;
  *address = reinterpret_cast<uintptr_t>(in->first_group.data());
  *bytes = sizeof in->first_group;
  return 0;
}
int cuFuncSetAttribute(void*, int, int) { return 0; }
int cuLaunchKernel(void* function, unsigned gx, unsigned gy, unsigned gz, unsigned bx, unsigned by, unsigned bz,
                   unsigned local_memory, void*, void** arguments, void**) {
  const bool is_launched =
      Processor::get().launch(*static_cast<Function*>(function), {gx, gy, gz}, {bx, by, bz}, local_memory, arguments);
  return is_launched ? 0 : kLaunchFailed;
}
int cuGetErrorName(int code, const char** name) {
  *name = code == kOutOfMemory ? "CUDA_ERROR_OUT_OF_MEMORY" : "CUDA_ERROR_UNKNOWN";
  return 0;
}

int nvrtcVersion(int* major, int* minor) { return *major = 12, *minor = 4, 0; }
int nvrtcCreateProgram(void** result, const char* text, const char*, int, const char* const*, const char* const*) {
  auto source = std::make_unique<Source>();
  source->text.source = text;
  return *result = source.release(), 0;
}
int nvrtcDestroyProgram(void** source) {
  delete static_cast<Source*>(*source);
  return 0;
}
int nvrtcCompileProgram(void* source, int n, const char* const* options) {
  auto* const in = static_cast<Source*>(source);
  for (int i = 0; i < n; ++i)
    if (std::string_view(options[i]).starts_with("-D")) in->text.options += std::string(" ") + options[i];
  return Processor::get().build(in->text, in->log) ? 0 : kCompilationFailed;
}
int nvrtcGetCUBINSize(void* source, size_t* bytes) { return *bytes = static_cast<Source*>(source)->binary().size(), 0; }
int nvrtcGetCUBIN(void* source, char* to) {
  const std::string binary = static_cast<Source*>(source)->binary();
  return std::memcpy(to, binary.data(), binary.size()), 0;
}
int nvrtcGetProgramLogSize(void* source, size_t* bytes) { return *bytes = static_cast<Source*>(source)->log.size(), 0; }
int nvrtcGetProgramLog(void* source, char* to) {
  const std::string& log = static_cast<Source*>(source)->log;
  return std::memcpy(to, log.data(), log.size()), 0;
}
const char* nvrtcGetErrorString(int) { return "NVRTC_ERROR_COMPILATION"; }

}  // extern "C"
