#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "core/random.h"
#include "tests/validate/fields/fields.h"

namespace terracast::test {

double Amount::signed_size() const {
  const double size = core::random_between(1.0, 3.0, seed, 1, 0);
  return core::random_bits(seed, 2, 0) % 2 == 0 ? size : -size;
}

double Amount::changed(double value) const {
  // What a matrix has left of a 0 by rounding stays: a few per cent of it are rounding too.
  constexpr double kRounding = 1e-9;
  if (is_relative && std::abs(value) < kRounding) return value;
  return is_relative ? value * (1.0 + 0.01 * signed_size()) : value + 0.01 * signed_size();
}

std::int64_t Amount::changed(std::int64_t value) const {
  return value + static_cast<std::int64_t>(signed_size());
}

namespace {

/// A stretch of a text that is one value.
struct Token {
  std::size_t begin = 0, end = 0;
};

bool is_whole_number(std::string_view word) {
  if (word.starts_with('-')) word.remove_prefix(1);
  return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos;
}

std::optional<double> number_in(std::string_view word) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// A letter of a word becomes another; of words without letters a digit does.
std::string changed_word(std::string word, const Amount& amount) {
  std::vector<std::size_t> letters, digits;
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (std::isalpha(static_cast<unsigned char>(word[i])) != 0) letters.push_back(i);
    if (std::isdigit(static_cast<unsigned char>(word[i])) != 0) digits.push_back(i);
  }
  const std::vector<std::size_t>& places = letters.empty() ? digits : letters;
  if (places.empty()) return word + "x";
  char& c = word[places[core::random_bits(amount.seed, 3, 0) % places.size()]];
  c = letters.empty() ? (c == '9' ? '0' : static_cast<char>(c + 1)) : (c == 'q' ? 'k' : 'q');
  return word;
}

std::string changed_token(const std::string& word, const Amount& amount) {
  if (word.starts_with('"'))
    return word.size() == 2 ? "\"q\""
                            : '"' + changed_word(word.substr(1, word.size() - 2), amount) + '"';
  if (word == "true" || word == "false") return word == "true" ? "false" : "true";
  if (word.empty() || word == "null") return "1";
  if (is_whole_number(word))
    return fmt::format("{}", amount.changed(static_cast<std::int64_t>(std::stoll(word))));
  if (const auto value = number_in(word)) {
    if (!std::isfinite(*value)) return "1.5";
    const double changed = amount.changed(*value);
    return changed == *value ? word : fmt::format("{}", changed);
  }
  return changed_word(word, amount);
}

NamedChange change_of(std::string name, Token token) {
  return {std::move(name), [token](const std::string& text, const Amount& amount) {
            const std::string word = text.substr(token.begin, token.end - token.begin);
            return text.substr(0, token.begin) + changed_token(word, amount) +
                   text.substr(token.end);
          }};
}

/// Walks JSON and keeps each leaf with the way that leads to it.
class JsonWalk {
 public:
  explicit JsonWalk(const std::string& text) : text_(text) { value(""); }
  std::vector<NamedChange> leaves;

 private:
  void blanks() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  Token quoted() {
    const std::size_t begin = at_++;
    while (text_.at(at_) != '"') at_ += text_[at_] == '\\' ? 2 : 1;
    return {begin, ++at_};
  }
  /// Whether another part of an object or array follows; steps over what parts them.
  bool has_more(char end) {
    blanks();
    if (text_.at(at_) == ',') ++at_;
    blanks();
    if (text_.at(at_) != end) return true;
    ++at_;
    return false;
  }
  void value(const std::string& way) {
    blanks();
    const char first = text_.at(at_);
    if (first == '{') {
      ++at_;
      while (has_more('}')) {
        const Token key = quoted();
        // Members that are paths of files, and not words of the format.
        const std::string name =
            way == "/files" ? "*" : text_.substr(key.begin + 1, key.end - key.begin - 2);
        blanks();
        ++at_;  // the colon
        value(way + "/" + name);
      }
    } else if (first == '[') {
      ++at_;
      while (has_more(']')) value(way + "/*");
    } else if (first == '"') {
      leaves.push_back(change_of(way, quoted()));
    } else {
      const std::size_t begin = at_;
      while (at_ < text_.size() &&
             std::string_view(",]} \n\r\t").find(text_[at_]) == std::string_view::npos)
        ++at_;
      leaves.push_back(change_of(way, {begin, at_}));
    }
  }

  const std::string& text_;
  std::size_t at_ = 0;
};

/// Parts of a text between separators, empty ones only where `keeps_empty`.
std::vector<Token> parts_of(const std::string& text, Token whole, const char* separators,
                            bool keeps_empty) {
  std::vector<Token> parts;
  for (std::size_t begin = whole.begin; begin <= whole.end;) {
    const std::size_t end = std::min(text.find_first_of(separators, begin), whole.end);
    if (keeps_empty || end > begin) parts.push_back({begin, end});
    begin = end + 1;
  }
  return parts;
}

std::vector<Token> lines_in(const std::string& text) {
  return parts_of(text, {0, text.size()}, "\n", false);
}

}  // namespace

std::vector<NamedChange> json_fields(const std::string& text) { return JsonWalk(text).leaves; }

std::vector<NamedChange> csv_fields(const std::string& text) {
  const std::vector<Token> lines = lines_in(text);
  std::vector<NamedChange> fields;
  if (lines.empty()) return fields;
  const std::vector<Token> head = parts_of(text, lines[0], ",", true);
  for (const Token& name : head) fields.push_back(change_of("header", name));
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::vector<Token> cells = parts_of(text, lines[i], ",", true);
    for (std::size_t k = 0; k < cells.size(); ++k)
      fields.push_back(
          change_of(text.substr(head.at(k).begin, head[k].end - head[k].begin), cells[k]));
  }
  return fields;
}

// Rows of one kind have a name by their first word, where it ends in a colon, or by how their words begin: with a
// number or not. From the thirtieth column on rows repeat themselves, as tracks of points do.
std::vector<NamedChange> word_fields(const std::string& text) {
  constexpr std::size_t kMostColumns = 30;
  std::vector<NamedChange> fields;
  for (const Token& line : lines_in(text)) {
    std::vector<Token> words = parts_of(text, line, " \t", false);
    const auto word = [&](std::size_t i) {
      return text.substr(words[i].begin, words[i].end - words[i].begin);
    };
    if (words.empty()) continue;
    std::string row;
    bool has_word = false;
    for (std::size_t i = 0; i < words.size(); ++i) has_word |= !number_in(word(i)).has_value();
    if (word(0).ends_with(':')) {
      row = word(0);
      row.pop_back();
      fields.push_back(change_of("key", words[0]));
      words.erase(words.begin());
      if (has_word && std::none_of(words.begin(), words.end(), [&](const Token& each) {
            return number_in(text.substr(each.begin, each.end - each.begin)).has_value();
          })) {
        for (const Token& each : words) fields.push_back(change_of("words", each));
        continue;
      }
    } else if (word(0).starts_with('#')) {
      for (const Token& each : words) fields.push_back(change_of("comment", each));
      continue;
    } else if (has_word) {
      row = "row";
    }
    for (std::size_t i = 0; i < words.size(); ++i)
      fields.push_back(change_of(fmt::format("{}[{}]", row, std::min(i, kMostColumns)), words[i]));
  }
  return fields;
}

std::string kind_of(const std::string& path) {
  std::string kind;
  const std::size_t name = path.rfind('/') + 1;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const bool is_digit = i >= name && std::isdigit(static_cast<unsigned char>(path[i])) != 0;
    if (!is_digit)
      kind += path[i];
    else if (!kind.ends_with('#'))
      kind += '#';
  }
  return kind;
}

}  // namespace terracast::test
