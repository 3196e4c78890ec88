// SPDX-License-Identifier: Apache-2.0
#include "pbrt_text/pbrt_tokens.h"

#include <fmt/format.h>

#include <utility>

#include "formats/xml_values.h"

namespace covary {

void PbrtMessages::warn(const SourceLocation& where, const std::string& message) {
  if (silent_) return;
  const auto [known, is_new] = indices_.emplace(message, warnings_.size());
  if (is_new)
    warnings_.push_back({message, where});
  else
    ++warnings_[known->second].count;
}

void PbrtMessages::flush() {
  for (const Repeated& w : warnings_) {
    const std::string more = w.count > 1 ? fmt::format(" ({} more like this)", w.count - 1) : "";
    diagnostics_->warn(w.first, w.message + more);
  }
  warnings_.clear(), indices_.clear();
}

PbrtTokens::PbrtTokens(std::string_view text, const std::string& file, PbrtMessages& messages, PbrtTokens* outer)
    : text_(text), file_(file), messages_(messages), outer_(outer) {
  if (text_.starts_with("\xef\xbb\xbf")) text_.remove_prefix(3);  // byte order mark
}

char PbrtTokens::take() {
  const char c = text_[place_++];
  if (c == '\n')
    ++line_, column_ = 1;
  else
    ++column_;
  return c;
}

void PbrtTokens::stop(const PbrtToken& token, const std::string& message) const {
  messages_.error(where(token), message);
  throw PbrtStop();
}

void PbrtTokens::skip_blanks() {
  constexpr std::string_view kBlanks = " \t\r\n";
  while (place_ < text_.size() && (kBlanks.find(text_[place_]) != kBlanks.npos || text_[place_] == '#'))
    if (take() == '#')
      while (place_ < text_.size() && text_[place_] != '\n') take();
}

bool PbrtTokens::at_end() {
  if (peeked_) return next_.kind == PbrtToken::kEnd;
  skip_blanks();
  return place_ == text_.size();
}

const PbrtToken& PbrtTokens::peek() {
  if (outer_ && at_end()) return outer_->peek();
  if (!peeked_) next_ = read();
  peeked_ = true;
  return next_;
}

PbrtToken PbrtTokens::next() {
  if (outer_ && at_end()) return outer_->next();
  if (!peeked_) return read();
  peeked_ = false;
  return std::move(next_);
}

PbrtToken PbrtTokens::read() {
  constexpr std::string_view kEnds = " \t\r\n\"[]#";
  skip_blanks();
  PbrtToken token;
  token.line = line_, token.column = column_, token.file = &file_;
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
  if (text.size() > 1 && text.back() == ',') {  // pbrt leaves unread what follows a number
    text.remove_suffix(1);
    messages_.warn(where(token), "a comma behind a number is read past, as in pbrt");
  }
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

}  // namespace covary
