// SPDX-License-Identifier: Apache-2.0
#include "core/shell_text.h"

namespace covary {

std::string shell_text(const std::vector<std::string>& words) {
  const char* safe = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./,:@%";
  std::string text;
  for (const std::string& word : words) {
    if (!text.empty()) text += ' ';
    if (!word.empty() && word.find_first_not_of(safe) == std::string::npos) {
      text += word;
      continue;
    }
    text += '\'';
    for (char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    text += '\'';
  }
  return text;
}

std::vector<std::string> words_of_shell_text(const std::string& text) {
  std::vector<std::string> words;
  bool quoted = false, in_word = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const bool was_in_word = in_word;
    in_word = quoted || text[i] != ' ';
    if (in_word && !was_in_word) words.emplace_back();
    if (text[i] == '\'')
      quoted = !quoted;
    else if (text[i] == '\\' && !quoted && i + 1 < text.size())
      words.back() += text[++i];
    else if (in_word)
      words.back() += text[i];
  }
  return words;
}

}  // namespace covary
