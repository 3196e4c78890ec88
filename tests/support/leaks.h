// SPDX-License-Identifier: Apache-2.0
#pragma once

#ifdef __SANITIZE_ADDRESS__  // GCC
#define COVARY_COUNTS_LEAKS
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define COVARY_COUNTS_LEAKS
#endif
#endif

#ifdef COVARY_COUNTS_LEAKS
#include <sanitizer/lsan_interface.h>
#endif

namespace covary::test_support {

/// While it lives, what this thread allocates is not counted as a leak: for those of other libraries that
/// scripts/sanitizers/leaks.txt cannot name, because the stack through them is not known.
#ifdef COVARY_COUNTS_LEAKS
using LeaksOfOthers = __lsan::ScopedDisabler;
#else
struct LeaksOfOthers {
  LeaksOfOthers() {}  // not trivial, so that nothing is unused
};
#endif

}  // namespace covary::test_support
