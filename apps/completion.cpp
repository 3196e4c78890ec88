// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "command_description.h"
#include "core/error.h"

namespace covary {
namespace {

/// `text` with a backslash before each character of `special`.
std::string escaped(const std::string& text, std::string_view special) {
  std::string result;
  for (const char c : text) {
    if (special.find(c) != std::string_view::npos) result += '\\';
    result += c;
  }
  return result;
}

/// In single quotes for bash and zsh.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

/// In single quotes for fish.
std::string fish_quoted(const std::string& text) { return "'" + escaped(text, "\\'") + "'"; }

std::string names_of(const std::vector<CommandDescription>& commands) {
  std::string names;
  for (const CommandDescription& command : commands) names += (names.empty() ? "" : " ") + command.name;
  return names;
}

// ---- bash -----------------------------------------------------------------------------------------------------------

/// Branches "render --spp|render --seed)" for options whose values are numbers, lists or choices.
std::string bash_values(const CommandDescription& command) {
  std::string branches;
  for (const OptionDescription& option : command.options) {
    if (option.value.empty() || option.takes_files) continue;
    std::vector<std::string> patterns;
    for (const std::string& name : option.names) patterns.push_back(quoted(command.name + " " + name));
    branches += fmt::format("    {}) values={} ;;\n", fmt::join(patterns, "|"),
                            quoted(fmt::format("{}", fmt::join(option.choices, " "))));
  }
  return branches;
}

std::string bash_script(const std::vector<CommandDescription>& commands) {
  std::string values, options, files;
  for (const CommandDescription& command : commands) {
    values += bash_values(command);
    std::vector<std::string> names;
    for (const OptionDescription& option : command.options) {
      names.insert(names.end(), option.names.begin(), option.names.end());
      if (!option.takes_files) continue;
      for (const std::string& name : option.names)
        files += fmt::format("{}{}", files.empty() ? "" : "|", quoted(command.name + " " + name));
    }
    options += fmt::format("    {}) options={} ;;\n", command.name, quoted(fmt::format("{}", fmt::join(names, " "))));
  }
  // If there is no match, readline completes file names (-o default).
  return "# bash completion for covary, made by `covary help --completion bash`\n"
         "_covary() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} options='' values=none\n"
         "  if [ \"$word\" = = ]; then word=''; elif [ \"$before\" = = ]; then before=${COMP_WORDS[COMP_CWORD-2]}; fi\n"
         "  COMPREPLY=()\n"
         "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
         "    COMPREPLY=($(compgen -W " +
         quoted(names_of(commands) + " --help --help-all --version") +
         " -- \"$word\"))\n"
         "    return\n"
         "  fi\n"
         "  case \"${COMP_WORDS[1]} $before\" in\n" +
         values + (files.empty() ? "" : "    " + files + ") return ;;\n") +
         "  esac\n"
         "  if [ \"$values\" != none ]; then\n"
         "    compopt +o default 2> /dev/null\n"
         "    COMPREPLY=($(compgen -W \"$values\" -- \"$word\"))\n"
         "    return\n"
         "  fi\n"
         "  case \"${COMP_WORDS[1]}\" in\n" +
         options +
         "  esac\n"
         "  case \"$word\" in -*) COMPREPLY=($(compgen -W \"$options\" -- \"$word\")) ;; esac\n"
         "}\n"
         "complete -o default -F _covary covary\n";
}

// ---- zsh ------------------------------------------------------------------------------------------------------------

std::string zsh_option(const OptionDescription& option) {
  std::string value;
  if (!option.value.empty()) {
    value = ":" + escaped(option.value, ":\\") + ":";
    if (!option.choices.empty())
      value += fmt::format("({})", fmt::join(option.choices, " "));
    else
      value += option.takes_files ? "_files" : " ";
  }
  const std::string text = "[" + escaped(option.text, "[]:\\") + "]";
  std::string result;
  for (const std::string& name : option.names) {
    // A star: the option may be repeated. Long names take their value after "=" or as the next word.
    const std::string equals = option.value.empty() ? "" : name.starts_with("--") ? "=" : "+";
    result += " \\\n        " + quoted("*" + name + equals + text + value);
  }
  return result;
}

std::string zsh_script(const std::vector<CommandDescription>& commands) {
  std::string names, cases;
  for (const CommandDescription& command : commands) {
    names += "    " + quoted(escaped(command.name, ":") + ":" + escaped(command.text, "\\")) + "\n";
    cases += "    " + command.name + ")\n      _arguments";
    for (const OptionDescription& option : command.options) cases += zsh_option(option);
    cases += " \\\n        '*:file:_files' ;;\n";
  }
  return "#compdef covary\n# zsh completion for covary, made by `covary help --completion zsh`\n"
         "_covary() {\n"
         "  local -a commands\n"
         "  commands=(\n" +
         names +
         "  )\n"
         "  if (( CURRENT == 2 )); then\n"
         "    _describe command commands\n"
         "    return\n"
         "  fi\n"
         "  local command=$words[2]\n"
         "  shift words\n"
         "  (( CURRENT-- ))\n"
         "  case $command in\n" +
         cases +
         "  esac\n"
         "}\n"
         "if [ \"$funcstack[1]\" = _covary ]; then _covary \"$@\"; else compdef _covary covary; fi\n";
}

// ---- fish -----------------------------------------------------------------------------------------------------------

std::string fish_option(const CommandDescription& command, const OptionDescription& option) {
  std::string line = fmt::format("complete -c covary -n '__fish_seen_subcommand_from {}'", command.name);
  for (const std::string& name : option.names)
    line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
  if (!option.choices.empty())
    line += " -x -a " + fish_quoted(fmt::format("{}", fmt::join(option.choices, " ")));
  else if (!option.value.empty())
    line += option.takes_files ? " -r -F" : " -x";
  return line + " -d " + fish_quoted(option.text) + "\n";
}

std::string fish_script(const std::vector<CommandDescription>& commands) {
  std::string script = "# fish completion for covary, made by `covary help --completion fish`\n";
  for (const CommandDescription& command : commands)
    script += fmt::format("complete -c covary -f -n __fish_use_subcommand -a {} -d {}\n", command.name,
                          fish_quoted(command.text));
  script += "complete -c covary -n __fish_use_subcommand -l version -d 'Print the version and exit'\n";
  for (const CommandDescription& command : commands)
    for (const OptionDescription& option : command.options) script += fish_option(command, option);
  return script;
}

}  // namespace

std::string completion_script(const CLI::App& app, const std::string& shell) {
  const std::vector<CommandDescription> commands = describe_subcommands(app);
  if (shell == "bash") return bash_script(commands);
  if (shell == "zsh") return zsh_script(commands);
  if (shell == "fish") return fish_script(commands);
  throw Error(ErrorCode::kUsage, "--completion '" + shell + "': expected bash, zsh or fish");
}

}  // namespace covary
