#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "batch/plan.h"
#include "core/error.h"

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
  std::filesystem::path report_checksums(const PlannedRun& run, const std::string& format) const {
    return state() / "checksums" / "report" / run.name / (format + ".sha256");
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
  /// Renames what this attempt made, a file or a folder, to its final place. What a twin has put there,
  /// or what was found wanting, vanishes; on a file system that can exchange two names there is no
  /// moment without either.
  /// throws Io
  void place(const std::filesystem::path& made, const std::filesystem::path& final_place);
  /// The same of a small text.
  void place_text(std::string_view text, const std::filesystem::path& final_place);
  /// Takes something out of its place, to vanish with this attempt; nothing where there is nothing.
  /// throws Io
  void take_away(const std::filesystem::path& place);

 private:
  std::filesystem::path new_name();

  std::filesystem::path folder_;
  int num_names_ = 0;
};

/// Whether an error of data or disk tells of something below a folder, in its message or context.
bool tells_of(const core::Error& error, const std::filesystem::path& folder);

/// Removes the attempts of processes that have ended, and of other machines' when they are older
/// than a day by the file system's time and nothing was written in them since.
void remove_ended_attempts(const JobFolder& job);

}  // namespace terracast::batch
