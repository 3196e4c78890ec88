// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry (option COVARY_FUZZ, needs Clang).
#include "fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  covary::fuzz::ply(std::as_bytes(std::span(data, size)));
  return 0;
}
