// SPDX-License-Identifier: Apache-2.0
#include "pbrt_text/pbrt_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/error.h"
#include "formats/xml_values.h"

namespace covary {
namespace {

const std::vector<std::string> kTypes = {"integer", "float",  "point2",  "vector2",   "point3",   "vector3",
                                         "normal3", "point",  "vector",  "normal",    "spectrum", "rgb",
                                         "bool",    "string", "texture", "blackbody", "color",    "xyz"};

bool is_one_of(const std::string& text, std::initializer_list<const char*> names) {
  return std::ranges::any_of(names, [&](const char* name) { return text == name; });
}

/// The words between two of such marks: words_in("one of 'a' and 'b'", '\'') are a and b.
std::vector<std::string> words_in(std::string_view text, char mark) {
  std::vector<std::string> words;
  for (size_t begin = text.find(mark); begin != text.npos; begin = text.find(mark, begin)) {
    const size_t end = std::min(text.find(mark, begin + 1), text.size());
    words.emplace_back(text.substr(begin + 1, end - begin - 1));
    begin = std::min(end + 1, text.size());
  }
  return words;
}

/// Names of older versions.
std::string current_type(const std::string& type) {
  if (type == "point" || type == "vector" || type == "normal") return type + "3";
  return type == "color" ? "rgb" : type;
}

/// XYZ to linear Rec. 709 (IEC 61966-2-1).
void xyz_to_rgb(std::vector<double>& n) {
  if (n.size() != 3) return;
  const double x = n[0], y = n[1], z = n[2];
  n = {3.240479 * x - 1.537150 * y - 0.498535 * z, -0.969256 * x + 1.875991 * y + 0.041556 * z,
       0.055648 * x - 0.204043 * y + 1.057311 * z};
}

}  // namespace

PbrtParameters::PbrtParameters(PbrtTokens& tokens, std::string what, const SourceLocation& where,
                               PbrtMessages& messages, const PbrtContext& context)
    : what_(std::move(what)), where_(where), messages_(&messages), context_(context) {
  while (tokens.peek().kind == PbrtToken::kString) {
    const PbrtToken token = tokens.next();
    PbrtParameter parameter;
    parameter.where = tokens.where(token);
    const size_t type = std::min(token.text.find_first_not_of(" \t"), token.text.size());
    const size_t type_end = token.text.find_first_of(" \t", type);
    const size_t name = token.text.find_first_not_of(" \t", type_end);
    if (type_end == std::string::npos || name == std::string::npos)
      tokens.stop(token, fmt::format("found '{}'; expected a type and a name, such as \"float radius\"", token.text));
    parameter.type = token.text.substr(type, type_end - type);
    parameter.name = token.text.substr(name, token.text.find_last_not_of(" \t") + 1 - name);
    if (std::ranges::find(kTypes, parameter.type) == kTypes.end())
      tokens.stop(token, fmt::format("unknown type '{}' of parameter '{}'{}", parameter.type, parameter.name,
                                     did_you_mean(parameter.type, kTypes)));
    read_values(tokens, parameter);
    if (parameter.type == "xyz") xyz_to_rgb(parameter.numbers), parameter.type = "rgb";
    parameter.type = current_type(parameter.type);
    if (has(parameter.name))
      messages.warn(parameter.where,
                    fmt::format("parameter '{}' of {} is given twice; the first counts", parameter.name, what_));
    else
      parameters_.push_back(std::move(parameter));
  }
  if (!context.defaults) return;
  for (const PbrtParameter& parameter : *context.defaults) {
    if (has(parameter.name)) continue;
    parameters_.push_back(parameter);
    parameters_.back().used = true;  // the directive may have no use for it
  }
}

void PbrtParameters::read_values(PbrtTokens& tokens, PbrtParameter& parameter) {
  const bool brackets = tokens.peek().kind == PbrtToken::kOpen;
  if (brackets) tokens.next();
  do {
    const PbrtToken token = tokens.peek();
    if (brackets && token.kind == PbrtToken::kClose) break;
    if (token.kind == PbrtToken::kString) {
      parameter.strings.push_back(tokens.next().text);
      if (parameter.type == "bool" && is_one_of(parameter.strings.back(), {"true", "false"}))  // as before version 4
        parameter.numbers.push_back(parameter.strings.back() == "true");
    } else if (parameter.type == "bool" && token.kind == PbrtToken::kWord) {
      tokens.next();
      if (!is_one_of(token.text, {"true", "false"}))
        tokens.stop(token, fmt::format("found '{}'; expected true or false", token.text));
      parameter.numbers.push_back(token.text == "true");
    } else {
      parameter.numbers.push_back(tokens.number());
    }
  } while (brackets);
  if (brackets) tokens.next();
}

bool PbrtParameters::has(const std::string& name) const {
  asked_.push_back(name);
  return std::ranges::any_of(parameters_, [&](const PbrtParameter& p) { return p.name == name; });
}

bool PbrtParameters::has_texture(const std::string& name) const {
  return std::ranges::any_of(parameters_,
                             [&](const PbrtParameter& p) { return p.name == name && p.type == "texture"; });
}

void PbrtParameters::rename(const std::string& from, const std::string& to) {
  if (has(to)) return;
  for (PbrtParameter& parameter : parameters_)
    if (parameter.name == from) parameter.name = to;
}

void PbrtParameters::remove(const std::string& name) {
  std::erase_if(parameters_, [&](const PbrtParameter& p) { return p.name == name; });
}

void PbrtParameters::set(const std::string& type, const std::string& name, std::vector<double> numbers) {
  remove(name);
  parameters_.push_back({type, name, where_, std::move(numbers), {}});
}

void PbrtParameters::set(const std::string& name, std::vector<std::string> strings) {
  remove(name);
  parameters_.push_back({"string", name, where_, {}, std::move(strings)});
}

const PbrtParameter* PbrtParameters::find(const std::string& name) {
  asked_.push_back(name);
  for (PbrtParameter& parameter : parameters_)
    if (parameter.name == name) {
      parameter.used = true;
      return &parameter;
    }
  return nullptr;
}

const PbrtParameter* PbrtParameters::find(const std::string& name, std::initializer_list<const char*> types,
                                          size_t count) {
  const PbrtParameter* p = find(name);
  if (!p) return nullptr;
  if (!is_one_of(p->type, types)) {
    error_at(*p, fmt::format("has the type '{}'; expected '{}'", p->type, *types.begin()));
    return nullptr;
  }
  const size_t n = is_one_of(p->type, {"string", "texture"}) ? p->strings.size() : p->numbers.size();
  if (count == 0 || n == count) return p;
  error_at(*p, fmt::format("has {} values; expected {}", n, count));
  return nullptr;
}

double PbrtParameters::get_float(const std::string& name, double fallback) {
  const PbrtParameter* p = find(name, {"float"}, 1);
  return p ? p->numbers[0] : fallback;
}

int64_t PbrtParameters::get_integer(const std::string& name, int64_t fallback) {
  const PbrtParameter* p = find(name, {"integer"}, 1);
  if (!p) return fallback;
  const double value = p->numbers[0];
  if (value == std::floor(value) && std::abs(value) < 2147483648.0) return static_cast<int64_t>(value);
  error_at(*p, fmt::format("is {}; expected an integer", value));
  return fallback;
}

bool PbrtParameters::get_bool(const std::string& name, bool fallback) {
  const PbrtParameter* p = find(name, {"bool"}, 1);
  return p ? p->numbers[0] != 0 : fallback;
}

std::string PbrtParameters::get_string(const std::string& name, const std::string& fallback) {
  const PbrtParameter* p = find(name, {"string"}, 1);
  return p ? p->strings[0] : fallback;
}

Vec3 PbrtParameters::get_vec3(const std::string& name, const Vec3& fallback) {
  const PbrtParameter* p = find(name, {"point3", "vector3", "normal3"}, 3);
  if (!p) return fallback;
  return {static_cast<float>(p->numbers[0]), static_cast<float>(p->numbers[1]), static_cast<float>(p->numbers[2])};
}

std::vector<double> PbrtParameters::get_array(const std::string& name, const std::string& type, size_t width) {
  // Pairs, such as texture coordinates, are also given as plain numbers, and points as vectors.
  const bool pair = type == "point2", triple = type.ends_with('3');
  const PbrtParameter* p = find(name,
                                {type.c_str(),
                                 pair     ? "vector2"
                                 : triple ? "vector3"
                                          : "",
                                 pair     ? "float"
                                 : triple ? "point3"
                                          : ""},
                                0);
  if (!p) return {};
  if (p->numbers.size() % width == 0 && p->strings.empty()) return p->numbers;
  error_at(*p, fmt::format("has {} numbers; expected a multiple of {}", p->numbers.size(), width));
  return {};
}

void PbrtParameters::error(const std::string& message) { messages_->error(where_, what_ + " " + message); }
void PbrtParameters::error_at(const PbrtParameter& parameter, const std::string& message) {
  messages_->error(parameter.where, fmt::format("parameter '{}' of {} {}", parameter.name, what_, message));
}
void PbrtParameters::warn(const std::string& message) {
  messages_->warn(where_, (kind_.empty() ? what_ : kind_) + " " + message);
}

void PbrtParameters::unsupported(const std::string& supported) {
  const std::vector<std::string> type = words_in(what_, '"');
  const std::string meant = did_you_mean(type.empty() ? "" : type.back(), words_in(supported, '\''));
  error(fmt::format("is not supported{}{}: {}", meant, meant.empty() ? "; supported" : " Supported", supported));
}

bool PbrtParameters::unknown(const std::string& supported, const std::string& instead) {
  if (messages_->ignores_unknown())
    warn("is unknown; " + instead);
  else
    unsupported(supported);
  ignore_all();
  return messages_->ignores_unknown();
}

void PbrtParameters::ignore(std::initializer_list<const char*> names) {
  for (const char* name : names) find(name);
}

void PbrtParameters::ignore_all() {
  for (PbrtParameter& parameter : parameters_) parameter.used = true;
}

void PbrtParameters::report_unknown(bool lenient) {
  std::ranges::sort(asked_);
  asked_.erase(std::unique(asked_.begin(), asked_.end()), asked_.end());
  for (const PbrtParameter& parameter : parameters_) {
    if (parameter.used) continue;
    std::erase(asked_, parameter.name);
    if (lenient || messages_->ignores_unknown())
      warn(fmt::format("has the parameter '{}', which is ignored", parameter.name));
    else
      error_at(parameter, "is not supported" + did_you_mean(parameter.name, asked_));
  }
}

}  // namespace covary
