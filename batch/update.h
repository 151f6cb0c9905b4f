#pragma once

#include <filesystem>
#include <vector>

#include "batch/job_folder.h"
#include "batch/plan.h"

namespace terracast::batch {

/// Whether a tile of a run's world is whole, but neither the one that was made nor one that the plan
/// knows: somebody has edited it since. False where no manifest tells.
/// cost   reads all tiles
bool has_unplanned_edits(const PlannedRun& run, const std::filesystem::path& store_folder);

/// Files of a run's planned edits that are damaged, missing, or others than planned. Nothing but the
/// user can make them again.
std::vector<std::filesystem::path> lost_edits(const PlannedRun& run,
                                              const std::filesystem::path& store_folder);
/// throws   Input: an edit is lost
void check_edits(const PlannedRun& run, const std::filesystem::path& store_folder);

/// The edits of a plan's runs as they stand now: those that it knows, and tiles whose files were
/// changed after the manifest of a run's world was written. They must be whole by their own checksum.
/// An edited tile whose file was removed is no edit any more.
/// cost     a look at the size and time of each tile
/// throws   Input: a tile is damaged
TileEdits find_edits(const Plan& plan, const JobFolder& folder);

/// What an update of a plan leaves to do.
struct Update {
  std::int64_t num_kept = 0;  ///< shards that stay done
  std::int64_t num_open = 0;
};

/// What an update would leave to do; nothing is written.
Update compare(const Plan& previous, const Plan& plan, const std::filesystem::path& job);

/// Carries over what a new revision has in common with the one before: records of shards of which
/// nothing changed. To be called before the new plan is written. What is rendered again of the
/// others is decided frame by frame, when they are rendered.
Update carry_over(const Plan& previous, const Plan& plan, const std::filesystem::path& job);

/// The right to bring a job a newer plan: one process at a time has it, and gives it back at its end.
class UpdateRight {
 public:
  /// throws   Usage: another process has it (names the file that says so); Io
  explicit UpdateRight(const std::filesystem::path& job);
  ~UpdateRight();
  UpdateRight(const UpdateRight&) = delete;
  UpdateRight& operator=(const UpdateRight&) = delete;

 private:
  std::filesystem::path file_;
};

/// Removes exports and reports of runs and formats that a plan does not have.
/// throws   Io
void remove_unplanned(const Plan& plan, const JobFolder& folder);

}  // namespace terracast::batch
