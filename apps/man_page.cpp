// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "command_description.h"

namespace covary {
namespace {

/// Text for man(7): escapes requests and backslashes, and keeps "-" a plain hyphen-minus, as shells need.
std::string escaped(const std::string& text) {
  std::string result;
  if (!text.empty() && (text[0] == '.' || text[0] == '\'')) result = "\\&";
  for (const char c : text) {
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else
      result += c;
  }
  return result;
}

/// "-o, --output TEXT" in bold and italics.
std::string term(const OptionDescription& option) {
  std::string result;
  for (const std::string& name : option.names)
    result += fmt::format("{}\\fB{}\\fR", result.empty() ? "" : ", ", escaped(name));
  const std::string value = value_text(option);
  if (!value.empty()) result += fmt::format("{}\\fI{}\\fR", result.empty() ? "" : " ", escaped(value));
  return result;
}

std::string list(const std::vector<OptionDescription>& options, const std::string& group) {
  std::string result;
  for (const OptionDescription& option : options)
    if (option.group == group || option.names.empty())
      result += fmt::format(".TP\n{}\n{}\n", term(option), escaped(option.text));
  return result;
}

}  // namespace

std::string man_page(const CLI::App& app, const std::string& version) {
  std::string page = fmt::format(
      ".TH COVARY 1 \"\" \"covary {}\" \"User Commands\"\n.SH NAME\n{}\n.SH SYNOPSIS\n.B covary\n.I COMMAND\n"
      "[\\fIoptions\\fR]\n.br\n.B covary\n[\\fB\\-\\-help\\fR] [\\fB\\-\\-version\\fR]\n",
      escaped(version), "covary \\- " + escaped(app.get_description().substr(app.get_description().find(' ') + 1)));
  page +=
      ".SH DESCRIPTION\n.B covary\nrenders scenes of Mitsuba, pbrt and glTF to images in OpenEXR files, combines "
      "renders that share random\nnumbers with independent ones into images with less noise, and compares methods.\n"
      ".SH COMMANDS\n";
  for (const CommandDescription& command : describe_subcommands(app)) {
    std::string arguments;
    for (const OptionDescription& positional : command.positionals)
      arguments += fmt::format(" \\fI{}\\fR", escaped(positional.value));
    page += fmt::format(".SS covary {} [options]{}\n{}.\n", command.name, arguments, escaped(command.text));
    page += list(command.positionals, "");
    for (const std::string& group : groups_of(command)) {
      if (group != kBasicOptions) page += fmt::format(".PP\n\\fI{}\\fR\n", escaped(group));
      page += list(command.options, group);
    }
  }
  return page +
         ".SH EXIT STATUS\n.TP\n.B 0\nDone.\n.TP\n.B 1\nFailed; the message says why.\n.TP\n.B 2\nWrong usage.\n"
         ".TP\n.B 3\nDone, but the error wanted by \\fB\\-\\-until\\fR was not reached.\n"
         ".TP\n.B 130\nInterrupted by Ctrl\\-C; what was rendered so far is kept.\n"
         ".SH SEE ALSO\nThe documentation lies in\n.I share/doc/covary\nbeside the program's folder.\n";
}

}  // namespace covary
