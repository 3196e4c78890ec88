// SPDX-License-Identifier: Apache-2.0
// The device of the tests behind functions that a test overrides, to count calls or to fail.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "device/backend.h"

namespace covary::test_support {

class WrappedBackend : public device::Backend {
 public:
  const device::DeviceInfo& info() const override { return real_->info(); }
  uint64_t allocate(size_t bytes) override { return real_->allocate(bytes); }
  void release(uint64_t buffer) noexcept override { real_->release(buffer); }
  void write(uint64_t buffer, size_t offset, const void* from, size_t bytes) override {
    real_->write(buffer, offset, from, bytes);
  }
  void read(uint64_t buffer, size_t offset, void* to, size_t bytes) override { real_->read(buffer, offset, to, bytes); }
  void finish() override { real_->finish(); }
  std::string compile(const std::string& source, const std::vector<std::string>& definitions) override {
    return real_->compile(source, definitions);
  }
  uint64_t load(const std::string& binary) override { return real_->load(binary); }
  void unload(uint64_t program) noexcept override { real_->unload(program); }
  uint64_t kernel(uint64_t program, const std::string& name) override { return real_->kernel(program, name); }
  void launch(uint64_t kernel, const device::Grid& grid, std::span<const device::Argument> arguments) override {
    real_->launch(kernel, grid, arguments);
  }

 private:
  const std::unique_ptr<Backend> real_ = device::open_opencl(0);
};

}  // namespace covary::test_support
