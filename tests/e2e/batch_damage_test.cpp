#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "core/random.h"
#include "tests/e2e/batch_job.h"
#include "tests/support/record.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// What becomes of a damaged file.
enum class Fate {
  Mended,    ///< the next run makes it again, or never needs it
  Refused,   ///< the next run names it, and what has it made again
  Restored,  ///< the next run names it; the user has to bring it back
  Noticed,   ///< nothing is left to run; `batch verify` names it, and has it made again
};

struct Case {
  const char* kind;
  std::size_t num_stages;  ///< that are done when it is damaged
  Fate fate;
};
constexpr Case kCases[] = {
    {"plan", 1, Fate::Restored},
    {"world inputs", 1, Fate::Mended},
    {"tile", 1, Fate::Mended},
    {"world manifest", 1, Fate::Mended},
    {"world manifest", 3, Fate::Mended},
    {"sequence", 2, Fate::Mended},
    {"tracks", 2, Fate::Mended},
    {"frame record", 2, Fate::Mended},
    {"colour image", 2, Fate::Mended},
    {"facts", 2, Fate::Mended},
    {"capture manifest", 2, Fate::Mended},
    {"tile", 5, Fate::Noticed},
    {"frame record", 5, Fate::Noticed},
    {"colour image", 5, Fate::Noticed},
    {"facts", 5, Fate::Noticed},
    {"exported file", 3, Fate::Refused},
    {"exported file", 5, Fate::Noticed},
    {"summary", 4, Fate::Refused},
    {"summary", 5, Fate::Noticed},
    {"run checksums", 4, Fate::Refused},
    {"run checksums", 5, Fate::Noticed},
    {"report", 5, Fate::Noticed},
    {"report checksums", 5, Fate::Noticed},
    {"SHA256SUMS", 5, Fate::Noticed},
    {"done record", 5, Fate::Noticed},
};

ProgramResult run_batch(const fs::path& job) {
  return run_program({"batch", "run", job.string(), "--max-tries", "2", "-q"});
}
ProgramResult verify_batch(const fs::path& job, bool is_repaired) {
  std::vector<std::string> arguments = {"batch", "verify", job.string(), "--samples", "0", "-q"};
  if (is_repaired) arguments.emplace_back("--repair");
  return run_program(arguments);
}

void expect_complete(const fs::path& job, const fs::path& complete) {
  for (const std::string& fault : faults_of_complete_job(job, complete)) ADD_FAILURE() << fault;
}

/// The record of a shard is there or not: a run that finds none does the shard again.
Fate fate_of(const Case& each, Damage damage) {
  const bool is_record = std::string(each.kind) == "done record";
  return is_record && damage == Damage::Delete ? Fate::Mended : each.fate;
}

void try_damage(const Case& each, Damage damage, std::uint64_t random,
                const BatchSnapshots& snapshots, const fs::path& job) {
  copy_job(snapshots.after(each.num_stages), job);
  const auto& kinds = kinds_of_job_files();
  const auto kind = std::find_if(kinds.begin(), kinds.end(),
                                 [&](const JobFiles& files) { return files.name == each.kind; });
  ASSERT_NE(kind, kinds.end());
  const std::vector<std::string> files = job_files(job, *kind);
  ASSERT_FALSE(files.empty());
  const std::string file = files[random % files.size()];
  ASSERT_TRUE(do_damage(job / file, damage, core::mix_bits(random)));
  SCOPED_TRACE(fmt::format("{} after {} stages, {}: {} ({})", each.kind, each.num_stages,
                           damage_name(damage), file, random));
  const auto run = run_batch(job);
  switch (fate_of(each, damage)) {
    case Fate::Mended:
      EXPECT_EQ(run.status, 0) << run.output;
      break;
    case Fate::Restored:
      EXPECT_EQ(run.status, damage == Damage::Delete ? 4 : 3) << run.output;
      EXPECT_THAT(run.output, HasSubstr((job / file).string()));
      fs::copy_file(snapshots.after(0) / file, job / file, fs::copy_options::overwrite_existing);
      EXPECT_EQ(run_batch(job).status, 0);
      break;
    case Fate::Refused:
      EXPECT_EQ(run.status, 1) << run.output;
      EXPECT_THAT(run.output, HasSubstr("terracast batch verify " + job.string() + " --repair"));
      EXPECT_EQ(verify_batch(job, true).status, 1);
      EXPECT_EQ(run_batch(job).status, 0);
      break;
    case Fate::Noticed: {
      EXPECT_EQ(run.status, 0) << run.output;
      const auto noticed = verify_batch(job, false);
      EXPECT_EQ(noticed.status, 1) << noticed.output;
      // Checksums that changed accuse what they are of.
      EXPECT_THAT(noticed.output, testing::AnyOf(HasSubstr((job / file).string()),
                                                 HasSubstr((job / "dataset").string()),
                                                 HasSubstr((job / "report").string())));
      EXPECT_EQ(verify_batch(job, true).status, 1);
      EXPECT_EQ(run_batch(job).status, 0);
      break;
    }
  }
  // A tile that no later stage reads is mended when it is looked for.
  if (std::string(each.kind) == "tile" && verify_batch(job, true).status != 0) {
    EXPECT_EQ(run_batch(job).status, 0);
  }
  EXPECT_EQ(verify_batch(job, false).status, 0);
  expect_complete(job, snapshots.complete());
}

// Every case in every way in a recorded run; else every third, each fate among them, in one way that the seed chooses.
TEST(BatchDamage, WhateverFileIsDamagedIsMadeAgainOrNamed) {
  const char* given = std::getenv("TERRACAST_CHAOS_SEED");
  const std::uint64_t seed = given != nullptr ? std::strtoull(given, nullptr, 10) : 1;
  std::cout << "TERRACAST_CHAOS_SEED=" << seed << "\n";
  const ScratchFolder scratch;
  const BatchSnapshots snapshots;
  ASSERT_FALSE(testing::Test::HasFailure());
  std::uint64_t number = 0;
  for (const Case& each : kCases) {
    const std::uint64_t random = core::random_bits(seed, 1, number++);
    if (number % 3 != 1 && !is_recorded_run()) continue;
    for (const Damage damage : kDamages) {
      const bool is_chosen = random / 4 % 4 == static_cast<std::uint64_t>(damage);
      if (!is_chosen && !is_recorded_run()) continue;
      const fs::path job = scratch / "job";
      try_damage(each, damage, random, snapshots, job);
      fs::remove_all(job);
    }
  }
}

}  // namespace
}  // namespace terracast::test
