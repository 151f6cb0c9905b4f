#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tests/labels/moving_bodies.h"
#include "tests/support/test_data.h"

/// Things that move before two cameras, known by slabs and bisection: one with a bar that turns on it passes behind a wall,
/// another before a tower, one leaves the image, one is gone in the next frame. A camera that moves sees them with all
/// lines at once, and another with one after the other.
namespace terracast::test::moving_scene {

using namespace moving_bodies;
using Eigen::Vector2d;
using Eigen::Vector3d;

inline constexpr std::uint32_t kCart = kVan + 1, kTruck = kVan + 2, kGone = kVan + 3;
inline const std::vector<Body> kBodies = {
    kVanBody, kBarBody, kCartBody, {kTruck, {-4.0, -3.0, -2.0}, {4.0, 3.0, 2.0}}, gone_body(kGone)};
inline constexpr int kTruckBody = 3;

inline std::vector<scene::MovingThing> moving_things() {
  scene::MovingThing truck =
      thing_of_body("truck", kBodies[kTruckBody], core::SemanticClass::Truck, 2);
  for (int frame = 0; frame < 2; ++frame)
    truck.states.push_back(leaning_state(frame, {80.0, -41.0 + 2.0 * frame, 55.0},
                                         -0.4 + 0.1 * frame, {3.0, 15.0, 0.0}, {0.3, 0.0, -1.0}));
  return {van({150.0, 150.0}), cart(2), truck, gone(1, 2)};
}

/// Two frames.
inline render::SequencePlan plan_of(const std::vector<scene::MovingThing>& things) {
  return two_camera_plan({0.0, 0.5}, things);
}

/// What a sequence shows, known by closed forms.
struct Truth : ShownBodies {
  explicit Truth(const capture::SequenceReader& shown) : ShownBodies{shown, kBodies} {}

  /// t of a body alone.
  double meet_body(int frame, int body, double time, const Vector3d& origin,
                   const Vector3d& direction) const {
    return ShownBodies::meet_body(frame, body, time, origin, direction, 0.0, slabs);
  }
  Hit meet(int frame, double time, const Vector3d& origin, const Vector3d& direction,
           double grown = 0.0) const {
    return ShownBodies::meet(frame, time, origin, direction, grown, slabs);
  }

  /// Where and when a point is seen by a camera.
  template <class PointAt>
  std::pair<Vector2d, double> seen(int frame, int camera, const PointAt& point_at) const {
    const auto pixel_at = [&](double t) {
      return pixel_of(camera_pose(frame, t).own(point_at(t)));
    };
    const double t =
        camera == 0 ? 0.0 : time_seen(0.2, [&](double time) { return pixel_at(time).y(); });
    return {pixel_at(t), t};
  }
};

struct MovingLabels : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  static inline std::optional<world::TileStore> store;
  static inline std::optional<capture::SequenceReader> sequence;
  static inline std::vector<scene::MovingThing> things;

  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    store = make_boxes_world(*folder / "world", kStill);
    things = moving_things();
    sequence = render_plan(*store, plan_of(things), *folder / "boxes");
  }
  static void TearDownTestSuite() {
    sequence.reset();
    store.reset();
    folder.reset();
  }
};

}  // namespace terracast::test::moving_scene
