#include "geo/fixes/telling.h"

#include <fmt/ranges.h>

namespace terracast::geo {
namespace {

constexpr std::size_t kMostKinds = 100;

/// "ele (3 times), time (1 times)"
template <class Counts>
std::string list_of(const Counts& counts) {
  std::string list;
  std::size_t num_listed = 0;
  for (const auto& [name, times] : counts) {
    if (num_listed++ == kMostKinds)
      return fmt::format("{}, and {} more kinds", list, counts.size() - kMostKinds);
    list += fmt::format("{}{} ({} times)", list.empty() ? "" : ", ", name, times);
  }
  return list;
}

/// Names that are ignored on purpose, by the reason.
std::map<std::string, std::vector<std::string>> ignored_by_reason(const core::Ledger& ledger) {
  std::map<std::string, std::vector<std::string>> ignored;
  for (const auto& [name, entry] : ledger.entries())
    if (entry.num_ignored > 0) ignored[entry.why].push_back(name);
  return ignored;
}

}  // namespace

void tell_of_file(const FileFacts& facts, const std::string& file, const core::Log& log) {
  for (const std::string& remark : facts.remarks) log.info("{}: {}", file, remark);
  if (!facts.empty.empty()) log.info("{}: empty: {}", file, list_of(facts.empty));
  std::map<std::string, std::int64_t> used;
  for (const auto& [name, entry] : facts.ledger.entries())
    if (entry.num_used > 0) used[name] = entry.num_used;
  if (!used.empty()) log.info("{}: read: {}", file, list_of(used));
  for (const auto& [why, names] : ignored_by_reason(facts.ledger))
    log.info("{}: not read: {} ({})", file, fmt::join(names, ", "), why);
  for (const std::string& line : facts.ledger.warnings(kMostKinds)) log.warn("{}: {}", file, line);
}

}  // namespace terracast::geo
