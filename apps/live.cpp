// SPDX-License-Identifier: Apache-2.0
#include "live.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <optional>

#include "browser.h"
#include "commands.h"
#include "core/error.h"
#include "core/number_text.h"
#include "interruption.h"
#include "live/live_files.h"

namespace covary {
namespace {

/// The command that continues this one.
std::string resuming_command(const RenderOptions& options) {
  constexpr std::string_view kOverwrite = "--overwrite";
  std::string command = command_line();
  if (options.request().resume) return command;
  if (const size_t at = command.find(kOverwrite); options.request().overwrite && at != std::string::npos)
    return command.replace(at, kOverwrite.size(), "--resume");
  return command + " --resume";
}

}  // namespace

void add_live_options(CLI::App& command, LiveOptions& options, const std::string& help) {
  const auto check = [](std::string& port) -> std::string {
    const std::optional<int> number = parse_number<int>(port);
    if (number && *number >= 0 && *number <= 65535) return "";
    return "'" + port + "': expected a port from 1 to 65535, e.g. --live=8080";
  };
  command.add_flag("--live{0}", options.live, help + "; --live=PORT: on this port")
      ->transform(CLI::Validator(check, ""));
}

void announce(const LivePage& page) {
  fmt::print(stderr, "live: {}\n", page.address());
  if (std::getenv("SSH_CONNECTION"))
    fmt::print(stderr, "live: over SSH, first run on your own machine: ssh -L {0}:127.0.0.1:{0} HOST\n", page.port());
  open_in_browser(page.address(), false);
}

void check_live(const RenderOptions& options) {
  if (!options.live.wanted()) return;
  if (options.is_replay()) throw Error(ErrorCode::kUsage, "--live shows a render, and --replay is none");
  if (options.sequence.is_sequence())
    throw Error(ErrorCode::kUsage, "--live is for single images; `covary view --live FOLDER` follows frames");
}

std::unique_ptr<LiveRender> live_of(const RenderOptions& options) {
  if (!options.live.wanted()) return nullptr;
  auto live = std::make_unique<LiveRender>(options.live.port(),
                                           LiveTexts{std::filesystem::path(options.scene).stem().string(),
                                                     options.request().output, resuming_command(options)},
                                           request_stop);
  announce(live->page());
  return live;
}

void follow(const LiveOptions& options, const std::string& path) {
  const StopFlag stop;
  LiveFiles files(options.port(), path);
  announce(files.page());
  if (const std::string text = files.waiting(); !text.empty()) fmt::print(stderr, "live: {}\n", text);
  files.run(*stop.token());
}

}  // namespace covary
