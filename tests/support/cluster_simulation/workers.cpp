#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tests/support/cluster_simulation/simulation.h"

namespace terracast::test {

void Simulation::start(int k) {
  outcome_.work_operations += cluster_.start_operations;
  workers_[at(k)].looked.assign(job_.stages.size(), {});
  workers_[at(k)].start_step = 0;
  ask(k, Phase::Starting, cluster_.start_operations);
}

void Simulation::go_on(int k) {
  Worker& worker = workers_[at(k)];
  switch (worker.phase) {
    case Phase::Off:
    case Phase::Down:
    case Phase::Waiting:
      return;
    case Phase::Starting:
      // Its operations, what it reads, and its CPU time.
      if (++worker.start_step == 1) return move(k, Phase::Starting, cluster_.start_bytes);
      if (worker.start_step > 2) return take_turn(k);
      enter(k, Phase::Starting);
      return after(k, cluster_.start_s * factor(worker));
    case Phase::Looking:
      return choose(k);
    case Phase::Claiming:
      return move(k, Phase::Reading, worker.work_share * shard(worker.shard).read_bytes);
    case Phase::Reading:
      enter(k, Phase::Computing);
      return after(k, worker.compute_s * factor(worker));
    case Phase::Computing:
      return move(k, Phase::Writing, worker.work_share * shard(worker.shard).written_bytes);
    case Phase::Writing:
      outcome_.claim_operations += operations::kCommit;
      return ask(k, Phase::Committing, operations::kCommit);
    case Phase::Committing:
      return finish(k);
  }
}

int Simulation::first_of(int k, int stage) const {
  if (cluster_.dealing == Dealing::PoolFromFirst) return 0;
  return static_cast<int>(static_cast<std::int64_t>(stages_[at(stage)].states.size()) * k /
                          cluster_.num_workers);
}

Simulation::Found Simulation::find(int k) {
  Found found;
  Worker& worker = workers_[at(k)];
  if (is_arrays()) {
    const Stage& stage = stages_[at(array_stage_)];
    const Task& task = tasks_[at(worker.task)];
    const auto next = stage.free.lower_bound(task.begin);
    if (next != stage.free.end() && *next < task.end) found.shard = Ref{array_stage_, *next};
    return found;
  }
  for (int s = 0; s < static_cast<int>(stages_.size()); ++s) {
    const Stage& stage = stages_[at(s)];
    if (stage.states.empty()) continue;
    const int first = first_of(k, s);
    auto next = stage.free.lower_bound(first);
    if (next == stage.free.end()) next = stage.free.begin();
    const int size = static_cast<int>(stage.states.size());
    const bool is_found = next != stage.free.end();
    const int end = is_found ? (*next - first + size) % size : size;
    const auto count = [&](const Marks& marks) {
      return end == 0 ? 0 : end == size ? marks.total() : marks.around(first, (first + end) % size);
    };
    found.num_held += count(stage.held);
    Looked& looked = worker.looked[at(s)];
    const int num_done = count(stage.done);
    const int num_new = std::max(0, num_done - looked.num_done);
    found.num_new_done += num_new;
    looked.num_done += num_new;
    if (!is_found) continue;
    found.shard = Ref{s, *next};
    return found;
  }
  return found;
}

void Simulation::take_turn(int k) {
  workers_[at(k)].num_held_seen = 0;
  look(k, operations::kTurn);
}

void Simulation::look(int k, double operations) {
  const Found found = find(k);
  Worker& worker = workers_[at(k)];
  const int num_held = std::max(0, found.num_held - worker.num_held_seen);
  worker.num_held_seen = std::max(worker.num_held_seen, found.num_held);
  operations += operations::kLookAtHeld * num_held + operations::kLookAtDone * found.num_new_done;
  if (found.shard) operations += operations::kLookAtFree;
  outcome_.look_operations += operations;
  ask(k, Phase::Looking, operations);
}

void Simulation::choose(int k) {
  Worker& worker = workers_[at(k)];
  const Found found = find(k);
  if (!found.shard) return wait(k);
  // Others were quicker: what they hold is in the way now.
  if (found.num_held > worker.num_held_seen) return look(k, 0.0);
  const Ref ref = *found.shard;
  Stage& stage = stages_[at(ref.stage)];
  stage.free.erase(ref.index);
  stage.held.add(ref.index, 1);
  state(ref) = State::Held;
  ++num_held_;
  update_crowd();
  ++outcome_.num_tries;
  worker.shard = ref;
  worker.claimed_s = now_s_;
  const SimulatedShard& work = shard(ref);
  const int kept = stage.kept[at(ref.index)];
  worker.work_share = work.num_frames > 0 ? 1.0 - static_cast<double>(kept) / work.num_frames : 1.0;
  worker.compute_s = work.start_s + worker.work_share * (work.cpu_s - work.start_s);
  outcome_.claim_operations += operations::kClaim;
  outcome_.work_operations += worker.work_share * work.operations;
  ask(k, Phase::Claiming, operations::kClaim + worker.work_share * work.operations);
}

void Simulation::finish(int k) {
  Worker& worker = workers_[at(k)];
  const Ref ref = worker.shard;
  const SimulatedShard& work = shard(ref);
  Stage& stage = stages_[at(ref.stage)];
  // What earlier tries have kept was booked with them.
  outcome_.useful_s += worker.work_share * (work.cpu_s - work.start_s) + work.start_s;
  outcome_.slow_s += worker.compute_s * (factor(worker) - 1.0);
  outcome_.claim_operations +=
      std::floor((now_s_ - worker.claimed_s) * operations::kRenewalsPerLease / cluster_.lease_s);
  stage.held.add(ref.index, -1);
  --num_held_;
  stage.done.add(ref.index, 1);
  state(ref) = State::Done;
  close(ref);
  last_done_s_ = now_s_;
  outcome_.stage_end_s[at(ref.stage)] = now_s_;
  for (const int gate : work.serves)
    if (gate >= 0 && --gates_[at(gate)].num_missing == 0)
      for (const Ref& ready : gates_[at(gate)].waiting)
        if (state(ready) == State::Blocked) set_free(ready);
  update_crowd();
  if (num_open_ == 0) return;
  if (is_arrays() && is_task_closed(worker.task)) return end_task(k);
  take_turn(k);
}

void Simulation::close(const Ref& ref) {
  ++stages_[at(ref.stage)].num_closed;
  --num_open_;
}

void Simulation::set_free(const Ref& ref) {
  state(ref) = State::Free;
  stages_[at(ref.stage)].free.insert(ref.index);
  call_waiting();
}

void Simulation::wait(int k) {
  Worker& worker = workers_[at(k)];
  if (is_arrays() && is_task_closed(worker.task)) return end_task(k);
  // One look more, at the records of all: then it knows what is done.
  for (std::size_t s = 0; s < stages_.size(); ++s)
    worker.looked[s].num_done = stages_[s].done.total();
  enter(k, Phase::Waiting);
  waiting_.insert(k);
}

double Simulation::waiting_operations() const {
  double folders = 0.0;
  for (const Stage& stage : stages_) {
    folders += 1.0;
    if (stage.done.total() < static_cast<int>(stage.states.size()))
      folders += 1.0 + std::ceil(stage.done.total() / operations::kShardsPerFolder);
  }
  const double held = is_arrays() ? 0.0 : num_held_;
  return operations::kTurn + folders * operations::kListFolder +
         num_held_ * operations::kWaitForTry + held * operations::kLookAtHeld;
}

void Simulation::set_waiting(int count) {
  num_waiting_ = count;
  update_crowd();
}

void Simulation::update_crowd() {
  const double renewals_per_s = num_held_ * operations::kRenewalsPerLease / cluster_.lease_s;
  metadata_.set_crowd(renewals_per_s, num_waiting_, waiting_operations(),
                      operations::kLongestWait_s);
}

void Simulation::call_waiting() {
  if (is_arrays() || num_waiting_ <= num_waking_) return;
  const double unit = core::random_unit(cluster_.seed, kWakeStream, ++num_calls_);
  const double first = 1.0 - std::pow(unit, 1.0 / (num_waiting_ - num_waking_));
  ++num_waking_;
  plan(now_s_ + metadata_.period_s() * first, Event::Kind::Wake, 0, 0);
}

void Simulation::wake_one() {
  if (waiting_.empty()) return;
  const int k = *waiting_.begin();
  waiting_.erase(waiting_.begin());
  // Its look at what is held was booked while it waited.
  workers_[at(k)].num_held_seen = num_held_;
  look(k, operations::kTurn);
}

}  // namespace terracast::test
