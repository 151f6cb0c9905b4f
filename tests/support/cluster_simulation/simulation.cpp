#include "tests/support/cluster_simulation/simulation.h"

#include <algorithm>

#include "core/random.h"

namespace terracast::test {

Simulation::Simulation(const SimulatedJob& job, const SimulatedCluster& cluster)
    : job_(job),
      cluster_(cluster),
      metadata_(cluster.operations_per_s,
                cluster.operation_s > 0.0 ? 1.0 / cluster.operation_s : kUnlimited),
      data_(std::min(cluster.bytes_per_s, num_nodes(cluster) * cluster.node_bytes_per_s),
            cluster.node_bytes_per_s),
      metadata_end_(at(cluster.num_workers)),
      data_end_(at(cluster.num_workers)),
      gates_(at(job.num_gates)),
      workers_(at(cluster.num_workers)) {
  outcome_.stage_end_s.resize(job.stages.size());
  for (std::size_t s = 0; s < job.stages.size(); ++s) {
    stages_.emplace_back(job.stages[s].size());
    num_open_ += static_cast<std::int64_t>(job.stages[s].size());
    for (std::size_t i = 0; i < job.stages[s].size(); ++i) {
      const Ref ref{static_cast<int>(s), static_cast<int>(i)};
      for (const int gate : shard(ref).serves)
        if (gate >= 0) ++gates_[at(gate)].num_missing;
      if (shard(ref).waits_for >= 0) gates_[at(shard(ref).waits_for)].waiting.push_back(ref);
    }
  }
  for (std::size_t s = 0; s < job.stages.size(); ++s)
    for (std::size_t i = 0; i < job.stages[s].size(); ++i) {
      const Ref ref{static_cast<int>(s), static_cast<int>(i)};
      const int gate = shard(ref).waits_for;
      if (gate < 0 || gates_[at(gate)].num_missing == 0) set_free(ref);
    }
  for (int k = 0; k < cluster.num_workers; ++k) {
    Worker& worker = workers_[at(k)];
    worker.node = k / cluster.workers_per_node;
    worker.looked.resize(job.stages.size());
    worker.is_slow =
        cluster.slow_factor != 1.0 &&
        core::random_unit(cluster.seed, kSlowStream, static_cast<std::uint64_t>(worker.node)) <
            cluster.slow_share;
  }
  num_failures_.resize(at(num_nodes(cluster)));
  for (int node = 0; node < num_nodes(cluster); ++node) plan_failure(node);
}

SimulatedOutcome Simulation::run() {
  if (is_arrays()) {
    open_array();
  } else {
    for (int k = 0; k < cluster_.num_workers; ++k) start(k);
  }
  while (num_open_ > 0) step();
  outcome_.makespan_s = last_done_s_;
  for (int k = 0; k < cluster_.num_workers; ++k) enter(k, Phase::Off);
  outcome_.look_operations += metadata_.crowd_units();
  const double all_s = outcome_.makespan_s * cluster_.num_workers;
  outcome_.idle_s =
      std::max(0.0, all_s - outcome_.useful_s - outcome_.starting_s - outcome_.slow_s -
                        outcome_.asking_s - outcome_.moving_s - outcome_.lost_s);
  return outcome_;
}

void Simulation::plan(double time_s, Event::Kind kind, int subject, int turn) {
  events_.push({time_s, ++num_events_, kind, subject, turn});
}

void Simulation::step() {
  const auto metadata = metadata_.next();
  const auto data = data_.next();
  const double metadata_s = metadata ? metadata->first : kUnlimited;
  const double data_s = data ? data->first : kUnlimited;
  const double event_s = events_.empty() ? kUnlimited : events_.top().time_s;
  const double next_s = std::min({metadata_s, data_s, event_s});
  now_s_ = std::max(now_s_, next_s);
  metadata_.advance(now_s_);
  data_.advance(now_s_);
  if (event_s <= next_s) {
    const Event event = events_.top();
    events_.pop();
    take(event);
  } else if (metadata_s <= next_s) {
    metadata_.remove(metadata->second, metadata_end_);
    go_on(metadata->second);
  } else {
    data_.remove(data->second, data_end_);
    go_on(data->second);
  }
}

void Simulation::take(const Event& event) {
  switch (event.kind) {
    case Event::Kind::Phase:
      if (workers_[at(event.subject)].turn == event.turn) go_on(event.subject);
      return;
    case Event::Kind::Failure:
      return fail(event.subject);
    case Event::Kind::Repair:
      return repair(event.subject);
    case Event::Kind::Expiry:
      return expire({event.turn, event.subject});
    case Event::Kind::Wake:
      num_waking_ -= 1;
      wake_one();
      return;
  }
}

void Simulation::enter(int k, Phase phase) {
  Worker& worker = workers_[at(k)];
  double* const booked = account(worker.phase);
  if (booked != nullptr) *booked += now_s_ - worker.since_s;
  if (worker.phase == Phase::Waiting) set_waiting(num_waiting_ - 1);
  worker.phase = phase;
  worker.since_s = now_s_;
  ++worker.turn;
  if (phase == Phase::Waiting) set_waiting(num_waiting_ + 1);
}

double* Simulation::account(Phase phase) {
  switch (phase) {
    case Phase::Starting:
      return &outcome_.starting_s;
    case Phase::Looking:
    case Phase::Claiming:
    case Phase::Committing:
      return &outcome_.asking_s;
    case Phase::Reading:
    case Phase::Writing:
      return &outcome_.moving_s;
    case Phase::Down:
      return &outcome_.lost_s;
    case Phase::Off:
    case Phase::Computing:  // when it is known what came of it
    case Phase::Waiting:
      break;
  }
  return nullptr;
}

void Simulation::after(int k, double duration_s) {
  plan(now_s_ + duration_s, Event::Kind::Phase, k, workers_[at(k)].turn);
}

void Simulation::ask(int k, Phase phase, double operations) {
  enter(k, phase);
  if (metadata_.is_instant() || operations <= 0.0)
    after(k, 0.0);
  else
    metadata_.add(k, operations, metadata_end_);
}

void Simulation::move(int k, Phase phase, double bytes) {
  enter(k, phase);
  outcome_.bytes += bytes;
  if (data_.is_instant() || bytes <= 0.0)
    after(k, 0.0);
  else
    data_.add(k, bytes, data_end_);
}

}  // namespace terracast::test
