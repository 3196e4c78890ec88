// SPDX-License-Identifier: Apache-2.0
// What covary.distributed needs from lab/: where scenes are, how many parts there are, and how to run the program.
#include <filesystem>

#include "core/process.h"
#include "lab/plan.h"
#include "python/module/bindings.h"
#include "python/module/work.h"

namespace covary::python {
namespace {

lab::Suite suite_of(const std::string& text) { return lab::parse_suite(text, "suite"); }

std::string scenes_folder(const std::string& suite, const std::string& word, const std::string& program) {
  return lab::scenes_folder(suite_of(suite), word, std::filesystem::canonical(program).string());
}

std::vector<size_t> numbers_of_parts(const std::string& text) {
  const lab::Suite suite = suite_of(text);
  std::vector<size_t> numbers;
  for (const lab::SceneEntry& scene : suite.scenes) numbers.push_back(number_of_parts(suite, scene));
  return numbers;
}

/// Exit code, standard output and standard error of a program, which ends with this process at the latest.
nb::tuple run_program(const std::vector<std::string>& command) {
  ProcessResult result;
  run_work([&](WorkState& state) { result = run_process(command, &state.stop); }, nb::none());
  const auto text = [](const std::string& s) {
    return nb::steal<nb::object>(PyUnicode_DecodeUTF8(s.data(), static_cast<Py_ssize_t>(s.size()), "replace"));
  };
  return nb::make_tuple(result.exit_code, text(result.output), text(result.errors));
}

}  // namespace

void bind_experiment(nb::module_& module) {
  using namespace nb::literals;
  module.def("scenes_folder", &scenes_folder, "suite"_a, "word"_a, "program"_a);
  module.def("numbers_of_parts", &numbers_of_parts, "suite"_a);
  module.def("run_program", &run_program, "command"_a,
             nb::sig("def run_program(command: list[str]) -> tuple[int, str, str]"));
}

}  // namespace covary::python
