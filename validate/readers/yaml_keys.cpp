#include "validate/readers/yaml_keys.h"

#include <algorithm>

#include "core/error.h"
#include "core/printable.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

/// A line without its comment.
std::string_view without_comment(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i)
    if (line[i] == '#' && (i == 0 || line[i - 1] == ' ')) return line.substr(0, i);
  return line;
}

/// A map that is open at a line: its key with those around it, and how far its line is indented.
struct OpenKey {
  std::string name;
  std::size_t indentation = 0;
};

std::ptrdiff_t num_open(std::string_view text) {
  return std::count(text.begin(), text.end(), '[') - std::count(text.begin(), text.end(), ']');
}

}  // namespace

YamlKeys::YamlKeys(std::string_view text, std::string path) : path_(std::move(path)) {
  std::vector<OpenKey> open;
  std::ptrdiff_t num_brackets = 0;
  for (const TextLine& line : split_lines(text)) {
    const std::string where = path_ + ":" + std::to_string(line.number);
    const std::string_view content = without_comment(line.text);
    const std::string_view words = trimmed(content);
    if (words.empty() || (line.number == 1 && words.starts_with("%YAML"))) continue;
    if (num_brackets > 0 || words.starts_with("- ")) {
      if (open.empty()) fail(ErrorKind::Input, "{}: a list without a key", where);
      std::string& value = values_[open.back().name];
      if (num_brackets == 0 && !value.empty()) value += ",";
      value += num_brackets > 0 ? words : words.substr(2);
    } else {
      const std::size_t indentation = content.find_first_not_of(' ');
      while (!open.empty() && open.back().indentation >= indentation) open.pop_back();
      const std::size_t colon = words.find(':');
      if (colon == std::string_view::npos)
        fail(ErrorKind::Input, "{}: \"{}\" is no key with a value", where,
             core::first_letters(words, 60));
      const std::string around = open.empty() ? "" : open.back().name + ".";
      open.push_back({around + std::string(trimmed(words.substr(0, colon))), indentation});
      const auto [value, is_new] =
          values_.emplace(open.back().name, std::string(trimmed(words.substr(colon + 1))));
      if (!is_new)
        fail(ErrorKind::Input, "{}: {} stands twice", where,
             core::first_letters(open.back().name, 60));
    }
    num_brackets += num_open(words);
    if (num_brackets < 0) fail(ErrorKind::Input, "{}: a list ends that did not begin", where);
  }
  if (num_brackets > 0) fail(ErrorKind::Input, "{}: a list without an end", path_);
}

const std::string& YamlKeys::word(const std::string& key) const {
  const auto found = values_.find(key);
  if (found == values_.end()) fail(ErrorKind::Input, "{}: no key {}", path_, key);
  return found->second;
}

std::vector<double> YamlKeys::numbers(const std::string& key, std::size_t count) const {
  std::string text = word(key);
  std::erase_if(text, [](char c) { return c == '[' || c == ']'; });
  std::vector<double> values;
  for (const std::string_view part : split_at(text, ','))
    values.push_back(parse_number(trimmed(part), where(key)));
  if (values.size() != count)
    fail(ErrorKind::Input, "{}: {} numbers, not {}", where(key), values.size(), count);
  return values;
}

}  // namespace terracast::validate
