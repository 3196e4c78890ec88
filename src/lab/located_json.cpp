// SPDX-License-Identifier: Apache-2.0
#include "lab/located_json.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/error.h"
#include "core/json_depth.h"
#include "core/known_names.h"
#include "core/printable.h"

namespace covary::lab {
namespace {

using Json = nlohmann::ordered_json;

/// Iterates over a text's characters, counting lines. Copies share the count.
class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;
  CountingIterator(const char* at, int* line) : at_(at), line_(line) {}
  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    *line_ += *at_ == '\n';
    ++at_;
    return *this;
  }
  CountingIterator operator++(int) {
    CountingIterator old = *this;
    ++*this;
    return old;
  }
  bool operator==(const CountingIterator& other) const { return at_ == other.at_; }

 private:
  const char* at_;
  int* line_;
};

/// Handles the parser's events: builds the value and records lines.
class Builder : public nlohmann::json_sax<Json> {
 public:
  Builder(LocatedJson& document, const std::string& text, const int& line)
      : document_(document), text_(text), line_(line) {}

  bool null() override { return add(nullptr); }
  bool boolean(bool v) override { return add(v); }
  bool number_integer(number_integer_t v) override { return add(v); }
  bool number_unsigned(number_unsigned_t v) override { return add(v); }
  bool number_float(number_float_t v, const string_t&) override { return add(v); }
  bool string(string_t& v) override { return add(v); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return begin(Json::object()); }
  bool start_array(std::size_t) override { return begin(Json::array()); }
  bool end_object() override { return end(); }
  bool end_array() override { return end(); }
  bool key(string_t& name) override {
    key_line_ = line_;
    if (open_.back()->contains(name)) fail(line_, fmt::format("the key '{}' appears twice in one object", name));
    key_ = name;
    return true;
  }
  /// `position`: of the last character that was read, counted from 1.
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception& error) override {
    std::string what = error.what();
    what = what.substr(std::min(what.find(": syntax error"), what.size() - 2) + 2);
    const size_t at = std::min(std::max<size_t>(position, 1) - 1, text_.size());
    const size_t first = at == 0 ? 0 : text_.rfind('\n', at - 1) + 1;  // npos + 1 == 0
    const std::string line = text_.substr(first, text_.find('\n', at) - first);
    const auto number = std::count(text_.begin(), text_.begin() + static_cast<ptrdiff_t>(first), '\n') + 1;
    const size_t before = at == 0 ? std::string::npos : text_.find_last_not_of(" \t\r\n", at - 1);
    const bool is_comma = before != std::string::npos && text_[before] == ',' && at < text_.size() &&
                          (text_[at] == ']' || text_[at] == '}');
    throw Error(
        ErrorCode::kInput,
        fmt::format("{}:{}:{}: not JSON: {}{}; the line is '{}'", document_.name, number, at - first + 1,
                    is_comma ? "no comma may stand before the end of a list or object; " : "", what, printable(line)));
  }

 private:
  [[noreturn]] void fail(int line, const std::string& text) const {
    throw Error(ErrorCode::kInput, fmt::format("{}:{}: {}", document_.name, line, text));
  }
  /// Inserts a value into the innermost container and returns its address.
  Json* place(Json value) {
    if (open_.empty()) {
      document_.value = std::move(value);
      document_.lines[""] = line_;
      return &document_.value;
    }
    Json& parent = *open_.back();
    const bool in_array = parent.is_array();
    pointer_.push_back(in_array ? std::to_string(parent.size()) : key_);
    document_.lines[fmt::format("/{}", fmt::join(pointer_, "/"))] = in_array ? line_ : key_line_;
    if (in_array) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    return &(parent[key_] = std::move(value));
  }
  bool add(Json value) {
    place(std::move(value));
    if (!pointer_.empty()) pointer_.pop_back();
    return true;
  }
  bool begin(Json value) {
    open_.push_back(place(std::move(value)));
    return true;
  }
  bool end() {
    open_.pop_back();
    if (!pointer_.empty()) pointer_.pop_back();
    return true;
  }

  LocatedJson& document_;
  const std::string& text_;
  const int& line_;
  std::vector<Json*> open_;  // the addresses stay valid: a container only grows while it is the innermost
  std::vector<std::string> pointer_;
  std::string key_;
  int key_line_ = 0;
};

/// "/scenes/0/file" -> "scenes[0].file".
std::string path_text(const std::string& pointer) {
  std::string text;
  for (size_t begin = 1; begin <= pointer.size() && !pointer.empty();) {
    const size_t end = std::min(pointer.find('/', begin), pointer.size());
    const std::string word = pointer.substr(begin, end - begin);
    const bool number = !word.empty() && word.find_first_not_of("0123456789") == std::string::npos;
    text += number ? "[" + word + "]" : (text.empty() ? "" : ".") + word;
    begin = end + 1;
  }
  return text;
}

}  // namespace

LocatedJson parse_located(const std::string& text, const std::string& name) {
  if (const int deep = line_nested_too_deep(text))
    throw Error(ErrorCode::kInput,
                fmt::format("{}:{}: arrays and objects nest deeper than {}", name, deep, kMaxJsonDepth));
  LocatedJson document;
  document.name = name;
  int line = 1;
  Builder builder(document, text, line);
  Json::sax_parse(CountingIterator(text.data(), &line), CountingIterator(text.data() + text.size(), &line), &builder);
  return document;
}

std::string shown(const Json& value) {
  constexpr size_t kMax = 60;
  // ASCII only, so that truncation cannot split a character.
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  return text.size() > kMax ? text.substr(0, kMax - 3) + "..." : text;
}

ObjectReader::ObjectReader(const LocatedJson& document, std::string pointer, std::vector<std::string>& problems)
    : document_(document),
      pointer_(std::move(pointer)),
      problems_(problems),
      object_(document.value.at(Json::json_pointer(pointer_))) {}

const Json* ObjectReader::find(const std::string& name) {
  known_.push_back(name);
  const auto it = object_.find(name);
  return it == object_.end() || it->is_null() ? nullptr : &*it;
}

template <typename Is>
const Json* ObjectReader::typed(const std::string& name, Is&& is, const std::string& expected) {
  const Json* value = find(name);
  if (!value || is(*value)) return value;
  problem(name, fmt::format("expected {}, found {}", expected, shown(*value)));
  return nullptr;
}

std::optional<std::string> ObjectReader::text(const std::string& name) {
  const Json* value = typed(
      name, [](const Json& v) { return v.is_string(); }, "a text");
  return value ? std::optional(value->get<std::string>()) : std::nullopt;
}

std::string ObjectReader::required_text(const std::string& name) {
  const bool given = object_.contains(name);
  const std::optional<std::string> value = text(name);
  if (!given || (value && value->empty())) problem("", fmt::format("lacks '{}'", name));
  return value.value_or("");
}

std::optional<double> ObjectReader::positive(const std::string& name) {
  const Json* value = typed(
      name, [](const Json& v) { return v.is_number() && v.get<double>() > 0; }, "a positive number");
  return value ? std::optional(value->get<double>()) : std::nullopt;
}

std::optional<int64_t> ObjectReader::whole(const std::string& name, int64_t lowest, int64_t highest) {
  const auto is_in_range = [&](const Json& v) {
    // Only integers above the largest int64_t are stored as unsigned.
    return v.is_number_integer() && (!v.is_number_unsigned() || std::in_range<int64_t>(v.get<uint64_t>())) &&
           v.get<int64_t>() >= lowest && v.get<int64_t>() <= highest;
  };
  const Json* value = typed(name, is_in_range, fmt::format("a whole number from {} to {}", lowest, highest));
  return value ? std::optional(value->get<int64_t>()) : std::nullopt;
}

std::vector<std::string> ObjectReader::texts(const std::string& name) {
  const auto are_texts = [](const Json& v) {
    return v.is_array() && std::all_of(v.begin(), v.end(), [](const Json& word) { return word.is_string(); });
  };
  const Json* value = typed(name, are_texts, "a list of texts");
  return value ? value->get<std::vector<std::string>>() : std::vector<std::string>{};
}

std::vector<std::string> ObjectReader::objects(const std::string& name) {
  const auto are_objects = [](const Json& v) {
    return v.is_array() && std::all_of(v.begin(), v.end(), [](const Json& o) { return o.is_object(); });
  };
  const Json* value = typed(name, are_objects, "a list of objects");
  std::vector<std::string> pointers;
  for (size_t i = 0; value && i < value->size(); ++i) pointers.push_back(fmt::format("{}/{}/{}", pointer_, name, i));
  return pointers;
}

std::optional<std::string> ObjectReader::object(const std::string& name) {
  const Json* value = typed(
      name, [](const Json& v) { return v.is_object(); }, "an object");
  return value ? std::optional(pointer_ + "/" + name) : std::nullopt;
}

void ObjectReader::problem(const std::string& name, const std::string& text) {
  const std::string pointer = name.empty() ? pointer_ : pointer_ + "/" + name;
  const auto line = document_.lines.find(pointer);
  const std::string where = path_text(pointer);
  problems_.push_back(fmt::format("{}:{}: {}{}", document_.name, line == document_.lines.end() ? 1 : line->second,
                                  where.empty() ? "" : where + ": ", text));
}

void ObjectReader::finish() {
  for (const auto& [name, value] : object_.items())
    if (std::find(known_.begin(), known_.end(), name) == known_.end())
      problem(name,
              "unknown key" + hint_and_list(name, known_, fmt::format("known keys are {}", fmt::join(known_, ", "))));
}

}  // namespace covary::lab
