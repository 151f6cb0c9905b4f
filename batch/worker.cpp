#include "batch/worker.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <set>
#include <thread>

#include "batch/array_index.h"
#include "batch/board.h"
#include "batch/shard_work.h"
#include "core/stop.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kFirstWait{100};
constexpr std::chrono::milliseconds kLongestWait{3000};
/// What must be left on the disk beside what a shard is expected to write.
constexpr double kSpareDisk_bytes = 256e6;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double cpu_s() {
  rusage all{};
  ::getrusage(RUSAGE_SELF, &all);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(all.ru_utime) + seconds(all.ru_stime);
}

double free_bytes(const fs::path& folder) {
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  return error ? std::numeric_limits<double>::infinity() : static_cast<double>(space.available);
}

class Worker {
 public:
  Worker(const Plan& plan, const JobFolder& folder, const WorkerOptions& options,
         const core::Context& context)
      : plan_(plan),
        folder_(folder),
        options_(options),
        context_(context),
        claims_(folder.state(), options.claims),
        board_(plan, claims_),
        work_(plan, folder, context) {}

  WorkerOutcome run() {
    clear_up();
    board_.refresh();
    if (options_.only) {
      do_only(*options_.only);
      return outcome_;
    }
    fill_queue();
    auto wait = kFirstWait;
    while (true) {
      core::throw_if_stop_asked();
      throw_if_outdated(folder_.root, plan_.revision);
      const Turn turn = take_turn();
      if (turn == Turn::Worked && !last_error_) {
        wait = kFirstWait;
      } else if (turn == Turn::Finished || outcome_.is_over_quota) {
        break;
      } else {
        std::this_thread::sleep_for(wait);
        wait = std::min(2 * wait, kLongestWait);
      }
    }
    outcome_.num_left = 0;
    for (const ShardId& shard : mine()) outcome_.num_left += board_.is_done(shard) ? 0 : 1;
    outcome_.is_merged = !plan_.of(Stage::Merge).empty() && board_.is_complete(Stage::Merge);
    for (const ShardId& shard : poisoned_)
      if (!board_.is_done(shard)) outcome_.poisoned.push_back(shard);
    if (!options_.is_part_only) outcome_.num_checks_failed = count_failed_checks();
    for (const Claims::Tried& tried : claims_.tried())
      if (poisoned_.contains(tried.shard))
        context_.log.warn("shard {} was given up: {}", tried.shard.text(), tried.last_error());
    clear_up();
    return outcome_;
  }

 private:
  enum class Turn {
    Worked,
    Waiting,   ///< for what others hold
    Finished,  ///< nothing is left, or nothing that could still be done
  };

  /// In all reports that there are, whoever made them. A task of an array tells of its own alone: so
  /// many would read all records.
  int count_failed_checks() const {
    int count = 0;
    for (const Shard& shard : plan_.of(Stage::Validate)) {
      if (!board_.is_done(shard.id)) continue;
      try {
        count += static_cast<int>(claims_.record(shard.id).at("checks_failed").integer());
      } catch (const core::Error& error) {
        if (error.kind() != ErrorKind::Input && error.kind() != ErrorKind::Io) throw;
        context_.log.warn("{}; `terracast batch verify {} --repair` has its shard done again",
                          error.what(), folder_.root.string());
      }
    }
    return count;
  }

  /// Removes what processes that have ended left behind.
  void clear_up() {
    remove_ended_attempts(folder_);
    claims_.clear_up([this](const ShardId& shard) {
      if (shard.index < static_cast<int>(plan_.of(shard.stage).size()))
        work_.clear_up(shard_of(shard));
    });
  }

  /// The shards that this worker takes, in the order in which it looks for work.
  std::vector<ShardId> mine() const {
    std::vector<ShardId> shards;
    for (const Stage stage : options_.stages) {
      const std::size_t count = plan_.of(stage).size();
      const int begin = part_begin(count, options_.part_index, options_.part_count);
      const int end = part_begin(count, options_.part_index + 1, options_.part_count);
      for (int i = begin; i < end; ++i) shards.push_back({stage, i});
      if (options_.is_part_only) continue;
      for (int i = end; i < static_cast<int>(count); ++i) shards.push_back({stage, i});
      for (int i = 0; i < begin; ++i) shards.push_back({stage, i});
    }
    return shards;
  }

  void fill_queue() {
    queue_ = mine();
    needs_.clear();
    if (options_.has_needs) add_needs();
  }

  /// Whether what was done is to be done again.
  bool take_up_reopened() {
    if (!board_.find_reopened()) return false;
    fill_queue();
    return true;
  }

  /// Puts what its shards need of others and nobody has done before them.
  void add_needs() {
    std::vector<ShardId> open;
    for (const ShardId& shard : queue_)
      if (!board_.is_done(shard)) open.push_back(shard);
    while (!open.empty()) {
      const ShardId shard = open.back();
      open.pop_back();
      for (const ShardId& needed : board_.missing(shard))
        if (!is_mine(needed) && needs_.insert(needed).second) open.push_back(needed);
    }
    queue_.insert(queue_.begin(), needs_.begin(), needs_.end());
  }

  bool is_mine(const ShardId& shard) const {
    if (needs_.contains(shard)) return true;
    const auto& stages = options_.stages;
    if (std::find(stages.begin(), stages.end(), shard.stage) == stages.end()) return false;
    const std::size_t count = plan_.of(shard.stage).size();
    return !options_.is_part_only ||
           (shard.index >= part_begin(count, options_.part_index, options_.part_count) &&
            shard.index < part_begin(count, options_.part_index + 1, options_.part_count));
  }

  /// Does the first shard that may be done.
  Turn take_turn() {
    std::erase_if(queue_, [&](const ShardId& shard) { return board_.is_done(shard); });
    for (const ShardId& shard : queue_) {
      if (poisoned_.contains(shard) || !board_.is_ready(shard)) continue;
      check_disk(shard);
      if (!has_quota_for(shard)) break;
      auto claimed = claims_.claim(shard, options_.is_retry && !retried_.contains(shard));
      if (auto* claim = std::get_if<Claim>(&claimed)) {
        // With the claim, so that of several workers each counts the others'.
        if (!has_quota_for(shard)) break;
        if (shard.stage == Stage::Merge && take_up_reopened()) return Turn::Worked;
        retried_.insert(shard);
        work_on(std::move(*claim));
        return Turn::Worked;
      }
      const auto standing = std::get<Claims::Standing>(claimed);
      if (standing == Claims::Standing::Poisoned) poisoned_.insert(shard);
      if (standing != Claims::Standing::Done) continue;
      board_.set_done(shard);
      return Turn::Worked;  // it may have made others ready
    }
    if (outcome_.is_over_quota) return Turn::Finished;
    board_.refresh();
    find_hope();
    const bool has_hope = std::any_of(queue_.begin(), queue_.end(),
                                      [&](const ShardId& shard) { return can_be_done(shard); });
    if (has_hope) return Turn::Waiting;
    return take_up_reopened() ? Turn::Worked : Turn::Finished;
  }

  /// Looks who holds what and what was given up.
  void find_hope() {
    held_.clear();
    hope_.clear();
    poisoned_.clear();  // `verify --repair` and retries of others take shards up again
    for (const Claims::Tried& tried : claims_.tried()) {
      if (!tried.holder.empty()) held_.insert(tried.shard);
      if (tried.is_poisoned && (!options_.is_retry || retried_.contains(tried.shard)))
        poisoned_.insert(tried.shard);
    }
  }

  /// Whether a shard is done, is held, or will be this worker's to do.
  bool can_be_done(const ShardId& shard) {
    if (board_.is_done(shard) || held_.contains(shard)) return true;
    if (poisoned_.contains(shard) || !is_mine(shard)) return false;
    const auto known = hope_.find(shard);
    if (known != hope_.end()) return known->second;
    bool has_hope = true;
    for (const ShardId& needed : board_.missing(shard)) has_hope = has_hope && can_be_done(needed);
    hope_.emplace(shard, has_hope);
    return has_hope;
  }

  /// throws   Io: the disk has no room for what a shard will write
  void check_disk(const ShardId& id) const {
    const Shard& shard = shard_of(id);
    const double left = free_bytes(folder_.root);
    if (left < shard.cost.bytes + kSpareDisk_bytes)
      fail(
          ErrorKind::Io,
          "{}: {:.1f} GB are left on its disk; shard {} is expected to write {:.1f} GB: make room, "
          "and run the same command again",
          folder_.root.string(), left * 1e-9, id.text(), shard.cost.bytes * 1e-9);
  }

  /// Whether the quota has room for a shard beside all that is done and being worked on, as far as the
  /// forecast knows. Where it has none for it even alone, the quota is used up.
  bool has_quota_for(const ShardId& id) {
    if (options_.quota_bytes == std::numeric_limits<double>::infinity()) return true;
    // First who holds what: a shard that is done meanwhile is counted as that.
    std::set<ShardId, ById> held;
    for (const Claims::Tried& tried : claims_.tried())
      if (!tried.holder.empty() &&
          tried.shard.index < static_cast<int>(plan_.of(tried.shard.stage).size()))
        held.insert(tried.shard);
    double bytes = 0.0;
    for (const Stage stage : kStages)
      for (const int index : claims_.done(stage)) {
        if (index >= static_cast<int>(plan_.of(stage).size())) continue;
        held.erase({stage, index});
        bytes += bytes_of({stage, index});
      }
    held.insert(id);
    outcome_.is_over_quota = bytes + shard_of(id).cost.bytes > options_.quota_bytes;
    for (const ShardId& shard : held) bytes += shard_of(shard).cost.bytes;
    return bytes <= options_.quota_bytes;
  }

  /// As the record of a shard that is done says, which is read once; or the forecast, where it cannot
  /// be read.
  double bytes_of(const ShardId& id) {
    const auto known = bytes_.find(id);
    if (known != bytes_.end()) return known->second;
    try {
      return bytes_.emplace(id, claims_.record(id).at("bytes").number()).first->second;
    } catch (const core::Error& error) {
      if (error.kind() != ErrorKind::Input && error.kind() != ErrorKind::Io) throw;
      return shard_of(id).cost.bytes;
    }
  }

  const Shard& shard_of(const ShardId& id) const {
    return plan_.of(id.stage)[static_cast<std::size_t>(id.index)];
  }

  void do_only(const ShardId& id) {
    if (id.index >= static_cast<int>(plan_.of(id.stage).size()))
      fail(ErrorKind::Usage, "there is no shard {}; {} has {}", id.text(), stage_name(id.stage),
           plan_.of(id.stage).size());
    if (board_.is_done(id)) {
      context_.log.info("shard {} is done already", id.text());
      return;
    }
    const std::vector<ShardId> missing = board_.missing(id);
    if (!missing.empty())
      fail(ErrorKind::Usage, "shard {} needs {} first, and {} in all", id.text(),
           missing.front().text(), missing.size());
    auto claimed = claims_.claim(id, true);
    auto* claim = std::get_if<Claim>(&claimed);
    if (claim == nullptr && std::get<Claims::Standing>(claimed) == Claims::Standing::Done) {
      context_.log.info("shard {} is done meanwhile", id.text());
      return;
    }
    if (claim == nullptr)
      fail(ErrorKind::Usage, "shard {} is being worked on by another process", id.text());
    work_on(std::move(*claim));
    if (last_error_) throw *last_error_;
  }

  void work_on(Claim claim) {
    const ShardId id = claim.shard();
    const Clock::time_point start = Clock::now();
    const double cpu_before_s = cpu_s();
    last_error_.reset();
    try {
      const ShardResult result = work_.run(shard_of(id), [&] { return claims_.is_done(id); });
      claim.commit(core::Json::object()
                       .set("shard", id.text())
                       .set("frames", result.num_frames)
                       .set("rendered", result.num_rendered)
                       .set("bytes", result.bytes)
                       .set("checks_failed", result.num_checks_failed)
                       .set("wall_s", seconds_since(start))
                       .set("cpu_s", cpu_s() - cpu_before_s));
      board_.set_done(id);
      ++outcome_.num_done;
      outcome_.num_checks_failed += result.num_checks_failed;
      context_.log.info("shard {} is done, {:.0f} s", id.text(), seconds_since(start));
    } catch (const core::Error& error) {
      if (error.kind() == ErrorKind::Interrupted) throw;
      // The disk's fault is no shard's.
      if (free_bytes(folder_.root) < 0.1 * kSpareDisk_bytes) throw;
      last_error_ = error;
    } catch (const std::exception& error) {
      last_error_ = core::Error(ErrorKind::Internal, error.what());
    }
    if (!last_error_) return;
    context_.log.warn("shard {} failed: {}", id.text(), last_error_->what());
    claim.fail(last_error_->what());
    // Others first: what failed for a passing reason may have passed by then.
    const auto place = std::find(queue_.begin(), queue_.end(), id);
    if (place != queue_.end()) std::rotate(place, place + 1, queue_.end());
  }

  struct ById {
    bool operator()(const ShardId& a, const ShardId& b) const {
      return std::pair(a.stage, a.index) < std::pair(b.stage, b.index);
    }
  };

  const Plan& plan_;
  const JobFolder& folder_;
  const WorkerOptions& options_;
  const core::Context& context_;
  Claims claims_;
  Board board_;
  ShardWork work_;
  std::vector<ShardId> queue_;     ///< what is left of its shards, in the order of looking
  std::set<ShardId, ById> needs_;  ///< of others, which its own shards need
  std::set<ShardId, ById> poisoned_;
  std::set<ShardId, ById> held_;           ///< by others, when it was last looked
  std::map<ShardId, bool, ById> hope_;     ///< can_be_done
  std::map<ShardId, double, ById> bytes_;  ///< bytes_of
  std::set<ShardId, ById> retried_;
  std::optional<core::Error> last_error_;
  WorkerOutcome outcome_;
};

}  // namespace

WorkerOutcome run_worker(const Plan& plan, const JobFolder& folder, const WorkerOptions& options,
                         const core::Context& context) {
  return Worker(plan, folder, options, context).run();
}

}  // namespace terracast::batch
