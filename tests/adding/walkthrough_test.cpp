// The code of docs/adding, as it stands on the pages (cmake/PageCode.cmake), used once each.

#include <gtest/gtest.h>

#include <cmath>

#include "capture/frame_reader.h"
#include "core/log.h"
#include "render/render_stage.h"
#include "scene/media/medium.h"
#include "sensors/sensor.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
SensorInfo altimeter_sensor();
}
namespace terracast::scene {
MediumInfo smoke_layer_medium();
}

namespace terracast::test {
namespace {

/// A body that stands still 100 m above the plane z = 40, turned to one side.
class Still : public geo::Trajectory {
 public:
  double duration_s() const override { return 1.0; }
  geo::MotionState at(double time_s) const override {
    geo::MotionState state;
    state.time_s = time_s;
    state.world_from_body = {
        .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX())),
        .translation = {0.0, 0.0, 140.0}};
    return state;
  }
  std::vector<double> knots_s() const override { return {0.0, 1.0}; }
};

TEST(Walkthrough, TheAltimeterMeasuresHeights) {
  const ScratchFolder folder;
  const world::TileStore store =
      make_tiny_world(folder / "world", [](double, double) { return 40.0; },
                      {.finest_level = 3, .coarsest_level = 3});
  const TracedPlan traced(store, small_plan(1, 16, 12));
  const auto altimeter = sensors::altimeter_sensor().make();
  const geo::BodyMotion motion{.trajectory = std::make_shared<Still>(), .start_s = 0.0};
  double values[2];
  altimeter->measure({.scene = traced.scene,
                      .body = motion,
                      .body_from_sensor = {},
                      .rate_hz = 2.0,
                      .stream_seed = 1,
                      .trail = nullptr},
                     std::vector<double>{0.0, 0.5}, values);
  // At the origin the ellipsoid's normal is the world's z.
  EXPECT_NEAR(values[0], 100.0, 1e-9);
  EXPECT_NEAR(values[1], 100.0, 1e-9);
}

TEST(Walkthrough, TheSmokeLayerDimsByItsThickness) {
  const ScratchFolder folder;
  const world::TileStore store = make_hills(folder / "world");
  const scene::Sky sky(scene::Daylight{});
  const auto smoke =
      scene::smoke_layer_medium().make()->make({.store = store, .sky = sky, .sea_level_m = 0.0});
  const scene::SampleWidth width;
  const scene::SeenMedium seen = smoke->look({.origin_world = {0.0, 0.0, 500.0},
                                              .direction_world = -Eigen::Vector3d::UnitZ(),
                                              .until_m = 450.0,
                                              .from_height_m = 500.0F,
                                              .sample_width = width,
                                              .jitter = 0.5});
  EXPECT_NEAR(seen.transmittance[0], std::exp(-0.01 * 50.0), 1e-6);
  EXPECT_NEAR(seen.distance_m, 150.0, 1e-6);
}

}  // namespace
}  // namespace terracast::test
