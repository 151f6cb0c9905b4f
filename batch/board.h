#pragma once

#include <vector>

#include "batch/claims.h"
#include "batch/plan.h"

namespace terracast::batch {

/// Which shards of a plan are done, and which may be worked on.
/// threads   one at a time
class Board {
 public:
  Board(const Plan& plan, const Claims& claims);

  /// Looks what others have done.
  void refresh();
  /// Whether shards that were done are open again, as `verify --repair` leaves them.
  /// cost   a listing of all that is done
  bool find_reopened();
  void set_done(const ShardId& shard);
  bool is_done(const ShardId& shard) const;
  int num_done(Stage stage) const;
  bool is_complete(Stage stage) const;
  /// Whether all that a shard needs of earlier stages is done.
  bool is_ready(const ShardId& shard) const;
  /// What a shard needs that is not done.
  std::vector<ShardId> missing(const ShardId& shard) const;

 private:
  /// Calls need(shard) for each shard that this one needs, until one returns false.
  template <class Need>
  void for_each_need(const ShardId& shard, const Need& need) const;

  const Plan& plan_;
  const Claims& claims_;
  std::vector<std::vector<std::uint8_t>> done_;   ///< by stage
  std::vector<int> tiles_of_run_;                 ///< shards
  std::vector<std::vector<int>> renders_of_run_;  ///< shards, ascending
  std::vector<std::vector<int>> exports_of_run_;  ///< the shard of each format
};

}  // namespace terracast::batch
