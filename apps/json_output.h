// SPDX-License-Identifier: Apache-2.0
// JSON output of commands.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace covary {

/// The value as text. File names need not be UTF-8, but JSON must be: invalid bytes are replaced by U+FFFD. `indent` <
/// 0: one line.
std::string json_text(const nlohmann::ordered_json& value, int indent = 2);

/// Writes the text to the file, or to standard output for "" and "-". Throws Error(kIo).
void write_text_output(const std::string& path, const std::string& text);

/// Peak memory of this process so far, without that of the one that started it (which getrusage() counts); bytes.
double peak_memory_bytes();

}  // namespace covary
