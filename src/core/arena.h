// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>

#include "core/error.h"

namespace covary {

/// Fixed-size arena for objects that live as long as one path vertex (BSDF closures). Runs no destructors.
class Arena {
 public:
  template <typename T, typename... Args>
  T* make(Args&&... args) {
    static_assert(std::is_trivially_destructible_v<T>);
    static_assert(alignof(T) <= alignof(std::max_align_t));
    constexpr size_t kSize = (sizeof(T) + alignof(std::max_align_t) - 1) & ~(alignof(std::max_align_t) - 1);
    if (used_ + kSize > sizeof(store_)) [[unlikely]]
      throw Error(ErrorCode::kInput, "a material nests too many reflectance models at one point");
    T* object = new (store_ + used_) T(std::forward<Args>(args)...);
    used_ += kSize;
    return object;
  }
  void reset() { used_ = 0; }
  /// Bytes in use; capacity in bytes.
  size_t used() const { return used_; }
  static constexpr size_t kCapacity = 4096;

 private:
  alignas(std::max_align_t) std::byte store_[kCapacity];
  size_t used_ = 0;
};

}  // namespace covary
