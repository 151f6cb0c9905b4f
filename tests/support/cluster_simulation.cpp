#include "tests/support/cluster_simulation.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "tests/support/cluster_simulation/index.h"
#include "tests/support/cluster_simulation/simulation.h"

namespace terracast::test {

double SimulatedJob::cpu_s() const {
  double sum_s = 0.0;
  for (const auto& shards : stages)
    for (const SimulatedShard& work : shards) sum_s += work.cpu_s;
  return sum_s;
}

double SimulatedJob::critical_path_s() const {
  std::vector<double> opened_s(at(num_gates), 0.0);
  double longest_s = 0.0;
  for (const auto& shards : stages)
    for (const SimulatedShard& work : shards) {
      const double end_s = work.cpu_s + (work.waits_for >= 0 ? opened_s[at(work.waits_for)] : 0.0);
      longest_s = std::max(longest_s, end_s);
      for (const int gate : work.serves)
        if (gate >= 0) opened_s[at(gate)] = std::max(opened_s[at(gate)], end_s);
    }
  return longest_s;
}

SimulatedOutcome simulate(const SimulatedJob& job, const SimulatedCluster& cluster) {
  return Simulation(job, cluster).run();
}

std::string bound_of(const SimulatedOutcome& outcome, const SimulatedJob& job,
                     const SimulatedCluster& cluster) {
  if (outcome.efficiency(cluster) >= 0.9) return "CPU";
  // Idle while one shard is left that waits for all others.
  const auto num_stages = outcome.stage_end_s.size();
  const double before_s = num_stages > 1 ? outcome.stage_end_s[num_stages - 2] : 0.0;
  const bool is_merge =
      num_stages > 1 && job.stages.back().size() == 1 &&
      (outcome.makespan_s - before_s) * cluster.num_workers > 0.5 * outcome.idle_s;
  const char* const idle = is_merge                                            ? "merge"
                           : job.critical_path_s() >= 0.5 * outcome.makespan_s ? "critical path"
                                                                               : "stragglers";
  return std::max({std::pair(outcome.asking_s, "metadata"),
                   std::pair(outcome.moving_s, "bandwidth"),
                   std::pair(outcome.starting_s, "start-up"), std::pair(outcome.lost_s, "failures"),
                   std::pair(outcome.slow_s, "slow nodes"), std::pair(outcome.idle_s, idle)})
      .second;
}

}  // namespace terracast::test
