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

/// During its lifetime, LeakSanitizer ignores what this thread allocates: for leaks of other libraries that
/// scripts/sanitizers/leaks.txt cannot suppress, because their stack frames are unknown.
#ifdef COVARY_COUNTS_LEAKS
using LeaksOfOthers = __lsan::ScopedDisabler;
#else
struct LeaksOfOthers {
  LeaksOfOthers() {}  // not trivial, to avoid warnings of unused variables
};
#endif

}  // namespace covary::test_support
