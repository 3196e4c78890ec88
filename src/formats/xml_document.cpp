// SPDX-License-Identifier: Apache-2.0
#include "formats/xml_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "core/known_names.h"

namespace covary {

std::string kind_of_file(std::string_view text) {
  if (text.starts_with("v/1\1")) return "an EXR image";
  if (text.starts_with("\x89PNG")) return "a PNG image";
  if (text.starts_with("ply")) return "a mesh";
  const size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string_view::npos && text[first] == '{') return "JSON";
  return "";
}

// ---- XmlDocument ----------------------------------------------------------------------------------------------------

XmlDocument::XmlDocument(std::string_view text, const std::string& name, Diagnostics& diagnostics)
    : name_(name), buffer_(text) {
  line_starts_.push_back(0);
  for (size_t i = 0; i < buffer_.size(); ++i)
    if (buffer_[i] == '\n') line_starts_.push_back(i + 1);
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    diagnostics.error({name_, 1, 1}, "the file is UTF-16 encoded; expected UTF-8");
    return;
  }
  if (const std::string kind = kind_of_file(text); !kind.empty()) {
    diagnostics.error({name_, 1, 1}, "the file is " + kind + "; expected a scene in XML");
    return;
  }
  // Parsed in place and without conversion, so that offsets into the buffer are offsets into the file.
  const pugi::xml_parse_result result =
      document_.load_buffer_inplace(buffer_.data(), buffer_.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!result) {
    const size_t offset = std::min(static_cast<size_t>(std::max<ptrdiff_t>(result.offset, 0)), buffer_.size());
    diagnostics.error(at(offset), std::string("malformed XML: ") + result.description());
    return;
  }
  root_ = document_.document_element();
}

SourceLocation XmlDocument::at(size_t offset) const {
  const auto next = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
  const size_t line = static_cast<size_t>(next - line_starts_.begin());
  return {name_, static_cast<int>(line), static_cast<int>(offset - line_starts_[line - 1]) + 1};
}

SourceLocation XmlDocument::where(pugi::xml_node element) const {
  const ptrdiff_t offset = element.offset_debug();  // of the tag name
  return at(static_cast<size_t>(std::max<ptrdiff_t>(offset - 1, 0)));
}

// ---- XmlDefines -----------------------------------------------------------------------------------------------------

XmlDefines::XmlDefines(const std::map<std::string, std::string>& defines) {
  for (const auto& [name, value] : defines) entries_[name] = {value, true};
}

void XmlDefines::add_default(const std::string& name, const std::string& value) {
  entries_.try_emplace(name, Entry{value}).first->second.has_default = true;
}

namespace {

std::string undefined_parameter(const std::string& name, const std::vector<std::string>& known) {
  const std::string hint = did_you_mean(name, known);
  std::string text = fmt::format("parameter '${}' is not defined{}", name, hint);
  if (!name.empty())
    text += fmt::format("{}ive it a value by -D {}=VALUE, or by <default name=\"{}\" value=\"…\"/>",
                        hint.empty() ? "; g" : " Or g", name, name);
  return text;
}

}  // namespace

std::string XmlDefines::substitute(std::string_view text) {
  // Nested defaults could otherwise grow without bound, and many attributes with them.
  constexpr size_t kLongest = size_t{1} << 20, kAll = size_t{1} << 24;
  std::string result;
  for (size_t i = 0; i < text.size();) {
    if (text[i] == '\\' && i + 1 < text.size() && text[i + 1] == '$') {
      result += '$';
      i += 2;
      continue;
    }
    if (text[i] != '$') {
      result += text[i++];
      continue;
    }
    Entry* best = nullptr;
    size_t best_length = 0;
    for (auto& [name, entry] : entries_)
      if (name.size() > best_length && text.substr(i + 1).starts_with(name)) best = &entry, best_length = name.size();
    if (!best) {
      size_t end = i + 1;
      while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) || text[end] == '_')) ++end;
      const std::string name(text.substr(i + 1, end - i - 1));
      std::vector<std::string> known;
      for (const auto& entry : entries_) known.push_back(entry.first);
      throw Error(ErrorCode::kInput, undefined_parameter(name, known));
    }
    best->used = true;
    result += best->value;
    i += 1 + best_length;
    n_substituted_ += best->value.size();
    if (result.size() > kLongest) throw Error(ErrorCode::kInput, "it grows beyond 1 MiB by substitution");
    if (n_substituted_ > kAll)
      throw Error(ErrorCode::kInput, "more than 16 MiB have been substituted for parameters of this scene");
  }
  return result;
}

void XmlDefines::report_unused(const std::string& file, Diagnostics& diagnostics) const {
  std::vector<std::string> known;
  std::string list;
  for (const auto& [name, entry] : entries_)
    if (entry.has_default) known.push_back(name), list += (list.empty() ? "'" : ", '") + name + "'";
  for (const auto& [name, entry] : entries_)
    if (entry.external && !entry.used)
      diagnostics.error(
          {file}, fmt::format("the scene does not use the parameter '{}' that was defined from outside", name) +
                      hint_and_list(name, known, list.empty() ? "it has no parameters" : "its parameters are " + list));
}

// ---- XmlAttributes --------------------------------------------------------------------------------------------------

XmlAttributes::XmlAttributes(pugi::xml_node element, const SourceLocation& where, XmlDefines& defines,
                             std::initializer_list<std::string_view> accepted, Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (std::string_view name : accepted) names.emplace_back(name.starts_with('!') ? name.substr(1) : name);
  for (const pugi::xml_attribute& attribute : element.attributes()) {
    const std::string name = attribute.name();
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      diagnostics.unknown(where, fmt::format("attribute '{}' of <{}>", name, element.name()),
                          did_you_mean(name, names));
      continue;
    }
    if (find(name)) {
      diagnostics.error(where, fmt::format("attribute '{}' of <{}> is given twice", name, element.name()));
      continue;
    }
    try {
      values_.emplace_back(name, defines.substitute(attribute.value()));
    } catch (const Error& error) {
      diagnostics.error(where, fmt::format("attribute '{}' of <{}>: {}", name, element.name(), error.what()));
      values_.emplace_back(name, "");
      complete_ = false;
    }
  }
  for (std::string_view name : accepted)
    if (name.starts_with('!') && !find(name.substr(1))) {
      diagnostics.error(where, fmt::format("<{}> needs the attribute '{}'", element.name(), name.substr(1)));
      complete_ = false;
    }
}

const std::string* XmlAttributes::find(std::string_view name) const {
  for (const auto& [key, value] : values_)
    if (key == name) return &value;
  return nullptr;
}

std::string XmlAttributes::get(std::string_view name, const std::string& fallback) const {
  const std::string* value = find(name);
  return value ? *value : fallback;
}

}  // namespace covary
