#include "job/job.h"

#include <algorithm>
#include <iterator>
#include <span>

#include "core/plugin_rows.h"
#include "core/schema_writer.h"
#include "core/stage_cost.h"
#include "export/cameras.h"
#include "geo/fine_rim.h"
#include "geo/geoid.h"
#include "geo/trajectory.h"
#include "job/stages.h"
#include "render/checked_plan.h"
#include "rigs/rig_errors.h"
#include "tiler/layer_stack.h"
#include "world/embree_scene.h"

namespace terracast::job {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// When ${data} is no folder, that explains every file below it.
void check_data_folder(const RunConfig& config) {
  if (config.data.empty() || fs::is_directory(config.data.resolved)) return;
  for (const auto& source : config.world.elevation)
    for (const core::Path& file : source.files)
      if (file.written.find("${data}") != std::string::npos)
        fail(ErrorKind::Io,
             "data = \"{}\": there is no folder {}, and {} is to be there; say where the source "
             "data is with --set data=FOLDER",
             config.data.written, config.data.resolved.string(), file.resolved.string());
}

std::string opening_sources(const RunConfig& config) {
  return config.data.empty() ? "opening the world's sources"
                             : fmt::format("opening the world's sources (${{data}} is {})",
                                           config.data.resolved.string());
}

/// Nothing that a later stage would refuse may cost the time of an earlier one.
void check_frames(const Job& job) {
  constexpr std::size_t kLeastFrames = 2;  // flow, and the checks that hold frames together
  for (const render::SequencePlan& plan : job.sequences)
    if (!job.config.exports.empty() && plan.states.size() < kLeastFrames)
      fail(ErrorKind::Config,
           "sequence {} has {} frame; an exported one needs {} or more: raise num_frames, or set "
           "exports=[]",
           plan.name, plan.states.size(), kLeastFrames);
}

/// throws Config: a sequence has too few images for a format
void check_images(const RunConfig& config, std::span<const labels::SequenceOutline> sequences) {
  for (const auto& chosen : config.exports)
    for (const labels::SequenceOutline& sequence : sequences) {
      const exporters::Exporter& exporter = chosen.exporter();
      if (!exporter.takes_any_of(sequence.cameras)) continue;
      const auto num_cameras =
          static_cast<std::int64_t>(exporters::cameras_taken(exporter, sequence.cameras).size());
      if (num_cameras * sequence.num_frames < exporter.least_images())
        fail(ErrorKind::Config,
             "sequence {} has {} frames of {} cameras for format {}, which needs {} images of a "
             "sequence: raise num_frames, or leave the export out",
             sequence.name, sequence.num_frames, num_cameras, chosen.format,
             exporter.least_images());
    }
}

/// Warns of too few track points for what is exported of a sequence.
/// throws Config: so few that its checks cannot but fail
void check_tracks(const RunConfig& config, std::span<const labels::SequenceOutline> sequences,
                  const core::Log& log) {
  const std::int64_t num_points = config.tracks.num_points;
  for (const auto& chosen : config.exports)
    for (const labels::SequenceOutline& sequence : sequences) {
      if (!chosen.exporter().takes_any_of(sequence.cameras)) continue;
      const auto [least, expected] =
          chosen.exporter().track_points_wanted(sequence.cameras, sequence.num_frames);
      if (num_points < least)
        fail(ErrorKind::Config,
             "tracks.num_points = {}; the {} export of sequence {} is checked to hold {} points: "
             "raise it, or leave the export out",
             num_points, chosen.format, sequence.name, least);
      if (num_points < expected)
        log.warn(
            "tracks.num_points = {}: they are drawn from the images of all {} cameras, and the {} "
            "export of sequence {} may show fewer than the {} that it is checked to hold; {} are "
            "enough in any case",
            num_points, sequence.cameras.size(), chosen.format, sequence.name, least, expected);
    }
}

/// Traffic goes along the ways of a layer, but for ships.
void check_traffic(const RunConfig& config) {
  const auto& layers = config.world.layers;
  const bool is_of_ships = std::all_of(config.traffic.begin(), config.traffic.end(),
                                       [](const auto& traffic) { return traffic.is_of_ships(); });
  if (is_of_ships || std::any_of(layers.begin(), layers.end(),
                                 [](const auto& layer) { return layer.kind == "roads"; }))
    return;
  fail(ErrorKind::Config,
       "the config asks for traffic, and its world has no ways: give it a layer of kind "
       "\"roads\", or leave out [[traffic]]");
}

/// The cameras as they are; without errors they are those of the config.
void set_cameras(const Job& job, const geo::TrajectoryOptions& options,
                 render::SequencePlan& plan) {
  const std::vector<rigs::RigOptions> rigs = carried_rigs(job.config.rigs, options);
  plan.cameras = job.cameras.of(options);
  plan.imaging = rigs::imaging_of_cameras(rigs);
  rigs::TrueRigs drawn = rigs::draw_true_rigs(rigs, plan.cameras, job.config.seed, plan.name);
  plan.clocks = std::move(drawn.clocks);
  plan.sensors = rigs::mount_sensors(rigs, drawn.cameras);
  sensors::draw_clocks(plan.sensors, job.config.seed, plan.name);
  if (drawn.cameras == plan.cameras) return;
  plan.believed_cameras = std::move(plan.cameras);
  plan.cameras = std::move(drawn.cameras);
}

/// throws Config: a format that cannot hold the cameras of a sequence as they are
void check_true_cameras(const RunConfig& config,
                        std::span<const labels::SequenceOutline> sequences) {
  for (const labels::SequenceOutline& sequence : sequences)
    for (const auto& chosen : config.exports) {
      if (!chosen.exporter().takes_any_of(sequence.cameras)) continue;
      core::with_context([&] { chosen.exporter().check(sequence.cameras); },
                         fmt::format("checking that format {} can hold the rigs with the errors "
                                     "that they have in sequence {}",
                                     chosen.format, sequence.name));
    }
}

/// All sequences show what the most demanding of them asks for.
void share_geometry(Job& job) {
  auto all = std::make_shared<std::vector<world::Viewpoint>>();
  for (const render::SequencePlan& plan : job.sequences) {
    std::vector<world::Viewpoint> own = render::viewpoints_of(plan.states, plan.cameras);
    std::move(own.begin(), own.end(), std::back_inserter(*all));
  }
  for (render::SequencePlan& plan : job.sequences) plan.shared_viewpoints = all;
}

/// How long before and after a frame's time lines of its images are exposed, at most.
double reach_of_lines_s(const render::SequencePlan& plan) {
  double longest_s = 0.0;
  for (const capture::CameraCalibration& camera : plan.cameras)
    longest_s = std::max(
        longest_s, camera.shutter.reach_s(camera.intrinsics.width_px, camera.intrinsics.height_px));
  return longest_s;
}

/// Says how near the poses of lines come to the trajectory, where there are lines.
void tell_terms(const std::vector<geo::BodyState>& states, const core::Log& log) {
  double error_m = 0.0, error_rad = 0.0;
  for (const geo::BodyState& state : states) {
    error_m = std::max(error_m, state.terms.error_m);
    error_rad = std::max(error_rad, state.terms.error_rad);
  }
  if (states.front().terms.are_any())
    log.info("poses of lines are within {:.2g} m and {:.2g} rad of the motion", error_m, error_rad);
}

/// Warns of cameras for which a world is made and read at its finest wherever they look.
void tell_fine_rims(const std::vector<capture::CameraCalibration>& cameras, const core::Log& log) {
  for (const capture::CameraCalibration& camera : cameras)
    if (const auto rim = geo::find_fine_rim(*geo::make_camera(camera.intrinsics)))
      log.warn(
          "camera {}/{}: its finest pixels, {:.3g} a radian, see next to nothing beside the usual "
          "ones, {:.3g} a radian, and the level of detail serves the finest wherever it looks, so "
          "that far more tiles are made than the image shows; the view reaches the end of what "
          "model {} can hold: a larger focal length or a smaller image mends that",
          camera.rig, camera.name, rim->finest_pixels_per_radian, rim->usual_pixels_per_radian,
          camera.intrinsics.model);
}

geo::TrajectoryContext trajectory_context(const Job& job, double half_size_m,
                                          const core::Log& log) {
  const tiler::WorldSurface& ground = *job.ground;
  return {.frame = ground.frame(),
          .ground_height_m =
              [&ground](double lat_deg, double lon_deg) {
                return ground.measured_height_m(lat_deg, lon_deg);
              },
          .geoid = geo::Geoid::egm96(),
          .log = &log,
          .half_size_m = half_size_m};
}

/// Entries that become several sequences are replaced by those.
void split_trajectories(Job& job, const core::Context& context) {
  std::vector<geo::TrajectoryOptions> all;
  const std::vector<double> half_sizes = half_sizes_m(job);
  for (std::size_t i = 0; i < half_sizes.size(); ++i) {
    const geo::TrajectoryOptions& options = job.config.trajectories[i];
    const core::Log log = context.log.for_stage("trajectory " + options.name);
    for (auto& sequence :
         geo::split_sequences(options, trajectory_context(job, half_sizes[i], log)))
      all.push_back(std::move(sequence));
  }
  job.config.trajectories = std::move(all);
  job.config.validate();
}

/// half_sizes   of all trajectories
/// index        of the sequence's
render::SequencePlan plan_sequence(const Job& job, const std::vector<double>& half_sizes,
                                   std::size_t index, const core::Log& log) {
  const geo::TrajectoryOptions& options = job.config.trajectories[index];
  render::SequencePlan plan;
  plan.name = options.name;
  plan.rate_hz = options.rate_hz;
  plan.seed = job.config.seed;
  set_cameras(job, options, plan);
  geo::TrajectoryContext of_body = trajectory_context(job, half_sizes[index], log);
  of_body.reach_s = reach_of_lines_s(plan);
  geo::SampledFrames frames =
      core::with_context([&] { return geo::sample_frames(options, of_body); },
                         fmt::format("laying out trajectory {}", options.name));
  plan.utc_start = frames.utc_start;
  plan.states = std::move(frames.states);
  plan.motion = std::move(frames.motion);
  tell_terms(plan.states, log);
  tell_fine_rims(plan.cameras, log);
  geo::TrajectoryContext of_things = trajectory_context(job, 0.5 * job.config.world.size_m, log);
  of_things.reach_s = reach_of_bodies_s(plan);
  plan.moving = lay_out_moving(job.config.moving, {job.config.trajectories, half_sizes}, options,
                               plan.states, of_things);
  plan.conditions = job.config.conditions;
  plan.facts = job.config.facts.options();
  plan.tracks = job.config.tracks;
  plan.detail = job.config.detail;
  plan.config_toml = toml_of_sequence(job.config, options);
  render::check_inside(plan, job.ground->frame(), job.config.world.size_m);
  render::check_exposures(plan);
  render::check_sensors(plan);
  return plan;
}

std::shared_ptr<const tiler::WorldSurface> open_ground(const RunConfig& config,
                                                       const core::Context& context,
                                                       const fs::path& store) {
  return core::with_context(
      [&] { return tiler::WorldSurface::prepare_ground(config.world, context, store); },
      opening_sources(config));
}

}  // namespace

double reach_of_bodies_s(const render::SequencePlan& plan) {
  const double of_lines_s = reach_of_lines_s(plan);
  return plan.sensors.empty() ? of_lines_s : std::max(of_lines_s, 0.5 / plan.rate_hz);
}

void check_formats(const RunConfig& config, const CarriedCameras& cameras) {
  std::vector<exporters::SequenceCameras> sequences;
  for (const geo::TrajectoryOptions& trajectory : config.trajectories)
    sequences.push_back({trajectory.name, cameras.of(trajectory)});
  exporters::check_formats(config.exports, sequences);
}

void check_outputs(const RunConfig& config, std::span<const labels::SequenceOutline> sequences,
                   const core::Log& log) {
  check_images(config, sequences);
  check_tracks(config, sequences, log);
  check_true_cameras(config, sequences);
  labels::check_labels(wanted_labels(config), sequences, log);
}

std::vector<labels::SequenceOutline> outlines_of(const Job& job) {
  std::vector<labels::SequenceOutline> outlines;
  for (const render::SequencePlan& plan : job.sequences)
    outlines.push_back(
        outline_of(job.config, plan.name, plan.cameras, plan.states.size(), plan.rate_hz));
  return outlines;
}

std::vector<double> half_sizes_m(const Job& job) {
  std::vector<double> half_sizes;
  for (const geo::TrajectoryOptions& trajectory : job.config.trajectories)
    half_sizes.push_back(0.5 * job.config.world.size_m - job.cameras.reach_m(trajectory));
  return half_sizes;
}

std::string toml_of_sequence(const RunConfig& config, const geo::TrajectoryOptions& trajectory) {
  RunConfig of_sequence = config;
  of_sequence.trajectories = {trajectory};
  // What is seen in it counts too, and who shares its geometry.
  for (const geo::TrajectoryOptions& other : config.trajectories)
    if ((!other.shown_as.empty() || config.shared_geometry) && other.name != trajectory.name)
      of_sequence.trajectories.push_back(other);
  return toml_of_captures(of_sequence);
}

std::string toml_of_captures(const RunConfig& config) {
  RunConfig of_captures = config;
  of_captures.required_plugins.clear();
  of_captures.labels.clear();
  of_captures.exports.clear();
  of_captures.clearance = {};
  of_captures.tracing = {};
  of_captures.validation = {};
  of_captures.data = {};
  keep_carried_rigs(of_captures.rigs, of_captures.trajectories);
  // A comment for each plug-in that takes part: edited, it is another config.
  const std::string text = core::toml_text(of_captures);
  std::string comments;
  for (const core::Plugin* plugin : core::plugins_named_in(text))
    comments +=
        fmt::format("# plugin {} {} {}\n", plugin->name, plugin->version, plugin->content_hash);
  return comments + text;
}

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

RunConfig with_sequences(RunConfig config, const core::Context& context, const fs::path& store) {
  const bool is_split =
      std::any_of(config.trajectories.begin(), config.trajectories.end(),
                  [](const geo::TrajectoryOptions& one) { return one.kind_options().is_split(); });
  if (!is_split) return config;
  Job job{.config = std::move(config), .cameras = {}, .ground = {}, .sequences = {}};
  job.cameras = CarriedCameras(job.config.rigs, job.config.trajectories);
  check_data_folder(job.config);
  const core::Log log = context.log.for_stage("sources");
  const core::StageCost cost(context.with_log(log), "preparing the ground");
  job.ground = open_ground(job.config, context.with_log(log), store);
  split_trajectories(job, context);
  return std::move(job.config);
}

Job prepare_job(RunConfig config, const core::Context& context, const fs::path& store,
                std::shared_ptr<const tiler::WorldSurface> ground) {
  Job job{.config = std::move(config), .cameras = {}, .ground = std::move(ground), .sequences = {}};
  job.cameras = CarriedCameras(job.config.rigs, job.config.trajectories);
  check_formats(job.config, job.cameras);
  // Refuses what this machine has not.
  const world::EmbreeDevice device(job.config.tracing.embree_profile);
  check_traffic(job.config);
  check_data_folder(job.config);
  const core::Log log = context.log.for_stage("sources");
  const core::StageCost cost(context.with_log(log), "preparing the ground and the flights");
  if (job.ground == nullptr) job.ground = open_ground(job.config, context.with_log(log), store);
  split_trajectories(job, context);
  const std::vector<double> half_sizes = half_sizes_m(job);
  for (std::size_t i = 0; i < half_sizes.size(); ++i)
    job.sequences.push_back(
        plan_sequence(job, half_sizes, i,
                      context.log.for_stage("trajectory " + job.config.trajectories[i].name)));
  if (job.config.shared_geometry) share_geometry(job);
  check_frames(job);
  check_outputs(job.config, outlines_of(job), context.log);
  return job;
}

std::shared_ptr<const tiler::WorldSurface> lay_out_world(const Job& job,
                                                         const core::Context& context) {
  const core::Log log = context.log.for_stage("sources");
  const core::StageCost cost(context.with_log(log), "laying out the world");
  return core::with_context(
      [&] { return tiler::layered_surface(job.ground, context.with_log(log)); },
      opening_sources(job.config));
}

}  // namespace terracast::job
