// SPDX-License-Identifier: Apache-2.0
#include "json_output.h"

#include <cstdio>
#include <fstream>
#include <string>

#include "imageio/output_file.h"

namespace covary {

std::string json_text(const nlohmann::ordered_json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

void write_text_output(const std::string& path, const std::string& text) {
  if (path.empty() || path == "-")
    std::fputs(text.c_str(), stdout);  // main() checks whether that could be written
  else
    write_text_file(path, text);
}

double peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (double kibibytes = 0; std::sscanf(line.c_str(), "VmHWM: %lf", &kibibytes) == 1) return kibibytes * 1024;
  return 0;
}

}  // namespace covary
