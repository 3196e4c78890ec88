// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "device/backend.h"
#include "device/device.h"

namespace covary::device {

std::string DeviceInfo::id() const { return fmt::format("{}:{}", api == Api::kCuda ? "cuda" : "opencl", number); }
std::string DeviceInfo::text() const { return fmt::format("{} ({})", id(), name); }

Failure cannot_compile(const std::string& compiler, const std::string& log) {
  const size_t error = std::min(log.find("error"), log.size());
  const size_t before = log.rfind('\n', error), first = before == std::string::npos ? 0 : before + 1;
  const std::string line = log.substr(first, log.find('\n', error) - first);
  return {FailureKind::kCompile, fmt::format("{} cannot compile a kernel: {}", compiler, line), log};
}

std::vector<DeviceInfo> devices(std::vector<std::string>* notes) {
  std::string no_cuda, no_opencl;
  std::vector<DeviceInfo> all = cuda_devices(&no_cuda);
  const std::vector<DeviceInfo> opencl = opencl_devices(&no_opencl);
  all.insert(all.end(), opencl.begin(), opencl.end());
  if (notes) {
    if (!no_cuda.empty()) notes->push_back("cuda: " + no_cuda);
    if (!no_opencl.empty()) notes->push_back("opencl: " + no_opencl);
  }
  return all;
}

namespace {

/// The device that Device::open() takes for `name`; null if there is none.
const DeviceInfo* choose(const std::vector<DeviceInfo>& all, std::string_view name) {
  for (const DeviceInfo& device : all)
    if (device.id() == name) return &device;
  const auto first = [&](bool processors) -> const DeviceInfo* {
    for (const DeviceInfo& device : all)
      if (device.is_processor == processors && (name == "auto" || device.id().substr(0, device.id().find(':')) == name))
        return &device;
    return nullptr;
  };
  const DeviceInfo* gpu = first(false);
  return gpu || name == "auto" ? gpu : first(true);
}

}  // namespace

Device Device::open(const std::string& name) {
  std::vector<std::string> notes;
  const std::vector<DeviceInfo> all = devices(&notes);
  const DeviceInfo* chosen = choose(all, name);
  if (!chosen) {
    std::string found;
    for (const DeviceInfo& device : all) found += (found.empty() ? "" : ", ") + device.text();
    for (const std::string& note : notes) found += (found.empty() ? "" : "; ") + note;
    throw Failure(FailureKind::kUnavailable,
                  fmt::format("{}; found: {}", name == "auto" ? "there is no GPU" : "there is no device '" + name + "'",
                              found.empty() ? "none" : found));
  }
  return Device(chosen->api == Api::kCuda ? open_cuda(chosen->number) : open_opencl(chosen->number));
}

}  // namespace covary::device
