// SPDX-License-Identifier: Apache-2.0
#include "core/large_vector.h"

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace covary {

void ask_for_huge_pages([[maybe_unused]] void* memory, [[maybe_unused]] size_t size) {
#ifdef __linux__
  madvise(memory, size, MADV_HUGEPAGE);  // a hint: failure is harmless
#endif
}

}  // namespace covary
