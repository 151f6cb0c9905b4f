#include "render/render_stage.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "capture/frame_writer.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/schema_writer.h"
#include "geo/geodesy.h"
#include "render/frame_renderer.h"
#include "render/scratch_pool.h"
#include "render/tracks.h"

namespace terracast::render {
namespace {

using core::ErrorKind;
using core::fail;

/// Part of every input hash: one more when the same inputs give other bytes.
constexpr int kRenderVersion = 3;
/// Cameras nearer to the ground than this stand in it for all that images can show.
constexpr double kLeastClearance_m = 0.25;
/// Camera images in work at once: enough for every thread to have one while others are encoded, few
/// enough to lose little.
constexpr int kImagesInFlight = 3;
/// Frames whose tiles are loaded before they are needed.
constexpr std::size_t kFramesExpected = 4;

void append_numbers(std::string& text, const double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    fmt::format_to(std::back_inserter(text), " {:.17g}", values[i]);
  text += '\n';
}

void append_pose(std::string& text, const geo::Rigid3d& pose) {
  append_numbers(text, pose.rotation.coeffs().data(), 4);
  append_numbers(text, pose.translation.data(), 3);
}

std::vector<world::CutTile> cut_of(const world::TileStore& store, const SequencePlan& plan) {
  std::vector<world::CutTile> cut =
      world::choose_cut(store, viewpoints_of(plan.states, plan.cameras), plan.detail);
  if (cut.size() > kMaxCutTiles) {
    fail(ErrorKind::Input,
         "sequence {} needs {} tiles at once; up to {} can be told apart: raise detail.cell_px or "
         "detail.finest_spacing_m, or cut the trajectory in two",
         plan.name, cut.size(), kMaxCutTiles);
  }
  return cut;
}

std::string input_hash_of(const SequencePlan& plan, const world::TileStore& store,
                          const std::vector<world::CutTile>& cut) {
  std::string text =
      fmt::format("render {}\nworld {}\n", kRenderVersion, store.manifest().input_hash);
  text += fmt::format("sequence {} {} {:.17g} {}\n", plan.name, plan.utc_start, plan.rate_hz,
                      plan.seed);
  for (const geo::BodyState& state : plan.states) {
    append_numbers(text, &state.time_s, 1);
    append_pose(text, state.world_from_body);
    append_numbers(text, state.velocity_world_mps.data(), 3);
    append_numbers(text, state.acceleration_world_mps2.data(), 3);
    append_numbers(text, state.angular_velocity_body_radps.data(), 3);
  }
  for (const capture::CameraCalibration& camera : plan.cameras) {
    const geo::CameraIntrinsics& intrinsics = camera.intrinsics;
    text += fmt::format("camera {} {} {} {} {}\n", camera.rig, camera.name, intrinsics.model,
                        intrinsics.width_px, intrinsics.height_px);
    append_numbers(text, intrinsics.parameters.data(), intrinsics.parameters.size());
    append_pose(text, camera.rig_from_camera);
    append_pose(text, camera.body_from_rig);
  }
  text += core::toml_text(plan.conditions);
  text += core::toml_text(plan.tracks);
  for (const world::CutTile& tile : cut) {
    text += fmt::format("tile {} {} {}\n", tile.id.name(), tile.coarser_sides,
                        store.find(tile.id)->content_hash);
  }
  text += plan.config_toml;
  return core::content_hash(text);
}

capture::ShownGeometry geometry_of(const SequencePlan& plan, const world::TileStore& store,
                                   const std::vector<world::CutTile>& cut) {
  capture::ShownGeometry geometry{.cell_px = plan.detail.cell_px,
                                  .finest_spacing_m = plan.detail.finest_spacing_m,
                                  .tiles = {}};
  for (const world::CutTile& tile : cut)
    geometry.tiles.push_back({.level = tile.id.level,
                              .x = tile.id.x,
                              .y = tile.id.y,
                              .content_hash = store.find(tile.id)->content_hash});
  return geometry;
}

void check_plan(const SequencePlan& plan, const capture::FrameSelection& selection) {
  if (plan.states.empty()) fail(ErrorKind::Config, "sequence {} has no frames", plan.name);
  if (plan.cameras.empty()) fail(ErrorKind::Config, "sequence {} has no cameras", plan.name);
  if (selection.first < 0 || selection.end < selection.first || selection.step < 1) {
    fail(ErrorKind::Usage,
         "frames {} to {} by {}: frames count from 0, a selection ends where it begins or later, "
         "and "
         "its step is 1 or more",
         selection.first, selection.end, selection.step);
  }
  plan.conditions.validate();
}

std::string place_of(const SequencePlan& plan, int frame, int camera,
                     const Eigen::Vector3d& center_world, const geo::WorldFrame& frame_of_world) {
  const geo::Geodetic place = frame_of_world.geodetic_from_world(center_world);
  const capture::CameraCalibration& calibration = plan.cameras[static_cast<std::size_t>(camera)];
  return fmt::format("sequence {}, frame {}, camera {}/{} at {:.6f} N {:.6f} E {:.1f} m", plan.name,
                     frame, calibration.rig, calibration.name, place.lat_deg, place.lon_deg,
                     place.height_m);
}

/// throws Input: the first camera that stands not clearly above the ground
void check_clearance(const SequencePlan& plan, const world::TileStore& store,
                     const world::RayQuery& query, const ViewTable& views) {
  const geo::WorldFrame frame_of_world(store.manifest().origin);
  for (int frame = 0; frame < views.num_frames(); ++frame) {
    for (int camera = 0; camera < views.num_cameras(); ++camera) {
      const Eigen::Vector3d& center = views.at(frame, camera).center_world;
      const auto where = [&] { return place_of(plan, frame, camera, center, frame_of_world); };
      const std::optional<double> ground_z = query.surface_z_world(center.x(), center.y());
      if (!ground_z) fail(ErrorKind::Input, "{}: the world has no ground there", where());
      const double clearance_m = center.z() - *ground_z;
      if (clearance_m < 0.0) {
        fail(ErrorKind::Input, "{}: {:.2f} m under the ground; raise the trajectory there", where(),
             -clearance_m);
      }
      if (clearance_m < kLeastClearance_m) {
        fail(ErrorKind::Input, "{}: {:.2f} m above the ground; a camera needs {} m", where(),
             clearance_m, kLeastClearance_m);
      }
    }
  }
}

std::vector<world::Viewpoint> viewpoints_of_frames(const ViewTable& views, int first, int last) {
  std::vector<world::Viewpoint> viewpoints;
  for (int frame = first; frame <= std::min(last, views.num_frames() - 1); ++frame) {
    for (int camera = 0; camera < views.num_cameras(); ++camera) {
      const View& view = views.at(frame, camera);
      viewpoints.push_back({.position_world = view.center_world,
                            .pixels_per_radian = view.model->finest_pixels_per_radian()});
    }
  }
  return viewpoints;
}

static_assert(world::kCenterReach_m <= 1.0, "as capture::TileScale says");
std::vector<capture::TileScale> scales_of(const world::TileStore& store,
                                          const std::vector<world::CutTile>& cut) {
  std::vector<capture::TileScale> scales;
  scales.reserve(cut.size());
  for (const world::CutTile& tile : cut) {
    const world::TileInfo& info = *store.find(tile.id);
    scales.push_back({.spacing_m = tile.id.spacing_m(),
                      .lowest_z_world = info.lowest_z_world,
                      .highest_z_world = info.highest_z_world});
  }
  return scales;
}

/// One sequence being rendered.
struct SequenceWork {
  const SequencePlan& plan;
  const world::RayQuery& query;
  const FrameRenderer& renderer;
  const capture::SequenceWriter& writer;
  const std::vector<capture::TrackPoint>& tracks;
  std::vector<Eigen::Vector3d> track_points_world;
  std::vector<capture::TileScale> tiles;  ///< of the cut
  mutable ScratchPool<TruthFrame> truth_frames;

  capture::CameraRecord render_camera(int frame, int camera) const {
    return core::with_context(
        [&] {
          ScratchPool<TruthFrame>::Lease lease(truth_frames);
          TruthFrame& truth = *lease;
          renderer.truth(frame, camera, truth);
          truth.facts.color = renderer.color(frame, camera);
          capture::CameraRecord record = writer.write_camera(frame, camera, truth.facts);
          record.bounds = bounds(frame, camera, truth.facts);
          const std::vector<std::uint8_t> is_visible =
              visible_in_view(query, renderer.views().at(frame, camera), track_points_world);
          for (std::size_t i = 0; i < is_visible.size(); ++i)
            if (is_visible[i] != 0) record.visible_tracks.push_back(tracks[i].id);
          return record;
        },
        fmt::format("rendering frame {}, camera {}/{}", frame,
                    plan.cameras[static_cast<std::size_t>(camera)].rig,
                    plan.cameras[static_cast<std::size_t>(camera)].name));
  }

  capture::LabelBounds bounds(int frame, int camera, const capture::CameraFrame& facts) const {
    const auto view_at = [&](int at) -> std::optional<capture::CameraView> {
      if (at < 0 || at >= renderer.views().num_frames()) return std::nullopt;
      return capture::CameraView{
          *renderer.views().at(at, camera).model,
          plan.states[static_cast<std::size_t>(at)].world_from_body *
              plan.cameras[static_cast<std::size_t>(camera)].body_from_camera()};
    };
    return capture::bounds_of_labels(*view_at(frame), view_at(frame + 1), view_at(frame - 1), facts,
                                     tiles);
  }

  capture::FrameRecord start_record(int frame) const {
    const geo::BodyState& state = plan.states[static_cast<std::size_t>(frame)];
    return {.index = frame,
            .time_s = state.time_s,
            .world_from_body = state.world_from_body,
            .velocity_world_mps = state.velocity_world_mps,
            .acceleration_world_mps2 = state.acceleration_world_mps2,
            .angular_velocity_body_radps = state.angular_velocity_body_radps,
            .cameras = {}};
  }

  void expect_frames(const std::vector<int>& frames, std::size_t first) const {
    std::vector<std::vector<world::Viewpoint>> turns;
    for (std::size_t i = first; i < std::min(first + kFramesExpected, frames.size()); ++i)
      turns.push_back(viewpoints_of_frames(renderer.views(), frames[i], frames[i] + 1));
    query.expect(turns);
  }

  void render_frames(const std::vector<int>& frames, core::Progress& progress) const {
    const int num_cameras = renderer.views().num_cameras();
    std::vector<capture::CameraRecord> in_flight(kImagesInFlight);
    const auto slot = [&](std::int64_t i) -> capture::CameraRecord& {
      return in_flight[static_cast<std::size_t>(i % kImagesInFlight)];
    };
    const auto frame_of = [&](std::int64_t i) {
      return frames[static_cast<std::size_t>(i / num_cameras)];
    };
    capture::FrameRecord record;
    core::parallel_in_order(
        static_cast<std::int64_t>(frames.size()) * num_cameras, kImagesInFlight,
        [&](std::int64_t i) {
          const int camera = static_cast<int>(i % num_cameras);
          if (camera == 0) expect_frames(frames, static_cast<std::size_t>(i / num_cameras));
          slot(i) = render_camera(frame_of(i), camera);
        },
        [&](std::int64_t i) {
          if (i % num_cameras == 0) record = start_record(frame_of(i));
          record.cameras.push_back(std::move(slot(i)));
          if (i % num_cameras != num_cameras - 1) return;
          writer.finish_frame(record);
          progress.advance();
        });
  }
};

}  // namespace

void ConditionOptions::describe(core::SchemaVisitor& visit) {
  visit.key("visibility_km", visibility_km,
            "Meteorological range at sea level: how clear the air is.", core::between(1.0, 300.0));
  visit.key("sun_azimuth_deg", sun_azimuth_deg,
            "Azimuth of the sun, clockwise from north; -1: from place and UTC.",
            core::between(-1.0, 360.0));
  visit.key("sun_elevation_deg", sun_elevation_deg,
            "Elevation of the sun above the horizontal; -91: from place and UTC.",
            core::between(-91.0, 90.0));
  visit.key("exposure", exposure,
            "Factor on the exposure, which is set once a sequence by its light.",
            core::between(0.01, 100.0));
  visit.key("color_samples", color_samples, "Rays a pixel for colour.", core::between(1, 256));
}

void ConditionOptions::validate() const {
  if (sun_azimuth_deg < 0.0 && sun_azimuth_deg != -1.0) {
    fail(ErrorKind::Config, "sun_azimuth_deg = {}; it takes 0 to 360, or -1 for place and UTC",
         sun_azimuth_deg);
  }
  if (sun_elevation_deg < -90.0 && sun_elevation_deg != -91.0) {
    fail(ErrorKind::Config, "sun_elevation_deg = {}; it takes -90 to 90, or -91 for place and UTC",
         sun_elevation_deg);
  }
  if (color_samples < 1 || color_samples > 256) {
    fail(ErrorKind::Config, "color_samples = {}; it takes 1 to 256", color_samples);
  }
}

void TrackOptions::describe(core::SchemaVisitor& visit) {
  visit.key("num_points", num_points, "Points of the ground that are followed through a sequence.",
            core::between(0, 1e6));
}

void check_inside(const SequencePlan& plan, const geo::WorldFrame& frame_of_world, double size_m) {
  for (int frame = 0; frame < static_cast<int>(plan.states.size()); ++frame) {
    const geo::Rigid3d& world_from_body =
        plan.states[static_cast<std::size_t>(frame)].world_from_body;
    for (int camera = 0; camera < static_cast<int>(plan.cameras.size()); ++camera) {
      const Eigen::Vector3d center =
          world_from_body *
          plan.cameras[static_cast<std::size_t>(camera)].body_from_camera().translation;
      if (!center.allFinite())
        fail(ErrorKind::Input, "sequence {}, frame {}: the pose is not finite", plan.name, frame);
      const double outside_m = std::max(std::abs(center.x()), std::abs(center.y())) - 0.5 * size_m;
      if (outside_m > 0.0)
        fail(ErrorKind::Input,
             "{}: {:.1f} m outside the world, which reaches {:.1f} m from its origin to each side",
             place_of(plan, frame, camera, center, frame_of_world), outside_m, 0.5 * size_m);
    }
  }
}

std::vector<world::Viewpoint> viewpoints_of(
    const std::vector<geo::BodyState>& states,
    const std::vector<capture::CameraCalibration>& cameras) {
  const ViewTable views(states, cameras);
  return viewpoints_of_frames(views, 0, views.num_frames() - 1);
}

capture::SequenceInfo describe_sequence(const SequencePlan& plan, const world::TileStore& store) {
  const world::WorldManifest& manifest = store.manifest();
  const std::vector<world::CutTile> cut = cut_of(store, plan);
  std::set<std::string> licences;
  for (const world::SourceInfo& source : manifest.sources)
    if (!source.licence.empty()) licences.insert(source.licence);
  return {.name = plan.name,
          .input_hash = input_hash_of(plan, store, cut),
          .world_name = manifest.name,
          .world_input_hash = manifest.input_hash,
          .origin = manifest.origin,
          .utc_start = plan.utc_start,
          .rate_hz = plan.rate_hz,
          .num_frames = static_cast<int>(plan.states.size()),
          .geometry = geometry_of(plan, store, cut),
          .cameras = plan.cameras,
          .config_toml = plan.config_toml,
          .licences = {licences.begin(), licences.end()}};
}

void run_render_stage(const world::TileStore& store, const SequencePlan& plan,
                      const world::RayQueryOptions& tracing,
                      const capture::FrameSelection& selection, const std::filesystem::path& folder,
                      const core::Context& context) {
  check_plan(plan, selection);
  check_inside(plan, geo::WorldFrame(store.manifest().origin), store.manifest().size_m);
  const core::ThreadLimit threads(context.num_threads);
  const capture::SequenceInfo info = describe_sequence(plan, store);
  const std::vector<int> selected = selection.frames_of(info.num_frames);
  const std::optional<std::vector<int>> damaged =
      capture::find_damaged_frames(folder, info, selection);
  if (damaged && damaged->empty()) {
    context.log.info("sequence {}: all {} frames are there", plan.name, selected.size());
    return;
  }
  if (damaged) {
    context.log.warn("sequence {}: {} frames lack files or are damaged, the first is {}", plan.name,
                     damaged->size(), damaged->front());
  }

  const world::RayQuery query(store, cut_of(store, plan), tracing);
  const FrameRenderer renderer(plan, store, query);
  check_clearance(plan, store, query, renderer.views());
  const std::vector<capture::TrackPoint> tracks =
      choose_tracks(query, renderer.views(), plan.tracks.num_points,
                    static_cast<std::uint64_t>(plan.seed), context.log);
  const capture::SequenceWriter writer(folder, info, tracks);

  const auto is_finished = [&](int frame) {
    return damaged ? !std::binary_search(damaged->begin(), damaged->end(), frame)
                   : writer.has_frame(frame);
  };
  std::vector<int> frames;
  std::remove_copy_if(selected.begin(), selected.end(), std::back_inserter(frames), is_finished);
  const std::size_t num_skipped = selected.size() - frames.size();
  context.log.info("sequence {}: {} frames of {} cameras to render, {} are there; {} tiles, {}",
                   plan.name, frames.size(), plan.cameras.size(), num_skipped, query.cut().size(),
                   query.profile());
  SequenceWork work{.plan = plan,
                    .query = query,
                    .renderer = renderer,
                    .writer = writer,
                    .tracks = tracks,
                    .track_points_world = {},
                    .tiles = scales_of(store, query.cut()),
                    .truth_frames = {}};
  for (const capture::TrackPoint& track : tracks)
    work.track_points_world.push_back(track.point_world);
  {
    core::Progress progress(context, "frames", static_cast<std::int64_t>(selected.size()));
    progress.skip(static_cast<std::int64_t>(num_skipped));
    work.render_frames(frames, progress);
  }
  const world::RayQueryStats stats = query.stats();
  context.log.info("sequence {}: {} tiles loaded ({} waited for), {:.2f} GB at most, {} re-casts",
                   plan.name, stats.num_tiles_loaded, stats.num_tiles_waited,
                   static_cast<double>(stats.peak_bytes_resident) * 1e-9, stats.num_recasts);
  if (!writer.finish_sequence())
    context.log.info("sequence {}: frames of other runs are missing yet", plan.name);
}

}  // namespace terracast::render
