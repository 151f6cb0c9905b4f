// Jobs drawn by seed: the right ones are not called wrong, and of each a spoilt one is. Every commit draws others; the
// test says which, and TERRACAST_JOBS_FIRST=N draws those from seed N again.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/jobs/written_job.h"
#include "tests/support/listed_files.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/verdict/corruptions.h"

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
  return count == nullptr ? 6 : std::stoull(count);
}

/// What a report says is wrong, and what it has not seen.
struct Verdict {
  bool is_ok = false;
  std::vector<std::string> wrong, unseen;

  explicit Verdict(const fs::path& report_folder) {
    const core::Json report = core::Json::read(report_folder / "report.json");
    is_ok = report.at("ok").boolean();
    unseen = report.at("unseen").strings();
    const core::Json& checks = report.at("checks");
    for (std::size_t i = 0; i < checks.size(); ++i)
      if (!checks.at(i).at("ok").boolean())
        wrong.push_back(fmt::format("{}: {}", checks.at(i).at("name").string(),
                                    checks.at(i).at("worst").string()));
  }
};

/// A job that ran, with its exports.
struct RightJob {
  std::uint64_t seed = 0;
  fs::path folder;
};

/// As many as are asked for, run once for all tests; the world is given up when a job is done.
struct RightJobs {
  ScratchFolder scratch;
  std::vector<RightJob> jobs;
  std::vector<std::string> called_wrong;
  std::size_t num_refused = 0;
  std::uint64_t first = first_seed();

  RightJobs() {
    for (std::uint64_t seed = first; jobs.size() < num_jobs() && num_refused < num_jobs(); ++seed) {
      const GeneratedJob job = generate_job(seed, {.has_data = false, .is_small = true});
      if (job.world == nullptr) continue;
      write_world(*job.world, scratch / "jobs", TERRACAST_SOURCE_DIR "/configs");
      write_job(job, scratch / "jobs", "");
      const fs::path folder = scratch / fmt::format("{}", seed);
      const ProgramResult run =
          run_program({"run", (scratch / "jobs" / folder_name(seed) / "job.toml").string(), "--out",
                       folder.string(), "--quiet"});
      constexpr int kCalledWrong = 1, kRefused = 2;
      if (run.status == kRefused) {
        ++num_refused;  // as a flight that its ground is in the way of
        continue;
      }
      if (run.status == kCalledWrong)
        for (const std::string& wrong : Verdict(folder / "report").wrong)
          called_wrong.push_back(fmt::format("seed {}: {}", seed, wrong));
      else if (run.status != 0)
        called_wrong.push_back(fmt::format("seed {}: status {}: {}", seed, run.status, run.output));
      fs::remove_all(folder / "world");
      fs::remove_all(folder / "capture");
      jobs.push_back({seed, folder});
    }
  }
};

const RightJobs& right_jobs() {
  static const RightJobs jobs;
  return jobs;
}

std::vector<fs::path> exports_of(const RightJob& job) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(job.folder / "export"))
    folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  return folders;
}

std::string stem(std::string check) {
  if (const std::size_t slash = check.rfind('/'); slash != std::string::npos)
    check.erase(0, slash + 1);
  return check;
}

TEST(GeneratedJobs, ThatAreRightAreNotCalledWrong) {
  const RightJobs& all = right_jobs();
  RecordProperty("first", std::to_string(all.first));
  for (const std::string& wrong : all.called_wrong)
    ADD_FAILURE() << wrong << "\nagain: TERRACAST_JOBS_FIRST=" << all.first;
  EXPECT_EQ(all.jobs.size(), num_jobs()) << all.num_refused << " were refused";
}

TEST(GeneratedJobs, ThatAreSpoiltAreCalledWrong) {
  const RightJobs& all = right_jobs();
  std::size_t num_found = 0, num_unseen = 0;
  for (const RightJob& job : all.jobs) {
    const std::vector<fs::path> folders = exports_of(job);
    const fs::path& right = folders[job.seed % folders.size()];
    SCOPED_TRACE(fmt::format("TERRACAST_JOBS_FIRST={} ({})", job.seed, right.filename().string()));
    const ScratchFolder scratch;
    const fs::path spoilt = scratch / "spoilt";
    fs::copy(right, spoilt, fs::copy_options::recursive);
    const std::vector<Corruption>& list = corruptions();
    std::size_t index = job.seed / folders.size() % list.size();
    while (!list[index].corrupt(spoilt, job.seed)) index = (index + 1) % list.size();
    list_files_again(spoilt);
    const ProgramResult run = run_program(
        {"validate", spoilt.string(), "--report", (scratch / "report").string(), "--quiet"});
    ASSERT_TRUE(run.status == 0 || run.status == 1) << list[index].name << run.output;
    const Verdict verdict(scratch / "report");
    if (!verdict.is_ok) {
      ++num_found;
      continue;
    }
    // What was not found was not to be seen, and the report says so.
    ++num_unseen;
    const bool is_said =
        std::any_of(verdict.unseen.begin(), verdict.unseen.end(), [&](const std::string& name) {
          return std::find(list[index].checks.begin(), list[index].checks.end(), stem(name)) !=
                 list[index].checks.end();
        });
    EXPECT_TRUE(is_said) << list[index].name;
  }
  // Most datasets show such mistakes.
  EXPECT_GE(num_found, 2 * num_unseen);
}

}  // namespace
}  // namespace terracast::test
