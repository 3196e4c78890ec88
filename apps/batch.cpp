// SPDX-License-Identifier: Apache-2.0
#include "batch.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "core/error.h"
#include "core/printable.h"
#include "core/stopwatch.h"
#include "motion_checks.h"

namespace covary {

bool attempt(const std::string& which, bool quiet, const std::function<std::string()>& run) {
  try {
    const std::string said = run();
    if (!quiet) fmt::print(stderr, "{}: {}\n", printable(which), said);
    return true;
  } catch (const WrongSequence&) {
    throw;
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kInput) throw;
    fmt::print(stderr, "warning: {} failed: {}\n", printable(which), printable(error.what()));
    return false;
  }
}

void poll(std::optional<double> idle, const std::function<Found()>& look) {
  for (Stopwatch since;;) {
    const Found found = look();
    if (found == Found::kEnd) return;
    if (found == Found::kWork) since = Stopwatch();
    if (idle && since.seconds() > *idle) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
}

}  // namespace covary
