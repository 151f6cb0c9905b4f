#pragma once

#include <functional>
#include <memory>

#include "batch/job_folder.h"
#include "batch/plan.h"
#include "core/context.h"

namespace terracast::batch {

/// What a shard came to, for its record.
struct ShardResult {
  std::int64_t num_frames = 0;
  std::int64_t num_rendered = 0;  ///< of these; the others were there, or were taken over
  double bytes = 0.0;             ///< on disk
  int num_checks_failed = 0;
};

/// Does shards of a plan. What follows on a run or world that was worked on before finds it opened.
/// Two may do the same shard at once, in whatever processes: what they make is put in place whole,
/// and has the same bytes. Tiles and frames of earlier stages that are found damaged are made again.
/// threads   one at a time; it uses the context's threads
class ShardWork {
 public:
  ShardWork(const Plan& plan, JobFolder folder, const core::Context& context);
  ~ShardWork();

  /// is_done   whether a twin has done the shard meanwhile: then nothing is put in place
  /// throws    Interrupted: a stop was asked for; Config, Input, Io: as the stages
  ShardResult run(const Shard& shard, const std::function<bool()>& is_done);

  /// Removes what processes that have ended left unfinished in the folders that a shard writes to.
  void clear_up(const Shard& shard) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terracast::batch
