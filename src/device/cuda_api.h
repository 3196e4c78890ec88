// SPDX-License-Identifier: Apache-2.0
// The functions of the CUDA driver (11 or later) and of its run-time compiler NVRTC that are used, as their headers
// declare them, and the libraries that have them, loaded when first asked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace covary::device::cuda {

typedef int DeviceNumber;
typedef struct Context_* Context;
typedef struct Module_* Module;
typedef struct Function_* Function;
typedef struct Stream_* Stream;
typedef unsigned long long Address;

constexpr int kSuccess = 0, kOutOfMemory = 2, kNotInitialised = 3;
// cuDeviceGetAttribute
constexpr int kLargestGroup = 1, kLocalMemory = 8, kUnits = 16, kTimeLimit = 17, kMajor = 75, kMinor = 76,
              kLocalMemoryOnRequest = 97;
constexpr int kLocalMemoryAttribute = 8;  // cuFuncSetAttribute: bytes of local memory that a launch may give

struct Driver {
  int (*init)(unsigned);
  int (*version)(int*);
  int (*device_count)(int*);
  int (*device_get)(DeviceNumber*, int);
  int (*device_name)(char*, int, DeviceNumber);
  int (*device_memory)(size_t*, DeviceNumber);
  int (*device_attribute)(int*, int what, DeviceNumber);
  int (*retain_context)(Context*, DeviceNumber);
  int (*release_context)(DeviceNumber);
  int (*set_context)(Context);
  int (*create_stream)(Stream*, unsigned);
  int (*destroy_stream)(Stream);
  int (*synchronise)(Stream);
  int (*allocate)(Address*, size_t);
  int (*free)(Address);
  int (*write)(Address, const void*, size_t, Stream);
  int (*read)(void*, Address, size_t, Stream);
  int (*load)(Module*, const void*);
  int (*unload)(Module);
  int (*get_function)(Function*, Module, const char*);
  int (*get_global)(Address*, size_t*, Module, const char*);
  int (*set_attribute)(Function, int what, int value);
  int (*launch)(Function, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned local_memory, Stream,
                void** arguments, void** extra);
  int (*error_name)(int, const char**);
};

typedef struct Source_* Source;

struct Compiler {
  int (*version)(int* major, int* minor);
  int (*create)(Source*, const char* text, const char* name, int, const char* const*, const char* const*);
  int (*destroy)(Source*);
  int (*compile)(Source, int, const char* const* options);
  int (*binary_size)(Source, size_t*);
  int (*binary)(Source, char*);
  int (*log_size)(Source, size_t*);
  int (*log)(Source, char*);
  const char* (*error_text)(int);
};

/// Null if the library is not there or, for the driver, finds no device; `why` then says so. NVRTC is looked for as
/// $COVARY_NVRTC (a file), by the loader, and in CUDA's usual folder.
const Driver* driver(std::string* why);
const Compiler* compiler(std::string* why);

/// The binary for devices of capability `architecture`, "sm_90", from a source text with definitions "NAME=value".
/// Needs no device. Throws Failure(kCompile) with the compiler's log.
std::string compile(const std::string& source, const std::vector<std::string>& definitions,
                    const std::string& architecture);

}  // namespace covary::device::cuda
