#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/json.h"
#include "tests/jobs/job.h"

/// Jobs that are drawn by seed, run by the program, and spoilt.
namespace terracast::test {

/// How a corrupted dataset was judged.
enum class Outcome {
  Found,      ///< and not named as something else alone
  Otherwise,  ///< and named as something else alone
  Below,      ///< not found, and smaller than what the report says that it sees
  Unseen,     ///< not found, and a check that is for it says that it saw nothing
  Missed
};

/// A mistake in one of a job's datasets, and how it was judged.
struct Spoiling {
  std::string kind;
  std::string format;
  double size = 0.0;  ///< in the kind's unit; of one without a size 0
  Outcome outcome = Outcome::Missed;
  bool is_named = false;
  std::string words;  ///< of the causes that the report names, and of what it says that it sees
  std::vector<std::string> failed;  ///< checks that call it wrong
};

/// What came of one job.
struct TriedJob {
  std::uint64_t seed = 0;
  JobExtent extent = JobExtent::Small;
  bool is_refused = false;  ///< by the program, for example because the flight meets the ground
  std::vector<std::string> formats;  ///< of its datasets
  std::vector<std::string>
      called_wrong;  ///< results that call a right dataset wrong; a status that is none
  std::vector<Spoiling> spoilings;

  core::Json json() const;
  static TriedJob of(const core::Json& json);
};

/// How many of a job's mistakes are made.
enum class Ways {
  None,
  One,  ///< which, by the seed
  All   ///< each in one of the formats
};

/// Whether a job of less than the whole extent is drawn for this seed.
bool has_job(std::uint64_t seed);

/// Runs a job of has_job(), and spoils it. What is missed is copied to the folder TERRACAST_JOBS_KEEP, if that is set.
TriedJob try_job(std::uint64_t seed, JobExtent extent, Ways ways);

}  // namespace terracast::test
