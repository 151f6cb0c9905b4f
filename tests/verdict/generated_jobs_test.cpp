// Jobs drawn by seed: the right ones are not called wrong, and of each a spoilt one is. Every commit draws others; the
// test says which, and TERRACAST_JOBS_FIRST=N draws those from seed N again.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/json.h"
#include "tests/support/record.h"
#include "tests/support/run_program.h"
#include "tests/verdict/corruptions.h"
#include "tests/verdict/tried_job.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;

/// The seed of the first job: by the environment, or else by the commit that is tested.
std::uint64_t first_seed() {
  if (const char* first = std::getenv("TERRACAST_JOBS_FIRST")) return std::stoull(first);
  const ProgramResult head =
      run_command("/usr/bin/git", {"-C", TERRACAST_SOURCE_DIR, "rev-parse", "HEAD"});
  constexpr std::size_t kDigits = 7;
  if (head.status != 0 || head.output.size() < kDigits) return 1;
  return std::stoull(head.output.substr(0, kDigits), nullptr, 16);
}

std::size_t num_jobs() {
  const char* count = std::getenv("TERRACAST_JOBS_COUNT");
  return count == nullptr ? 30 : std::stoull(count);
}

/// A job of a recorded run: as it was kept by one that was cut off, or tried and kept. Half of them are quick, and half are
/// spoilt in every way.
TriedJob kept_job(std::uint64_t seed, const fs::path& folder) {
  const fs::path file = folder / fmt::format("{:010}.json", seed);
  if (fs::exists(file)) return TriedJob::of(core::Json::read(file));
  const TriedJob job = try_job(seed, seed % 2 == 0 ? JobExtent::Small : JobExtent::Quick,
                               seed % 4 < 2 ? Ways::One : Ways::All);
  fs::create_directories(folder);
  job.json().write(file);
  return job;
}

/// As many as are asked for, run once for all tests; of a recorded run besides all that it has kept.
struct TriedJobs {
  std::vector<TriedJob> jobs;
  std::uint64_t first = first_seed();
  std::size_t num_refused = 0;

  TriedJobs() {
    const auto folder = record_folder();
    for (std::uint64_t seed = first; jobs.size() < num_jobs() && num_refused < num_jobs(); ++seed) {
      if (!has_job(seed)) continue;
      const TriedJob job =
          folder ? kept_job(seed, *folder / "tried") : try_job(seed, JobExtent::Quick, Ways::One);
      if (job.is_refused)
        ++num_refused;
      else
        jobs.push_back(job);
    }
    if (!folder || !fs::exists(*folder / "tried")) return;
    jobs.clear();
    for (const auto& entry : fs::directory_iterator(*folder / "tried"))
      if (const TriedJob job = TriedJob::of(core::Json::read(entry.path())); !job.is_refused)
        jobs.push_back(job);
    std::sort(jobs.begin(), jobs.end(),
              [](const TriedJob& a, const TriedJob& b) { return a.seed < b.seed; });
  }
};

const TriedJobs& tried_jobs() {
  static const TriedJobs jobs;
  return jobs;
}

/// How a job is tried once more.
std::string again(const TriedJob& job) {
  return fmt::format("{}TERRACAST_JOBS_FIRST={} TERRACAST_JOBS_COUNT=1",
                     record_folder() ? "TERRACAST_RECORD=(a new folder) " : "", job.seed);
}

TEST(GeneratedJobs, ThatAreRightAreNotCalledWrong) {
  const TriedJobs& all = tried_jobs();
  RecordProperty("first", std::to_string(all.first));
  std::map<std::string, int> num_of_format;
  std::size_t num_datasets = 0, num_wrong = 0;
  for (const TriedJob& job : all.jobs) {
    for (const std::string& wrong : job.called_wrong)
      ADD_FAILURE() << "seed " << job.seed << ": " << wrong << "\nagain: " << again(job);
    num_wrong += job.called_wrong.empty() ? 0 : 1;
    num_datasets += job.formats.size();
    for (const std::string& format : job.formats) ++num_of_format[format];
  }
  EXPECT_GE(all.jobs.size(), num_jobs()) << all.num_refused << " were refused";
  std::string formats;
  for (const auto& [format, count] : num_of_format)
    formats += fmt::format("{}{} {}", formats.empty() ? "" : ", ", count, format);
  record("verdict", "right_jobs",
         fmt::format("{} right jobs with {} datasets ({}); jobs called wrong: {}.", all.jobs.size(),
                     num_datasets, formats, num_wrong));
}

/// Seeds of jobs that were called wrong once, and why.
constexpr std::uint64_t kCalledWrongOnce[] = {
    50032,     // three images of a point that six frames over a ramp show
    50118,     // three packets of a body that turns by a radian between them
    50497,     // two ties of sight in 9000
    50641,     // eight in 2000, of views that graze the ground
    50823,     // 64 blocks of 8 x 8 pixels
    50826,     // a plane, whose depths differ by rounding alone
    50902,     // a plane 3 m below, and poses of six decimals
    810040,    // a recorded flight that hovers, starts and stops
    800037,    // plants in haze, bluer than in any sun
    800378,    // smudges on a lens, which go along with the image
    90033,     // flow of 600 px, which PNG cannot hold
    86889586,  // an orthographic camera of 16 m beside one whose pixels are 300 m wide
    86889626,  // a camera a metre out on a body that creeps and turns
};

TEST(GeneratedJobs, ThatWereCalledWrongOnceAreNot) {
  // An ordinary run looks at two of them, others with every commit.
  const std::size_t step = is_recorded_run() ? 1 : std::size(kCalledWrongOnce) / 2;
  std::size_t num_run = 0;
  for (std::size_t i = is_recorded_run() ? 0 : first_seed() % step; i < std::size(kCalledWrongOnce);
       i += step) {
    const TriedJob job = try_job(kCalledWrongOnce[i], JobExtent::Small, Ways::None);
    num_run += job.is_refused ? 0 : 1;
    for (const std::string& wrong : job.called_wrong)
      ADD_FAILURE() << "seed " << job.seed << ": " << wrong;
  }
  EXPECT_GE(num_run, 2U);
}

/// Counts of outcomes by size.
class PowerCurve {
 public:
  void add(const Spoiling& spoilt) {
    Row& row = rows_[spoilt.size > 0.0 ? std::floor(2.0 * std::log10(spoilt.size)) : -100.0];
    ++row.num_all;
    row.num_named += spoilt.outcome == Outcome::Found && spoilt.is_named ? 1 : 0;
    ++row.num_of[static_cast<std::size_t>(spoilt.outcome)];
  }
  /// Rows of a table: a size's range, then how many were spoilt so, were found, of these named, named as something else, below what is seen, unseen,
  /// missed.
  std::string text(const Corruption& corruption) const {
    std::string text;
    for (const auto& [half_decade, row] : rows_) {
      const std::string range =
          corruption.unit.empty()
              ? ""
              : fmt::format("{:.2g} to {:.2g} {}", std::pow(10.0, 0.5 * half_decade),
                            std::pow(10.0, 0.5 * (half_decade + 1.0)), corruption.unit);
      text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", corruption.name,
                          range, row.num_all, row.num_of[0], row.num_named, row.num_of[1],
                          row.num_of[2], row.num_of[3], row.num_of[4]);
    }
    if (!text.empty()) text.pop_back();
    return text;
  }

 private:
  struct Row {
    int num_all = 0;
    int num_named = 0;
    std::array<int, 5> num_of{};
  };
  std::map<double, Row> rows_;
};

TEST(GeneratedJobs, ThatAreSpoiltAreCalledWrong) {
  const std::vector<Corruption>& list = corruptions();
  std::map<std::string, PowerCurve> curves;
  int num_found = 0, num_all = 0;
  for (const TriedJob& job : tried_jobs().jobs)
    for (const Spoiling& spoilt : job.spoilings) {
      curves[spoilt.kind].add(spoilt);
      ++num_all;
      num_found += spoilt.outcome <= Outcome::Otherwise ? 1 : 0;
      const std::string what = fmt::format("{} ({}): {}, {:.3g}; {}", again(job), spoilt.format,
                                           spoilt.kind, spoilt.size, spoilt.words);
      if (spoilt.outcome <= Outcome::Otherwise && !spoilt.is_named &&
          std::getenv("TERRACAST_SHOW_CAUSES") != nullptr)
        fmt::print("{}\n", what);
      EXPECT_NE(spoilt.outcome, Outcome::Missed) << what;
    }
  for (std::size_t i = 0; i < list.size(); ++i)
    if (const std::string rows = curves[list[i].name].text(list[i]); !rows.empty())
      record("power", fmt::format("{:02}", i), rows);
  // Two of three show such mistakes; sizes are drawn, and some are too small to be seen.
  EXPECT_GE(3 * num_found, num_all);
}

}  // namespace
}  // namespace terracast::test
