// SPDX-License-Identifier: Apache-2.0
#include "device/cuda_api.h"

#include <fmt/format.h>

#include <cstdlib>

#include "device/device_info.h"
#include "device/library.h"

namespace covary::device::cuda {
namespace {

Loaded<Driver> load_driver() {
  Loaded<Driver> loaded;
  std::string& why = loaded.why;
  const Library library({"libcuda.so.1"}, why);
  if (!library) return loaded;
  Driver& d = loaded.all;
  library.bind("cuInit", d.init, why);
  library.bind("cuDriverGetVersion", d.version, why);
  library.bind("cuDeviceGetCount", d.device_count, why);
  library.bind("cuDeviceGet", d.device_get, why);
  library.bind("cuDeviceGetName", d.device_name, why);
  library.bind("cuDeviceTotalMem_v2", d.device_memory, why);
  library.bind("cuDeviceGetAttribute", d.device_attribute, why);
  library.bind("cuDevicePrimaryCtxRetain", d.retain_context, why);
  library.bind("cuDevicePrimaryCtxRelease_v2", d.release_context, why);
  library.bind("cuCtxSetCurrent", d.set_context, why);
  library.bind("cuStreamCreate", d.create_stream, why);
  library.bind("cuStreamDestroy_v2", d.destroy_stream, why);
  library.bind("cuStreamSynchronize", d.synchronise, why);
  library.bind("cuMemAlloc_v2", d.allocate, why);
  library.bind("cuMemFree_v2", d.free, why);
  library.bind("cuMemcpyHtoDAsync_v2", d.write, why);
  library.bind("cuMemcpyDtoHAsync_v2", d.read, why);
  library.bind("cuModuleLoadData", d.load, why);
  library.bind("cuModuleUnload", d.unload, why);
  library.bind("cuModuleGetFunction", d.get_function, why);
  library.bind("cuModuleGetGlobal_v2", d.get_global, why);
  library.bind("cuFuncSetAttribute", d.set_attribute, why);
  library.bind("cuLaunchKernel", d.launch, why);
  library.bind("cuGetErrorName", d.error_name, why);
  if (why.empty() && d.init(0) != kSuccess) why = "its driver finds no device";
  return loaded;
}

Loaded<Compiler> load_compiler() {
  std::vector<std::string> files;
  if (const char* own = std::getenv("COVARY_NVRTC")) files.push_back(own);
  for (const char* name : {"libnvrtc.so", "libnvrtc.so.13", "libnvrtc.so.12", "libnvrtc.so.11.2"}) {
    files.push_back(name);
    files.push_back(std::string("/usr/local/cuda/lib64/") + name);
  }
  Loaded<Compiler> loaded;
  std::string& why = loaded.why;
  const Library library(files, why);
  if (!library) {
    why = "no NVRTC, which compiles kernels: " + why + "; COVARY_NVRTC can name it";
    return loaded;
  }
  Compiler& c = loaded.all;
  library.bind("nvrtcVersion", c.version, why);
  library.bind("nvrtcCreateProgram", c.create, why);
  library.bind("nvrtcDestroyProgram", c.destroy, why);
  library.bind("nvrtcCompileProgram", c.compile, why);
  library.bind("nvrtcGetCUBINSize", c.binary_size, why);
  library.bind("nvrtcGetCUBIN", c.binary, why);
  library.bind("nvrtcGetProgramLogSize", c.log_size, why);
  library.bind("nvrtcGetProgramLog", c.log, why);
  library.bind("nvrtcGetErrorString", c.error_text, why);
  return loaded;
}

/// A program of NVRTC, destroyed with the object.
struct Program {
  const Compiler& compiler;
  Source source = nullptr;
  ~Program() { compiler.destroy(&source); }
};

}  // namespace

const Driver* driver(std::string* why) {
  static const Loaded<Driver> loaded = load_driver();
  return loaded.get(why);
}

const Compiler* compiler(std::string* why) {
  static const Loaded<Compiler> loaded = load_compiler();
  return loaded.get(why);
}

std::string compile(const std::string& source, const std::vector<std::string>& definitions,
                    const std::string& architecture) {
  std::string why;
  const Compiler* c = compiler(&why);
  if (!c) throw Failure(FailureKind::kCompile, "CUDA kernels cannot be compiled: " + why);
  // Like OpenCL kernels: products and sums are fused only where they say so (kernels/portable.h).
  std::vector<std::string> options = {"--gpu-architecture=" + architecture, "--std=c++17", "--fmad=false",
                                      "--device-as-default-execution-space"};
  for (const std::string& definition : definitions) options.push_back("-D" + definition);
  std::vector<const char*> pointers;
  for (const std::string& option : options) pointers.push_back(option.c_str());

  Program program{*c};
  int code = c->create(&program.source, source.c_str(), "kernels.cu", 0, nullptr, nullptr);
  if (code == kSuccess) code = c->compile(program.source, static_cast<int>(pointers.size()), pointers.data());
  if (code != kSuccess) {
    std::string log;
    if (size_t size = 0; program.source && c->log_size(program.source, &size) == kSuccess) {
      log.resize(size);
      c->log(program.source, log.data());
    }
    throw cannot_compile("NVRTC", log.empty() ? c->error_text(code) : log);
  }
  size_t size = 0;
  c->binary_size(program.source, &size);
  std::string binary(size, '\0');
  if (size == 0 || c->binary(program.source, binary.data()) != kSuccess)
    throw Failure(FailureKind::kCompile, "NVRTC gives no binary for " + architecture);
  return binary;
}

}  // namespace covary::device::cuda
