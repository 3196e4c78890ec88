// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <new>
#include <type_traits>
#include <utility>

namespace covary {

/// target = make(), built where it is to stay. An assignment would build a temporary piece by piece and copy it with
/// wide loads at once, which have to wait until the narrow stores have reached the cache: some twenty cycles each time,
/// a tenth of a path's time in all.
template <typename T, typename Make>
void make_in_place(T& target, Make&& make) {
  static_assert(std::is_trivially_destructible_v<T>);
  new (&target) T(std::forward<Make>(make)());
}

}  // namespace covary
