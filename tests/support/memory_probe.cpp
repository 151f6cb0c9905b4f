// Renders a frame that looks all round a world within a memory budget, and prints what it came to, for
// tests/sensors/memory_budget_test.cpp: as a process of its own, so that its peak memory can be told.
//
//     terracast_memory_probe WORLD BUDGET_BYTES

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "core/process_memory.h"
#include "tests/support/frame_hashes.h"

namespace terracast::test {
namespace {

/// Frames before and after it, and a low sun, so that rays go where no camera looks.
render::SequencePlan plan_all_round(double height_m) {
  render::SequencePlan plan = small_plan(3, 240, 180);
  rigs::RigOptions rig;
  rig.name = "round";
  rig.mount_pitch_deg = 15.0;
  for (const double yaw_deg : {0.0, 90.0, 180.0, 270.0}) {
    rig.cameras.push_back(camera_options(fmt::format("yaw{}", yaw_deg), 240, 180, 120.0));
    rig.cameras.back().euler_deg = {yaw_deg, 0.0, 0.0};
  }
  plan.cameras = rigs::build_cameras({rig});
  for (int i = 0; i < 3; ++i)
    plan.states[static_cast<std::size_t>(i)].world_from_body = {
        Eigen::Quaterniond::Identity(), Eigen::Vector3d(40.0 * i, 20.0 * i, height_m)};
  plan.conditions.color_samples = 1;
  plan.conditions.sun_azimuth_deg = 130.0;
  plan.conditions.sun_elevation_deg = 12.0;
  return plan;
}

void probe(const std::filesystem::path& world, double budget_bytes) {
  const TracedPlan scene(world::TileStore::open(world), plan_all_round(450.0),
                    {.memory_bytes = budget_bytes});
  const std::string hashes = frame_hashes(scene, {0, 1});
  const world::RayQueryStats stats = scene.query.stats();
  fmt::print("tiles {}\nloaded {}\nbytes {}\n{}", scene.query.cut().size(), stats.num_tiles_loaded,
             stats.peak_bytes_resident, hashes);
}

}  // namespace
}  // namespace terracast::test

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  terracast::core::share_freed_memory();
  try {
    terracast::test::probe(argv[1], std::atof(argv[2]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
