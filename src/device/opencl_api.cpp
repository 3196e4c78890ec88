// SPDX-License-Identifier: Apache-2.0
#include "device/opencl_api.h"

#include <utility>

#include "device/library.h"

namespace covary::device::opencl {
namespace {

Loaded<Functions> load() {
  Loaded<Functions> loaded;
  std::string& why = loaded.why;
  const Library library({"libOpenCL.so.1"}, why);
  if (!library) return loaded;
  Functions& a = loaded.all;
  library.bind("clGetPlatformIDs", a.get_platforms, why);
  library.bind("clGetDeviceIDs", a.get_devices, why);
  library.bind("clGetDeviceInfo", a.get_device_info, why);
  library.bind("clCreateContext", a.create_context, why);
  library.bind("clReleaseContext", a.release_context, why);
  library.bind("clCreateCommandQueue", a.create_queue, why);
  library.bind("clReleaseCommandQueue", a.release_queue, why);
  library.bind("clCreateBuffer", a.create_buffer, why);
  library.bind("clReleaseMemObject", a.release_memory, why);
  library.bind("clCreateProgramWithSource", a.create_from_source, why);
  library.bind("clCreateProgramWithBinary", a.create_from_binary, why);
  library.bind("clBuildProgram", a.build, why);
  library.bind("clGetProgramBuildInfo", a.get_build_info, why);
  library.bind("clGetProgramInfo", a.get_program_info, why);
  library.bind("clReleaseProgram", a.release_program, why);
  library.bind("clCreateKernel", a.create_kernel, why);
  library.bind("clReleaseKernel", a.release_kernel, why);
  library.bind("clSetKernelArg", a.set_argument, why);
  library.bind("clEnqueueNDRangeKernel", a.launch, why);
  library.bind("clEnqueueWriteBuffer", a.write, why);
  library.bind("clEnqueueReadBuffer", a.read, why);
  library.bind("clFinish", a.finish, why);
  return loaded;
}

}  // namespace

const Functions* functions(std::string* why) {
  static const Loaded<Functions> loaded = load();
  return loaded.get(why);
}

std::string error_name(int code) {
  static constexpr std::pair<int, const char*> kNames[] = {
      {-1, "CL_DEVICE_NOT_FOUND"},          {-2, "CL_DEVICE_NOT_AVAILABLE"},
      {-3, "CL_COMPILER_NOT_AVAILABLE"},    {-4, "CL_MEM_OBJECT_ALLOCATION_FAILURE"},
      {-5, "CL_OUT_OF_RESOURCES"},          {-6, "CL_OUT_OF_HOST_MEMORY"},
      {-11, "CL_BUILD_PROGRAM_FAILURE"},    {-30, "CL_INVALID_VALUE"},
      {-36, "CL_INVALID_COMMAND_QUEUE"},    {-38, "CL_INVALID_MEM_OBJECT"},
      {-42, "CL_INVALID_BINARY"},           {-45, "CL_INVALID_PROGRAM_EXECUTABLE"},
      {-46, "CL_INVALID_KERNEL_NAME"},      {-49, "CL_INVALID_ARG_INDEX"},
      {-50, "CL_INVALID_ARG_VALUE"},        {-51, "CL_INVALID_ARG_SIZE"},
      {-52, "CL_INVALID_KERNEL_ARGS"},      {-54, "CL_INVALID_WORK_GROUP_SIZE"},
      {-55, "CL_INVALID_WORK_ITEM_SIZE"},   {-61, "CL_INVALID_BUFFER_SIZE"},
      {-9999, "illegal access by a kernel"}};
  for (const auto& [known, name] : kNames)
    if (known == code) return name;
  return "error " + std::to_string(code);
}

}  // namespace covary::device::opencl
