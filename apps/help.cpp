// SPDX-License-Identifier: Apache-2.0
// covary help: the help of a command, the man page, completions for shells.
#include <cstdio>
#include <memory>

#include "command_description.h"
#include "commands.h"
#include "core/error.h"
#include "method_options.h"
#include "version.h"

namespace covary {
namespace {

struct HelpOptions {
  std::string command, shell;
  bool man = false, all = false;
};

std::string text_for(const CLI::App& app, const HelpOptions& o) {
  if (o.man) return man_page(app, version_text());
  if (!o.shell.empty()) return completion_script(app, o.shell);
  if (o.command.empty()) return help_text(app, app.get_name(), o.all);
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands(nullptr)) {
    if (command->get_name() == o.command) return help_text(*command, "covary " + o.command, o.all);
    names.push_back(command->get_name());
  }
  if (const std::string text = help_of_method(o.command); !text.empty()) return text;
  throw Error(ErrorCode::kUsage, "unknown command '" + o.command + "'" + did_you_mean(o.command, names));
}

}  // namespace

void add_help(CLI::App& app) {
  const auto o = std::make_shared<HelpOptions>();
  CLI::App* command = app.add_subcommand("help", "Help on a command or a method, the man page, completions for shells");
  CLI::Option* name = command->add_option("COMMAND", o->command,
                                          "The command, integrator or estimator; without it, commands are listed");
  command->add_flag("--all", o->all, "All options, as --help-all shows them");
  CLI::Option* man = command->add_flag("--man", o->man, "Print the page of all commands for man(1)")->excludes(name);
  command->add_option("--completion", o->shell, "Print the completion script of this shell")
      ->check(CLI::IsMember({"bash", "zsh", "fish"}))
      ->excludes(name)
      ->excludes(man);
  command->callback([&app, o] { std::fputs(text_for(app, *o).c_str(), stdout); });
}

}  // namespace covary
