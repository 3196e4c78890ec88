// SPDX-License-Identifier: Apache-2.0
#include "formats/pbrt_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/xml_values.h"

namespace covary {
namespace {

const std::vector<std::string> kTypes = {"integer", "float",  "point2",  "vector2",  "point3",   "vector3",
                                         "normal3", "point",  "vector",  "normal",   "spectrum", "rgb",
                                         "bool",    "string", "texture", "blackbody"};

bool is_one_of(const std::string& text, std::initializer_list<const char*> names) {
  return std::ranges::any_of(names, [&](const char* name) { return text == name; });
}

}  // namespace

char PbrtTokens::take() {
  const char c = text_[place_++];
  if (c == '\n')
    ++line_, column_ = 1;
  else
    ++column_;
  return c;
}

void PbrtTokens::stop(const PbrtToken& token, const std::string& message) const {
  diagnostics_.error(where(token), message);
  throw PbrtStop();
}

PbrtToken PbrtTokens::peek() {
  if (!peeked_) next_ = next();
  peeked_ = true;
  return next_;
}

PbrtToken PbrtTokens::next() {
  if (peeked_) {
    peeked_ = false;
    return std::move(next_);
  }
  constexpr std::string_view kBlanks = " \t\r\n", kEnds = " \t\r\n\"[]#";
  while (place_ < text_.size() && (kBlanks.find(text_[place_]) != kBlanks.npos || text_[place_] == '#'))
    if (take() == '#')
      while (place_ < text_.size() && text_[place_] != '\n') take();
  PbrtToken token;
  token.line = line_, token.column = column_;
  if (place_ == text_.size()) return token;
  const char first = take();
  if (first == '[' || first == ']') {
    token.kind = first == '[' ? PbrtToken::kOpen : PbrtToken::kClose;
    token.text = first;
  } else if (first == '"') {
    token.kind = PbrtToken::kString;
    for (;;) {
      if (place_ == text_.size() || text_[place_] == '\n') stop(token, "unterminated string");
      char c = take();
      if (c == '"') break;
      if (c == '\\' && place_ < text_.size()) {
        c = take();
        c = c == 'n' ? '\n' : c == 't' ? '\t' : c;
      }
      token.text += c;
    }
  } else {
    token.kind = PbrtToken::kWord;
    const size_t begin = place_ - 1;
    while (place_ < text_.size() && kEnds.find(text_[place_]) == kEnds.npos) take();
    token.text = text_.substr(begin, place_ - begin);
  }
  return token;
}

std::string PbrtTokens::string(const char* what) {
  PbrtToken token = next();
  if (token.kind != PbrtToken::kString) stop(token, fmt::format("found '{}'; expected {} in quotes", token.text, what));
  return std::move(token.text);
}

double PbrtTokens::number() {
  const PbrtToken token = next();
  if (token.kind != PbrtToken::kWord)
    stop(token, fmt::format("found {}; expected a number",
                            token.kind == PbrtToken::kEnd ? "the end of the file" : "'" + token.text + "'"));
  std::string_view text = token.text;
  if (text.size() > 1 && text[0] == '+') text.remove_prefix(1);
  try {
    return parse_number(text);
  } catch (const Error&) {
    stop(token, fmt::format("found '{}'; expected a number", token.text));
  }
}

std::vector<double> PbrtTokens::numbers(size_t count) {
  const bool brackets = peek().kind == PbrtToken::kOpen;
  if (brackets) next();
  std::vector<double> result;
  for (size_t i = 0; i < count; ++i) result.push_back(number());
  if (!brackets) return result;
  if (const PbrtToken token = next(); token.kind != PbrtToken::kClose)
    stop(token, fmt::format("found '{}'; expected ']' after {} numbers", token.text, count));
  return result;
}

PbrtParameters::PbrtParameters(PbrtTokens& tokens, std::string what, const SourceLocation& where,
                               Diagnostics& diagnostics)
    : what_(std::move(what)), where_(where), diagnostics_(diagnostics) {
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
      tokens.stop(token, fmt::format("unknown type '{}' of parameter '{}'{}{}", parameter.type, parameter.name,
                                     did_you_mean(parameter.type, kTypes),
                                     parameter.type == "color" || parameter.type == "xyz"
                                         ? "; files of pbrt-v3 are brought to version 4 by 'pbrt --upgrade'"
                                         : ""));
    read_values(tokens, parameter);
    if (has(parameter.name))
      diagnostics_.error(parameter.where, fmt::format("parameter '{}' of {} is given twice", parameter.name, what_));
    parameters_.push_back(std::move(parameter));
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
  return std::ranges::any_of(parameters_, [&](const PbrtParameter& p) { return p.name == name; });
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
  const PbrtParameter* p = find(name, {"point3", "vector3", "normal3", "point", "vector", "normal"}, 3);
  if (!p) return fallback;
  return {static_cast<float>(p->numbers[0]), static_cast<float>(p->numbers[1]), static_cast<float>(p->numbers[2])};
}

std::vector<double> PbrtParameters::get_array(const std::string& name, const std::string& type, size_t width) {
  std::string older = type;
  if (type.back() == '3') older.pop_back();  // "point" for "point3"
  const PbrtParameter* p = find(name, {type.c_str(), older.c_str()}, 0);
  if (!p) return {};
  if (p->numbers.size() % width == 0 && p->strings.empty()) return p->numbers;
  error_at(*p, fmt::format("has {} numbers; expected a multiple of {}", p->numbers.size(), width));
  return {};
}

void PbrtParameters::error(const std::string& message) { diagnostics_.error(where_, what_ + " " + message); }
void PbrtParameters::error_at(const PbrtParameter& parameter, const std::string& message) {
  diagnostics_.error(parameter.where, fmt::format("parameter '{}' of {} {}", parameter.name, what_, message));
}
void PbrtParameters::warn(const std::string& message) { diagnostics_.warn(where_, what_ + " " + message); }

void PbrtParameters::ignore(std::initializer_list<const char*> names) {
  for (const char* name : names) find(name);
}

void PbrtParameters::report_unknown() {
  std::ranges::sort(asked_);
  asked_.erase(std::unique(asked_.begin(), asked_.end()), asked_.end());
  for (const PbrtParameter& parameter : parameters_)
    if (!parameter.used) error_at(parameter, "is not supported" + did_you_mean(parameter.name, asked_));
}

}  // namespace covary
