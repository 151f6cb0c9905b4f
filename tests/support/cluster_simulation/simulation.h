#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <queue>
#include <set>
#include <utility>
#include <vector>

#include "tests/support/cluster_simulation.h"
#include "tests/support/cluster_simulation/index.h"
#include "tests/support/cluster_simulation/marks.h"
#include "tests/support/cluster_simulation/shared_server.h"

namespace terracast::test {

/// A shard of a job.
struct Ref {
  int stage = 0;
  int index = 0;
};

/// A job that is played on a cluster, once.
class Simulation {
 public:
  Simulation(const SimulatedJob& job, const SimulatedCluster& cluster);

  SimulatedOutcome run();

 private:
  static constexpr std::uint64_t kSlowStream = 0x736c6f77;
  static constexpr std::uint64_t kFailureStream = 0x6661696c;
  static constexpr std::uint64_t kWakeStream = 0x77616b65;

  enum class State : std::uint8_t { Blocked, Free, Held, Done, GivenUp };
  struct Stage {
    explicit Stage(std::size_t size)
        : states(size, State::Blocked), tries(size, 0), kept(size, 0), held(size), done(size) {}
    std::vector<State> states;
    std::vector<int> tries;
    std::vector<int> kept;  ///< frames of earlier tries
    std::set<int> free;
    Marks held;
    Marks done;
    int num_closed = 0;  ///< done or given up
  };
  struct Gate {
    int num_missing = 0;
    std::vector<Ref> waiting;
  };
  enum class Phase {
    Off,
    Down,
    Starting,
    Looking,
    Claiming,
    Reading,
    Computing,
    Writing,
    Committing,
    Waiting
  };
  /// What a worker knows of a stage: how far it looked, and how many there it saw done.
  struct Looked {
    int end = 0;
    int num_done = 0;
  };
  struct Worker {
    int node = 0;
    bool is_slow = false;
    Phase phase = Phase::Off;
    int turn = 0;  ///< of its phases, so that events of what was broken off are told apart
    double since_s = 0.0;
    Ref shard;
    double claimed_s = 0.0;
    double work_share = 1.0;  ///< of the shard's operations and bytes that this try does
    double compute_s = 0.0;
    int num_held_seen = 0;  ///< in this turn
    int start_step = 0;
    std::vector<Looked> looked;
    int task = -1;
  };
  struct Event {
    double time_s;
    std::int64_t number;  ///< of two at once the one that was planned first
    enum class Kind { Phase, Failure, Repair, Expiry, Wake } kind;
    int subject;
    int turn;
    bool operator>(const Event& other) const {
      return std::pair(time_s, number) > std::pair(other.time_s, other.number);
    }
  };
  struct Task {
    int begin = 0;
    int end = 0;
  };

  static int num_nodes(const SimulatedCluster& cluster) {
    return (cluster.num_workers - 1) / cluster.workers_per_node + 1;
  }
  bool is_arrays() const { return cluster_.dealing == Dealing::Arrays; }
  const SimulatedShard& shard(const Ref& ref) const {
    return job_.stages[at(ref.stage)][at(ref.index)];
  }
  State& state(const Ref& ref) { return stages_[at(ref.stage)].states[at(ref.index)]; }

  // Time, and what it is booked to: simulation.cpp.

  void plan(double time_s, Event::Kind kind, int subject, int turn);

  /// Whatever comes next: an event, or a client of a server that is through.
  void step();
  void take(const Event& event);

  /// Books the phase that ends, and begins another.
  void enter(int k, Phase phase);
  double* account(Phase phase);

  void after(int k, double duration_s);
  void ask(int k, Phase phase, double operations);
  void move(int k, Phase phase, double bytes);

  // What workers do: workers.cpp.

  void start(int k);
  /// What a worker was waiting for has happened.
  void go_on(int k);
  double factor(const Worker& worker) const { return worker.is_slow ? cluster_.slow_factor : 1.0; }

  int first_of(int k, int stage) const;

  struct Found {
    std::optional<Ref> shard;
    int num_held = 0;      ///< that were in the way
    int num_new_done = 0;  ///< that the worker did not know to be done
  };
  /// The first shard that is free, in the worker's order.
  Found find(int k);
  void take_turn(int k);
  void look(int k, double operations);
  /// Takes the shard that it found, or one that is still free after it.
  void choose(int k);

  void finish(int k);
  void close(const Ref& ref);
  void set_free(const Ref& ref);
  void wait(int k);

  /// Operations of one who looks once and finds nothing to do.
  double waiting_operations() const;
  void set_waiting(int count);
  void update_crowd();
  /// A shard is free: the first of those who wait will see it, each at some time of its period.
  void call_waiting();
  void wake_one();

  // Arrays: arrays.cpp.

  void open_array();
  void take_task(int k);
  bool is_task_closed(int task);
  void end_task(int k);

  // Failures: failures.cpp.

  void plan_failure(int node);
  int begin_of(int node) const { return node * cluster_.workers_per_node; }
  int end_of(int node) const {
    return std::min(cluster_.num_workers, begin_of(node) + cluster_.workers_per_node);
  }

  void fail(int node);
  void lose(Worker& worker);
  void repair(int node);
  /// The lease of a shard whose worker is gone has run out.
  void expire(const Ref& ref);
  /// Of a shard, and of all that waits for it.
  void give_up(const Ref& ref);

  const SimulatedJob& job_;
  const SimulatedCluster& cluster_;
  SharedServer metadata_;
  SharedServer data_;
  std::vector<double> metadata_end_;  ///< of workers, in terms of their servers
  std::vector<double> data_end_;
  std::vector<Stage> stages_;
  std::vector<Gate> gates_;
  std::vector<Worker> workers_;
  std::set<int> waiting_;  ///< workers that look for work
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  std::vector<std::uint64_t> num_failures_;  ///< of nodes
  std::int64_t num_events_ = 0;
  std::uint64_t num_calls_ = 0;
  std::int64_t num_open_ = 0;
  int num_held_ = 0;
  int num_waiting_ = 0;
  int num_waking_ = 0;  ///< of those who wait, who will see a shard that is free
  double now_s_ = 0.0;
  double last_done_s_ = 0.0;
  int array_stage_ = 0;
  std::vector<Task> tasks_;
  std::queue<int> queue_;
  int num_tasks_open_ = 0;
  SimulatedOutcome outcome_;
};

}  // namespace terracast::test
