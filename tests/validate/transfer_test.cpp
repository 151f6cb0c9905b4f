#include "validate/transfer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "validate/dataset.h"

namespace terracast::validate {
namespace {

// A camera that pitches by w while it stands still has a point straight ahead in row f tan(w t) below the middle at a
// time t, and exposes the row y below it at t = y / rate: the point is seen at 0, and where tan(w t) = rate t / f.
TEST(Transfer, RollingShutterThatTurnsFastSeesAPointAtSeveralTimes) {
  constexpr double kFocal_px = 100.0, kRate_px_s = 1000.0, kTurn_radps = 8.0;
  Camera camera;
  camera.intrinsics.width_px = camera.intrinsics.height_px = 240;
  camera.intrinsics.fx_px = camera.intrinsics.fy_px = kFocal_px;
  camera.intrinsics.cx_px = camera.intrinsics.cy_px = 120.0;
  View a, b;
  a.camera = b.camera = &camera;
  LineMotion lines;
  lines.shutter = {1.0 / kRate_px_s, Readout::Down};
  // Nose up: what stands still sinks in the image.
  lines.body.turn_radps = {0.0, -kTurn_radps, 0.0};
  lines.body_from_camera.rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  b.lines = lines;
  const Transfer transfer(a, b);
  const Eigen::Vector2d middle(120.0, 120.0);

  // Its second time, by halving: the row is below the point's before it, and above it after.
  double low_s = 0.05, high_s = 0.15;
  for (int i = 0; i < 60; ++i) {
    const double t = 0.5 * (low_s + high_s);
    (std::tan(kTurn_radps * t) < kRate_px_s * t / kFocal_px ? low_s : high_s) = t;
  }
  const Eigen::Vector2d second(120.0, 120.0 + kRate_px_s * low_s);
  ASSERT_LT(second.y(), 240.0);

  const auto place = transfer.point(middle, 50.0);
  ASSERT_TRUE(place);
  EXPECT_NEAR((place->pixel - middle).norm(), 0.0, 1e-9);
  for (const bool is_direction : {false, true}) {
    EXPECT_TRUE(transfer.is_seen_at(middle, middle, 50.0, is_direction, 1e-9));
    EXPECT_TRUE(transfer.is_seen_at(second, middle, 50.0, is_direction, 1e-9));
    for (const Eigen::Vector2d& off : {Eigen::Vector2d(0.1, 0.0), Eigen::Vector2d(0.0, 0.1),
                                       Eigen::Vector2d(0.0, -30.0), Eigen::Vector2d(0.0, -190.0)})
      EXPECT_FALSE(transfer.is_seen_at(second + off, middle, 50.0, is_direction, 5e-3));
  }
  // Without lines a point is seen once.
  b.lines.reset();
  const Transfer at_once(a, b);
  EXPECT_TRUE(at_once.is_seen_at(middle, middle, 50.0, false, 1e-9));
  EXPECT_FALSE(at_once.is_seen_at(second, middle, 50.0, false, 5e-3));
}

}  // namespace
}  // namespace terracast::validate
