#include <cmath>

#include "core/parallel.h"
#include "plugins/laws/laws.h"
#include "validate/dataset.h"

namespace terracast::plugins {
namespace {

using validate::CheckResult;

std::vector<CheckResult> run_check(const validate::CheckInfo& check,
                                   const validate::Dataset& dataset,
                                   const validate::Sequence& sequence) {
  validate::Findings findings;
  const auto checker = core::made(check.make({}), "check", check.name);
  validate::FrameWindow window(dataset, sequence, findings);
  while (window.advance()) checker->frame(window, window.pairs());
  return checker->finish(dataset, sequence);
}

std::string words_of(const CheckResult& result) {
  return fmt::format("{} is {:.6g} {} (bound {:.6g}): {}", result.name, result.value, result.unit,
                     result.bound, result.worst);
}

/// Whether two results say the same.
bool are_same(const CheckResult& a, const CheckResult& b) {
  return a.name == b.name && a.value == b.value && a.bound == b.bound && a.ok == b.ok &&
         a.skipped == b.skipped && a.worst == b.worst && a.summary == b.summary;
}

/// Results of one name are merged: a check's begin with the check's own, and none is another check's.
void try_names(const std::vector<CheckResult>& results, std::string_view check, LawReport& report) {
  report.begin("its results are called after it");
  const std::string_view own = check.substr(check.find('.') + 1);  // npos + 1 is 0
  for (const CheckResult& result : results) {
    report.expect(result.name.starts_with(check) || result.name.starts_with(own),
                  fmt::format("{}: begin with {} or {}", result.name, check, own));
    for (const validate::CheckInfo& other : validate::checks())
      report.expect(other.name == check || other.name != result.name,
                    fmt::format("{} is another check's name", result.name));
  }
}

void try_results(const std::vector<CheckResult>& results, const std::string& format,
                 LawReport& report) {
  report.begin("it has results for a dataset of " + format + ", each with a name and a bound");
  report.expect(!results.empty(), "there is none; what it cannot measure is a skipped result");
  for (const CheckResult& result : results) {
    report.expect(!result.name.empty(), "a result has no name");
    if (result.skipped) {
      report.expect(result.ok && !result.worst.empty(),
                    result.name + " is skipped, and not ok or without the reason why");
      continue;
    }
    report.expect(std::isfinite(result.value) && std::isfinite(result.bound), words_of(result));
    report.expect(result.ok == result.is_within_bound(),
                  words_of(result) + (result.ok ? ", and is called ok" : ", and is not called ok"));
  }
  report.begin("a right dataset of " + format + " is not called wrong");
  for (const CheckResult& result : results) report.expect(result.ok, words_of(result));
}

}  // namespace

void try_check(const validate::CheckInfo& check, const std::vector<std::filesystem::path>& datasets,
               LawReport& report) {
  for (const std::filesystem::path& folder : datasets) {
    report.begin("it reads a right dataset");
    validate::Findings findings;
    const validate::Dataset dataset = validate::read_dataset(folder, "", findings);
    for (const validate::Sequence& sequence : dataset.sequences) {
      const std::vector<CheckResult> results = run_check(check, dataset, sequence);
      if (check.name.find('.') != std::string_view::npos) try_names(results, check.name, report);
      try_results(results, dataset.format, report);
      report.begin("it says the same again, on one thread");
      const core::ThreadLimit limit(1);
      const std::vector<CheckResult> again = run_check(check, dataset, sequence);
      report.expect(again.size() == results.size(), "there are more or fewer results");
      for (std::size_t i = 0; i < std::min(again.size(), results.size()); ++i)
        report.expect(are_same(results[i], again[i]),
                      words_of(results[i]) + "; again: " + words_of(again[i]));
    }
  }
}

}  // namespace terracast::plugins
