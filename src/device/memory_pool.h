// SPDX-License-Identifier: Apache-2.0
// Memory of a device that is used again: drivers take about a millisecond to give memory and to take it back.
#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "device/backend.h"

namespace covary::device {

/// Buffers of a backend. Those that are released are kept for requests of the same size until memory is short. As
/// commands run in order, nothing still reads a buffer when the next one writes it. Thread-safe.
class MemoryPool {
 public:
  explicit MemoryPool(std::shared_ptr<Backend> backend) : backend_(std::move(backend)) {}
  ~MemoryPool() { clear(); }
  MemoryPool(const MemoryPool&) = delete;
  MemoryPool& operator=(const MemoryPool&) = delete;

  uint64_t take(size_t bytes);
  void give(uint64_t buffer, size_t bytes) noexcept;
  /// Frees what nobody uses.
  void clear() noexcept;

 private:
  const std::shared_ptr<Backend> backend_;
  std::mutex mutex_;
  std::multimap<size_t, uint64_t> free_;
};

}  // namespace covary::device
