#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "batch/plan.h"
#include "batch/run_files.h"
#include "core/hash.h"
#include "core/plugin_rows.h"
#include "core/progress.h"
#include "core/schema_writer.h"
#include "job/carried_rigs.h"
#include "job/job.h"
#include "job/stages.h"
#include "rigs/rig_errors.h"
#include "tiler/surface.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

constexpr double kShardsWanted = 32.0;
constexpr double kLeastShard_s = 60.0;
constexpr double kLongestShard_s = 900.0;
/// A shard that is so full takes no piece of another sequence, whose start costs more.
constexpr double kFull = 0.85;

/// Whether all that a source holds stands in the one file; a VRT names others.
bool is_plain_file(const fs::path& file) {
  std::error_code ignored;
  return fs::is_regular_file(file, ignored) && file.extension() != ".vrt";
}

/// Of the sequences of a run; those of the same cameras share one.
using RunCost = std::vector<std::shared_ptr<const SequenceCost>>;

/// Lays out the runs of a description one by one; what several share is looked into once.
class RunPlanner {
 public:
  RunPlanner(const Description& description, const PlanOptions& options, const Plan* previous,
             const core::Context& context)
      : description_(description),
        options_(options),
        context_(context),
        to_leave_out_(description.sweep().leave_out.begin(), description.sweep().leave_out.end()) {
    if (previous == nullptr) return;
    for (const PlannedRun& run : previous->runs) {
      names_.emplace(run.identity, run.name);
      taken_.insert(run.name);
      previous_runs_.emplace(run.name, &run);
    }
    for (const LeftOutRun& run : previous->left_out) {
      names_.emplace(run.identity, run.name);
      taken_.insert(run.name);
    }
  }

  void add(std::int64_t index) {
    const RunChanges changes = description_.changes(index);
    const auto [known, is_new] = identities_.emplace(changes.identity, index);
    if (!is_new)
      fail(ErrorKind::Config, "runs {} and {} of the sweep are the same: {}", known->second, index,
           changes.text());
    const std::string name = name_of(changes.identity, index);
    if (to_leave_out_.erase(name) > 0) {
      left_out.push_back({name, changes.identity});
      return;
    }
    const job::RunConfig config = description_.run_config(index);
    const job::CarriedCameras cameras(config.rigs, config.trajectories);
    const std::vector<LaidOut> laid_out =
        core::with_context([&] { return checked_sequences(config, cameras); }, "planning " + name);
    PlannedRun run{.name = name,
                   .index = index,
                   .identity = changes.identity,
                   .changes = changes.text(),
                   .key = {},
                   .edits = {},
                   .checks = checks_key(config),
                   .world = world_of(config.world),
                   .sequences = {},
                   .formats = formats_of(config)};
    for (const LaidOut& sequence : laid_out) run.sequences.push_back(sequence.planned);
    const std::string& world = worlds_[static_cast<std::size_t>(run.world)];
    const auto key_with = [&](const std::string& edits) {
      return run_key(world, edits, config,
                     [this](const fs::path& file) { return hash_of_file(file); });
    };
    // A run that is as it was has the tiles that it had; another may have any.
    const auto before = previous_runs_.find(run.name);
    const bool is_as_before =
        before != previous_runs_.end() && before->second->key == key_with(before->second->edits);
    run.edits = is_as_before ? look_up(options_.edits.of_runs, run.name)
                             : look_up(options_.edits.of_worlds, world);
    run.key = key_with(run.edits);
    costs.push_back(costs_of(config, cameras, laid_out));
    world_costs.try_emplace(run.world, world_cost(config.world));
    for (std::size_t s = 0; s < run.sequences.size(); ++s)
      memory_bytes =
          std::max(memory_bytes, costs.back()[s]->memory_bytes(2, run.sequences[s].num_frames));
    runs.push_back(std::move(run));
  }

  /// throws Config: nothing is left to make; names to leave out that no run has
  void check_left_out() const {
    if (!to_leave_out_.empty())
      fail(ErrorKind::Config,
           "sweep.leave_out names {}, and no run is called so; `terracast batch status` names "
           "those that failed",
           *to_leave_out_.begin());
    if (runs.empty())
      fail(ErrorKind::Config, "sweep.leave_out names every run; nothing is left to make");
  }

  const std::vector<std::string>& worlds() const { return worlds_; }

  std::vector<PlannedRun> runs;
  std::vector<LeftOutRun> left_out;
  std::vector<RunCost> costs;  ///< of the runs
  std::map<int, Cost> world_costs;
  double memory_bytes = 0.0;

 private:
  /// A sequence, and the trajectory that it is, or is a part of.
  struct LaidOut {
    PlannedSequence planned;
    std::size_t trajectory = 0;
    labels::SequenceOutline outline = {};  ///< with the cameras as they are
  };

  static RunCost costs_of(const job::RunConfig& config, const job::CarriedCameras& cameras,
                          const std::vector<LaidOut>& sequences) {
    std::map<std::vector<std::string>, std::shared_ptr<const SequenceCost>> known;
    RunCost costs;
    for (const LaidOut& sequence : sequences) {
      const geo::TrajectoryOptions& trajectory = config.trajectories[sequence.trajectory];
      std::shared_ptr<const SequenceCost>& cost = known[trajectory.rigs];
      if (cost == nullptr)
        cost = std::make_shared<const SequenceCost>(config, cameras.of(trajectory));
      costs.push_back(cost);
    }
    return costs;
  }

  std::vector<PlannedFormat> formats_of(const job::RunConfig& config) {
    std::vector<PlannedFormat> formats;
    for (const auto& chosen : config.exports)
      formats.push_back(
          {chosen.format, format_key(config, chosen, description_.dataset().within_m)});
    if (formats.empty() && !config.labels.empty() && !std::exchange(has_told_of_labels_, true))
      context_.log.warn(
          "the config names no format, and a batch makes labels with its exports: it makes none; "
          "add an [[exports]]");
    return formats;
  }

  /// What the previous plan called a run of the same rows and values, or else a name of its own.
  std::string name_of(const std::string& identity, std::int64_t index) {
    const auto known = names_.find(identity);
    if (known != names_.end()) return known->second;
    std::string name = fmt::format("run{:04}", index);
    for (std::int64_t next = description_.num_runs(); !taken_.insert(name).second; ++next)
      name = fmt::format("run{:04}", next);
    return name;
  }

  static std::string look_up(const std::map<std::string, std::string>& texts,
                             const std::string& name) {
    const auto found = texts.find(name);
    return found != texts.end() ? found->second : std::string();
  }

  int world_of(const tiler::WorldOptions& options) {
    std::string text = core::toml_text(options);
    text += core::plugin_marks(text);
    std::string others;
    const auto add = [&](const core::Path& file) {
      if (is_plain_file(file.resolved))
        text += hash_of_file(file.resolved);
      else
        others += "\n" + file.resolved.string();
    };
    for (const auto& source : options.elevation) {
      for (const core::Path& file : source.files) add(file);
      if (!source.datum_grid.empty()) add(source.datum_grid);
    }
    if (!options.aridity_raster.empty()) add(options.aridity_raster);
    if (!others.empty()) text += surface_hash(text + others, options);
    const std::string key = core::content_hash(text).substr(0, 12);
    const auto [known, is_new] =
        world_indices_.emplace(key, static_cast<int>(world_indices_.size()));
    if (is_new) worlds_.push_back(key);
    return known->second;
  }

  /// Of a world, some of whose sources are folders, members of archives or lists of other files: what
  /// they hold is found by reading the world's square.
  /// sources   tells worlds apart; it stands for sources that cannot be read, as their shards will say
  const std::string& surface_hash(const std::string& sources, const tiler::WorldOptions& options) {
    const auto known = surface_hashes_.find(sources);
    if (known != surface_hashes_.end()) return known->second;
    std::string hash = sources;
    try {
      hash = tiler::WorldSurface::prepare(options, context_)->input_hash();
    } catch (const core::Error& error) {
      if (error.kind() == ErrorKind::Interrupted || error.kind() == ErrorKind::Internal) throw;
    }
    return surface_hashes_.emplace(sources, std::move(hash)).first->second;
  }

  const std::string& hash_of_file(const fs::path& file) {
    const auto known = file_hashes_.find(file);
    if (known != file_hashes_.end()) return known->second;
    return file_hashes_.emplace(file, hash_of_path(file)).first->second;
  }

  /// throws   Config: what every shard of the run would be refused for
  std::vector<LaidOut> checked_sequences(const job::RunConfig& config,
                                         const job::CarriedCameras& cameras) {
    job::check_formats(config, cameras);
    std::vector<LaidOut> sequences = sequences_of(config, cameras);
    std::vector<labels::SequenceOutline> outlines;
    for (const LaidOut& sequence : sequences) outlines.push_back(sequence.outline);
    // Labels that may fall short are logged where they are made, not for every run.
    job::check_outputs(config, outlines, core::Log("plan", core::LogLevel::Off));
    return sequences;
  }

  /// Entries that state their frames need no ground to count them.
  std::vector<LaidOut> sequences_of(const job::RunConfig& config,
                                    const job::CarriedCameras& cameras) {
    std::vector<LaidOut> sequences;
    for (const geo::TrajectoryOptions& trajectory : config.trajectories) {
      if (trajectory.num_frames == 0 || trajectory.kind_options().is_split())
        return laid_out(config);
      const rigs::TrueRigs drawn =
          rigs::draw_true_rigs(job::carried_rigs(config.rigs, trajectory), cameras.of(trajectory),
                               config.seed, trajectory.name);
      sequences.push_back(
          {{trajectory.name, trajectory.num_frames},
           sequences.size(),
           job::outline_of(config, trajectory.name, drawn.cameras,
                           static_cast<std::size_t>(trajectory.num_frames), trajectory.rate_hz)});
    }
    return sequences;
  }

  /// By what is captured alone: runs that differ in labels and formats share it.
  const std::vector<LaidOut>& laid_out(const job::RunConfig& config) {
    const std::string text = job::toml_of_captures(config);
    const auto known = laid_out_.find(text);
    if (known != laid_out_.end()) return known->second;
    const job::Job job = job::prepare_job(config, context_);
    const std::vector<labels::SequenceOutline> outlines = job::outlines_of(job);
    std::vector<LaidOut> sequences;
    for (std::size_t i = 0; i < job.sequences.size(); ++i) {
      const geo::TrajectoryOptions& part = job.config.trajectories[i];
      const std::string& entry = part.split_from.empty() ? part.name : part.split_from;
      const auto whole =
          std::find_if(config.trajectories.begin(), config.trajectories.end(),
                       [&](const geo::TrajectoryOptions& each) { return each.name == entry; });
      TERRACAST_CHECK(whole != config.trajectories.end(), "no trajectory {}", entry);
      sequences.push_back({{part.name, static_cast<std::int64_t>(job.sequences[i].states.size())},
                           static_cast<std::size_t>(whole - config.trajectories.begin()),
                           outlines[i]});
    }
    return laid_out_.emplace(text, std::move(sequences)).first->second;
  }

  const Description& description_;
  const PlanOptions& options_;
  const core::Context& context_;
  std::set<std::string> to_leave_out_;        ///< names that no run has had yet
  std::map<std::string, std::string> names_;  ///< by identity
  std::set<std::string> taken_;
  std::map<std::string, const PlannedRun*> previous_runs_;  ///< by name
  std::map<std::string, std::int64_t> identities_;
  std::vector<std::string> worlds_;
  std::map<std::string, int> world_indices_;
  std::map<fs::path, std::string> file_hashes_;
  std::map<std::string, std::string> surface_hashes_;  ///< by surface_hash()'s sources
  std::map<std::string, std::vector<LaidOut>> laid_out_;
  bool has_told_of_labels_ = false;
};

/// Makes the shards of a stage, in order.
class Dealer {
 public:
  Dealer(Stage stage, double shard_s) : stage_(stage), shard_s_(shard_s) {}

  double left_s() const { return shards.empty() ? 0.0 : shard_s_ - shards.back().cost.cpu_s; }
  bool is_full() const { return shards.empty() || left_s() < (1.0 - kFull) * shard_s_; }
  void open() {
    shards.push_back({.id = {stage_, static_cast<int>(shards.size())}, .pieces = {}, .cost = {}});
  }
  void add(const Piece& piece, const Cost& cost) {
    shards.back().pieces.push_back(piece);
    shards.back().cost += cost;
  }
  std::vector<Shard> shards;

 private:
  Stage stage_;
  double shard_s_;
};

/// A shard a run: one that cannot be tiled keeps no other from being so.
std::vector<Shard> deal_tiles(const RunPlanner& planner, const std::vector<int>& order) {
  Dealer dealer(Stage::Tile, 0.0);
  int world = -1;
  for (const int run : order) {
    const PlannedRun& planned = planner.runs[static_cast<std::size_t>(run)];
    Cost cost;
    for (std::size_t s = 0; s < planned.sequences.size(); ++s)
      cost +=
          planner.costs[static_cast<std::size_t>(run)][s]->tiles(planned.sequences[s].num_frames);
    if (planned.world != world) cost += planner.world_costs.at(planned.world);
    world = planned.world;
    dealer.open();
    dealer.add({.run = run}, cost);
  }
  return std::move(dealer.shards);
}

std::vector<Shard> deal_frames(const RunPlanner& planner, const std::vector<int>& order,
                               double shard_s) {
  Dealer dealer(Stage::Render, shard_s);
  for (const int run : order) {
    const PlannedRun& planned = planner.runs[static_cast<std::size_t>(run)];
    dealer.open();  // a shard is of one run: one that cannot be flown keeps no other from being so
    for (std::size_t s = 0; s < planned.sequences.size(); ++s) {
      const SequenceCost& cost = *planner.costs[static_cast<std::size_t>(run)][s];
      const Cost start = cost.sequence_start();
      const Cost frame = cost.frame();
      const auto num_frames = static_cast<int>(planned.sequences[s].num_frames);
      for (int first = 0; first < num_frames;) {
        if (dealer.is_full()) dealer.open();
        double room_s = dealer.left_s() - start.cpu_s;
        if (room_s < frame.cpu_s && !dealer.shards.back().pieces.empty()) {
          dealer.open();
          room_s = dealer.left_s() - start.cpu_s;
        }
        const double fits = std::clamp(room_s / frame.cpu_s, 1.0, 1e9);
        const int end = std::min(num_frames, first + static_cast<int>(fits));
        dealer.add(
            {.run = run, .sequence = static_cast<int>(s), .first_frame = first, .end_frame = end},
            start + static_cast<double>(end - first) * frame);
        first = end;
      }
    }
  }
  return std::move(dealer.shards);
}

/// Of all frames of a run.
template <class CostOfFrame>
Cost cost_of_frames(const RunPlanner& planner, std::size_t run, const CostOfFrame& cost_of_frame) {
  Cost cost;
  for (std::size_t s = 0; s < planner.runs[run].sequences.size(); ++s)
    cost += static_cast<double>(planner.runs[run].sequences[s].num_frames) *
            cost_of_frame(*planner.costs[run][s]);
  return cost;
}

/// A shard for each run and format.
/// cost_of   SequenceCost::export_frame or validate_frame
std::vector<Shard> deal_formats(const RunPlanner& planner, const std::vector<int>& order,
                                Stage stage, Cost (SequenceCost::*cost_of)(std::size_t) const) {
  Dealer dealer(stage, 0.0);
  for (const int run : order) {
    const PlannedRun& planned = planner.runs[static_cast<std::size_t>(run)];
    for (std::size_t f = 0; f < planned.formats.size(); ++f) {
      dealer.open();
      dealer.add({.run = run, .format = static_cast<int>(f)},
                 cost_of_frames(planner, static_cast<std::size_t>(run),
                                [&](const SequenceCost& cost) { return (cost.*cost_of)(f); }));
    }
  }
  return std::move(dealer.shards);
}

double shard_time_s(const RunPlanner& planner, const PlanOptions& options) {
  if (options.shard_s > 0.0) return options.shard_s;
  Cost whole;
  for (std::size_t run = 0; run < planner.runs.size(); ++run)
    whole += cost_of_frames(planner, run, [](const SequenceCost& cost) { return cost.frame(); });
  return std::clamp(whole.cpu_s / kShardsWanted, kLeastShard_s, kLongestShard_s);
}

/// Every file is read once more, and its checksum taken.
Cost merge_cost(const Plan& plan) {
  constexpr double kChecksum_bytes_per_s = 1e9;
  constexpr double kCard_s = 5.0;
  return {.cpu_s = kCard_s + plan.cost_of(Stage::Export).bytes / kChecksum_bytes_per_s,
          .bytes = 5e6};
}

}  // namespace

Plan make_plan(const Description& description, const PlanOptions& options, const Plan* previous,
               const core::Context& context) {
  for (const fs::path& tile : options.edits.removed)
    context.log.warn("{}: this tile was edited, and is removed: it is made of its sources again",
                     tile.string());
  RunPlanner planner(description, options, previous, context);
  {
    core::Progress progress(context, "runs", description.num_runs());
    for (std::int64_t index = 0; index < description.num_runs(); ++index) {
      planner.add(index);
      progress.advance();
    }
  }
  planner.check_left_out();
  // Shards that follow each other share a world and, as far as the sweep's order goes, tiles.
  std::vector<int> order(planner.runs.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return planner.runs[static_cast<std::size_t>(a)].world <
           planner.runs[static_cast<std::size_t>(b)].world;
  });
  // As before: shards that are cut alike stay done.
  const double shard_s = previous != nullptr && options.shard_s == 0.0
                             ? previous->shard_s
                             : shard_time_s(planner, options);
  Plan plan{.revision = previous != nullptr ? previous->revision + 1 : 1,
            .name = description.run_config(0).name,
            .claims = options.claims,
            .shard_s = shard_s,
            .inputs = description.inputs(),
            .worlds = planner.worlds(),
            .runs = {},
            .left_out = std::move(planner.left_out),
            .shards = {},
            .memory_bytes = planner.memory_bytes};
  plan.shards = {deal_tiles(planner, order),
                 deal_frames(planner, order, shard_s),
                 deal_formats(planner, order, Stage::Export, &SequenceCost::export_frame),
                 deal_formats(planner, order, Stage::Validate, &SequenceCost::validate_frame),
                 {}};
  if (!plan.of(Stage::Export).empty())
    plan.shards.back().push_back({.id = {Stage::Merge, 0}, .pieces = {}, .cost = merge_cost(plan)});
  plan.runs = std::move(planner.runs);
  return plan;
}

}  // namespace terracast::batch
