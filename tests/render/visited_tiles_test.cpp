#include "render/visited_tiles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/random.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::render {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(SeenTiles, PassagesAreRoundedDownAndToldUpToAHeightAboveWhatIsTouched) {
  std::vector<capture::TileScale> tiles;
  for (const double highest_z : {100.0, 40.0, 500.0, 10.0, 10.0, 10.0})
    tiles.push_back({.spacing_m = 1.0, .lowest_z_world = 0.0, .highest_z_world = highest_z});
  world::RayTrail trail(6);
  capture::FrameRecord record;
  set_seen_tiles(trail, tiles, record);
  EXPECT_THAT(record.touched_tiles, testing::IsEmpty());
  EXPECT_THAT(record.passed_tiles, testing::IsEmpty());

  trail.touch(1);
  trail.pass(1, 30.0);
  trail.touch(0);
  trail.pass(2, 164.25);  // higher than 64 m above the highest touched
  trail.pass(3, 90.1);
  trail.pass(3, 55.126);
  trail.pass(4, 163.75);
  trail.pass(5, -3.01);
  set_seen_tiles(trail, tiles, record);
  EXPECT_THAT(record.touched_tiles, testing::ElementsAre(0, 1));
  EXPECT_EQ(told_below_z(record.touched_tiles, tiles), 164.0);
  ASSERT_EQ(record.passed_tiles.size(), 3u);
  EXPECT_EQ(record.passed_tiles[0], (capture::PassedTile{3, 55.125}));
  // On a step, rounding may have put it there: the one below is told.
  EXPECT_EQ(record.passed_tiles[1], (capture::PassedTile{4, 163.6875}));
  EXPECT_EQ(record.passed_tiles[2], (capture::PassedTile{5, -3.0625}));
}

/// Whether a ray comes into a box in [0, t_end].
bool enters(const Vector3d& origin, const Vector3d& direction, double t_end,
            const geo::Box3d& box) {
  double first = 0.0;
  double last = t_end;
  for (int k = 0; k < 3; ++k) {
    if (direction[k] == 0.0) {
      if (origin[k] < box.min()[k] || origin[k] > box.max()[k]) return false;
      continue;
    }
    const double a = (box.min()[k] - origin[k]) / direction[k];
    const double b = (box.max()[k] - origin[k]) / direction[k];
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  return first <= last;
}

struct TiledScene {
  TiledScene(const world::TileStore& store, const SequencePlan& plan) : scene(store, plan) {
    for (const world::CutTile& tile : scene.query.cut())
      boxes.push_back(store.find(tile.id)->box_world());
  }
  test::TracedPlan scene;
  std::vector<geo::Box3d> boxes;
};

/// Boxes drawn at random, and whether rays come into them: small boxes are found by rays through their
/// points, large ones by rays drawn.
class FrameSights : public testing::Test {
 protected:
  static constexpr int kNumBoxes = 400;
  static constexpr std::uint64_t kNumSamples = 1000;

  FrameSights() : plan_(test::small_plan(3, 40, 30)), store_(test::make_hills(folder_ / "world")) {
    plan_.conditions.sun_azimuth_deg = 120.0;
    plan_.conditions.sun_elevation_deg = -30.0;
  }

  static double draw(double low, double high, std::uint64_t stream, std::uint64_t index) {
    return core::random_between(low, high, 5, stream, index);
  }
  static geo::Box3d box_of(int number) {
    const auto n = static_cast<std::uint64_t>(number);
    const Vector3d low(draw(-900.0, 900.0, 1, n), draw(-900.0, 900.0, 2, n),
                       draw(90.0, 160.0, 3, n));
    const double side = std::exp(draw(0.0, 5.5, 4, n));
    return {low, low + Vector3d(side, side, std::exp(draw(0.0, 5.0, 5, n)))};
  }
  static Vector3d point_in(const geo::Box3d& box, std::uint64_t number) {
    Vector3d point;
    for (int k = 0; k < 3; ++k)
      point[k] = draw(box.min()[k], box.max()[k], 8 + static_cast<std::uint64_t>(k), number);
    return point;
  }

  /// Compares may_reach of frame 1 with samples: it must miss none, and be wrong otherwise only where
  /// rays touch a box so little that no sample does.
  /// is_reached_by   box, sample number -> whether that sample's ray comes into the box
  /// most_wrong      of the boxes
  void expect_tells(
      const std::vector<int>& touched,
      const std::function<bool(const TiledScene&, const geo::Box3d&, std::uint64_t)>& is_reached_by,
      double most_wrong) {
    const TiledScene tiled(store_, plan_);
    const FrameSight sight(tiled.scene.renderer, tiled.boxes);
    int num_reached = 0;
    int num_wrong = 0;
    for (int i = 0; i < kNumBoxes; ++i) {
      const geo::Box3d box = box_of(i);
      // What images see is told whatever is touched.
      if (!touched.empty() && sight.may_reach(1, {}, box)) continue;
      bool is_reached = false;
      for (std::uint64_t k = 0; k < kNumSamples && !is_reached; ++k)
        is_reached = is_reached_by(tiled, box, k);
      const bool may_reach = sight.may_reach(1, touched, box);
      EXPECT_TRUE(may_reach || !is_reached) << "box " << i;
      num_reached += is_reached ? 1 : 0;
      num_wrong += may_reach && !is_reached ? 1 : 0;
    }
    EXPECT_GT(num_reached, kNumBoxes / 40);
    EXPECT_LT(num_reached, kNumBoxes * 4 / 5);
    EXPECT_LE(num_wrong, most_wrong * kNumBoxes);
  }

  test::ScratchFolder folder_;
  SequencePlan plan_;
  world::TileStore store_;
};

TEST_F(FrameSights, TellWhatComesIntoAnImage) {
  expect_tells(
      {},
      [](const TiledScene& tiled, const geo::Box3d& box, std::uint64_t k) {
        const sensors::View& view = tiled.scene.renderer.views().at(1, static_cast<int>(k % 3));
        const Vector3d direction = view.ray_world({draw(0.0, 40.0, 6, k), draw(0.0, 30.0, 7, k)});
        return enters(view.center_world, direction, kInfinity, box) ||
               view.has_in_image(point_in(box, k));
      },
      0.02);
}

TEST_F(FrameSights, TellWhatComesBetweenTouchedTilesAndTheSun) {
  plan_.conditions.sun_elevation_deg = 25.0;
  // All images look up, where no box is.
  for (geo::BodyState& state : plan_.states)
    state.world_from_body.rotation = Eigen::AngleAxisd(-1.9, Vector3d::UnitY());
  const std::vector<int> touched = {0, 5, 9};
  expect_tells(
      touched,
      [&](const TiledScene& tiled, const geo::Box3d& box, std::uint64_t k) {
        const geo::Box3d& tile = tiled.boxes[static_cast<std::size_t>(touched[k % 3])];
        const Vector3d sun = tiled.scene.renderer.sky().daylight().sun_direction_world;
        return enters(point_in(tile, k), sun, kInfinity, box) ||
               enters(point_in(box, k), -sun, kInfinity, tile);
      },
      0.03);
}

TEST_F(FrameSights, TellWhatComesBetweenTheFramesBesideAndTouchedTiles) {
  // This frame looks up, those beside it down.
  plan_.states[1].world_from_body.rotation = Eigen::AngleAxisd(-1.9, Vector3d::UnitY());
  const std::vector<int> touched = {3, 8, 14, 20};
  expect_tells(
      touched,
      [&](const TiledScene& tiled, const geo::Box3d& box, std::uint64_t k) {
        const geo::Box3d& tile = tiled.boxes[static_cast<std::size_t>(touched[k % 4])];
        const sensors::View& view =
            tiled.scene.renderer.views().at(k % 8 < 4 ? 0 : 2, static_cast<int>(k % 3));
        const Vector3d from = view.center_world;
        const Vector3d to = point_in(tile, k);
        if (view.has_in_image(to) && enters(from, to - from, 1.0, box)) return true;
        const Vector3d in_box = point_in(box, k);
        return view.has_in_image(in_box) && enters(in_box, in_box - from, kInfinity, tile);
      },
      0.2);  // tiles that lie in the image in part are taken for whole
}

}  // namespace
}  // namespace terracast::render
