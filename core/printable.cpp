#include "core/printable.h"

#include <fmt/format.h>

namespace terracast::core {

namespace {

bool is_between(char c, unsigned least, unsigned most) {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= least && byte <= most;
}

/// Bytes of the well-formed letter that a text begins with (The Unicode Standard, table 3-7); 0 where
/// there is none.
std::size_t letter_length(std::string_view text) {
  struct Form {
    unsigned first_least, first_most, second_least, second_most;
    std::size_t length;
  };
  static constexpr Form kForms[] = {{0xC2, 0xDF, 0x80, 0xBF, 2}, {0xE0, 0xE0, 0xA0, 0xBF, 3},
                                    {0xE1, 0xEC, 0x80, 0xBF, 3}, {0xED, 0xED, 0x80, 0x9F, 3},
                                    {0xEE, 0xEF, 0x80, 0xBF, 3}, {0xF0, 0xF0, 0x90, 0xBF, 4},
                                    {0xF1, 0xF3, 0x80, 0xBF, 4}, {0xF4, 0xF4, 0x80, 0x8F, 4}};
  if (is_between(text[0], 0x00, 0x7F)) return 1;
  for (const Form& form : kForms) {
    if (!is_between(text[0], form.first_least, form.first_most)) continue;
    if (text.size() < form.length || !is_between(text[1], form.second_least, form.second_most))
      return 0;
    for (std::size_t i = 2; i < form.length; ++i)
      if (!is_between(text[i], 0x80, 0xBF)) return 0;
    return form.length;
  }
  return 0;
}

/// C0, delete, and C1 (two bytes from 0xC2 0x80 on).
bool is_control(std::string_view letter) {
  if (letter.size() == 1) return is_between(letter[0], 0x00, 0x1F) || letter[0] == '\x7F';
  return letter.size() == 2 && letter[0] == '\xC2' && is_between(letter[1], 0x80, 0x9F);
}

}  // namespace

std::string printable(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = letter_length(text);
    const std::string_view letter = text.substr(0, length == 0 ? 1 : length);
    const bool is_mark = text.starts_with("\\x");
    if (length == 0 || is_mark || is_control(letter))
      for (const char c : letter)
        result += fmt::format("\\x{:02x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      result += letter;
    text.remove_prefix(letter.size());
  }
  return result;
}

std::string_view first_letters(std::string_view text, std::size_t most_bytes) {
  if (text.size() <= most_bytes) return text;
  std::size_t end = most_bytes;
  // What begins with a first byte ends before the next one; a letter has at most three more.
  for (int i = 0; i < 3 && end > 0 && is_between(text[end], 0x80, 0xBF); ++i) --end;
  return text.substr(0, is_between(text[end], 0x80, 0xBF) ? most_bytes : end);
}

}  // namespace terracast::core
