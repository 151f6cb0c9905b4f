#include "job/stages.h"

#include <algorithm>

#include "capture/frame_reader.h"
#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/stage_cost.h"
#include "geo/geoid.h"
#include "job/afloat.h"
#include "job/clearance.h"
#include "job/moving.h"
#include "job/traffic/traffic_site.h"
#include "render/checked_plan.h"
#include "tiler/preview.h"
#include "tiler/tile_stage.h"
#include "validate/check.h"

namespace terracast::job {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

OutputFolders::OutputFolders(const fs::path& out)
    : world(out / "world"),
      captures(out / "capture"),
      exports(out / "export"),
      reports(out / "report") {}

world::TileStore tile(const Job& job, const fs::path& store, const core::Context& context,
                      std::shared_ptr<const tiler::WorldSurface> surface) {
  if (surface == nullptr) surface = lay_out_world(job, context);
  const core::Log log = context.log.for_stage("tile");
  const core::StageCost cost(context.with_log(log), "tile");
  for (const auto& sequence : job.sequences)
    core::with_context([&] { check_afloat(sequence.moving, *surface); },
                       fmt::format("laying out what moves in sequence {}", sequence.name));
  tiler::TilePlan plan{.detail = job.config.detail, .sequences = {}};
  for (const auto& sequence : job.sequences)
    plan.sequences.push_back(render::viewpoints_of(sequence.states, sequence.cameras));
  return core::with_context(
      [&] { return run_tile_stage(*surface, plan, store, context.with_log(log)); },
      "running stage tile");
}

namespace {

/// throws Input: a path that does not stay as clear of the world as the config says
void check_clearance(const Job& job, const render::SequencePlan& sequence,
                     const world::TileStore& store, const core::Context& context) {
  const ClearanceConfig& clearance = job.config.clearance;
  if (clearance.min_m <= 0.0) return;
  const auto trajectory =
      std::find_if(job.config.trajectories.begin(), job.config.trajectories.end(),
                   [&](const geo::TrajectoryOptions& one) { return one.name == sequence.name; });
  TERRACAST_CHECK(trajectory != job.config.trajectories.end(), "sequence {} without a trajectory",
                  sequence.name);
  if (!clearance.is_of(*trajectory)) return;
  prove_clearance(sequence, clearance.min_m, store, context);
  context.log.info("sequence {}: the whole path stays {} m or more from every surface",
                   sequence.name, clearance.min_m);
}

/// A world that was tiled for other flights, or for coarser images, has not all the detail that this
/// config asks for.
void check_detail(const world::TileStore& store, const render::SequencePlan& sequence) {
  const auto tile = world::missing_detail(store, render::viewpoints_of(sequence), sequence.detail);
  if (tile)
    fail(ErrorKind::Input,
         "{}: the world is not tiled for sequence {}: cells of {} m in tile {} are too coarse for "
         "its cameras; run `terracast tile` with this config first",
         store.folder().string(), sequence.name, tile->spacing_m(), tile->name());
}

/// What the last of several sequences would be refused for is refused before the first is rendered.
void check_sequences(const Job& job, const world::TileStore& store, const core::Context& context) {
  for (const render::SequencePlan& sequence : job.sequences)
    core::with_context(
        [&] {
          check_detail(store, sequence);
          check_clearance(job, sequence, store, context);
          // Of a single one rendering finds out.
          if (job.sequences.size() > 1) render::check_rides(sequence, store, job.config.tracing);
        },
        fmt::format("rendering sequence {}", sequence.name));
}

/// Renders a sequence of which check_detail() and check_clearance() found nothing wrong.
render::RenderedFrames render_checked(const Job& job, const render::SequencePlan& sequence,
                                      const world::TileStore& store,
                                      const capture::FrameSelection& selection,
                                      const fs::path& folder, const core::Context& context,
                                      const std::vector<fs::path>& earlier_folders) {
  render::SequencePlan plan = sequence;
  add_traffic(job, store, context.log, plan);
  return render::run_render_stage(store, plan, job.config.tracing, selection, folder, context,
                                  earlier_folders);
}

}  // namespace

render::RenderedFrames render_sequence(const Job& job, const render::SequencePlan& sequence,
                                       const world::TileStore& store,
                                       const capture::FrameSelection& selection,
                                       const fs::path& folder, const core::Context& context,
                                       const std::vector<fs::path>& earlier_folders) {
  return core::with_context(
      [&] {
        check_detail(store, sequence);
        check_clearance(job, sequence, store, context);
        return render_checked(job, sequence, store, selection, folder, context, earlier_folders);
      },
      fmt::format("rendering sequence {}", sequence.name));
}

void render(const Job& job, const world::TileStore& store, const capture::FrameSelection& selection,
            const fs::path& captures, const core::Context& context) {
  const core::Log log = context.log.for_stage("render");
  const core::StageCost cost(context.with_log(log), "render");
  check_sequences(job, store, context.with_log(log));
  for (const auto& sequence : job.sequences)
    core::with_context(
        [&] {
          render_checked(job, sequence, store, selection, captures / sequence.name,
                         context.with_log(log), {});
        },
        fmt::format("rendering sequence {}", sequence.name));
}

std::vector<labels::LabelOptions> wanted_labels(const RunConfig& config) {
  std::vector<labels::LabelOptions> wanted = config.labels;
  for (const auto& chosen : config.exports)
    for (const std::string& kind : chosen.exporter().labels())
      if (std::none_of(wanted.begin(), wanted.end(),
                       [&](const labels::LabelOptions& one) { return one.kind == kind; }))
        wanted.emplace_back(kind);
  return wanted;
}

labels::SequenceOutline outline_of(const RunConfig& config, const std::string& name,
                                   const std::vector<capture::CameraCalibration>& cameras,
                                   std::size_t num_frames, double rate_hz) {
  return {.name = name,
          .cameras = cameras,
          .num_frames = static_cast<int>(num_frames),
          .rate_hz = rate_hz,
          .shares_geometry = config.shared_geometry,
          .has_bottom_range = config.conditions.bottom_range};
}

namespace {

/// The sequences of a config in a folder of captures.
std::vector<capture::SequenceReader> open_captured(const RunConfig& config,
                                                   const fs::path& captures, const core::Log& log) {
  std::vector<exporters::WantedSequence> wanted;
  for (const auto& trajectory : config.trajectories)
    wanted.push_back({trajectory.name, toml_of_sequence(config, trajectory)});
  return exporters::open_sequences(captures, wanted, log);
}

/// Holds labels against sequences that are captured.
void check_captured(const RunConfig& config, const std::vector<labels::LabelOptions>& labels,
                    const std::vector<capture::SequenceReader>& sequences, const core::Log& log) {
  std::vector<labels::SequenceOutline> outlines;
  for (const capture::SequenceReader& sequence : sequences)
    outlines.push_back(outline_of(config, sequence.info().name, sequence.info().cameras,
                                  sequence.frames().size(), sequence.info().rate_hz));
  labels::check_labels(labels, outlines, log);
}

}  // namespace

void label(const RunConfig& config, const world::TileStore& store, const fs::path& captures,
           const core::Context& context, bool are_checked) {
  const std::vector<labels::LabelOptions> labels = wanted_labels(config);
  if (labels.empty()) return;
  const core::Log log = context.log.for_stage("label");
  const core::StageCost cost(context.with_log(log), "label");
  core::with_context(
      [&] {
        const std::vector<capture::SequenceReader> sequences = open_captured(config, captures, log);
        if (!are_checked) check_captured(config, labels, sequences, log);
        for (const capture::SequenceReader& sequence : sequences)
          labels::run_label_stage(sequence, store, captured_things(sequence.info()), labels,
                                  context.with_log(log),
                                  {.sequences = sequences, .things_of = captured_things});
      },
      "running stage label");
}

void export_formats(const RunConfig& config, const OutputFolders& out,
                    const core::Context& context) {
  if (config.exports.empty())
    fail(ErrorKind::Config, "the config names no format; add an [[exports]]");
  const core::Log log = context.log.for_stage("export");
  const core::StageCost cost(context.with_log(log), "export");
  core::with_context(
      [&] {
        exporters::run_export_stage(open_captured(config, out.captures, log), config.exports,
                                    out.exports, context.with_log(log));
      },
      "running stage export");
}

validate::GroundMapMaker ground_map_of(const world::TileStore& store) {
  return [store](const validate::MapArea& area, int size_px) -> std::optional<core::Image8> {
    const geo::WorldFrame local({area.lat_deg, area.lon_deg, area.height_m});
    const geo::WorldFrame world(store.manifest().origin);
    const auto world_from_local = [&](double x_local, double y_local) -> Eigen::Vector2d {
      return world.world_from_geodetic(local.geodetic_from_world({x_local, y_local, 0.0}))
          .head<2>();
    };
    // Over a flight's surroundings one tangent plane maps to the other as a rotation, to metres.
    const Eigen::Vector2d corner = world_from_local(area.west_m, area.north_m);
    const double width_m = area.east_m - area.west_m;
    const double height_m = area.north_m - area.south_m;
    const double metres_per_px = std::max(width_m, height_m) / size_px;
    const int width_px = std::max(1, static_cast<int>(std::lround(width_m / metres_per_px)));
    const int height_px = std::max(1, static_cast<int>(std::lround(height_m / metres_per_px)));
    Eigen::Affine2d world_from_pixel = Eigen::Affine2d::Identity();
    world_from_pixel.translation() = corner;
    world_from_pixel.linear().col(0) =
        (world_from_local(area.east_m, area.north_m) - corner) / width_px;
    world_from_pixel.linear().col(1) =
        (world_from_local(area.west_m, area.south_m) - corner) / height_px;
    const Eigen::Vector2d middle =
        world_from_pixel * Eigen::Vector2d(0.5 * width_px, 0.5 * height_px);
    if (!(middle.cwiseAbs().maxCoeff() < 0.5 * store.manifest().size_m)) return std::nullopt;
    try {
      return tiler::render_relief(store, world_from_pixel, width_px, height_px);
    } catch (const core::Error& error) {
      if (error.kind() == ErrorKind::Interrupted) throw;
      return std::nullopt;  // the report shows the ground by the dataset's depth
    }
  };
}

std::optional<double> egm96_undulation_m(double lat_deg, double lon_deg) {
  try {
    return geo::Geoid::egm96()->undulation_m(lat_deg, lon_deg);
  } catch (const core::Error&) {
    return std::nullopt;  // PROJ's data may lack the grid
  }
}

validate::ValidateOptions validate_options(const RunConfig& config, const std::string& format,
                                           const world::TileStore& store) {
  return {.format = format,
          .seed = config.validation.seed,
          .samples_per_image = config.validation.samples_per_image,
          .world = store.folder(),
          .oracle_samples = config.validation.oracle_samples,
          .ground_map = ground_map_of(store),
          .undulation_m = egm96_undulation_m};
}

bool validate_formats(const Job& job, const OutputFolders& out, const core::Context& context) {
  const core::Log log = context.log.for_stage("validate");
  const core::StageCost cost(context.with_log(log), "validate");
  std::vector<std::string> formats;
  const world::TileStore store = world::TileStore::open(out.world);
  for (const auto& chosen : job.config.exports) {
    const validate::ValidateOptions options = validate_options(job.config, chosen.format, store);
    core::with_context(
        [&] {
          validate::run_validate_stage(out.exports / chosen.format, options,
                                       out.reports / chosen.format, context.with_log(log));
        },
        fmt::format("validating {}", chosen.format));
    formats.push_back(chosen.format);
  }
  return validate::join_reports(out.reports, formats, context.events_file);
}

std::optional<bool> run(const Job& job, const fs::path& out_folder, const core::Context& context) {
  const OutputFolders out(out_folder);
  for (const auto& sequence : job.sequences)
    capture::check_captured_config(out.captures / sequence.name, sequence.config_toml);
  const world::TileStore store = tile(job, out.world, context);
  core::write_file(out.reports / "map.png",
                   core::encode_png(tiler::render_preview(store, paths_of(job)), 6));
  render(job, store, {}, out.captures, context);
  label(job.config, store, out.captures, context, true);
  if (job.config.exports.empty()) {
    context.log.warn("the config names no format: nothing is exported, and nothing checked");
    return std::nullopt;
  }
  export_formats(job.config, out, context);
  return validate_formats(job, out, context);
}

}  // namespace terracast::job
