#include "render/input_hash.h"

#include <algorithm>
#include <iterator>

#include "capture/sequence_files.h"
#include "core/hash.h"
#include "core/plugin_rows.h"
#include "core/schema_writer.h"

namespace terracast::render {
namespace {

/// One more when the same inputs give other bytes.
constexpr int kRenderVersion = 15;

void append_numbers(std::string& text, const double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    fmt::format_to(std::back_inserter(text), " {:.17g}", values[i]);
  text += '\n';
}

void append_pose(std::string& text, const geo::Rigid3d& pose) {
  append_numbers(text, pose.rotation.coeffs().data(), 4);
  append_numbers(text, pose.translation.data(), 3);
}

void append_cameras(std::string& text, const std::vector<capture::CameraCalibration>& cameras) {
  for (const capture::CameraCalibration& camera : cameras) {
    const geo::CameraIntrinsics& intrinsics = camera.intrinsics;
    text += fmt::format("camera {} {} {} {} {}\n", camera.rig, camera.name, intrinsics.model,
                        intrinsics.width_px, intrinsics.height_px);
    append_numbers(text, intrinsics.parameters.data(), intrinsics.parameters.size());
    append_pose(text, camera.rig_from_camera);
    append_pose(text, camera.body_from_rig);
    if (camera.shutter.is_instant() && camera.aperture == geo::Aperture{}) continue;
    text += fmt::format("exposure {:.17g} {:.17g} {} {:.17g} {:.17g}\n", camera.shutter.exposure_s,
                        camera.shutter.line_time_s,
                        geo::kReadoutNames[static_cast<std::size_t>(camera.shutter.readout)],
                        camera.aperture.diameter_m, camera.aperture.focus_m);
  }
}

/// Random numbers of imaging follow names.
void append_imaging(std::string& text, const SequencePlan& plan) {
  if (plan.imaging.empty()) return;
  text += fmt::format("imaging of {}\n", plan.name);
  for (const sensors::ImagingOptions& imaging : plan.imaging)
    text += fmt::format("camera\n{}\n", core::toml_text(imaging));
}

/// How a body goes on about a frame's time.
void append_motion(std::string& text, const geo::BodyState& state) {
  append_numbers(text, state.velocity_world_mps.data(), 3);
  append_numbers(text, state.acceleration_world_mps2.data(), 3);
  append_numbers(text, state.angular_velocity_body_radps.data(), 3);
  const geo::MotionTerms& terms = state.terms;
  if (!terms.are_any()) return;
  text += "terms\n";
  append_numbers(text, &terms.reach_s, 1);
  for (const Eigen::Vector3d& term : terms.position_world) append_numbers(text, term.data(), 3);
  for (const Eigen::Vector3d& term : terms.turning_body) append_numbers(text, term.data(), 3);
  append_numbers(text, terms.spin_body_radps.data(), 3);
}

/// As their motions have them: where the ground takes part is a function of it.
void append_moving(std::string& text, const SequencePlan& plan) {
  text += scene::text_of_shapes(plan.moving);
  for (const scene::MovingThing& thing : plan.moving) {
    text += fmt::format("rides {}\n", static_cast<int>(thing.ride));
    if (thing.ride == scene::Ride::Rails) append_numbers(text, thing.footing_m.data(), 2);
    for (const scene::TurningPart& part : thing.parts) {
      append_numbers(text, part.origin_m.data(), 3);
      append_numbers(text, part.axis.data(), 3);
      for (const double value : {part.rate_radps, part.per_metre_rad})
        append_numbers(text, &value, 1);
      if (part.swing_rad <= 0.0) continue;
      text += "swings\n";
      for (const double value : {part.swing_rad, part.phase_rad}) append_numbers(text, &value, 1);
    }
    append_numbers(text, thing.gone_m.data(), thing.gone_m.size());
    for (const std::optional<geo::BodyState>& state : thing.states) {
      if (!state) {
        text += "none\n";
        continue;
      }
      append_pose(text, state->world_from_body);
      append_motion(text, *state);
    }
  }
}

/// Their samples follow the motion between frames too, which the config's text determines.
void append_sensors(std::string& text, const SequencePlan& plan) {
  for (const sensors::MountedSensor& sensor : plan.sensors) {
    const capture::StreamInfo& info = sensor.info;
    text += fmt::format("sensor {} {} {} {:.17g}\n{}\n", info.rig, info.name, info.kind,
                        info.rate_hz, info.settings_toml);
    append_pose(text, info.rig_from_sensor);
    append_pose(text, info.body_from_rig);
    if (!info.clock) continue;
    text += "clock\n";
    for (const double value : {info.clock->offset_s, info.clock->drift, info.clock->jitter_sd_s,
                               info.clock->believed_offset_s, info.clock->believed_drift})
      append_numbers(text, &value, 1);
  }
}

void append_tile(std::string& text, const world::CutTile& tile, const world::TileStore& store) {
  text += fmt::format("tile {} {} {}\n", tile.id.name(), tile.coarser_sides,
                      store.find(tile.id)->content_hash);
}

void append_climate(std::string& text, const scene::Climate& climate) {
  text +=
      fmt::format("climate {} {} {} {} {}\n", climate.seed, climate.has_sea, climate.has_mapped_ice,
                  climate.has_trees, climate.exposure ? climate.exposure->content_hash() : "none");
  for (const double value : {climate.sea_level_m, climate.snow_line_m, climate.tree_line_m})
    append_numbers(text, &value, 1);
}

void append_daylight(std::string& text, const scene::Daylight& daylight) {
  text += "daylight\n";
  append_numbers(text, daylight.sun_direction_world.data(), 3);
  append_numbers(text, daylight.up_world.data(), 3);
  append_numbers(text, &daylight.visibility_m, 1);
}

}  // namespace

std::string input_hash_of(const SequencePlan& plan, const world::TileStore& store,
                          const std::vector<world::CutTile>& cut) {
  std::string text =
      fmt::format("render {}\nworld {}\n", kRenderVersion, store.manifest().input_hash);
  text += fmt::format("sequence {} {} {:.17g} {}\n", plan.name, plan.utc_start, plan.rate_hz,
                      plan.seed);
  for (const geo::BodyState& state : plan.states) {
    append_numbers(text, &state.time_s, 1);
    append_pose(text, state.world_from_body);
    append_motion(text, state);
  }
  append_cameras(text, plan.cameras);
  append_cameras(text, plan.believed_cameras);
  for (const capture::CameraClock& clock : plan.clocks)
    for (const double value : {clock.offset_s, clock.drift, clock.jitter_sd_s})
      append_numbers(text, &value, 1);
  append_imaging(text, plan);
  append_moving(text, plan);
  append_sensors(text, plan);
  text += core::toml_text(plan.conditions);
  text += core::toml_text(plan.facts);
  text += core::toml_text(plan.tracks);
  for (const world::CutTile& tile : cut) append_tile(text, tile, store);
  text += plan.config_toml;
  text += core::plugin_marks(text);
  return core::content_hash(text);
}

FrameKeys::FrameKeys(const SequencePlan& plan, const world::TileStore& store,
                     const std::vector<world::CutTile>& cut, const sensors::FrameRenderer& renderer)
    : plan_(plan), store_(store), cut_(cut), moving_(renderer.moving()) {
  std::string text =
      fmt::format("render {} capture {}\n", kRenderVersion, capture::kCaptureVersion);
  append_cameras(text, plan.cameras);
  append_climate(text, renderer.ground().climate());
  append_daylight(text, renderer.sky().daylight());
  // Tiles name these by their rows.
  for (const world::PrototypeInfo& prototype : store.manifest().prototypes)
    text += fmt::format("prototype {}\n", prototype.content_hash);
  for (const world::TextureInfo& texture : store.manifest().textures)
    text += fmt::format("texture {}\n", texture.content_hash);
  // A picture's coarser levels hold all that lies under them.
  for (const world::ImageryInfo& imagery : store.manifest().imagery)
    for (const world::ImageryTileInfo& tile : imagery.tiles)
      text += fmt::format("imagery {} {} {} {} {}\n", imagery.finest_level, tile.id.level,
                          tile.id.x, tile.id.y, tile.content_hash);
  text += fmt::format("seed {}\n", plan.seed);
  text += core::toml_text(plan.conditions);
  text += fmt::format("flags {}\n", plan.facts.flag_bits());
  for (const world::VolumeInfo& volume : store.manifest().volumes)
    text += fmt::format("volume {}\n", volume.content_hash);
  for (const world::VolumePlace& place : store.manifest().volume_places) {
    text += fmt::format("place {}\n", place.volume);
    append_numbers(text, place.place_world.data(), 3);
    for (const double value :
         {place.heading_rad, place.scale, place.extinction_per_m, place.albedo, place.anisotropy})
      append_numbers(text, &value, 1);
  }
  append_imaging(text, plan);
  text += scene::text_of_shapes(plan.moving);
  // What is metered at other frames may be any of what they show.
  const bool looks_at_other_frames = std::any_of(
      plan.imaging.begin(), plan.imaging.end(),
      [](const sensors::ImagingOptions& imaging) { return imaging.looks_at_other_frames(); });
  if (looks_at_other_frames) {
    for (const geo::BodyState& state : plan.states) {
      append_numbers(text, &state.time_s, 1);
      append_pose(text, state.world_from_body);
    }
    for (std::size_t at = 0; at < plan.states.size(); ++at)
      text += moving_.text_of(static_cast<int>(at));
    for (const world::CutTile& tile : cut) append_tile(text, tile, store);
  }
  text += core::plugin_marks(text);
  common_ = core::content_hash(text);
}

std::string FrameKeys::key(int frame, std::span<const int> touched_tiles) const {
  std::string text = fmt::format("{}\nframe {}\n", common_, frame);
  // The points of a frame are looked for from the frames beside it.
  for (const int at : {frame, frame - 1, frame + 1}) {
    if (at < 0 || at >= static_cast<int>(plan_.states.size())) {
      text += "none\n";
      continue;
    }
    append_pose(text, plan_.states[static_cast<std::size_t>(at)].world_from_body);
    text += moving_.text_of(at);
  }
  for (const int tile : touched_tiles) {
    text += fmt::format("{} ", tile);
    append_tile(text, cut_[static_cast<std::size_t>(tile)], store_);
  }
  return core::content_hash(text);
}

}  // namespace terracast::render
