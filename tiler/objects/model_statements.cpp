#include "tiler/objects/model_statements.h"

#include <charconv>
#include <cstdlib>

#include "core/stop.h"

namespace terracast::tiler {
namespace {

constexpr std::uint64_t kLinesAtOnce = 65536;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v'; }
bool ends_line(char c) { return c == '\n' || c == '\r' || c == '\0' || c == '\f'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

void take_statement(std::string_view text, std::uint64_t line,
                    const std::function<void(const ModelStatement&)>& take) {
  text = trimmed(text);
  if (text.empty()) return;
  std::size_t end = 0;
  while (end < text.size() && !is_blank(text[end])) ++end;
  take({.line = line, .name = text.substr(0, end), .rest = trimmed(text.substr(end))});
}

}  // namespace

void each_statement(std::span<const std::byte> bytes,
                    const std::function<void(const ModelStatement&)>& take) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  std::string joined;
  std::uint64_t first_line = 0;
  std::uint64_t line = 1;
  for (std::size_t begin = 0; begin < text.size(); ++line) {
    if (line % kLinesAtOnce == 0) core::throw_if_stop_asked();
    std::size_t end = begin;
    while (end < text.size() && !ends_line(text[end])) ++end;
    const std::string_view own = trimmed(text.substr(begin, end - begin));
    begin = end + (text.substr(end, 2) == "\r\n" ? 2 : 1);
    const bool goes_on = own.ends_with('\\') && !own.starts_with('#');
    if (first_line == 0 && !goes_on) {
      take_statement(own, line, take);
      continue;
    }
    if (first_line == 0) first_line = line;
    joined += own.substr(0, own.size() - (goes_on ? 1 : 0));
    joined += ' ';
    if (goes_on && begin < text.size()) continue;
    take_statement(joined, first_line, take);
    joined.clear();
    first_line = 0;
  }
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t begin = 0; begin < text.size();) {
    while (begin < text.size() && is_blank(text[begin])) ++begin;
    std::size_t end = begin;
    while (end < text.size() && !is_blank(text[end])) ++end;
    if (end == begin || text[begin] == '#') break;
    words.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return words;
}

std::optional<double> number_of(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || word.empty()) return std::nullopt;
  // Too small or too large for a double: 0 and infinity are the nearest.
  if (error == std::errc::result_out_of_range)
    return std::strtod(std::string(word).c_str(), nullptr);
  return error == std::errc() ? std::optional(value) : std::nullopt;
}

}  // namespace terracast::tiler
