#include "core/ledger.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/printable.h"

namespace terracast::core {

namespace {

constexpr std::size_t kMostNames = 1000;
constexpr std::size_t kMostValues = 20;
constexpr std::size_t kMostBytes = 80;  ///< of a name or value

std::string short_text(std::string_view text) {
  const std::string_view first = first_letters(text, kMostBytes);
  return printable(first) + (first.size() < text.size() ? "…" : "");
}

std::int64_t times_of(const Ledger::Entry& entry) {
  return entry.num_used + entry.num_ignored + entry.num_unknown;
}

std::string words_of_values(const Ledger::Entry& entry) {
  std::string words;
  for (const auto& [value, times] : entry.not_understood)
    words += fmt::format("{}\"{}\"{}", words.empty() ? "" : ", ", value,
                         times > 1 ? fmt::format(" ({} times)", times) : "");
  if (entry.num_other_values > 0)
    words += fmt::format(" and {} more of other values", entry.num_other_values);
  return words;
}

void add_value(Ledger::Entry& entry, const std::string& value, std::int64_t times) {
  entry.not_understood[value] += times;
  if (entry.not_understood.size() <= kMostValues) return;
  const auto last = std::prev(entry.not_understood.end());
  entry.num_other_values += last->second;
  entry.not_understood.erase(last);
}

}  // namespace

const KnownName* find_known(std::span<const KnownName> known, std::string_view name) {
  const auto is_it = [&](const KnownName& one) {
    return one.name.ends_with('*') ? name.starts_with(one.name.substr(0, one.name.size() - 1))
                                   : name == one.name;
  };
  const auto found = std::find_if(known.begin(), known.end(), is_it);
  return found == known.end() ? nullptr : &*found;
}

std::int64_t Ledger::Entry::num_not_understood() const {
  std::int64_t sum = num_other_values;
  for (const auto& [value, times] : not_understood) sum += times;
  return sum;
}

Ledger::Entry& Ledger::entry(std::string_view name) { return entries_[short_text(name)]; }

void Ledger::leave_out_the_last() {
  if (entries_.size() <= kMostNames) return;
  const auto last = std::prev(entries_.end());
  num_of_others_ += times_of(last->second);
  entries_.erase(last);
}

void Ledger::count(std::string_view name, std::span<const KnownName> known, std::int64_t times) {
  const KnownName* found = find_known(known, name);
  if (found == nullptr)
    miss(name, times);
  else if (found->is_used)
    use(name, times);
  else
    ignore(name, found->words, times);
}

void Ledger::use(std::string_view name, std::int64_t times) {
  entry(name).num_used += times;
  leave_out_the_last();
}

void Ledger::ignore(std::string_view name, std::string_view why, std::int64_t times) {
  Entry& found = entry(name);
  found.num_ignored += times;
  // The first by the alphabet, so that the order of calls does not matter.
  if (found.why.empty() || why < found.why) found.why = why;
  leave_out_the_last();
}

void Ledger::miss(std::string_view name, std::int64_t times) {
  entry(name).num_unknown += times;
  leave_out_the_last();
}

void Ledger::misunderstand(std::string_view name, std::string_view value, std::int64_t times) {
  add_value(entry(name), short_text(value), times);
  leave_out_the_last();
}

void Ledger::merge(const Ledger& other) {
  num_of_others_ += other.num_of_others_;
  for (const auto& [name, theirs] : other.entries_) {
    Entry& ours = entries_[name];
    ours.num_used += theirs.num_used;
    ours.num_ignored += theirs.num_ignored;
    ours.num_unknown += theirs.num_unknown;
    if (ours.why.empty() || (!theirs.why.empty() && theirs.why < ours.why)) ours.why = theirs.why;
    ours.num_other_values += theirs.num_other_values;
    for (const auto& [value, times] : theirs.not_understood) add_value(ours, value, times);
    leave_out_the_last();
  }
}

std::vector<std::string> Ledger::warnings(std::size_t most_lines) const {
  std::vector<std::pair<std::int64_t, std::string>> lines;
  for (const auto& [name, entry] : entries_) {
    if (entry.num_unknown > 0)
      lines.emplace_back(-entry.num_unknown, fmt::format("{} is not known, and stands {} times",
                                                         name, entry.num_unknown));
    if (const std::int64_t times = entry.num_not_understood(); times > 0)
      lines.emplace_back(-times,
                         fmt::format("{}: not understood: {}", name, words_of_values(entry)));
  }
  std::stable_sort(lines.begin(), lines.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> texts;
  for (const auto& [times, line] : lines) {
    if (texts.size() == most_lines) {
      texts.push_back(fmt::format("and {} more kinds", lines.size() - most_lines));
      break;
    }
    texts.push_back(line);
  }
  return texts;
}

std::string Ledger::table() const {
  std::size_t width = 4;
  for (const auto& [name, entry] : entries_) width = std::max(width, name.size());
  std::string text =
      fmt::format("{:<{}} {:>9} {:>9} {:>9}\n", "name", width, "used", "ignored", "unknown");
  for (const auto& [name, entry] : entries_) {
    text += fmt::format("{:<{}} {:>9} {:>9} {:>9}", name, width, entry.num_used, entry.num_ignored,
                        entry.num_unknown);
    if (!entry.why.empty()) text += "  ignored: " + entry.why;
    if (entry.num_not_understood() > 0) text += "  not understood: " + words_of_values(entry);
    text += "\n";
  }
  if (num_of_others_ > 0) text += fmt::format("and {} times other names\n", num_of_others_);
  return text;
}

Json Ledger::json() const {
  Json names = Json::object();
  for (const auto& [name, entry] : entries_) {
    Json json = Json::object();
    if (entry.num_used > 0) json.set("used", entry.num_used);
    if (entry.num_ignored > 0) json.set("ignored", entry.num_ignored).set("why", entry.why);
    if (entry.num_unknown > 0) json.set("unknown", entry.num_unknown);
    if (!entry.not_understood.empty()) {
      Json values = Json::object();
      for (const auto& [value, times] : entry.not_understood) values.set(value, times);
      json.set("not_understood", std::move(values));
    }
    if (entry.num_other_values > 0) json.set("other_values", entry.num_other_values);
    names.set(name, std::move(json));
  }
  return Json::object().set("names", std::move(names)).set("others", num_of_others_);
}

Ledger Ledger::of(const Json& json) {
  Ledger ledger;
  ledger.num_of_others_ = json.at("others").integer();
  for (const auto& member : json.at("names").members()) {
    const Json& one = member.second;
    Entry& entry = ledger.entries_[member.first];
    const auto times = [&](const char* what) {
      return one.has(what) ? one.at(what).integer() : std::int64_t{0};
    };
    entry.num_used = times("used");
    entry.num_ignored = times("ignored");
    entry.num_unknown = times("unknown");
    entry.num_other_values = times("other_values");
    if (one.has("why")) entry.why = one.at("why").string();
    if (one.has("not_understood"))
      for (const auto& [value, count] : one.at("not_understood").members())
        entry.not_understood[value] = count.integer();
  }
  return ledger;
}

bool Ledger::operator==(const Ledger& other) const {
  return json().text(-1) == other.json().text(-1);
}

}  // namespace terracast::core
