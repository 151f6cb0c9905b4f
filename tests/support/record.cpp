#include "tests/support/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>

#include "core/atomic_file.h"
#include "core/json.h"

namespace terracast::test {

namespace fs = std::filesystem;

std::optional<fs::path> record_folder() {
  const char* folder = std::getenv("TERRACAST_RECORD");
  if (folder == nullptr || *folder == '\0') return std::nullopt;
  return fs::path(folder);
}

bool is_recorded_run() { return std::getenv("TERRACAST_FULL") != nullptr; }

void record(const std::string& kind, const std::string& name, const std::string& text) {
  const std::optional<fs::path> folder = record_folder();
  if (!folder) return;
  fs::create_directories(*folder / kind);
  core::write_file(*folder / kind / (name + ".md"), text + "\n");
}

void record_report(const std::string& name, const fs::path& report) {
  const std::optional<fs::path> folder = record_folder();
  if (!folder) return;
  const fs::path kept = *folder / "reports" / name;
  fs::remove_all(kept);
  fs::create_directories(kept);
  for (auto entry = fs::recursive_directory_iterator(report);
       entry != fs::recursive_directory_iterator(); ++entry) {
    // The folder that COLMAP worked in is large, and no report.
    if (entry->is_directory() && entry->path().filename() == "colmap" &&
        !fs::exists(entry->path() / "index.html")) {
      entry.disable_recursion_pending();
      continue;
    }
    const fs::path target = kept / fs::relative(entry->path(), report);
    if (entry->is_directory())
      fs::create_directories(target);
    else
      fs::copy_file(entry->path(), target);
  }
}

void record_job(const std::string& name, const fs::path& out) {
  const std::optional<fs::path> folder = record_folder();
  if (!folder) return;
  record_report(name, out / "report");

  struct Stage {
    double wall_s = 0.0, cpu_s = 0.0;
  };
  std::map<std::string, Stage> stages;
  double peak_bytes = 0.0;
  std::ifstream events(out / "events.jsonl");
  for (std::string line; std::getline(events, line);) {
    const core::Json event = core::Json::parse(line, "events.jsonl");
    if (event.at("what").string() != "stage") continue;
    Stage& stage = stages[event.at("stage").string()];
    stage.wall_s += event.at("wall_s").number();
    stage.cpu_s += event.at("cpu_s").number();
    peak_bytes = std::max(peak_bytes, event.at("peak_bytes").number());
  }
  std::string row = fmt::format("| {} ", name);
  for (const char* stage : {"tile", "render", "export", "validate"})
    row += fmt::format("| {:.0f} s, {:.0f} s ", stages[stage].wall_s, stages[stage].cpu_s);
  row += fmt::format("| {:.2f} GB ", 1e-9 * peak_bytes);

  const core::Json report = core::Json::read(out / "report/report.json");
  std::size_t num_measured = 0, num_unseen = 0, num_failed = 0;
  double largest_share = 0.0;
  std::string nearest;
  for (std::size_t i = 0; i < report.at("checks").size(); ++i) {
    const core::Json& check = report.at("checks").at(i);
    if (check.at("unseen").boolean()) ++num_unseen;
    if (check.at("skipped").boolean()) continue;
    ++num_measured;
    if (!check.at("ok").boolean()) ++num_failed;
    const double value = check.at("value").number(), bound = check.at("bound").number();
    if (bound <= 0.0 || value <= 0.0) continue;
    const double share = check.at("lower_bound").boolean() ? bound / value : value / bound;
    if (share >= largest_share) {
      largest_share = share;
      nearest = check.at("name").string();
    }
  }
  row +=
      fmt::format("| {} hold, {} fail, {} unseen | {:.0f} % of `{}` |", num_measured - num_failed,
                  num_failed, num_unseen, 100.0 * largest_share, nearest);
  record("jobs", name, row);
}

void record_results(const std::string& kind, const std::string& name, const fs::path& report,
                    const std::vector<std::string>& prefixes) {
  std::string rows;
  const core::Json checks = core::Json::read(report / "report.json").at("checks");
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const core::Json& check = checks.at(i);
    const std::string& result = check.at("name").string();
    const bool is_wanted =
        std::any_of(prefixes.begin(), prefixes.end(),
                    [&](const std::string& prefix) { return result.starts_with(prefix); });
    if (!is_wanted || check.at("skipped").boolean()) continue;
    rows += fmt::format("{}| {}: {} | {:.4g} | {} {:.4g} {} |", rows.empty() ? "" : "\n", name,
                        result, check.at("value").number(),
                        check.at("lower_bound").boolean() ? "at least" : "at most",
                        check.at("bound").number(), check.at("unit").string());
  }
  record(kind, name, rows);
}

}  // namespace terracast::test
