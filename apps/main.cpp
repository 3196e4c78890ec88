// SPDX-License-Identifier: Apache-2.0
// The `covary` program. Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done but target error missed (--until), and
// after a signal 128 + its number: 130 for Ctrl-C. Where COVARY_EXIT_CODES is set, those of sysexits.h say what failed:
// 65 for the content of a file, 74 for a file that cannot be read or written, 70 for a bug. Where COVARY_PROGRESS names
// a file, the line of progress is added to it (progress.cpp).
#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <regex>
#include <string>
#include <system_error>
#include <vector>

#include "command_description.h"
#include "commands.h"
#include "core/detached_work.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/shell_text.h"
#include "core/unfinished.h"
#include "interruption.h"
#include "io/scene_formats.h"
#include "method_options.h"
#include "unknown_argument.h"
#include "version.h"

namespace covary {
namespace {

std::string g_command_line;
bool g_tells_kinds = false;  // of errors, by exit codes

/// What the caller asked for is not for the programs that this one runs.
void read_environment() {
  g_tells_kinds = std::getenv("COVARY_EXIT_CODES") != nullptr;
  unsetenv("COVARY_EXIT_CODES");
}

/// Opens closed standard streams: otherwise the next file would get their descriptors, and messages would be written
/// into it. Standard output then fails, as it should; error messages are lost.
void open_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) == -1) [[maybe_unused]]
      const int opened = open(stream == STDOUT_FILENO ? "/dev/full" : "/dev/null", O_RDWR);
}

void check_standard_output() {
  if (!std::cout.flush() || std::fflush(stdout) != 0 || std::ferror(stdout))
    throw Error(ErrorCode::kIo, "cannot write to standard output");
}

int report(const char* program, const Error& error) {
  std::fprintf(stderr, "%s: %s%s\n", program, error.code() == ErrorCode::kInternal ? "internal error: " : "",
               printable(as_options(error.what())).c_str());
  if (const auto* unfinished = dynamic_cast<const Unfinished*>(&error)) return unfinished->exit_code();
  if (error.code() == ErrorCode::kUsage) return 2;
  if (!g_tells_kinds) return 1;
  return error.code() == ErrorCode::kInput ? EX_DATAERR : error.code() == ErrorCode::kIo ? EX_IOERR : EX_SOFTWARE;
}

/// The message about an option given more often than it may be, in plain words; other messages as they are.
std::string in_plain_words(const std::string& message) {
  std::smatch found;
  if (!std::regex_match(message, found, std::regex("(.*): At Most 1 required but received (\\d+)"))) return message;
  return fmt::format("{} is given {} times; give it once", found[1].str(), found[2].str());
}

/// "; write: covary render room.xml -o room.exr", of the name of a scene in place of a command.
std::string scene_without_command(const std::string& word) {
  if (!is_scene_file(word)) return "";
  const std::string output = std::filesystem::path(word).stem().string() + ".exr";
  return "; write: " + shell_text({"covary", "render", word, "-o", output});
}

/// What is wrong with the first argument that no option takes; "" if there is none.
std::string describe_extra(const CLI::App& app) {
  const CLI::App& command = app.get_subcommands().empty() ? app : *app.get_subcommands()[0];
  return unknown_argument(command, &command == &app ? "covary" : "covary " + command.get_name());
}

int run(int argc, char** argv) {
  CLI::App app("covary: Monte Carlo rendering with less noise by control variates and correlated sampling", "covary");
  app.set_version_flag("--version", "covary " + version_text(), "Print version and commit, and exit");
  app.require_subcommand(0, 1);
  app.failure_message(CLI::FailureMessage::simple);
  add_commands(app);

  if (argc < 2) {
    std::fputs(app.help().c_str(), stdout);
    check_standard_output();
    return 0;
  }
  // CLI11 would report an unknown subcommand as an extra argument; name it and the nearest one.
  const std::string first = argv[1];
  if (!first.empty() && first[0] != '-') {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands(nullptr)) names.push_back(command->get_name());
    if (std::find(names.begin(), names.end(), first) == names.end())
      throw Error(ErrorCode::kUsage, "unknown command '" + first + "'" + did_you_mean(first, names) +
                                         scene_without_command(first) + "; 'covary --help' lists all");
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {  // --help, --version
    const int code = app.exit(success);
    check_standard_output();
    return code;
  } catch (const CLI::ParseError& error) {
    // Reports a misspelt option before what CLI11 finds first: that the intended option is missing.
    const std::string extra = describe_extra(app);
    if (!extra.empty()) throw Error(ErrorCode::kUsage, extra);
    const std::string command = app.get_subcommands().empty() ? "" : " " + app.get_subcommands()[0]->get_name();
    throw Error(ErrorCode::kUsage, in_plain_words(error.what()) + "; see 'covary" + command + " --help'");
  }
  if (app.get_subcommands().empty()) throw Error(ErrorCode::kUsage, "no command given; 'covary --help' lists all");
  check_standard_output();
  return 0;
}

/// The exit code; errors are printed on standard error.
int run_and_report(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const Error& error) {
    return report("covary", error);
  } catch (const std::bad_alloc&) {
    std::fputs("covary: out of memory\n", stderr);
  } catch (const std::system_error& error) {  // of threads that cannot start
    std::fprintf(stderr, "covary: the system gives no more threads or memory: %s\n", error.what());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "covary: internal error: %s\n", error.what());
  }
  return 1;
}

}  // namespace

const std::string& command_line() { return g_command_line; }

void add_commands(CLI::App& app) {
  app.set_help_flag("-h,--help", "Print this help and exit");
  app.set_help_all_flag("--help-all", "Print the help of all options and exit");
  app.formatter_fn([](const CLI::App* command, const std::string& name, CLI::AppFormatMode mode) {
    return help_text(*command, name, mode == CLI::AppFormatMode::All);
  });
  for (const auto add : {add_render, add_combine, add_denoise, add_compare, add_view, add_info, add_convert,
                         add_convert_scene, add_help})
    add(app);
  const std::vector<CLI::App*> everybodys = app.get_subcommands([](CLI::App*) { return true; });
  for (const auto add : {add_experiment, add_scenes, add_merge, add_probe}) add(app);
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) {
    const bool is_everybodys = std::find(everybodys.begin(), everybodys.end(), command) != everybodys.end();
    command->group(is_everybodys ? "Commands" : "Laboratory");
  }
}

}  // namespace covary

int main(int argc, char** argv) {
  covary::open_closed_streams();
  covary::read_environment();
  std::vector<std::string> words(argv, argv + argc);
  if (words.empty()) words.emplace_back();
  words[0] = "covary";
  covary::g_command_line = covary::shell_text(words);
  // Makes exceeding the file size limit an error like a full disk, so that no partially written file remains.
  std::signal(SIGXFSZ, SIG_IGN);
  covary::catch_signals();
  const int code = covary::run_and_report(argc, argv);
  if (covary::has_detached_work()) {
    // Ctrl-C ends the program now, without waiting for a library's current step.
    std::cout.flush();
    std::fflush(nullptr);
    _exit(code);
  }
  return code;
}
