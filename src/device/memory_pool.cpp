// SPDX-License-Identifier: Apache-2.0
#include "device/memory_pool.h"

namespace covary::device {

uint64_t MemoryPool::take(size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = free_.find(bytes); found != free_.end()) {
      const uint64_t buffer = found->second;
      free_.erase(found);
      return buffer;
    }
  }
  try {
    return backend_->allocate(bytes);
  } catch (const Failure& failure) {
    if (failure.kind() != FailureKind::kMemory) throw;
  }
  clear();
  return backend_->allocate(bytes);
}

void MemoryPool::give(uint64_t buffer, size_t bytes) noexcept {
  try {
    const std::lock_guard lock(mutex_);
    free_.emplace(bytes, buffer);
  } catch (const std::bad_alloc&) {
    backend_->release(buffer);
  }
}

void MemoryPool::clear() noexcept {
  const std::lock_guard lock(mutex_);
  for (const auto& [bytes, buffer] : free_) backend_->release(buffer);
  free_.clear();
}

}  // namespace covary::device
