#include "sensors/camera/tracks.h"

#include <gtest/gtest.h>

#include "sensors/camera/ground_truth.h"
#include "sensors/camera/sight.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
namespace {

TEST(Tracks, PointsAreSeenByThreeImagesAndMoreAndEveryShardFindsTheSame) {
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  const test::TracedPlan scene(store, test::small_plan(8, 64, 48));
  const ViewTable& views = scene.renderer.views();
  const auto tracks = choose_tracks(scene.query, views, 500, 1, scene.log);
  ASSERT_EQ(tracks.size(), 500u);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    EXPECT_EQ(tracks[i].id, static_cast<std::int64_t>(i));
    points.push_back(tracks[i].point_world);
    // On the surface: the closed form is met at the samples, a cell's plane is off by its
    // curvature.
    EXPECT_NEAR(points.back().z(),
                *scene.query.surface_z_world(points.back().x(), points.back().y()), 1e-9);
  }
  std::vector<int> length(tracks.size(), 0);
  for (int frame = 0; frame < views.num_frames(); ++frame) {
    for (int camera = 0; camera < views.num_cameras(); ++camera) {
      const auto is_visible = visible_in_view(scene.query, views.open(frame, camera), points);
      for (std::size_t i = 0; i < is_visible.size(); ++i) length[i] += is_visible[i];
    }
  }
  double mean = 0.0;
  for (const int seen : length) {
    EXPECT_GE(seen, 1);
    mean += seen / 500.0;
  }
  EXPECT_GE(mean, 3.0);
  EXPECT_EQ(tracks, choose_tracks(scene.query, views, 500, 1, scene.log));
  EXPECT_NE(tracks, choose_tracks(scene.query, views, 500, 2, scene.log));
}

}  // namespace
}  // namespace terracast::sensors
