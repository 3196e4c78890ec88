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
#include <fstream>
#include <map>
#include <string>
#include <thread>

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
void oidnReleaseFilter(void* filter) { delete static_cast<Filter*>(filter); }
}
