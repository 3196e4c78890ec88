// SPDX-License-Identifier: Apache-2.0
#include "lab/cell_pairs.h"

#include <cmath>

namespace covary::lab {
namespace {

/// Pairs of errors, which share the noise of the references.
Pairs of_errors(const Cell& base, const Cell& cell, const std::function<double(const RunResult&)>& value) {
  const auto noise = [](const Cell& c) { return c.split.reference_noise / c.split.relative.error.value; };
  Pairs pairs = in_pairs(base, cell, value);
  if (&base != &cell) pairs.noise = std::hypot(noise(base), noise(cell));
  return pairs;
}

}  // namespace

double relmse(const RunResult& run) { return run.relmse; }
double seconds(const RunResult& run) { return run.record.method_seconds(); }

Pairs in_pairs(const Cell& a, const Cell& b, const std::function<double(const RunResult&)>& value) {
  Pairs pairs;
  for (const RunResult& run : a.runs)
    for (const RunResult& other : b.runs) {
      if (run.seed != other.seed) continue;
      pairs.seeds.push_back(run.seed);
      pairs.a.push_back(value(run)), pairs.b.push_back(value(other));
    }
  return pairs;
}

Pairs at_equal_samples(const Cell& base, const Cell& cell) {
  if (!cell.equal_sample_normalised) return of_errors(base, cell, relmse);
  return of_errors(base, cell, [](const RunResult& r) { return r.relmse * r.record.samples_per_pixel; });
}

Pairs at_equal_time(const Cell& base, const Cell& cell, const Budget& budget) {
  if (budget.seconds > 0) return of_errors(base, cell, relmse);
  return of_errors(base, cell, [](const RunResult& r) { return r.relmse * seconds(r); });
}

Pairs at_equal_processor_time(const Cell& base, const Cell& cell) {
  return of_errors(base, cell, [](const RunResult& r) { return r.relmse * r.record.processor_seconds; });
}

}  // namespace covary::lab
