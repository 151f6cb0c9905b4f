#include "plugins/law_report.h"

#include <algorithm>
#include <utility>

namespace terracast::plugins {

void LawReport::begin(std::string_view law) {
  laws_.push_back({.law = std::string(law), .broken = {}});
  if (told_) told_(laws_.back());
}

void LawReport::broken(std::string what) {
  if (!holds()) return;
  laws_.back().broken = std::move(what);
  if (told_) told_(laws_.back());
}

bool LawReport::all_hold() const {
  return std::all_of(laws_.begin(), laws_.end(),
                     [](const LawTried& law) { return law.broken.empty(); });
}

std::string LawReport::text() const {
  std::string text;
  for (const LawTried& law : laws_)
    if (!law.broken.empty()) text += law.law + ": " + law.broken + "\n";
  return text;
}

}  // namespace terracast::plugins
