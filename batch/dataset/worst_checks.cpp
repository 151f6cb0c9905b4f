#include "batch/dataset/worst_checks.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "validate/check.h"

namespace terracast::batch {

std::vector<CheckFacts> worst_checks(std::vector<ValidationReport> reports) {
  std::sort(reports.begin(), reports.end(),
            [](const ValidationReport& a, const ValidationReport& b) {
              return std::tie(a.run, a.format) < std::tie(b.run, b.format);
            });
  struct Worst {
    CheckFacts facts;
    std::pair<bool, double> rank = {false, -1.0};  ///< whether it failed; share of the bound
  };
  std::map<std::string, Worst> by_name;
  for (const ValidationReport& report : reports) {
    const core::Json& checks = report.report.at("checks");
    for (std::size_t i = 0; i < checks.size(); ++i) {
      const core::Json& check = checks.at(i);
      const std::string& name = check.at("name").string();
      const bool is_ok = check.at("ok").boolean();
      Worst& worst = by_name[name];
      worst.facts.name = name;
      worst.facts.num_unseen += check.at("unseen").boolean() ? 1 : 0;
      worst.facts.num_failed += is_ok ? 0 : 1;
      if (check.at("skipped").boolean() && is_ok) continue;
      ++worst.facts.num_measured;
      const double value = check.at("value").number();
      const double bound = check.at("bound").number();
      const bool is_lower_bound = check.at("lower_bound").boolean();
      const std::pair<bool, double> rank = {!is_ok,
                                            validate::share_of_bound(value, bound, is_lower_bound)};
      if (rank <= worst.rank) continue;
      worst.rank = rank;
      worst.facts.unit = check.at("unit").string();
      worst.facts.value = value;
      worst.facts.bound = bound;
      worst.facts.is_lower_bound = is_lower_bound;
      worst.facts.run = report.run;
      worst.facts.format = report.format;
    }
  }
  std::vector<CheckFacts> result;
  for (auto& [name, worst] : by_name) result.push_back(std::move(worst.facts));
  return result;
}

}  // namespace terracast::batch
