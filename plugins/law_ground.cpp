#include "plugins/law_ground.h"

#include "core/atomic_file.h"
#include "core/log.h"
#include "job/job.h"
#include "job/run_config.h"
#include "job/stages.h"
#include "render/checked_plan.h"

namespace terracast::plugins {
namespace {

namespace fs = std::filesystem;

/// Hills by a coast, and a pair of small cameras that turns and climbs over them.
constexpr const char* kJob = R"(name = "laws"
seed = 5

[world]
name = "laws"
origin_lat_deg = 46.0
origin_lon_deg = 7.0
size_m = 2048.0
seed = 3
outside = "extend"

[[world.elevation]]
kind = "procedural"
landform = "coast"
vertical_datum = "ellipsoid"
relief_m = 300.0

[detail]
cell_px = 8.0
finest_spacing_m = 2.0

[[rigs]]
name = "pair"
[[rigs.cameras]]
name = "left"
width_px = 96
height_px = 64
fx_px = 70.0
offset_mm = [0.0, 250.0, 0.0]
euler_deg = [0.0, 40.0, 0.0]
[[rigs.cameras]]
name = "right"
width_px = 96
height_px = 64
fx_px = 70.0
offset_mm = [0.0, -250.0, 0.0]
euler_deg = [0.0, 40.0, 0.0]

[[trajectories]]
name = "P000"
kind = "waypoints"
rate_hz = 4.0
num_frames = 6
speed_mps = 25.0
waypoints = [
  {east_m = -60.0, north_m = -40.0, height_m = 90.0, above = "ground"},
  {east_m = 10.0, north_m = -20.0, height_m = 100.0, above = "ground"},
  {east_m = 60.0, north_m = 50.0, height_m = 120.0, above = "ground"},
]

[conditions]
color_samples = 2

[[exports]]
format = "colmap"

[[exports]]
format = "kitti"
rig = "pair"
left = "left"
right = "right"

[[exports]]
format = "terracast"
)";

core::Context quiet() {
  static const core::Log log("laws", core::LogLevel::Warn);
  return {.log = log};
}

job::Job law_job(const LawGround& ground) {
  const job::RunConfig config = job::load_run_config(ground.folder / "laws.toml", {});
  return job::prepare_job(config, quiet(), ground.world());
}

}  // namespace

fs::path LawGround::world() const { return job::OutputFolders(folder).world; }

fs::path LawGround::captures() const { return job::OutputFolders(folder).captures; }

std::vector<fs::path> LawGround::datasets() const {
  std::vector<fs::path> all;
  for (const char* format : {"colmap", "kitti", "terracast"})
    all.push_back(job::OutputFolders(folder).exports / format);
  return all;
}

LawGround make_law_ground(const fs::path& folder) {
  const LawGround ground{folder};
  core::write_file(folder / "laws.toml", kJob);
  const job::Job job = law_job(ground);
  const world::TileStore store = job::tile(job, ground.world(), quiet());
  job::render(job, store, {}, ground.captures(), quiet());
  job::label(job.config, store, ground.captures(), quiet());
  job::export_formats(job.config, job::OutputFolders(folder), quiet());
  return ground;
}

void in_law_scene(const LawGround& ground, const std::function<void(const LawScene&)>& work) {
  const job::Job job = law_job(ground);
  const world::TileStore store = world::TileStore::open(ground.world());
  const render::SequencePlan& plan = job.sequences.at(0);
  const render::CheckedPlan checked(plan, store);
  const scene::Scene scene(store, checked.cut(), plan.moving,
                           checked.scene_options(job.config.tracing));
  work({.scene = scene, .body = plan.motion, .duration_s = plan.states.back().time_s});
}

}  // namespace terracast::plugins
