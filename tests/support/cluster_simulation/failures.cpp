#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tests/support/cluster_simulation/simulation.h"

namespace terracast::test {

void Simulation::plan_failure(int node) {
  if (std::isinf(cluster_.node_mtbf_s)) return;
  const double unit = core::random_unit(
      cluster_.seed, core::stream_of(kFailureStream, static_cast<std::uint64_t>(node)),
      ++num_failures_[at(node)]);
  plan(now_s_ - cluster_.node_mtbf_s * std::log1p(-unit), Event::Kind::Failure, node, 0);
}

void Simulation::fail(int node) {
  for (int k = begin_of(node); k < end_of(node); ++k) {
    Worker& worker = workers_[at(k)];
    metadata_.remove(k, metadata_end_);
    data_.remove(k, data_end_);
    waiting_.erase(k);
    const bool has_shard = worker.phase == Phase::Claiming || worker.phase == Phase::Reading ||
                           worker.phase == Phase::Computing || worker.phase == Phase::Writing ||
                           worker.phase == Phase::Committing;
    if (has_shard) lose(worker);
    if (worker.task >= 0) {
      queue_.push(worker.task);
      worker.task = -1;
    }
    enter(k, Phase::Down);
  }
  plan(now_s_ + cluster_.repair_s, Event::Kind::Repair, node, 0);
  for (int k = 0; k < cluster_.num_workers && !queue_.empty(); ++k)
    if (workers_[at(k)].phase == Phase::Off) take_task(k);
}

void Simulation::lose(Worker& worker) {
  const Ref ref = worker.shard;
  const SimulatedShard& work = shard(ref);
  Stage& stage = stages_[at(ref.stage)];
  double computed_s = 0.0;
  if (worker.phase == Phase::Computing)
    computed_s = now_s_ - worker.since_s;
  else if (worker.phase == Phase::Writing || worker.phase == Phase::Committing)
    computed_s = worker.compute_s * factor(worker);
  double kept_s = 0.0;
  if (work.num_frames > 0) {
    const double frame_s = (work.cpu_s - work.start_s) / work.num_frames;
    const double for_frames_s = std::max(0.0, computed_s / factor(worker) - work.start_s);
    int& kept = stage.kept[at(ref.index)];
    const int num_new =
        frame_s > 0.0 ? std::min(work.num_frames - kept, static_cast<int>(for_frames_s / frame_s))
                      : 0;
    kept += num_new;
    kept_s = num_new * frame_s;
  }
  outcome_.useful_s += kept_s;
  outcome_.lost_s += computed_s - kept_s;
  ++outcome_.num_lost;
  const double renewal_s = cluster_.lease_s / operations::kRenewalsPerLease;
  const double renewed_s =
      worker.claimed_s + std::floor((now_s_ - worker.claimed_s) / renewal_s) * renewal_s;
  plan(renewed_s + cluster_.lease_s, Event::Kind::Expiry, ref.index, ref.stage);
}

void Simulation::repair(int node) {
  for (int k = begin_of(node); k < end_of(node); ++k) {
    enter(k, Phase::Off);
    if (is_arrays())
      take_task(k);
    else
      start(k);
  }
  plan_failure(node);
}

void Simulation::expire(const Ref& ref) {
  Stage& stage = stages_[at(ref.stage)];
  stage.held.add(ref.index, -1);
  --num_held_;
  if (++stage.tries[at(ref.index)] >= cluster_.max_tries)
    give_up(ref);
  else
    set_free(ref);
  update_crowd();
  if (!is_arrays()) return;
  // The task that it is of may be waiting for it.
  const auto worker = std::find_if(waiting_.begin(), waiting_.end(), [&](int k) {
    const Task& task = tasks_[at(workers_[at(k)].task)];
    return ref.index >= task.begin && ref.index < task.end;
  });
  if (worker == waiting_.end()) return;
  const int k = *worker;
  waiting_.erase(worker);
  take_turn(k);
}

void Simulation::give_up(const Ref& ref) {
  state(ref) = State::GivenUp;
  ++outcome_.num_given_up;
  close(ref);
  last_done_s_ = now_s_;
  for (const int gate : shard(ref).serves)
    if (gate >= 0)
      for (const Ref& later : gates_[at(gate)].waiting)
        if (state(later) == State::Blocked) give_up(later);
}

}  // namespace terracast::test
