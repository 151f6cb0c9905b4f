#include "cli/pipeline.h"

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/schema_writer.h"
#include "geo/trajectory.h"
#include "tiler/preview.h"
#include "validate/check.h"

namespace terracast::cli {
namespace {

namespace fs = std::filesystem;

core::Context stage_context(const core::Context& context, const core::Log& log) {
  return {.log = log, .num_threads = context.num_threads, .events_file = context.events_file};
}

render::SequencePlan plan_sequence(const Job& job, const geo::TrajectoryOptions& options) {
  const tiler::WorldSurface& surface = *job.surface;
  const geo::TrajectoryContext place{.frame = surface.frame(),
                                     .ground_height_m =
                                         [&](double lat_deg, double lon_deg) {
                                           return surface.measured_height_m(lat_deg, lon_deg);
                                         },
                                     .geoid = surface.geoid(),
                                     .base_folder = {}};
  render::SequencePlan plan;
  plan.name = options.name;
  plan.utc_start = options.utc_start;
  plan.rate_hz = options.rate_hz;
  plan.seed = job.config.seed;
  plan.states = core::with_context([&] { return geo::sample_frames(options, place); },
                                   fmt::format("laying out trajectory {}", options.name));
  plan.cameras = job.cameras;
  plan.conditions = job.config.conditions;
  plan.tracks = job.config.tracks;
  plan.detail = job.config.detail;
  RunConfig of_sequence =
      job.config;  // another sequence, format or memory bound changes no byte of this one
  of_sequence.trajectories = {options};
  of_sequence.exports.clear();
  of_sequence.tracing = {};
  of_sequence.validation = {};
  of_sequence.data = {};
  plan.config_toml = core::toml_text(of_sequence);
  return plan;
}

}  // namespace

std::vector<tiler::PreviewPath> paths_of(const Job& job) {
  std::vector<tiler::PreviewPath> paths;
  for (const auto& sequence : job.sequences) {
    tiler::PreviewPath path{.name = sequence.name, .positions_world = {}};
    for (const auto& state : sequence.states)
      path.positions_world.push_back(state.world_from_body.translation);
    paths.push_back(std::move(path));
  }
  return paths;
}

OutputFolders::OutputFolders(const fs::path& out)
    : world(out / "world"),
      captures(out / "capture"),
      exports(out / "export"),
      reports(out / "report") {}

Job prepare_job(RunConfig config, const core::Context& context) {
  Job job{.config = std::move(config), .cameras = {}, .surface = nullptr, .sequences = {}};
  job.cameras = render::build_cameras(job.config.rigs);
  for (const auto& chosen : job.config.exports)
    core::with_context([&] { chosen.exporter().check(job.cameras); },
                       fmt::format("checking that format {} can hold the rigs", chosen.format));
  const core::Log log = context.log.for_stage("sources");
  job.surface = tiler::WorldSurface::prepare(job.config.world, stage_context(context, log));
  for (const auto& options : job.config.trajectories)
    job.sequences.push_back(plan_sequence(job, options));
  return job;
}

world::TileStore tile(const Job& job, const fs::path& store, const core::Context& context) {
  const core::Log log = context.log.for_stage("tile");
  tiler::TilePlan plan{.detail = job.config.detail, .sequences = {}};
  for (const auto& sequence : job.sequences)
    plan.sequences.push_back(render::viewpoints_of(sequence.states, sequence.cameras));
  return core::with_context(
      [&] { return run_tile_stage(*job.surface, plan, store, stage_context(context, log)); },
      "running stage tile");
}

void render(const Job& job, const world::TileStore& store, const render::Shard& shard,
            const fs::path& captures, const core::Context& context) {
  const core::Log log = context.log.for_stage("render");
  for (const auto& sequence : job.sequences)
    core::with_context(
        [&] {
          render::run_render_stage(store, sequence, job.config.tracing, shard,
                                   captures / sequence.name, stage_context(context, log));
        },
        fmt::format("rendering sequence {}", sequence.name));
}

void export_formats(const Job& job, const OutputFolders& out, const core::Context& context) {
  const core::Log log = context.log.for_stage("export");
  core::with_context(
      [&] {
        exporters::run_export_stage(out.captures, job.config.exports, out.exports,
                                    stage_context(context, log));
      },
      "running stage export");
}

bool validate_formats(const Job& job, const OutputFolders& out, const core::Context& context) {
  const core::Log log = context.log.for_stage("validate");
  std::vector<std::string> formats;
  for (const auto& chosen : job.config.exports) {
    const validate::ValidateOptions options{
        .format = chosen.format,
        .seed = job.config.validation.seed,
        .samples_per_image = job.config.validation.samples_per_image};
    core::with_context(
        [&] {
          validate::run_validate_stage(out.exports / chosen.format, options,
                                       out.reports / chosen.format, stage_context(context, log));
        },
        fmt::format("validating {}", chosen.format));
    formats.push_back(chosen.format);
  }
  return validate::join_reports(out.reports, formats);
}

bool run(const Job& job, const fs::path& out_folder, const core::Context& context) {
  const OutputFolders out(out_folder);
  const world::TileStore store = tile(job, out.world, context);
  core::write_file(out.reports / "map.png",
                   core::encode_png(tiler::render_preview(store, paths_of(job)), 6));
  render(job, store, {}, out.captures, context);
  export_formats(job, out, context);
  return validate_formats(job, out, context);
}

}  // namespace terracast::cli
