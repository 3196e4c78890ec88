// SPDX-License-Identifier: Apache-2.0
#include "device/device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>

#include "core/content_hash.h"
#include "core/stopwatch.h"
#include "device/binary_cache.h"
#include "device/kernel_source.h"
#include "device/launch_pace.h"

namespace covary::device {

namespace {

/// Drivers refuse buffers of no bytes.
size_t at_least_one(size_t bytes) { return std::max<size_t>(bytes, 1); }

}  // namespace

RawBuffer::RawBuffer(std::shared_ptr<MemoryPool> pool, size_t bytes) : pool_(std::move(pool)), bytes_(bytes) {
  handle_ = pool_->take(at_least_one(bytes));
}

void RawBuffer::reset() noexcept {
  if (handle_ && pool_) pool_->give(handle_, at_least_one(bytes_));
  pool_.reset();
  handle_ = 0;
  bytes_ = 0;
}

/// Programs of an opened device by what they were made of.
struct Device::Programs {
  explicit Programs(Backend& b) : backend(b) {}
  ~Programs() {
    for (const auto& [key, program] : loaded) backend.unload(program);
  }
  Programs(const Programs&) = delete;
  Programs& operator=(const Programs&) = delete;

  uint64_t get(const std::string& source, const std::vector<std::string>& definitions) {
    const DeviceInfo& info = backend.info();
    const std::string key = key_text(
        fmt::format("{}\n{}\n{}\n{}\n{}", info.id(), info.name, info.driver, fmt::join(definitions, "\n"), source));
    if (const auto found = loaded.find(key); found != loaded.end()) return found->second;
    const std::filesystem::path folder = cache_folder();
    if (const std::optional<std::string> binary = cached_binary(folder, key)) {
      try {
        return loaded[key] = backend.load(*binary);
      } catch (const Failure&) {  // of a driver that calls itself the same; compile it again
        loaded.erase(key);
      }
    }
    const std::string binary = backend.compile(source, definitions);
    const uint64_t program = backend.load(binary);
    loaded[key] = program;
    store_binary(folder, key, binary);
    return program;
  }

  Backend& backend;
  std::map<std::string, uint64_t> loaded;
  std::map<std::pair<uint64_t, std::string>, uint64_t> kernels;
  std::map<uint64_t, LaunchPace> paces;  ///< of kernels
};

Device::Device(std::shared_ptr<Backend> backend)
    : backend_(std::move(backend)),
      pool_(std::make_shared<MemoryPool>(backend_)),
      programs_(std::make_unique<Programs>(*backend_)) {}
Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&& other) noexcept {
  std::swap(backend_, other.backend_);
  std::swap(pool_, other.pool_);
  std::swap(programs_, other.programs_);
  return *this;
}
Device::~Device() = default;

Kernel Device::kernel(const std::string& file, const std::string& name, const std::vector<std::string>& definitions) {
  return kernel_of(kernel_source(file), name, definitions);
}

Kernel Device::kernel_of(const std::string& source, const std::string& name,
                         const std::vector<std::string>& definitions) {
  const uint64_t program = programs_->get(source, definitions);
  uint64_t& handle = programs_->kernels[{program, name}];
  if (!handle) handle = backend_->kernel(program, name);
  return {handle, name};
}

void Device::launch_with(const Kernel& kernel, Range global, Range group, std::span<const Argument> arguments) {
  const auto groups = [](uint32_t items, uint32_t in_group) { return (items + in_group - 1) / in_group; };
  const Grid grid{.groups = {groups(global.x, group.x), groups(global.y, group.y), groups(global.z, group.z)},
                  .items = {group.x, group.y, group.z}};
  const uint64_t n = uint64_t{grid.groups[0]} * grid.groups[1] * grid.groups[2];
  if (n == 0) return;
  constexpr uint32_t kOfUnit = 4;  // groups that a multiprocessor has at first
  LaunchPace& pace = programs_->paces.try_emplace(kernel.handle, kOfUnit * std::max(info().units, 1u)).first->second;
  if (!info().stops_long_work || n <= pace.groups()) return backend_->launch(kernel.handle, grid, arguments);
  launch_in_parts(kernel, grid, pace, arguments);
}

void Device::launch_in_parts(const Kernel& kernel, const Grid& whole, LaunchPace& pace,
                             std::span<const Argument> arguments) {
  const size_t d = whole.groups[2] > 1 ? 2 : whole.groups[1] > 1 ? 1 : 0;
  const uint32_t of_slice = whole.groups[d == 0 ? 1 : 0] * whole.groups[d == 2 ? 1 : 2];
  Grid part = whole;
  backend_->finish();  // what was launched before has its own time
  for (uint32_t first = 0; first < whole.groups[d]; first += part.groups[d]) {
    part.first[d] = first;
    part.groups[d] = std::clamp(pace.groups() / of_slice, 1u, whole.groups[d] - first);
    const Stopwatch watch;
    backend_->launch(kernel.handle, part, arguments);
    backend_->finish();
    pace.measured(part.groups[d] * of_slice, watch.seconds());
  }
}

void Device::finish() { backend_->finish(); }

void Device::write_bytes(const RawBuffer& to, size_t offset, const void* from, size_t bytes) {
  COVARY_CHECK(offset + bytes <= to.bytes(), "what is written fits the buffer");
  if (bytes) backend_->write(to.handle(), offset, from, bytes);
}

void Device::read_bytes(const RawBuffer& from, size_t offset, void* to, size_t bytes) {
  COVARY_CHECK(offset + bytes <= from.bytes(), "what is read is in the buffer");
  if (bytes) backend_->read(from.handle(), offset, to, bytes);
}

}  // namespace covary::device
