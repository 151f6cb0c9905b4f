#include "rigs/key_record.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/printable.h"

namespace terracast::rigs {
namespace {

bool is_item(std::string_view step) { return step.starts_with('[') && step.ends_with(']'); }

bool is_digit(char letter) { return letter >= '0' && letter <= '9'; }

}  // namespace

void KeyRecord::open(const Path& map, const std::vector<std::string>& keys,
                     const std::string& where) {
  if (!maps_.emplace(map, keys).second) return;
  std::set<std::string_view> seen;
  for (const std::string& key : keys)
    if (!seen.insert(key).second)
      core::fail(core::ErrorKind::Input,
                 "{}: the key {} stands twice, and one of the two would be lost; leave one out",
                 where, core::printable(key));
}

void KeyRecord::leave_out(const Path& key, const std::string& part, const std::string& why) {
  parts_[key].emplace_back(part, why);
}

void KeyRecord::misunderstand(const Path& key, const std::string& value) {
  misunderstood_[key].push_back(value);
}

std::string KeyRecord::name_of(const Path& path) {
  std::string name;
  for (const std::string& step : path) {
    if (is_item(step))
      name += "[]";
    else
      name += (name.empty() ? "" : ".") + step;
  }
  return name;
}

std::string KeyRecord::numbered_name_of(const Path& path) {
  if (path.empty()) return {};
  Path numbered = path;
  std::string& first = numbered.front();
  const auto begin = std::find_if(first.begin(), first.end(), is_digit);
  if (begin != first.end())
    first.replace(begin, std::find_if_not(begin, first.end(), is_digit), "N");
  return name_of(numbered);
}

core::Ledger KeyRecord::ledger(std::span<const core::KnownName> known,
                               std::string (*name)(const Path&)) const {
  core::Ledger ledger;
  for (const auto& [map, keys] : maps_) {
    for (const std::string& key : keys) {
      Path path = map;
      path.push_back(key);
      const std::string named = name(path);
      const core::KnownName* found = core::find_known(known, named);
      if (const auto passed = passed_over_.find(path); passed != passed_over_.end())
        ledger.ignore(named, passed->second);
      else if (taken_.contains(path))
        ledger.use(named);
      else if (found != nullptr && found->is_used)
        ledger.ignore(named, "not needed beside what else the file says");
      else
        ledger.count(named, known);
    }
  }
  for (const auto& [path, parts] : parts_)
    for (const auto& [part, why] : parts)
      ledger.ignore(fmt::format("{}: {}", name(path), part), why);
  for (const auto& [path, values] : misunderstood_)
    for (const std::string& value : values) ledger.misunderstand(name(path), value);
  return ledger;
}

}  // namespace terracast::rigs
