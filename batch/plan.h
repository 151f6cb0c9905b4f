#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "batch/claims.h"
#include "batch/cost_model.h"
#include "batch/description.h"
#include "batch/stage.h"
#include "core/context.h"

namespace terracast::batch {

struct PlannedSequence {
  std::string name;
  std::int64_t num_frames = 0;
  bool operator==(const PlannedSequence&) const = default;
};

struct PlannedFormat {
  std::string name;
  std::string key;  ///< hash of its options
  bool operator==(const PlannedFormat&) const = default;
};

/// One run of the batch: what `terracast run` would make of its config.
struct PlannedRun {
  std::string name;        ///< of its folders: "run0012"
  std::int64_t index = 0;  ///< in the sweep
  std::string identity;    ///< RunChanges::identity
  std::string changes;     ///< what it sets, for readers
  std::string key;     ///< run_key(): hash of all in its config that its captures depend on, of the
                       ///< files that its world and flights name, and of `edits`
  std::string edits;   ///< tiles that were changed in place and the hashes of their files, a line
                       ///< each: "3/-1/0 HASH"; empty: none was
  std::string checks;  ///< hash of how its exports are checked
  int world = 0;       ///< into Plan::worlds
  std::vector<PlannedSequence> sequences;
  std::vector<PlannedFormat> formats;
  bool operator==(const PlannedRun&) const = default;

  std::int64_t num_frames() const;
};

/// A part of a shard; which members count depends on the stage.
struct Piece {
  int run = 0;
  int sequence = 0;     ///< render
  int first_frame = 0;  ///< render: [first, end)
  int end_frame = 0;
  int format = 0;  ///< export, validate
  bool operator==(const Piece&) const = default;
};

/// What one process does at a time.
struct Shard {
  ShardId id;
  std::vector<Piece> pieces;  ///< of one run; merge: none
  Cost cost;
};

/// Tiles that users changed in place, as PlannedRun::edits.
struct TileEdits {
  std::map<std::string, std::string> of_runs;    ///< of the previous plan, by their names
  std::map<std::string, std::string> of_worlds;  ///< of all their runs, by their keys
  std::set<std::filesystem::path> removed;       ///< tiles that were edited before, and are no more
};

/// A run that the sweep makes and the plan leaves out, by its name, and what keeps it that name.
struct LeftOutRun {
  std::string name;
  std::string identity;
  bool operator==(const LeftOutRun&) const = default;
};

struct PlanOptions {
  ClaimOptions claims;
  TileEdits edits;
  double shard_s = 0.0;  ///< CPU time of a shard; 0: a thirty-second of the whole, 1 to 15 minutes
};

/// A job's plan. Immutable: a change of the config makes another revision.
struct Plan {
  int revision = 1;
  std::string name;
  ClaimOptions claims;
  double shard_s = 0.0;  ///< CPU time that shards of frames were cut to
  core::ConfigInputs inputs;
  std::vector<std::string> worlds;  ///< keys, the names of their folders
  std::vector<PlannedRun> runs;
  std::vector<LeftOutRun> left_out;
  std::vector<std::vector<Shard>> shards;  ///< by stage
  double memory_bytes = 0.0;               ///< of a process with two threads

  const std::vector<Shard>& of(Stage stage) const {
    return shards[static_cast<std::size_t>(stage)];
  }
  std::int64_t num_frames() const;
  std::int64_t num_sequences() const;
  Cost cost_of(Stage stage) const;
  Cost total() const;
};

/// previous  of the same job, whose runs keep their names; null for a new one
/// cost      0.2 ms a run that states its num_frames; of others the flight is laid out;
///           of worlds whose sources are no plain files the square is read, once each
/// throws    as reading each run's config; Config: two runs are the same
Plan make_plan(const Description& description, const PlanOptions& options, const Plan* previous,
               const core::Context& context);

/// Plans of a job folder: plan/0001/{plan.json,config.json,runs.jsonl,shards.jsonl}; the last one
/// that is whole counts.
void write_plan(const Plan& plan, const std::filesystem::path& job_folder);
/// throws Io: the folder holds no plan; Input: a file is damaged (says which)
Plan read_plan(const std::filesystem::path& job_folder);
/// Whether two plans of a job have the same shards of the same runs, and the same keys.
bool is_same_but_for_revision(const Plan& a, const Plan& b);
/// Whether there is a later revision than this.
bool has_newer_plan(const std::filesystem::path& job_folder, int revision);
/// throws   Interrupted: there is a newer plan, with which the same command goes on
void throw_if_outdated(const std::filesystem::path& job_folder, int revision);
bool has_plan(const std::filesystem::path& job_folder);

/// The story of a plan, for the command line.
std::string describe_plan(const Plan& plan);

}  // namespace terracast::batch
