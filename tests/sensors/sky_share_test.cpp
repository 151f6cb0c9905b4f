#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
namespace {

constexpr double kWallFoot_m = 40.0;  // world y

/// Level land with a wall that stands at y = 40 m and reaches from west to east, 100 m high.
world::TileStore make_wall(const std::filesystem::path& folder) {
  test::TinyWorldOptions options;
  options.coarsest_level = 0;
  const world::TileStore bare = test::make_tiny_world(
      folder, [](double, double) { return 0.0; }, options);
  const auto steps = [](double metres) { return static_cast<int>(metres / world::kHeightStep_m); };
  world::Shape shape;
  for (const double z : {-1.0, 100.0})
    for (const double x : {-120.0, 120.0}) shape.vertices_steps.push_back({steps(x), 0, steps(z)});
  shape.triangles = {{{0, 1, 3}, 0}, {{0, 3, 2}, 0}};
  shape.finishes = {{}};
  world::WorldManifest manifest = bare.manifest();
  for (world::TileInfo& info : manifest.tiles) {
    world::Tile tile = bare.load(info.id);
    world::Solid wall;
    wall.provenance = {.instance_id = 1, .layer = 0, .feature = 1};
    wall.place_m = {0, static_cast<int>(kWallFoot_m)};
    wall.origin_steps = {0, steps(kWallFoot_m), 0};
    wall.levels = {{.coarsest_level = 9, .shape = shape}};
    if (info.id.corner_world().y() <= kWallFoot_m &&
        info.id.corner_world().y() + info.id.side_m() >= kWallFoot_m)
      tile.objects.solids.push_back(wall);
    tile.objects_top_steps = steps(110.0);
    info = world::write_tile(folder, tile);
  }
  manifest.input_hash = "wall";
  manifest.layers.resize(1);
  manifest.layers[0].name = "walls";
  world::write_manifest(folder, manifest);
  return world::TileStore::open(folder);
}

/// Looks straight down from 8 m above a place.
core::Image8 look_down(const world::TileStore& store, double y_m, int ambient_rays) {
  render::SequencePlan plan = test::small_plan(1, 32, 32);
  rigs::RigOptions rig;
  rig.name = "down";
  rig.mount_pitch_deg = 90.0;
  rig.cameras = {test::camera_options("down", 32, 32, 32.0 * 8.0 / 0.3)};  // 0.3 m wide
  plan.cameras = rigs::build_cameras({rig});
  geo::BodyState state;
  state.world_from_body.translation = {0.0, y_m, 8.0};
  plan.states = {state};
  plan.conditions.color_samples = 16;
  plan.conditions.ambient_rays = ambient_rays;
  plan.conditions.sun_azimuth_deg = 0.0;  // behind the wall
  plan.conditions.sun_elevation_deg = 30.0;
  plan.conditions.exposure = 3.0;
  plan.detail.finest_spacing_m = 1.0;
  const test::TracedPlan scene(store, plan);
  return scene.renderer.color(0, 0);
}

double mean_linear(const core::Image8& image) {
  double sum = 0.0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double value = (&image(x, y))[1] / 255.0;
      sum += value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
    }
  }
  return sum / (image.width() * image.height());
}

// At the foot of a wall without an end half of the light of the sky is gone, and what the wall sends on
// comes in its place.
TEST(SkyShare, AWallHidesHalfOfTheSkyAtItsFoot) {
  const test::ScratchFolder folder;
  const world::TileStore store = make_wall(folder.path());
  const double y_m = kWallFoot_m - 0.3;
  const double without = mean_linear(look_down(store, y_m, 0));
  const double with = mean_linear(look_down(store, y_m, 16));
  const scene::ConditionOptions conditions{.sun_azimuth_deg = 0.0, .sun_elevation_deg = 30.0};
  const scene::Sky sky(scene::daylight_at(Eigen::Vector3d::Zero(), "2025-06-21T10:00:00Z",
                                          conditions, geo::WorldFrame(store.manifest().origin)));
  const double ambient = static_cast<double>(sky.ambient().irradiance(Eigen::Vector3f::UnitZ())[1]);
  const double bounced = static_cast<double>(scene::kBouncedShare * sky.global_irradiance()[1]);
  // The ground's own openness lies between 0.7 and 1; 16 rays of 16 samples of 1024 pixels, and 8 bits, err
  // by 1 %. At 0.3 m from the wall, 30 m of reach miss 1 % of it, and its ends another.
  EXPECT_GT(with / without, 0.5 + 0.5 * bounced / ambient - 0.03);
  EXPECT_LT(with / without, 0.5 + 0.5 * bounced / (0.7 * ambient) + 0.03);
}

// Where nothing stands within reach, nobody sees whether rays have looked.
TEST(SkyShare, InTheOpenNothingChanges) {
  const test::ScratchFolder folder;
  const world::TileStore store = make_wall(folder.path());
  const double y_m = kWallFoot_m - 31.0;
  EXPECT_TRUE(look_down(store, y_m, 0) == look_down(store, y_m, 4));
}

}  // namespace
}  // namespace terracast::sensors
