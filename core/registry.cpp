#include "core/registry.h"

#include <algorithm>
#include <numeric>

#include "core/plugin_rows.h"

namespace terracast::core {

namespace {

/// Capitals and dashes are slips of the hand, not other letters.
std::string plain_spelling(std::string_view name) {
  std::string plain(name);
  for (char& letter : plain) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
    if (letter == '-' || letter == ' ') letter = '_';
  }
  return plain;
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row[b.size()];
}

std::string nearest_name(std::string_view name, const std::vector<std::string>& known) {
  constexpr std::size_t kLongestName = 200;  // the work grows with the product of the lengths
  if (name.size() > kLongestName) return {};
  const std::string plain = plain_spelling(name);
  std::string nearest;
  std::size_t least = 0;
  for (const std::string& candidate : known) {
    const std::size_t distance = edit_distance(plain, plain_spelling(candidate));
    if (3 * distance > std::max(plain.size(), candidate.size())) continue;
    if (!nearest.empty() && distance >= least) continue;
    nearest = candidate;
    least = distance;
  }
  return nearest;
}

std::string unknown_name_message(std::string_view what, std::string_view name,
                                 const std::vector<std::string>& known) {
  const std::string nearest = nearest_name(name, known);
  if (const std::string missing = missing_plugin(name); !missing.empty())
    return fmt::format("unknown {} \"{}\": {}", what, name, missing);
  return fmt::format("unknown {} \"{}\" ({}known: {})", what, name,
                     nearest.empty() ? "" : fmt::format("nearest: \"{}\"; ", nearest),
                     known.empty() ? "none" : fmt::format("{}", fmt::join(known, ", ")));
}

}  // namespace terracast::core
