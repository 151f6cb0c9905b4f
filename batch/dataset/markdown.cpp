#include "batch/dataset/markdown.h"

#include <algorithm>

#include "core/printable.h"

namespace terracast::batch {

namespace {

bool is_word(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         static_cast<unsigned char>(c) >= 0x80;
}

/// Whether a letter could be a mark where it stands.
bool is_mark(std::string_view text, std::size_t at) {
  const char c = text[at];
  switch (c) {
    case '_':  // within a word it is none
      return at == 0 || at + 1 == text.size() || !is_word(text[at - 1]) || !is_word(text[at + 1]);
    case '-':
    case '+':
    case '=':
      return text.find_first_not_of(' ') == at;
    case '.':
    case ')': {  // after the number of a list, or the www of a link
      const std::string_view before = text.substr(0, at);
      const bool ends_word = at + 1 == text.size() || text[at + 1] == ' ';
      return (ends_word && before.find_first_not_of(" 0123456789") == std::string_view::npos) ||
             before.ends_with("www") || before.ends_with("WWW");
    }
    case ':':  // of a link
      return text.substr(at).starts_with("://");
    default:
      return std::string_view("\\`*[]<>#|~!&$@").find(c) != std::string_view::npos;
  }
}

}  // namespace

std::string markdown_text(std::string_view text) {
  const std::string shown = core::printable(text);
  std::string result;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    if (is_mark(shown, i)) result += '\\';
    result += shown[i];
  }
  // Blanks at the ends would be taken away, or make lines of code.
  const std::size_t first = result.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  return result.substr(first, result.find_last_not_of(' ') - first + 1);
}

std::string markdown_lines(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    result += markdown_text(text.substr(0, end)) + "\n";
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return result;
}

std::string markdown_code(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    result += "    " + core::printable(text.substr(0, end)) + "\n";
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return result;
}

std::string markdown_table(const std::vector<std::string>& head,
                           const std::vector<std::vector<std::string>>& rows,
                           const std::vector<bool>& right_aligned) {
  const auto row_text = [](const std::vector<std::string>& cells) {
    std::string text = "|";
    for (const std::string& cell : cells) text += " " + cell + " |";
    return text + "\n";
  };
  std::string text = row_text(head) + "|";
  for (const bool is_right : right_aligned) text += is_right ? " ---: |" : " --- |";
  text += "\n";
  for (const std::vector<std::string>& row : rows) text += row_text(row);
  return text;
}

}  // namespace terracast::batch
