// SPDX-License-Identifier: Apache-2.0
#include "meshes/ply_header.h"

#include <fmt/format.h>

#include <charconv>
#include <utility>

#include "core/error.h"

namespace covary {
namespace {

PlyType parse_type(std::string_view name, size_t line) {
  static constexpr std::pair<std::string_view, PlyType> kNames[] = {
      {"char", PlyType::kInt8},      {"int8", PlyType::kInt8},      {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},    {"short", PlyType::kInt16},    {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16},  {"uint16", PlyType::kUint16},  {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},    {"uint", PlyType::kUint32},    {"uint32", PlyType::kUint32},
      {"long", PlyType::kInt64},     {"int64", PlyType::kInt64},    {"ulong", PlyType::kUint64},
      {"uint64", PlyType::kUint64},  {"float", PlyType::kFloat32},  {"float32", PlyType::kFloat32},
      {"double", PlyType::kFloat64}, {"float64", PlyType::kFloat64}};
  for (const auto& [known, type] : kNames)
    if (known == name) return type;
  fail_ply(fmt::format("line {}: unknown type '{}'", line, name));
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  size_t i = 0;
  while (i < line.size()) {
    while (i < line.size() && (line[i] == ' ' || line[i] == '\t' || line[i] == '\r')) ++i;
    const size_t start = i;
    while (i < line.size() && line[i] != ' ' && line[i] != '\t' && line[i] != '\r') ++i;
    if (i > start) words.push_back(line.substr(start, i - start));
  }
  return words;
}

}  // namespace

void fail_ply(const std::string& message) { throw Error(ErrorCode::kInput, "PLY: " + message); }

PlyHeader parse_ply_header(std::string_view text) {
  PlyHeader header;
  bool has_format = false;
  size_t start = 0;
  for (size_t line = 1;; ++line) {
    const size_t end = text.find('\n', start);
    if (end == std::string_view::npos) fail_ply(fmt::format("line {}: the header has no 'end_header'", line));
    const std::vector<std::string_view> words = words_of(text.substr(start, end - start));
    start = end + 1;
    if (line == 1) {
      if (words.size() != 1 || words[0] != "ply") fail_ply("the file does not start with 'ply'");
      continue;
    }
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format" && words.size() == 3) {
      if (words[1] == "ascii") {
        header.format = PlyFormat::kAscii;
      } else if (words[1] == "binary_little_endian") {
        header.format = PlyFormat::kLittleEndian;
      } else if (words[1] == "binary_big_endian") {
        header.format = PlyFormat::kBigEndian;
      } else {
        fail_ply(fmt::format("line {}: unknown format '{}'; expected ascii, binary_little_endian or binary_big_endian",
                             line, words[1]));
      }
      if (words[2] != "1.0") fail_ply(fmt::format("line {}: version '{}'; expected 1.0", line, words[2]));
      has_format = true;
    } else if (words[0] == "element" && words.size() == 3) {
      PlyElement element;
      element.name = words[1];
      const auto [rest, error] = std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
      if (error != std::errc() || rest != words[2].data() + words[2].size())
        fail_ply(fmt::format("line {}: '{}' is not a number of elements", line, words[2]));
      for (const PlyElement& other : header.elements)
        if (other.name == element.name)
          fail_ply(fmt::format("line {}: element '{}' is given twice", line, element.name));
      header.elements.push_back(std::move(element));
    } else if (words[0] == "property" && (words.size() == 3 || (words.size() == 5 && words[1] == "list"))) {
      if (header.elements.empty()) fail_ply(fmt::format("line {}: a property before any element", line));
      PlyProperty property;
      property.is_list = words.size() == 5;
      property.name = words.back();
      property.type = parse_type(words[words.size() - 2], line);
      if (property.is_list) property.count_type = parse_type(words[2], line);
      if (property.is_list && property.count_type >= PlyType::kFloat32)
        fail_ply(fmt::format("line {}: the length of list '{}' must be an integer", line, property.name));
      header.elements.back().properties.push_back(std::move(property));
    } else {
      fail_ply(fmt::format("line {}: cannot read '{}'", line, words[0]));
    }
  }
  if (!has_format) fail_ply("the header has no 'format' line");
  header.size = start;
  return header;
}

}  // namespace covary
