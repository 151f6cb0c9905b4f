#include "batch/status.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/plugin_rows.h"
#include "core/stage_cost.h"

namespace terracast::batch {
namespace {

constexpr std::size_t kSlowestShown = 3;
constexpr std::size_t kFailuresShown = 10;
/// What takes so much more than its like is worth a look.
constexpr double kSlow = 1.5;

std::int64_t num_failures(const Claims::Tried& tried) {
  return std::count_if(tried.ends.begin(), tried.ends.end(),
                       [](const TryEnd& end) { return end.how != TryEnd::How::Released; });
}

std::string command_of(const Claims::Tried& tried, const std::string& job) {
  return fmt::format("{} batch run {} --only {}", core::program_with_plugins(), job,
                     tried.shard.text());
}

std::string size_text(double bytes) {
  if (bytes >= 1e12) return fmt::format("{:.2f} TB", bytes * 1e-12);
  if (bytes >= 1e9) return fmt::format("{:.1f} GB", bytes * 1e-9);
  return fmt::format("{:.1f} MB", bytes * 1e-6);
}

/// Shards with tries, and the runs they are of.
std::vector<Status::Tried> tried_of(const Plan& plan, const Claims& claims) {
  std::vector<Status::Tried> all;
  for (Claims::Tried& tried : claims.tried()) {
    const std::vector<Shard>& shards = plan.of(tried.shard.stage);
    if (static_cast<std::size_t>(tried.shard.index) >= shards.size()) continue;
    const std::vector<Piece>& pieces = shards[static_cast<std::size_t>(tried.shard.index)].pieces;
    std::string run =
        pieces.empty() ? "" : plan.runs[static_cast<std::size_t>(pieces.front().run)].name;
    all.push_back({std::move(tried), std::move(run)});
  }
  return all;
}

/// How to have the rest merged, when runs cannot be made; empty where none was given up.
std::string way_without(const Status& status, const std::string& job) {
  std::set<std::string> runs;
  for (const Status::Tried& tried : status.tried)
    if (tried.is_poisoned && !tried.run.empty()) runs.insert(tried.run);
  if (runs.empty()) return {};
  runs.insert(status.left_out.begin(), status.left_out.end());
  if (runs.size() > kFailuresShown)
    return fmt::format(
        "{} runs keep the rest from being merged; to plan without them, name them in "
        "sweep.leave_out\n",
        runs.size());
  return fmt::format(
      "without what was given up, and with the same --set as before: terracast batch plan CONFIG "
      "--out {} --update --set 'sweep.leave_out=[\"{}\"]'\n",
      job, fmt::join(runs, "\",\""));
}

std::int64_t frames_of(const Plan& plan, const Shard& shard) {
  std::int64_t count = 0;
  for (const Piece& piece : shard.pieces) {
    if (shard.id.stage == Stage::Render) count += piece.end_frame - piece.first_frame;
    if (shard.id.stage == Stage::Export || shard.id.stage == Stage::Validate)
      count += plan.runs[static_cast<std::size_t>(piece.run)].num_frames();
  }
  return count;
}

/// What is left, by what was done: the forecast, corrected by how it erred, over the workers at it.
void estimate(Status& status) {
  double left_cpu_s = 0.0;
  double cores = 0.0;
  bool is_known = false;
  double all_cpu_s = 0.0;
  double all_planned_s = 0.0;
  for (const auto& stage : status.stages) {
    all_cpu_s += stage.cpu_s;
    all_planned_s += stage.cpu_planned_done_s;
  }
  const double all_ratio = all_planned_s > 0.0 ? all_cpu_s / all_planned_s : 1.0;
  for (const auto& stage : status.stages) {
    const double ratio =
        stage.cpu_planned_done_s > 0.0 ? stage.cpu_s / stage.cpu_planned_done_s : all_ratio;
    left_cpu_s += ratio * (stage.cpu_planned_s - stage.cpu_planned_done_s);
    const double cores_each = stage.wall_s > 0.0 ? stage.cpu_s / stage.wall_s : 1.0;
    cores += static_cast<double>(stage.num_held) * cores_each;
    is_known = is_known || stage.num_done > 0;
    if (stage.stage == Stage::Render && stage.wall_s > 0.0)
      status.frames_per_s = static_cast<double>(stage.num_held) *
                            static_cast<double>(stage.num_frames) / stage.wall_s;
  }
  if (is_known && cores > 0.0) status.left_s = left_cpu_s / cores;
}

}  // namespace

bool Status::is_complete() const {
  return std::all_of(stages.begin(), stages.end(),
                     [](const StageStatus& s) { return s.num_done == s.num_shards; });
}

double Status::bytes() const {
  double bytes = 0.0;
  for (const StageStatus& stage : stages) bytes += stage.bytes;
  return bytes;
}

Status status_of(const Plan& plan, const JobFolder& folder, const ClaimOptions& options) {
  const Claims claims(folder.state(), options);
  Status status{.name = plan.name,
                .stages = {},
                .left_out = {},
                .tried = tried_of(plan, claims),
                .slowest = {},
                .num_checks_failed = 0};
  for (const LeftOutRun& run : plan.left_out) status.left_out.push_back(run.name);
  for (const Stage stage : kStages) {
    Status::StageStatus of_stage{.stage = stage,
                                 .num_shards = static_cast<std::int64_t>(plan.of(stage).size()),
                                 .cpu_planned_s = plan.cost_of(stage).cpu_s};
    for (const Shard& shard : plan.of(stage)) of_stage.num_frames_planned += frames_of(plan, shard);
    for (const int index : claims.done(stage)) {
      if (index >= of_stage.num_shards) continue;
      const Shard& shard = plan.of(stage)[static_cast<std::size_t>(index)];
      const core::Json record = claims.record(shard.id);
      ++of_stage.num_done;
      of_stage.num_frames += record.at("frames").integer();
      of_stage.cpu_s += record.at("cpu_s").number();
      of_stage.wall_s += record.at("wall_s").number();
      of_stage.bytes += record.at("bytes").number();
      of_stage.cpu_planned_done_s += shard.cost.cpu_s;
      status.num_checks_failed += record.at("checks_failed").integer();
      status.slowest.push_back({shard.id, record.at("wall_s").number(),
                                record.at("cpu_s").number() / std::max(shard.cost.cpu_s, 1e-3)});
    }
    for (const Claims::Tried& tried : status.tried) {
      if (tried.shard.stage != stage) continue;
      of_stage.num_held += tried.holder.empty() ? 0 : 1;
      of_stage.num_poisoned += tried.is_poisoned ? 1 : 0;
    }
    const double ratio = of_stage.cpu_s / std::max(of_stage.cpu_planned_done_s, 1e-3);
    for (Status::Slow& slow : status.slowest)
      if (slow.shard.stage == stage) slow.factor /= std::max(ratio, 1e-9);
    status.stages.push_back(of_stage);
  }
  std::sort(status.slowest.begin(), status.slowest.end(),
            [](const Status::Slow& a, const Status::Slow& b) { return a.wall_s > b.wall_s; });
  status.slowest.resize(std::min(status.slowest.size(), kSlowestShown));
  estimate(status);
  return status;
}

std::string status_text(const Status& status, const std::string& job) {
  std::string text =
      fmt::format("{}\n{:10} {:>15} {:>9} {:>7} {:>19} {:>14} {:>10}\n", status.name, "stage",
                  "shards done", "at work", "failed", "frames", "CPU time", "disk");
  for (const auto& stage : status.stages)
    text += fmt::format(
        "{:10} {:>15} {:>9} {:>7} {:>19} {:>14} {:>10}\n", stage_name(stage.stage),
        fmt::format("{}/{}", stage.num_done, stage.num_shards), stage.num_held, stage.num_poisoned,
        stage.num_frames_planned > 0
            ? fmt::format("{}/{}", stage.num_frames, stage.num_frames_planned)
            : "",
        core::duration_text(stage.cpu_s), stage.bytes > 0.0 ? size_text(stage.bytes) : "");
  if (status.is_complete()) {
    text += fmt::format("complete, {}\n", size_text(status.bytes()));
  } else if (status.left_s >= 0.0) {
    text += fmt::format("{:.2f} frames/s, about {} left\n", status.frames_per_s,
                        core::duration_text(status.left_s));
  } else if (std::any_of(status.stages.begin(), status.stages.end(),
                         [](const auto& stage) { return stage.num_held > 0; })) {
    text += "at work; the time that is left shows when a shard is done\n";
  } else if (std::any_of(status.tried.begin(), status.tried.end(),
                         [](const Claims::Tried& tried) { return tried.is_poisoned; })) {
    text += fmt::format("nobody is at work; `{} batch run {} --retry` goes on\n",
                        core::program_with_plugins(), job);
  } else {
    text += fmt::format("nobody is at work; `{} batch run {}` goes on\n",
                        core::program_with_plugins(), job);
  }
  if (status.num_checks_failed > 0)
    text +=
        fmt::format("{} checks failed; see the reports below report/\n", status.num_checks_failed);
  std::size_t num_shown = 0;
  for (const Status::Tried& tried : status.tried) {
    const std::int64_t failures = num_failures(tried);
    if (failures == 0) continue;
    if (++num_shown > kFailuresShown) continue;
    text += fmt::format("{}{} {} {} times: {}\n    {}\n", tried.shard.text(),
                        tried.run.empty() ? "" : fmt::format(" ({})", tried.run),
                        tried.is_poisoned ? "was given up after it failed" : "failed", failures,
                        tried.last_error(), command_of(tried, job));
  }
  if (num_shown > kFailuresShown)
    text += fmt::format("and {} more; --json lists all\n", num_shown - kFailuresShown);
  text += way_without(status, job);
  for (const Status::Slow& slow : status.slowest)
    if (slow.wall_s >= 1.0 && slow.factor >= kSlow)
      text += fmt::format("slow: {} took {}, {:.1f} times the CPU time of its like\n",
                          slow.shard.text(), core::duration_text(slow.wall_s), slow.factor);
  return text;
}

core::Json status_json(const Status& status, const std::string& job) {
  core::Json stages = core::Json::object();
  for (const auto& stage : status.stages)
    stages.set(stage_name(stage.stage), core::Json::object()
                                            .set("shards", stage.num_shards)
                                            .set("done", stage.num_done)
                                            .set("at_work", stage.num_held)
                                            .set("given_up", stage.num_poisoned)
                                            .set("frames", stage.num_frames)
                                            .set("frames_planned", stage.num_frames_planned)
                                            .set("cpu_s", stage.cpu_s)
                                            .set("wall_s", stage.wall_s)
                                            .set("cpu_planned_s", stage.cpu_planned_s)
                                            .set("bytes", stage.bytes));
  core::Json failures = core::Json::array();
  for (const Status::Tried& tried : status.tried) {
    if (num_failures(tried) == 0) continue;
    failures.push(core::Json::object()
                      .set("shard", tried.shard.text())
                      .set("run", tried.run)
                      .set("tries", num_failures(tried))
                      .set("given_up", tried.is_poisoned)
                      .set("error", tried.last_error())
                      .set("command", command_of(tried, job)));
  }
  core::Json slowest = core::Json::array();
  for (const Status::Slow& slow : status.slowest)
    slowest.push(core::Json::object()
                     .set("shard", slow.shard.text())
                     .set("wall_s", slow.wall_s)
                     .set("factor", slow.factor));
  core::Json json = core::Json::object();
  json.set("name", status.name)
      .set("complete", status.is_complete())
      .set("frames_per_s", status.frames_per_s)
      .set("left_s", status.left_s >= 0.0 ? core::Json(status.left_s) : core::Json())
      .set("bytes", status.bytes())
      .set("checks_failed", status.num_checks_failed)
      .set("stages", std::move(stages))
      .set("failures", std::move(failures))
      .set("slowest", std::move(slowest));
  return json;
}

}  // namespace terracast::batch
