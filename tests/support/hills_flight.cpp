#include "tests/support/hills_flight.h"

#include <cmath>

namespace terracast::test {

double hills_m(double x, double y) {
  return 60.0 * std::sin(x * 0.011) * std::cos(y * 0.013) + 25.0 * std::sin(x * 0.037 + y * 0.021) +
         9.0 * std::cos(x * 0.09 - y * 0.11) + 2.0 * std::sin(x * 0.41) * std::sin(y * 0.37);
}

world::TileStore make_hills(const std::filesystem::path& folder) {
  TinyWorldOptions options;
  options.finest_level = 1;
  options.coarsest_level = 3;
  options.refine = [](const world::TileId& id) { return id.x >= -1 && id.x <= 0; };
  options.moisture = [](double x, double) { return 0.5 + 0.4 * std::sin(x * 0.003); };
  return make_tiny_world(folder, hills_m, options);
}

rigs::CameraOptions camera_options(const std::string& name, int width_px, int height_px,
                                   double focal_px) {
  rigs::CameraOptions camera;
  camera.name = name;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = focal_px;
  return camera;
}

std::vector<capture::CameraCalibration> small_rig(int width_px, int height_px, double pitch_deg) {
  rigs::RigOptions rig;
  rig.name = "pair";
  rig.mount_pitch_deg = pitch_deg;
  rig.cameras = {camera_options("left", width_px, height_px, width_px),
                 camera_options("right", width_px, height_px, width_px),
                 camera_options("aside", width_px, height_px, width_px)};
  rig.cameras[1].offset_mm = {0.0, -500.0, 0.0};
  rig.cameras[2].euler_deg = {-30.0, 0.0, 0.0};
  return rigs::build_cameras({rig});
}

std::vector<geo::BodyState> climbing_turn(int num_frames) {
  std::vector<geo::BodyState> states;
  for (int i = 0; i < num_frames; ++i) {
    const double turn = 0.05 * i;
    geo::BodyState state;
    state.time_s = 0.1 * i;
    state.world_from_body.translation = {-100.0 + 8.0 * i, 6.0 * i, 130.0 + 3.0 * i};
    state.world_from_body.rotation = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) *
                                     Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
    states.push_back(state);
  }
  return states;
}

render::SequencePlan small_plan(int num_frames, int width_px, int height_px) {
  render::SequencePlan plan;
  plan.name = "P000";
  plan.utc_start = "2025-06-21T10:00:00Z";
  plan.states = climbing_turn(num_frames);
  plan.cameras = small_rig(width_px, height_px, 20.0);
  plan.tracks.num_points = 200;
  plan.detail = {.cell_px = 1.0, .finest_spacing_m = 2.0};
  plan.conditions.color_samples = 2;
  plan.config_toml = "name = \"small\"\n";
  return plan;
}

}  // namespace terracast::test
