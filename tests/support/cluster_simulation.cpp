#include "tests/support/cluster_simulation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <set>
#include <utility>

#include "core/random.h"

namespace terracast::test {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

/// Gives n clients who ask at once an n-th each of what it can do, and to none more than its own limit.
/// Those who wait for work are clients too, but as a crowd: each sleeps, asks, and sleeps again.
class SharedServer {
 public:
  SharedServer(double units_per_s, double client_units_per_s)
      : units_per_s_(units_per_s), client_units_per_s_(client_units_per_s) {
    update();
  }

  bool is_instant() const { return std::isinf(units_per_s_) && std::isinf(client_units_per_s_); }

  void advance(double now_s) {
    if (!clients_.empty()) served_ += (now_s - now_s_) * rate_;
    if (num_waiting_ > 0.0)
      crowd_units_ += (now_s - now_s_) * num_waiting_ * waiting_units_ / period_s();
    now_s_ = now_s;
  }
  void add(int client, double units, std::vector<double>& end_of_client) {
    end_of_client[at(client)] = served_ + units;
    clients_.emplace(served_ + units, client);
    update();
  }
  void remove(int client, const std::vector<double>& end_of_client) {
    clients_.erase({end_of_client[at(client)], client});
    update();
  }
  /// Who is served next, and when.
  std::optional<std::pair<double, int>> next() const {
    if (clients_.empty()) return std::nullopt;
    const auto& [end, client] = *clients_.begin();
    return std::pair(now_s_ + std::max(0.0, end - served_) / rate_, client);
  }
  /// taken_per_s   by renewals
  /// num_waiting   who ask for so many units each, after a pause
  void set_crowd(double taken_per_s, double num_waiting, double units, double pause_s) {
    taken_per_s_ = taken_per_s;
    num_waiting_ = num_waiting;
    waiting_units_ = units;
    pause_s_ = pause_s;
    update();
  }
  /// Between two times that one who waits begins to ask.
  double period_s() const { return pause_s_ + waiting_units_ / rate_; }
  /// All that those who wait have asked for.
  double crowd_units() const { return crowd_units_; }

 private:
  void update() {
    // rate (n + w u / (p rate + u)) = R, where u / (p rate + u) is the part of the time in which one
    // who waits is asking.
    const double n = static_cast<double>(clients_.size());
    const double left = std::max(units_per_s_ - taken_per_s_, 1e-3 * units_per_s_);
    if (std::isinf(units_per_s_)) {
      rate_ = client_units_per_s_;
      return;
    }
    double rate = left / std::max(n, 1.0);
    if (num_waiting_ > 0.0 && waiting_units_ > 0.0) {
      const double a = pause_s_ * n;
      const double b = (n + num_waiting_) * waiting_units_ - pause_s_ * left;
      const double c = -left * waiting_units_;
      if (a > 0.0)
        rate = b > 0.0 ? 2.0 * -c / (b + std::sqrt(b * b - 4.0 * a * c))
                       : (-b + std::sqrt(b * b - 4.0 * a * c)) / (2.0 * a);
      else
        rate = b > 0.0 ? -c / b : left;
    }
    rate_ = std::min(client_units_per_s_, rate);
  }

  double units_per_s_;
  double client_units_per_s_;
  double taken_per_s_ = 0.0;
  double num_waiting_ = 0.0;
  double waiting_units_ = 0.0;
  double pause_s_ = 0.0;
  double crowd_units_ = 0.0;
  double now_s_ = 0.0;
  double served_ = 0.0;  ///< units that a client who was there all the time has had
  double rate_ = 1.0;
  std::set<std::pair<double, int>> clients_;  ///< by the value of served_ at which they are through
};

/// How many of a stage's shards have a property, between two of them (a Fenwick tree).
class Marks {
 public:
  explicit Marks(std::size_t size) : sums_(size + 1, 0) {}
  void add(int index, int change) {
    total_ += change;
    for (std::size_t i = at(index) + 1; i < sums_.size(); i += i & (~i + 1)) sums_[i] += change;
  }
  int total() const { return total_; }
  /// Around from `begin` up to `end`; all where they are equal.
  int around(int begin, int end) const {
    return begin < end ? before(end) - before(begin) : total_ - before(begin) + before(end);
  }

 private:
  int before(int index) const {
    int sum = 0;
    for (std::size_t i = at(index); i > 0; i -= i & (~i + 1)) sum += sums_[i];
    return sum;
  }
  std::vector<int> sums_;
  int total_ = 0;
};

struct Ref {
  int stage = 0;
  int index = 0;
};

class Simulation {
 public:
  Simulation(const SimulatedJob& job, const SimulatedCluster& cluster)
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

  SimulatedOutcome run() {
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

  void plan(double time_s, Event::Kind kind, int subject, int turn) {
    events_.push({time_s, ++num_events_, kind, subject, turn});
  }

  /// Whatever comes next: an event, or a client of a server that is through.
  void step() {
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

  void take(const Event& event) {
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

  /// Books the phase that ends, and begins another.
  void enter(int k, Phase phase) {
    Worker& worker = workers_[at(k)];
    double* const booked = account(worker.phase);
    if (booked != nullptr) *booked += now_s_ - worker.since_s;
    if (worker.phase == Phase::Waiting) set_waiting(num_waiting_ - 1);
    worker.phase = phase;
    worker.since_s = now_s_;
    ++worker.turn;
    if (phase == Phase::Waiting) set_waiting(num_waiting_ + 1);
  }
  double* account(Phase phase) {
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

  void after(int k, double duration_s) {
    plan(now_s_ + duration_s, Event::Kind::Phase, k, workers_[at(k)].turn);
  }
  void ask(int k, Phase phase, double operations) {
    enter(k, phase);
    if (metadata_.is_instant() || operations <= 0.0)
      after(k, 0.0);
    else
      metadata_.add(k, operations, metadata_end_);
  }
  void move(int k, Phase phase, double bytes) {
    enter(k, phase);
    outcome_.bytes += bytes;
    if (data_.is_instant() || bytes <= 0.0)
      after(k, 0.0);
    else
      data_.add(k, bytes, data_end_);
  }

  void start(int k) {
    outcome_.work_operations += cluster_.start_operations;
    workers_[at(k)].looked.assign(job_.stages.size(), {});
    workers_[at(k)].start_step = 0;
    ask(k, Phase::Starting, cluster_.start_operations);
  }

  /// What a worker was waiting for has happened.
  void go_on(int k) {
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
  double factor(const Worker& worker) const { return worker.is_slow ? cluster_.slow_factor : 1.0; }

  int first_of(int k, int stage) const {
    if (cluster_.dealing == Dealing::PoolFromFirst) return 0;
    return static_cast<int>(static_cast<std::int64_t>(stages_[at(stage)].states.size()) * k /
                            cluster_.num_workers);
  }

  struct Found {
    std::optional<Ref> shard;
    int num_held = 0;      ///< that were in the way
    int num_new_done = 0;  ///< that the worker did not know to be done
  };
  /// The first shard that is free, in the worker's order.
  Found find(int k) {
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
        return end == 0      ? 0
               : end == size ? marks.total()
                             : marks.around(first, (first + end) % size);
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

  void take_turn(int k) {
    workers_[at(k)].num_held_seen = 0;
    look(k, operations::kTurn);
  }

  void look(int k, double operations) {
    const Found found = find(k);
    Worker& worker = workers_[at(k)];
    const int num_held = std::max(0, found.num_held - worker.num_held_seen);
    worker.num_held_seen = std::max(worker.num_held_seen, found.num_held);
    operations += operations::kLookAtHeld * num_held + operations::kLookAtDone * found.num_new_done;
    if (found.shard) operations += operations::kLookAtFree;
    outcome_.look_operations += operations;
    ask(k, Phase::Looking, operations);
  }

  /// Takes the shard that it found, or one that is still free after it.
  void choose(int k) {
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
    worker.work_share =
        work.num_frames > 0 ? 1.0 - static_cast<double>(kept) / work.num_frames : 1.0;
    worker.compute_s = work.start_s + worker.work_share * (work.cpu_s - work.start_s);
    outcome_.claim_operations += operations::kClaim;
    outcome_.work_operations += worker.work_share * work.operations;
    ask(k, Phase::Claiming, operations::kClaim + worker.work_share * work.operations);
  }

  void finish(int k) {
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

  void close(const Ref& ref) {
    ++stages_[at(ref.stage)].num_closed;
    --num_open_;
  }

  void set_free(const Ref& ref) {
    state(ref) = State::Free;
    stages_[at(ref.stage)].free.insert(ref.index);
    call_waiting();
  }

  void wait(int k) {
    Worker& worker = workers_[at(k)];
    if (is_arrays() && is_task_closed(worker.task)) return end_task(k);
    // One look more, at the records of all: then it knows what is done.
    for (std::size_t s = 0; s < stages_.size(); ++s)
      worker.looked[s].num_done = stages_[s].done.total();
    enter(k, Phase::Waiting);
    waiting_.insert(k);
  }

  /// Operations of one who looks once and finds nothing to do.
  double waiting_operations() const {
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
  void set_waiting(int count) {
    num_waiting_ = count;
    update_crowd();
  }
  void update_crowd() {
    const double renewals_per_s = num_held_ * operations::kRenewalsPerLease / cluster_.lease_s;
    metadata_.set_crowd(renewals_per_s, num_waiting_, waiting_operations(),
                        operations::kLongestWait_s);
  }
  /// A shard is free: the first of those who wait will see it, each at some time of its period.
  void call_waiting() {
    if (is_arrays() || num_waiting_ <= num_waking_) return;
    const double unit = core::random_unit(cluster_.seed, kWakeStream, ++num_calls_);
    const double first = 1.0 - std::pow(unit, 1.0 / (num_waiting_ - num_waking_));
    ++num_waking_;
    plan(now_s_ + metadata_.period_s() * first, Event::Kind::Wake, 0, 0);
  }
  void wake_one() {
    if (waiting_.empty()) return;
    const int k = *waiting_.begin();
    waiting_.erase(waiting_.begin());
    // Its look at what is held was booked while it waited.
    workers_[at(k)].num_held_seen = num_held_;
    look(k, operations::kTurn);
  }

  // Arrays.

  void open_array() {
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
  void take_task(int k) {
    Worker& worker = workers_[at(k)];
    if (queue_.empty()) return enter(k, Phase::Off);
    worker.task = queue_.front();
    queue_.pop();
    start(k);
  }
  bool is_task_closed(int task) {
    const Stage& stage = stages_[at(array_stage_)];
    for (int i = tasks_[at(task)].begin; i < tasks_[at(task)].end; ++i)
      if (stage.states[at(i)] == State::Free || stage.states[at(i)] == State::Held) return false;
    return true;
  }
  void end_task(int k) {
    workers_[at(k)].task = -1;
    --num_tasks_open_;
    enter(k, Phase::Off);
    if (num_tasks_open_ > 0) return take_task(k);
    ++array_stage_;
    open_array();
  }

  // Failures.

  void plan_failure(int node) {
    if (std::isinf(cluster_.node_mtbf_s)) return;
    const double unit = core::random_unit(
        cluster_.seed, core::stream_of(kFailureStream, static_cast<std::uint64_t>(node)),
        ++num_failures_[at(node)]);
    plan(now_s_ - cluster_.node_mtbf_s * std::log1p(-unit), Event::Kind::Failure, node, 0);
  }
  int begin_of(int node) const { return node * cluster_.workers_per_node; }
  int end_of(int node) const {
    return std::min(cluster_.num_workers, begin_of(node) + cluster_.workers_per_node);
  }

  void fail(int node) {
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

  void lose(Worker& worker) {
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

  void repair(int node) {
    for (int k = begin_of(node); k < end_of(node); ++k) {
      enter(k, Phase::Off);
      if (is_arrays())
        take_task(k);
      else
        start(k);
    }
    plan_failure(node);
  }

  /// The lease of a shard whose worker is gone has run out.
  void expire(const Ref& ref) {
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

  /// Of a shard, and of all that waits for it.
  void give_up(const Ref& ref) {
    state(ref) = State::GivenUp;
    ++outcome_.num_given_up;
    close(ref);
    last_done_s_ = now_s_;
    for (const int gate : shard(ref).serves)
      if (gate >= 0)
        for (const Ref& later : gates_[at(gate)].waiting)
          if (state(later) == State::Blocked) give_up(later);
  }

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

}  // namespace

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
