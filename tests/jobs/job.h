#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/jobs/worlds.h"

namespace terracast::test {

/// A file of a job: a section of its config, or an item of one of its lists.
struct JobFile {
  std::string name;  ///< "flight0.toml"
  std::string text;
};

/// A job that is drawn: right by construction, whatever the draws.
struct GeneratedJob {
  std::uint64_t seed = 0;
  const JobWorld* world = nullptr;
  std::vector<JobFile> files;
  std::string text;  ///< of the config: names the files, and world.toml for the world
  /// One row of a sweep: the keys that differ between jobs, and their values as TOML; @ stands for the job's folder.
  std::vector<std::string> keys, values;
};

/// How much a job renders. Jobs of one seed and different extents have the same world, but different images.
enum class JobExtent {
  Whole,
  Small,  ///< worlds of formulas alone, a tenth of the rays and ten frames at most: some seconds
  Quick   ///< the same, three hundredths of the rays and five frames at most
};

/// Which jobs may be drawn.
struct JobChoice {
  bool has_data =
      false;  ///< whether worlds of outside data may be drawn; the jobs of other worlds are the same either way
  JobExtent extent = JobExtent::Whole;
};

/// The job of a seed.
/// returns    one without a world where the seed's is none of the choice
GeneratedJob generate_job(std::uint64_t seed, const JobChoice& choice);

}  // namespace terracast::test
