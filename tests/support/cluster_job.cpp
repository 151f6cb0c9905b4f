#include "tests/support/cluster_job.h"

#include <algorithm>

#include "batch/claims.h"
#include "batch/job_folder.h"
#include "core/error.h"
#include "core/random.h"

namespace terracast::test {
namespace {

using batch::Stage;

std::size_t at(int index) { return static_cast<std::size_t>(index); }
std::size_t at(Stage stage) { return static_cast<std::size_t>(stage); }

constexpr std::uint64_t kResidualStream = 0x726573696475;

struct Sample {
  double planned_s = 0.0;
  double measured_s = 0.0;
};

/// Fits measured = fixed + rate planned with neither below 0.
void fit(MeasuredStage& stage, const std::vector<Sample>& samples) {
  double planned_s = 0.0;
  double measured_s = 0.0;
  for (const Sample& sample : samples) {
    planned_s += sample.planned_s / static_cast<double>(samples.size());
    measured_s += sample.measured_s / static_cast<double>(samples.size());
  }
  double covariance = 0.0;
  double variance = 0.0;
  for (const Sample& sample : samples) {
    covariance += (sample.planned_s - planned_s) * (sample.measured_s - measured_s);
    variance += (sample.planned_s - planned_s) * (sample.planned_s - planned_s);
  }
  // Of shards that are all alike only the ratio is known.
  const double proportional = measured_s / planned_s;
  stage.rate = variance > 1e-9 * planned_s * planned_s
                   ? std::clamp(covariance / variance, 0.0, proportional)
                   : proportional;
  stage.fixed_s = measured_s - stage.rate * planned_s;
  for (const Sample& sample : samples)
    stage.residuals.push_back(sample.measured_s / (stage.fixed_s + stage.rate * sample.planned_s));
}

std::int64_t num_frames(const batch::Shard& shard, const batch::Plan& plan) {
  std::int64_t count = 0;
  for (const batch::Piece& piece : shard.pieces)
    count += shard.id.stage == Stage::Render ? piece.end_frame - piece.first_frame
                                             : plan.runs[at(piece.run)].num_frames();
  return count;
}

}  // namespace

std::vector<std::vector<double>> measured_times(const batch::Plan& plan,
                                                const std::filesystem::path& job_folder,
                                                bool is_wall) {
  const batch::Claims claims(batch::JobFolder{job_folder, plan.revision}.state(), plan.claims);
  std::vector<std::vector<double>> times;
  for (const Stage stage : batch::kStages) {
    times.emplace_back();
    for (const batch::Shard& shard : plan.of(stage))
      times.back().push_back(claims.record(shard.id).at(is_wall ? "wall_s" : "cpu_s").number());
  }
  return times;
}

MeasuredJob measure_job(const std::filesystem::path& job_folder, bool is_wall) {
  const batch::Plan plan = batch::read_plan(job_folder);
  const batch::Claims claims(batch::JobFolder{job_folder, plan.revision}.state(), plan.claims);
  MeasuredJob measured;
  for (const Stage stage : batch::kStages) {
    std::vector<Sample> samples;
    double planned_bytes = 0.0;
    double bytes = 0.0;
    for (const int index : claims.done(stage)) {
      const batch::Shard& shard = plan.of(stage).at(at(index));
      const core::Json record = claims.record(shard.id);
      samples.push_back({.planned_s = shard.cost.cpu_s,
                         .measured_s = record.at(is_wall ? "wall_s" : "cpu_s").number()});
      planned_bytes += shard.cost.bytes;
      bytes += record.at("bytes").number();
    }
    if (samples.empty())
      core::fail(core::ErrorKind::Input,
                 "{}: no shard of stage {} is done; run the batch to its end first",
                 job_folder.string(), batch::stage_name(stage));
    MeasuredStage& result = measured.stages[at(stage)];
    fit(result, samples);
    result.bytes_rate = planned_bytes > 0.0 ? bytes / planned_bytes : 0.0;
    if (stage == Stage::Merge)
      measured.merge_s_per_byte =
          samples.front().measured_s /
          (plan.cost_of(Stage::Export).bytes * measured.stages[at(Stage::Export)].bytes_rate);
  }
  return measured;
}

SimulatedJob job_of(const batch::Plan& plan) {
  // Gates: a run's tiles, its frames, its exports one by one; and all that the merge joins.
  SimulatedJob job;
  std::vector<int> exports_of_run;
  const int num_runs = static_cast<int>(plan.runs.size());
  job.num_gates = 2 * num_runs;
  for (const batch::PlannedRun& run : plan.runs) {
    exports_of_run.push_back(job.num_gates);
    job.num_gates += static_cast<int>(run.formats.size());
  }
  const int merge = job.num_gates++;
  for (const Stage stage : batch::kStages) {
    job.stages.emplace_back();
    for (const batch::Shard& shard : plan.of(stage)) {
      SimulatedShard simulated;
      const batch::Piece piece = shard.pieces.empty() ? batch::Piece() : shard.pieces.front();
      const int exported =
          stage == Stage::Merge ? -1 : exports_of_run[at(piece.run)] + piece.format;
      switch (stage) {
        case Stage::Tile:
          simulated.serves = {piece.run, -1};
          break;
        case Stage::Render:
          simulated.waits_for = piece.run;
          simulated.serves = {num_runs + piece.run, -1};
          break;
        case Stage::Export:
          simulated.waits_for = num_runs + piece.run;
          simulated.serves = {exported, merge};
          break;
        case Stage::Validate:
          simulated.waits_for = exported;
          simulated.serves = {merge, -1};
          break;
        case Stage::Merge:
          simulated.waits_for = merge;
          break;
      }
      job.stages.back().push_back(simulated);
    }
  }
  return job;
}

SimulatedJob job_of(const batch::Plan& plan, const MeasuredJob& measured, const FileUses& uses,
                    std::uint64_t seed) {
  SimulatedJob job = job_of(plan);
  const double exported_bytes =
      plan.cost_of(Stage::Export).bytes * measured.stages[at(Stage::Export)].bytes_rate;
  for (const Stage stage : batch::kStages) {
    const MeasuredStage& of_stage = measured.stages[at(stage)];
    const FileUse& use = uses[at(stage)];
    for (const batch::Shard& shard : plan.of(stage)) {
      SimulatedShard& simulated = job.stages[at(stage)][at(shard.id.index)];
      const auto frames = static_cast<double>(num_frames(shard, plan));
      const double unit = core::random_unit(seed, core::stream_of(kResidualStream, at(stage)),
                                            static_cast<std::uint64_t>(shard.id.index));
      const double residual = of_stage.residuals[static_cast<std::size_t>(
          unit * static_cast<double>(of_stage.residuals.size()))];
      simulated.start_s = of_stage.fixed_s * residual;
      simulated.cpu_s = simulated.start_s + of_stage.rate * shard.cost.cpu_s * residual;
      simulated.written_bytes = shard.cost.bytes * of_stage.bytes_rate;
      if (stage == Stage::Render) simulated.num_frames = static_cast<int>(frames);
      if (stage == Stage::Merge) {
        simulated.start_s = 0.0;
        simulated.cpu_s = exported_bytes * measured.merge_s_per_byte;
        simulated.read_bytes = exported_bytes;
        simulated.operations = use.operations_per_frame * static_cast<double>(plan.num_frames());
        continue;
      }
      simulated.operations = use.operations_per_shard + frames * use.operations_per_frame;
      simulated.read_bytes = use.read_bytes_per_shard + frames * use.read_bytes_per_frame;
    }
  }
  return job;
}

}  // namespace terracast::test
