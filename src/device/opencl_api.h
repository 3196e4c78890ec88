// SPDX-License-Identifier: Apache-2.0
// The functions of OpenCL 1.2 that are used, as its specification declares them, and the library that has them, loaded
// when first asked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace covary::device::opencl {

typedef struct Platform_* Platform;
typedef struct DeviceId_* DeviceId;
typedef struct Context_* Context;
typedef struct Queue_* Queue;
typedef struct Program_* Program;
typedef struct KernelObject_* KernelObject;
typedef struct Memory_* Memory;
typedef struct Event_* Event;

constexpr int kSuccess = 0, kDeviceNotFound = -1, kNoAllocation = -4, kOutOfResources = -5, kOutOfHostMemory = -6,
              kInvalidBufferSize = -61, kNoPlatform = -1001;
constexpr uint64_t kAllDevices = 0xFFFFFFFF, kProcessor = 1 << 1, kReadWrite = 1 << 0;
// clGetDeviceInfo
constexpr uint32_t kType = 0x1000, kUnits = 0x1002, kLargestGroup = 0x1004, kLargestBuffer = 0x1010,
                   kMemorySize = 0x101F, kLocalMemorySize = 0x1023, kAvailable = 0x1027, kCompiler = 0x1028,
                   kName = 0x102B, kDriverVersion = 0x102D, kDeviceVersion = 0x102F, kSingleConfig = 0x101B;
constexpr uint64_t kRoundedDivision = 1 << 7;  // of kSingleConfig
// clGetProgramInfo, clGetProgramBuildInfo
constexpr uint32_t kBinarySizes = 0x1165, kBinaries = 0x1166, kBuildLog = 0x1183;

struct Functions {
  int (*get_platforms)(uint32_t, Platform*, uint32_t*);
  int (*get_devices)(Platform, uint64_t type, uint32_t, DeviceId*, uint32_t*);
  int (*get_device_info)(DeviceId, uint32_t what, size_t, void*, size_t*);
  Context (*create_context)(const intptr_t*, uint32_t, const DeviceId*,
                            void (*)(const char*, const void*, size_t, void*), void*, int*);
  int (*release_context)(Context);
  Queue (*create_queue)(Context, DeviceId, uint64_t properties, int*);
  int (*release_queue)(Queue);
  Memory (*create_buffer)(Context, uint64_t flags, size_t, void*, int*);
  int (*release_memory)(Memory);
  Program (*create_from_source)(Context, uint32_t, const char**, const size_t*, int*);
  Program (*create_from_binary)(Context, uint32_t, const DeviceId*, const size_t*, const unsigned char**, int*, int*);
  int (*build)(Program, uint32_t, const DeviceId*, const char*, void (*)(Program, void*), void*);
  int (*get_build_info)(Program, DeviceId, uint32_t what, size_t, void*, size_t*);
  int (*get_program_info)(Program, uint32_t what, size_t, void*, size_t*);
  int (*release_program)(Program);
  KernelObject (*create_kernel)(Program, const char*, int*);
  int (*release_kernel)(KernelObject);
  int (*set_argument)(KernelObject, uint32_t, size_t, const void*);
  int (*launch)(Queue, KernelObject, uint32_t, const size_t* offset, const size_t* global, const size_t* local,
                uint32_t, const Event*, Event*);
  int (*write)(Queue, Memory, uint32_t blocking, size_t, size_t, const void*, uint32_t, const Event*, Event*);
  int (*read)(Queue, Memory, uint32_t blocking, size_t, size_t, void*, uint32_t, const Event*, Event*);
  int (*finish)(Queue);
};

/// Null if the library is not there; `why` then says so.
const Functions* functions(std::string* why);

/// The specification's name of a code, "CL_OUT_OF_RESOURCES", or its number.
std::string error_name(int code);

}  // namespace covary::device::opencl
