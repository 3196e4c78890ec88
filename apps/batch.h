// SPDX-License-Identifier: Apache-2.0
// Work on many files, some of which may fail or not be there yet.
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace covary {

/// Calls `run`, which returns what to say, and says it after `which` ("frame 3") unless `quiet` is set. If it throws
/// Error(kInput), prints a warning and returns false; other errors, and WrongSequence, pass.
bool attempt(const std::string& which, bool quiet, const std::function<std::string()>& run);

/// What a look at files found.
enum class Found { kNothing, kWork, kEnd };
/// Looks twice a second, until the end, or until nothing was found for `idle` seconds (none: until interrupted).
void poll(std::optional<double> idle, const std::function<Found()>& look);

}  // namespace covary
