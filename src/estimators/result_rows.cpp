// SPDX-License-Identifier: Apache-2.0
#include "estimators/result_rows.h"

#include <algorithm>

namespace covary {

void copy_rows(const Image& part, int skipped, int y, int n, int height, Image& whole) {
  if (part.data.empty()) return;
  if (whole.data.empty()) whole = Image(part.width, height, part.channels);
  std::copy_n(part.pixel(0, skipped), static_cast<size_t>(part.width) * part.channels * n, whole.pixel(0, y));
}

void append_rows(const MethodImage& part, int skipped, int y, int n, int height, MethodImage& whole) {
  copy_rows(part.estimate, skipped, y, n, height, whole.estimate);
  copy_rows(part.std_error, skipped, y, n, height, whole.std_error);
  copy_rows(part.bias, skipped, y, n, height, whole.bias);
  whole.risk_kind = part.risk_kind;
  if (!part.risk_rows.empty())
    whole.risk_rows.insert(whole.risk_rows.end(), part.risk_rows.begin() + skipped,
                           part.risk_rows.begin() + skipped + n);
}

}  // namespace covary
