// SPDX-License-Identifier: Apache-2.0
// Arrays for random access: aligned to cache lines, so that records that fit into a line do not straddle two, and with
// huge pages for large ones, so that reads rarely miss the TLB.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace covary {

/// Asks the system for huge pages if it has them; `memory` must be aligned to one.
void ask_for_huge_pages(void* memory, size_t size);

template <typename T>
struct LargeArrayAllocator {
  using value_type = T;
  LargeArrayAllocator() = default;
  template <typename U>
  LargeArrayAllocator(const LargeArrayAllocator<U>&) {}

  T* allocate(size_t n) {
    const size_t size = n * sizeof(T);
    void* memory = ::operator new(size, alignment(size));
    if (alignment(size) == kHugePage) ask_for_huge_pages(memory, size);
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, size_t n) { ::operator delete(memory, alignment(n * sizeof(T))); }
  template <typename U>
  bool operator==(const LargeArrayAllocator<U>&) const {
    return true;
  }

 private:
  static constexpr std::align_val_t kCacheLine{64}, kHugePage{2u << 20};
  static std::align_val_t alignment(size_t size) {
    return size < static_cast<size_t>(kHugePage) ? kCacheLine : kHugePage;
  }
};

template <typename T>
using LargeVector = std::vector<T, LargeArrayAllocator<T>>;

}  // namespace covary
