// SPDX-License-Identifier: Apache-2.0
// Stands in for Open Image Denoise where tests need one that is at a place of its own: the functions of its interface
// that covary calls (denoising/denoise.cpp). Its image is the input turned upside down, which no filter makes, with
// a trace of the guide of reflectance.
// Where STAND_IN_RUNS names a file, a byte is added to it by each filter.
// Where STAND_IN_BEGINS names a file, it is made when a filter begins, which then works for ten minutes and cannot be
// cancelled.
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <string>
#include <thread>
#include <vector>

namespace {

struct Plane {
  float* data;
  size_t width, height;
};
using Filter = std::map<std::string, Plane>;

}  // namespace

extern "C" {

void* oidnNewDevice(int) {
  static int device;
  return &device;
}
void oidnCommitDevice(void*) {}
void oidnReleaseDevice(void*) {}
void oidnSetDeviceInt(void*, const char*, int) {}
int oidnGetDeviceInt(void*, const char*) { return 20000; }
int oidnGetDeviceError(void*, const char**) { return 0; }
void* oidnNewFilter(void*, const char*) { return new Filter; }
void oidnSetSharedFilterImage(void* filter, const char* name, void* data, int, size_t width, size_t height, size_t,
                              size_t, size_t) {
  static_cast<Filter*>(filter)->insert_or_assign(name, Plane{static_cast<float*>(data), width, height});
}
void oidnSetFilterBool(void*, const char*, bool) {}
void oidnSetFilterInt(void*, const char*, int) {}
void oidnSetFilterProgressMonitorFunction(void*, bool (*)(void*, double), void*) {}
void oidnCommitFilter(void*) {}
void oidnExecuteFilter(void* filter) {
  if (const char* begins = std::getenv("STAND_IN_BEGINS")) {
    std::ofstream(begins).close();
    std::this_thread::sleep_for(std::chrono::minutes(10));
  }
  if (const char* runs = std::getenv("STAND_IN_RUNS")) std::ofstream(runs, std::ios::app) << '.';
  Filter& planes = *static_cast<Filter*>(filter);
  const Plane from = planes.contains("color") ? planes.at("color") : planes.begin()->second, to = planes.at("output");
  const size_t n = 3 * from.width * from.height;
  const bool is_guided = planes.contains("color") && planes.contains("albedo");
  for (size_t i = 0; i < n; ++i)
    to.data[i] = from.data[n - 1 - i] + (is_guided ? 0.01f * planes.at("albedo").data[i] : 0.0f);
}
// Devices of CUDA: one, whose buffers are in the processor's memory but not at the caller's addresses.
// STAND_IN_BUFFERS names a file to which a byte is added by each.
bool oidnIsCUDADeviceSupported(int number) { return number == 0; }
void* oidnNewCUDADevice(const int*, void* const*, int) { return oidnNewDevice(0); }
void* oidnNewBuffer(void*, size_t bytes) {
  if (const char* buffers = std::getenv("STAND_IN_BUFFERS")) std::ofstream(buffers, std::ios::app) << '.';
  return new std::vector<char>(bytes);
}
void oidnWriteBuffer(void* buffer, size_t offset, size_t bytes, const void* from) {
  std::memcpy(static_cast<std::vector<char>*>(buffer)->data() + offset, from, bytes);
}
void oidnReadBuffer(void* buffer, size_t offset, size_t bytes, void* to) {
  std::memcpy(to, static_cast<std::vector<char>*>(buffer)->data() + offset, bytes);
}
void oidnReleaseBuffer(void* buffer) { delete static_cast<std::vector<char>*>(buffer); }
void oidnSetFilterImage(void* filter, const char* name, void* buffer, int format, size_t width, size_t height, size_t,
                        size_t, size_t) {
  oidnSetSharedFilterImage(filter, name, static_cast<std::vector<char>*>(buffer)->data(), format, width, height, 0, 0,
                           0);
}
void oidnReleaseFilter(void* filter) { delete static_cast<Filter*>(filter); }
}
