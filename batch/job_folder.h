#pragma once

#include <filesystem>
#include <string>

#include "batch/plan.h"

namespace terracast::batch {

/// Where a batch keeps its things, of one revision of its plan.
struct JobFolder {
  std::filesystem::path root;
  int revision = 1;

  /// The store of a run's world, whose tiles are a link to those that all runs of it share.
  std::filesystem::path world(const std::string& key, const PlannedRun& run) const {
    return root / "world" / key / run.name;
  }
  std::filesystem::path tiles(const std::string& key) const {
    return root / "world" / key / "tiles";
  }
  /// Captures of a run under whatever inputs it had in the plan's revisions.
  std::filesystem::path captures_of_all(const PlannedRun& run) const {
    return root / "capture" / run.name;
  }
  std::filesystem::path captures(const PlannedRun& run) const {
    return captures_of_all(run) / run.key.substr(0, 12);
  }
  std::filesystem::path dataset() const { return root / "dataset"; }
  /// A run in a format, relative to the dataset's folder.
  static std::filesystem::path exported(const PlannedRun& run, const std::string& format) {
    return std::filesystem::path(format) / run.name;
  }
  /// Of one revision: what a worker of an older one exports late is found to be another's.
  std::filesystem::path checksums(const PlannedRun& run, const std::string& format) const {
    return state() / "checksums" / format / (run.name + ".sha256");
  }
  std::filesystem::path report(const PlannedRun& run, const std::string& format) const {
    return root / "report" / run.name / format;
  }
  /// Claims and records.
  std::filesystem::path state() const;
  /// What the merge is told of a sequence.
  std::filesystem::path summary(const PlannedRun& run, const std::string& sequence) const {
    return root / "summary" / run.name / run.key.substr(0, 12) / (sequence + ".json");
  }
  std::filesystem::path attempts() const { return root / "attempts"; }
  std::filesystem::path logs() const { return root / "logs"; }
};

/// A folder of one try at something, which is put in place as a whole or vanishes with the try.
/// threads   one at a time
class Attempt {
 public:
  explicit Attempt(const JobFolder& job);
  ~Attempt();
  Attempt(const Attempt&) = delete;
  Attempt& operator=(const Attempt&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  /// Renames what this attempt made to its final place. What a twin has put there, or what was found
  /// wanting, makes room and vanishes.
  /// throws Io
  void place(const std::filesystem::path& made, const std::filesystem::path& final_place);

 private:
  std::filesystem::path folder_;
};

/// Removes the attempts of processes that have ended, and of other machines' when they are older
/// than a day.
void remove_ended_attempts(const JobFolder& job);

}  // namespace terracast::batch
