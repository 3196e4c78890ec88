// SPDX-License-Identifier: Apache-2.0
#include "combine_light.h"

#include <algorithm>

#include "estimators/light_film.h"

namespace covary {
namespace {

constexpr int kRows = 64;  // in memory at a time

}  // namespace

void add_light_file(const GroupedFile& light, EstimatorResult& result) {
  GroupedFile::Rows rows;
  for (int y = 0; y < light.height(); y += kRows) {
    const int n = std::min(kRows, light.height() - y);
    light.read_rows(y, n, rows);
    add_light(light.view(rows, n), result, y);
  }
}

}  // namespace covary
