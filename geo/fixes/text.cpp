#include "geo/fixes/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"

namespace terracast::geo {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";
constexpr std::size_t kMostBytes = std::size_t{1} << 28;

}  // namespace

void refuse_if_too_large(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (!error && size > kMostBytes)
    core::fail(core::ErrorKind::Input,
               "{}: {} MB; recordings of up to {} MB are read: cut it into parts, or keep every "
               "tenth row",
               file.string(), size >> 20, kMostBytes >> 20);
}

std::string text_of_recording(const std::filesystem::path& file) {
  refuse_if_too_large(file);
  std::string text = core::read_text_file(file, kMostBytes);
  constexpr std::string_view kUtf8 = "\xEF\xBB\xBF", kUtf16 = "\xFF\xFE", kUtf16Big = "\xFE\xFF";
  if (text.starts_with(kUtf16) || text.starts_with(kUtf16Big))
    core::fail(core::ErrorKind::Input, "{}: its text is UTF-16; save it as UTF-8", file.string());
  if (const std::size_t zero = text.find('\0'); zero != std::string::npos)
    core::fail(core::ErrorKind::Input,
               "{}: byte {} is 0, as in no text; a recording in UTF-8 is expected", file.string(),
               zero);
  if (text.starts_with(kUtf8)) text.erase(0, kUtf8.size());
  if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');
  return text;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::string in_lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

std::optional<double> number_of(std::string_view text) {
  std::string_view digits = trimmed(text);
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(kBlanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlanks, end);
  }
  return words;
}

std::vector<std::string_view> lines_of_text(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    lines.push_back(line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

}  // namespace terracast::geo
