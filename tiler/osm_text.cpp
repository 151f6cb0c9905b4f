#include "tiler/osm_text.h"

#include <algorithm>
#include <charconv>
#include <cstring>

namespace terracast::tiler {

std::string_view osm_attribute(std::string_view element, std::string_view name) {
  std::size_t at = 0;
  while ((at = element.find(name, at)) != std::string_view::npos) {
    const std::size_t end = at + name.size();
    const bool is_name = at > 0 && std::strchr(" \t\r\n", element[at - 1]) != nullptr;
    std::size_t quote = element.find_first_not_of(" \t\r\n", end);
    if (is_name && quote != std::string_view::npos && element[quote] == '=') {
      quote = element.find_first_not_of(" \t\r\n", quote + 1);
      if (quote == std::string_view::npos || (element[quote] != '"' && element[quote] != '\''))
        return "";
      const std::size_t close = element.find(element[quote], quote + 1);
      return close == std::string_view::npos ? "" : element.substr(quote + 1, close - quote - 1);
    }
    at = end;
  }
  return "";
}

std::optional<std::int64_t> osm_number_in(std::string_view element, std::string_view name) {
  const std::string_view text = osm_attribute(element, name);
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string_view osm_element_name(std::string_view element) {
  const std::size_t start = element.starts_with('/') ? 1 : 0;
  return element.substr(0, std::min(element.find_first_of(" \t\r\n/", start), element.size()));
}

std::size_t end_of_osm_element(std::string_view text) {
  if (text.starts_with("!--")) {
    const std::size_t end = text.find("-->");
    return end == std::string_view::npos ? end : end + 2;
  }
  char quote = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (quote != 0)
      quote = text[i] == quote ? 0 : quote;
    else if (text[i] == '"' || text[i] == '\'')
      quote = text[i];
    else if (text[i] == '>')
      return i;
  }
  return std::string_view::npos;
}

}  // namespace terracast::tiler
