// SPDX-License-Identifier: Apache-2.0
#include "gpu/target.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace covary::gpu {

std::string wrong_device_name(const std::string& name) {
  const size_t colon = name.find(':');
  const std::string api = name.substr(0, colon);
  const bool has_number = colon != std::string::npos;
  const std::string number = has_number ? name.substr(colon + 1) : "0";
  const bool is_number =
      !number.empty() && number.size() < 4 && std::ranges::all_of(number, [](char c) { return c >= '0' && c <= '9'; });
  const bool is_known = api == "cuda" || api == "opencl" || (!has_number && (api == kProcessor || api == kAutomatic));
  return is_known && is_number ? "" : "cpu, auto, cuda, opencl, or one of these devices, e.g. opencl:1";
}

std::shared_ptr<Target> Target::open(const std::string& name) {
  if (name == kProcessor) return nullptr;
  static std::mutex mutex;
  static std::map<std::string, std::weak_ptr<Target>> opened;
  const std::lock_guard lock(mutex);
  if (std::shared_ptr<Target> known = opened[name].lock()) return known;
  try {
    auto target = std::make_shared<Target>(device::Device::open(name), name == kAutomatic);
    opened[name] = target;
    return target;
  } catch (const device::Failure& failure) {
    if (name == kAutomatic) return nullptr;
    throw Error(failure.code(), fmt::format("`device` {}: {}", name, failure.what()));
  }
}

void Target::check_finite(const EstimatorResult& result) const {
  std::vector<const Image*> images = {&result.estimate, &result.std_error};
  for (const Image& layer : result.layers) images.push_back(&layer);
  for (const Image* image : images)
    if (!std::ranges::all_of(image->data, [](float v) { return std::isfinite(v); }))
      throw device::Failure(device::FailureKind::kLost,
                            fmt::format("{} made values that are not finite numbers", info().text()));
}

void Target::fail(const device::Failure& failure) {
  if (!is_automatic_) throw Error(failure.code(), fmt::format("{}; `device` cpu does without it", failure.what()));
  failed_ = failure.what();
}

void Target::add_note(EstimatorResult& result) const {
  const std::string note = fmt::format("{}; the processor takes over", failed_.value_or(""));
  if (result.note.find(note) == std::string::npos) result.note += (result.note.empty() ? "" : "; ") + note;
}

}  // namespace covary::gpu
