// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry for the target that COVARY_FUZZ_TARGET names (option COVARY_FUZZ, needs Clang).
#include <tbb/global_control.h>

#include "fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  // One thread: what an input reaches must not depend on the order of threads.
  static const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  covary::fuzz::COVARY_FUZZ_TARGET(std::as_bytes(std::span(data, size)));
  return 0;
}
