#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

/// Plays a batch on a cluster that is not there: how long it takes on so many workers, and what holds it
/// up. It knows nothing of files; cluster_job.h makes its input of a plan and of measured costs.
namespace terracast::test {

/// What one shard asks of its worker and of the file system.
struct SimulatedShard {
  double cpu_s = 0.0;       ///< of one core
  double start_s = 0.0;     ///< of these, what every try spends before its first frame
  int num_frames = 0;       ///< that outlive a try, each done after the other; 0: all begins again
  double operations = 0.0;  ///< of the metadata server, beside those of its claim
  double read_bytes = 0.0;
  double written_bytes = 0.0;
  int waits_for = -1;  ///< gate; -1: none
  std::array<int, 2> serves = {-1,
                               -1};  ///< gates that open when all shards that serve them are done
};

/// Shards by stage. Workers look for work in this order.
struct SimulatedJob {
  std::vector<std::vector<SimulatedShard>> stages;
  int num_gates = 0;

  double cpu_s() const;
  /// Longest chain of shards of which each waits for the one before.
  double critical_path_s() const;
};

/// How the shards come to the workers.
enum class Dealing {
  /// Each worker looks for work on its own, beginning at its own part of each stage.
  Pool,
  /// The same, but all begin at the first shard.
  PoolFromFirst,
  /// Tasks of an array, which are parts of one stage, side by side; each stage after the one before.
  Arrays,
};

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

struct SimulatedCluster {
  int num_workers = 1;  ///< processes, of one core each
  int workers_per_node = 64;
  Dealing dealing = Dealing::Pool;
  double task_s = 1800.0;  ///< Arrays: CPU time of a task
  double start_s = 0.0;    ///< CPU time of a process before its first look
  double start_operations = 0.0;
  double start_bytes = 0.0;

  double operations_per_s = kUnlimited;  ///< of the metadata server
  double operation_s = 0.0;         ///< to and fro, of one; a worker has one on its way at a time
  double bytes_per_s = kUnlimited;  ///< of the file system
  double node_bytes_per_s = kUnlimited;  ///< of one worker at most, and of all nodes together

  double node_mtbf_s = kUnlimited;  ///< times between failures are exponential
  double repair_s = 600.0;
  double slow_share = 0.0;   ///< of the nodes
  double slow_factor = 1.0;  ///< of their CPU times

  double lease_s = 300.0;
  int max_tries = 5;
  std::uint64_t seed = 1;
};

struct SimulatedOutcome {
  double makespan_s = 0.0;
  double useful_s = 0.0;  ///< CPU time of the shards that were done, each once
  /// Time of all workers together, useful_s and idle_s with them: workers times makespan.
  double starting_s = 0.0;
  double slow_s = 0.0;            ///< what slow nodes took longer
  double asking_s = 0.0;          ///< waiting for the metadata server
  double moving_s = 0.0;          ///< reading and writing
  double lost_s = 0.0;            ///< work that a failure undid, and nodes that were down
  double idle_s = 0.0;            ///< no shard was to be had
  double work_operations = 0.0;   ///< of shards' work and of starting processes
  double claim_operations = 0.0;  ///< of claims, renewals and records
  double look_operations = 0.0;   ///< of looking for shards that are free
  double bytes = 0.0;
  std::int64_t num_tries = 0;
  std::int64_t num_lost = 0;
  std::int64_t num_given_up = 0;  ///< shards lost too often, and those that wait for them
  std::vector<double> stage_end_s;

  double efficiency(const SimulatedCluster& cluster) const {
    return useful_s / (makespan_s * cluster.num_workers);
  }
  double operations() const { return work_operations + claim_operations + look_operations; }
};

/// File operations of the claim rules, counted in batch/claims.cpp and batch/worker.cpp; they agree
/// with what strace counts within a few for each shard (docs/cluster.md).
namespace operations {
constexpr double kTurn = 1.0;        ///< is there a newer plan
constexpr double kLookAtFree = 3.0;  ///< room on the disk, done, first try
constexpr double kLookAtDone = 3.0;  ///< room, done; and the next turn
/// Room, done, try, end, age, who, clock set and read, next try.
constexpr double kLookAtHeld = 10.0;
constexpr double kClaim = 10.0;   ///< folder, file, link, removal of the other name, done once more
constexpr double kCommit = 14.0;  ///< folders, file, link, removal; claims counted and removed
/// Of one who waits: for each try on record done, end, age, who, clock, who again.
constexpr double kWaitForTry = 9.0;
constexpr double kListFolder = 4.0;
constexpr double kShardsPerFolder = 1000.0;
constexpr double kRenewalsPerLease = 6.0;
constexpr double kLongestWait_s = 3.0;
}  // namespace operations

/// Deterministic by the cluster's seed.
///
/// A shard's try: it is looked for and claimed; its operations, its reads, its CPU time and its writes
/// follow each other without overlap. Operations and bytes share their servers evenly: of n who ask at
/// once each has one n-th of the server, and never more than one operation at a time, or than what
/// a node can take in. Nodes are taken to be loaded alike. Claims are renewed six times a lease. A node that fails takes its workers with
/// it; their shards are free again when their leases have run out, a lost try counts, and the next
/// begins after the last frame that was finished, or from nothing where none outlives a try. The node
/// is back after its repair. A worker without work asks again every 3 s, as batch::run_worker does.
/// cost   10 microseconds a shard
SimulatedOutcome simulate(const SimulatedJob& job, const SimulatedCluster& cluster);

/// What took most of the time that was not useful: "CPU" (nine tenths are useful), "metadata",
/// "bandwidth", "start-up", "failures", "slow nodes", "merge" (idle, mostly while the last stage's only
/// shard is worked on), "critical path" (idle, and the longest chain takes half of the makespan or
/// more) or "stragglers" (idle otherwise).
std::string bound_of(const SimulatedOutcome& outcome, const SimulatedJob& job,
                     const SimulatedCluster& cluster);

}  // namespace terracast::test
