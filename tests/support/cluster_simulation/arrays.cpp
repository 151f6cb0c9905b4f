#include <algorithm>
#include <cmath>

#include "tests/support/cluster_simulation/simulation.h"

namespace terracast::test {

void Simulation::open_array() {
  while (array_stage_ < static_cast<int>(stages_.size()) &&
         stages_[at(array_stage_)].states.empty())
    ++array_stage_;
  if (array_stage_ == static_cast<int>(stages_.size())) {
    num_open_ = 0;  // what was given up, and what waits for it, stays
    return;
  }
  const auto& shards = job_.stages[at(array_stage_)];
  double cpu_s = 0.0;
  for (const SimulatedShard& work : shards) cpu_s += work.cpu_s;
  const auto size = static_cast<std::int64_t>(shards.size());
  const auto count = std::clamp<std::int64_t>(
      static_cast<std::int64_t>(std::ceil(cpu_s / cluster_.task_s)), 1, size);
  tasks_.clear();
  queue_ = {};
  for (std::int64_t i = 0; i < count; ++i) {
    tasks_.push_back(
        {static_cast<int>(size * i / count), static_cast<int>(size * (i + 1) / count)});
    queue_.push(static_cast<int>(i));
  }
  num_tasks_open_ = static_cast<int>(count);
  for (int k = 0; k < cluster_.num_workers; ++k)
    if (workers_[at(k)].phase == Phase::Off) take_task(k);
}

void Simulation::take_task(int k) {
  Worker& worker = workers_[at(k)];
  if (queue_.empty()) return enter(k, Phase::Off);
  worker.task = queue_.front();
  queue_.pop();
  start(k);
}

bool Simulation::is_task_closed(int task) {
  const Stage& stage = stages_[at(array_stage_)];
  for (int i = tasks_[at(task)].begin; i < tasks_[at(task)].end; ++i)
    if (stage.states[at(i)] == State::Free || stage.states[at(i)] == State::Held) return false;
  return true;
}

void Simulation::end_task(int k) {
  workers_[at(k)].task = -1;
  --num_tasks_open_;
  enter(k, Phase::Off);
  if (num_tasks_open_ > 0) return take_task(k);
  ++array_stage_;
  open_array();
}

}  // namespace terracast::test
