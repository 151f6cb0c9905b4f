#include "tests/verdict/tried_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "core/error.h"
#include "tests/jobs/written_job.h"
#include "tests/support/listed_files.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/verdict/corruptions.h"

namespace terracast::test {

namespace {

namespace fs = std::filesystem;

/// Runs the job in a folder.
/// returns  with its datasets in folder/run/export and their reports in folder/run/report
TriedJob run_job(std::uint64_t seed, JobExtent extent, const fs::path& folder) {
  TriedJob tried;
  tried.seed = seed;
  tried.extent = extent;
  const GeneratedJob job = generate_job(seed, {.has_data = false, .extent = extent});
  write_world(*job.world, folder, TERRACAST_SOURCE_DIR "/configs");
  write_job(job, folder, "");
  const fs::path out = folder / "run";
  const ProgramResult run = run_program({"run", (folder / folder_name(seed) / "job.toml").string(),
                                         "--out", out.string(), "--quiet"});
  constexpr int kCalledWrong = 1, kRefused = 2, kNoGround = 3;
  if (run.status == kRefused || (run.status == kNoGround && !fs::exists(out / "export"))) {
    tried.is_refused = true;
    return tried;
  }
  if (run.status == kCalledWrong) {
    const core::Json report = core::Json::read(out / "report/report.json");
    const core::Json& checks = report.at("checks");
    for (std::size_t i = 0; i < checks.size(); ++i)
      if (!checks.at(i).at("ok").boolean())
        tried.called_wrong.push_back(fmt::format("{}: {}", checks.at(i).at("name").string(),
                                                 checks.at(i).at("worst").string()));
  } else if (run.status != 0) {
    tried.called_wrong.push_back(fmt::format("status {}: {}", run.status, run.output));
  }
  fs::remove_all(out / "world");
  fs::remove_all(out / "capture");
  if (!fs::exists(out / "export")) return tried;
  for (const auto& entry : fs::directory_iterator(out / "export"))
    tried.formats.push_back(entry.path().filename().string());
  std::sort(tried.formats.begin(), tried.formats.end());
  return tried;
}

/// From what size on a report sees a mistake, by the results that measure it; nothing where none of them does.
std::optional<double> visible_size(const Corruption& corruption, const core::Json& checks) {
  std::optional<double> least;
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const core::Json& check = checks.at(i);
    const auto& measures = corruption.measures;
    if (check.at("skipped").boolean() ||
        std::find(measures.begin(), measures.end(), check.at("name").string()) == measures.end())
      continue;
    // Beside a bound of 0 everything shows.
    const double size = check.has("smallest") ? check.at("smallest").number() : 0.0;
    least = std::min(least.value_or(size), size);
  }
  return least;
}

core::Json report_of(const fs::path& dataset, const fs::path& folder) {
  const ProgramResult run =
      run_program({"validate", dataset.string(), "--report", folder.string(), "--quiet"});
  if (run.status != 0 && run.status != 1)
    throw core::Error(core::ErrorKind::Internal,
                      fmt::format("status {}: {}", run.status, run.output));
  return core::Json::read(folder / "report.json");
}

bool is_one_of(const std::string& name, const std::vector<std::string>& names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Whether one of the checks that are for a mistake says that the dataset, or a camera of it, could not show it.
bool is_unseen(const Corruption& corruption, const core::Json& report) {
  const std::vector<std::string> unseen = report.at("unseen").strings();
  const core::Json& checks = report.at("checks");
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const std::string& name = checks.at(i).at("name").string();
    if (is_one_of(name, corruption.checks) &&
        (is_one_of(name, unseen) || checks.at(i).has("unseen_parts")))
      return true;
  }
  return false;
}

/// right, wrong  reports on the dataset before and after
void judge(Spoiling& spoiling, const Corruption& corruption, const core::Json& right,
           const core::Json& wrong) {
  const core::Json& causes = wrong.at("causes");
  for (std::size_t i = 0; i < causes.size(); ++i) {
    // A file that does not hold what it should is named with its row or pixel, whatever spoilt it.
    const std::string& name = causes.at(i).at("name").string();
    spoiling.is_named |= name == "file_damaged" || is_one_of(name, corruption.causes);
    spoiling.words += causes.at(i).at("words").string() + "; ";
  }
  if (!wrong.at("ok").boolean()) {
    const core::Json& checks = wrong.at("checks");
    for (std::size_t i = 0; i < checks.size(); ++i)
      if (!checks.at(i).at("ok").boolean())
        spoiling.failed.push_back(checks.at(i).at("name").string());
    spoiling.outcome =
        spoiling.is_named || causes.size() == 0 ? Outcome::Found : Outcome::Otherwise;
    return;
  }
  if (corruption.unit.empty()) {
    spoiling.outcome = is_unseen(corruption, wrong) ? Outcome::Unseen : Outcome::Missed;
    return;
  }
  const std::optional<double> visible = visible_size(corruption, right.at("checks"));
  spoiling.outcome = !visible                       ? Outcome::Unseen
                     : spoiling.size <= *visible    ? Outcome::Below
                     : is_unseen(corruption, wrong) ? Outcome::Unseen
                                                    : Outcome::Missed;
  if (visible) spoiling.words += fmt::format("visible from {:.3g} {}", *visible, corruption.unit);
}

/// Copies what was missed or called something else, for a closer look.
void keep(const fs::path& dataset, const std::string& name) {
  const char* folder = std::getenv("TERRACAST_JOBS_KEEP");
  if (folder == nullptr) return;
  fs::create_directories(folder);
  fs::copy(dataset, fs::path(folder) / name,
           fs::copy_options::recursive | fs::copy_options::overwrite_existing);
}

/// Spoils one of the datasets in one way.
/// folder   of run_job()
/// returns  nothing where the format holds nothing of the kind
std::optional<Spoiling> spoil(const TriedJob& job, const fs::path& folder,
                              const std::string& format, const Corruption& corruption) {
  const fs::path spoilt = folder / "spoilt", report = folder / "report";
  fs::remove_all(spoilt);
  fs::remove_all(report);
  fs::copy(folder / "run/export" / format, spoilt, fs::copy_options::recursive);
  Spoiling spoiling;
  spoiling.kind = corruption.name;
  spoiling.format = format;
  if (!corruption.unit.empty())
    spoiling.size =
        Draws(job.seed, corruption.name + " size").log_between(corruption.least, corruption.most);
  Draws draws(job.seed, corruption.name);
  if (!corruption.corrupt(spoilt, draws, spoiling.size)) return std::nullopt;
  list_files_again(spoilt);
  judge(spoiling, corruption, core::Json::read(folder / "run/report" / format / "report.json"),
        report_of(spoilt, report));
  if (spoiling.outcome == Outcome::Missed || spoiling.outcome == Outcome::Otherwise)
    keep(spoilt, fmt::format("{}-{}-{}", job.seed, format, corruption.name));
  return spoiling;
}

}  // namespace

bool has_job(std::uint64_t seed) {
  return generate_job(seed, {.has_data = false, .extent = JobExtent::Small}).world != nullptr;
}

TriedJob try_job(std::uint64_t seed, JobExtent extent, Ways ways) {
  const ScratchFolder scratch;
  TriedJob job = run_job(seed, extent, scratch.path());
  if (ways == Ways::None || job.formats.empty()) return job;
  const std::vector<Corruption>& list = corruptions();
  const std::size_t num_formats = job.formats.size();
  // Those after the first make the mistake in another format, or another mistake, where the first has nothing of its kind.
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::size_t turn = job.seed + i;
    const std::size_t index = ways == Ways::All ? i : (job.seed / num_formats + i) % list.size();
    const std::optional<Spoiling> spoiling =
        spoil(job, scratch.path(), job.formats[turn % num_formats], list[index]);
    if (spoiling) job.spoilings.push_back(*spoiling);
    if (spoiling && ways == Ways::One) break;
  }
  return job;
}

core::Json TriedJob::json() const {
  core::Json spoilt = core::Json::array();
  for (const Spoiling& one : spoilings)
    spoilt.push(core::Json::object()
                    .set("kind", one.kind)
                    .set("format", one.format)
                    .set("size", one.size)
                    .set("outcome", static_cast<int>(one.outcome))
                    .set("named", one.is_named)
                    .set("words", one.words)
                    .set("failed", core::Json::array_of(one.failed)));
  return core::Json::object()
      .set("seed", seed)
      .set("quick", extent == JobExtent::Quick)
      .set("refused", is_refused)
      .set("formats", core::Json::array_of(formats))
      .set("called_wrong", core::Json::array_of(called_wrong))
      .set("spoilt", std::move(spoilt));
}

TriedJob TriedJob::of(const core::Json& json) {
  TriedJob job;
  job.seed = static_cast<std::uint64_t>(json.at("seed").integer());
  job.extent = json.at("quick").boolean() ? JobExtent::Quick : JobExtent::Small;
  job.is_refused = json.at("refused").boolean();
  job.formats = json.at("formats").strings();
  job.called_wrong = json.at("called_wrong").strings();
  const core::Json& spoilt = json.at("spoilt");
  for (std::size_t i = 0; i < spoilt.size(); ++i)
    job.spoilings.push_back({.kind = spoilt.at(i).at("kind").string(),
                             .format = spoilt.at(i).at("format").string(),
                             .size = spoilt.at(i).at("size").number(),
                             .outcome = static_cast<Outcome>(spoilt.at(i).at("outcome").integer()),
                             .is_named = spoilt.at(i).at("named").boolean(),
                             .words = spoilt.at(i).at("words").string(),
                             .failed = spoilt.at(i).at("failed").strings()});
  return job;
}

}  // namespace terracast::test
