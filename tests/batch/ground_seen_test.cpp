#include "batch/dataset/ground_seen.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/batch/plane_capture.h"
#include "tests/support/test_data.h"

namespace terracast::batch {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kAnyDistance = std::numeric_limits<double>::infinity();

/// Whether a place is shown: it projects among the pixels' centres, and the four round it show
/// ground. The plane is projected forward into the image, where the code under test goes back.
bool is_shown(const PlaneCapture& plane, double lat_deg, double lon_deg, double within_m) {
  const Vector3d ground = plane.ground_world(lat_deg, lon_deg);
  for (std::size_t i = 0; i < plane.world_from_camera.size(); ++i) {
    const int frame = static_cast<int>(i);
    Vector2d at;
    if ((ground - plane.world_from_camera[i].translation).norm() > within_m ||
        !plane.project(frame, ground, at))
      continue;
    const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
    if (x < 0 || y < 0 || x + 1 >= plane.width_px || y + 1 >= plane.height_px) continue;
    if (plane.shown(frame, x, y).is_ground && plane.shown(frame, x + 1, y).is_ground &&
        plane.shown(frame, x, y + 1).is_ground && plane.shown(frame, x + 1, y + 1).is_ground)
      return true;
  }
  return false;
}

/// Whether a place of a rectangle is shown, tried every 100 m / per_cell.
bool is_any_shown(const PlaneCapture& plane, const CellBounds& bounds, int num, double within_m) {
  for (int i = 0; i < num; ++i)
    for (int k = 0; k < num; ++k)
      if (is_shown(
              plane, bounds.south_deg + (bounds.north_deg - bounds.south_deg) * (i + 0.5) / num,
              bounds.west_deg + (bounds.east_deg - bounds.west_deg) * (k + 0.5) / num, within_m))
        return true;
  return false;
}

/// Holds what is found against the closed form, over all cells within reach_m of the origin.
void expect_exact(const PlaneCapture& plane, double within_m, double reach_m) {
  const test::ScratchFolder folder;
  const GroundSeen seen = ground_seen(plane.write(folder / "plane"), {.within_m = within_m});
  ASSERT_GT(seen.num_cells(), 0);
  const GroundCell middle = ground_cell_at(plane.origin.lat_deg, plane.origin.lon_deg);
  const int reach = static_cast<int>(reach_m / 100.0);
  std::int64_t num_shown = 0;
  std::int64_t num_held = 0;
  for (int band = middle.band - reach; band <= middle.band + reach; ++band) {
    const int count = cells_in_band(band);
    const int column = column_at(band, plane.origin.lon_deg);
    for (int k = -reach; k <= reach; ++k) {
      const GroundCell cell{band, ((column + k) % count + count) % count};
      const CellBounds bounds = bounds_of(cell);
      const bool is_held = seen.holds(cell);
      num_held += is_held ? 1 : 0;
      // The line that ends at within_m has chords for arcs: 1 m.
      const bool must_hold = is_any_shown(plane, bounds, 6, within_m - 1.0);
      num_shown += must_hold ? 1 : 0;
      ASSERT_TRUE(is_held || !must_hold) << "missed: band " << band << " column " << cell.column;
      if (!is_held || must_hold) continue;
      const double dy = bounds.north_deg - bounds.south_deg;
      const double dx = bounds.east_deg - bounds.west_deg;
      ASSERT_TRUE(is_any_shown(plane,
                               {bounds.south_deg - dy, bounds.north_deg + dy, bounds.west_deg - dx,
                                bounds.east_deg + dx},
                               18, within_m))
          << "too far: band " << band << " column " << cell.column;
    }
  }
  EXPECT_EQ(num_held, seen.num_cells()) << "cells beyond the part that was looked at";
  EXPECT_GT(num_shown, seen.num_cells() / 2);  // most are held because something of them is shown
}

TEST(GroundSeen, IsTheFootprintOfAViewStraightDown) {
  PlaneCapture plane;
  for (const double x_m : {-300.0, 0.0, 250.0, 700.0})
    plane.world_from_camera.push_back(looking({x_m, 0.4 * x_m, 900.0}, 20.0, 90.0));
  expect_exact(plane, kAnyDistance, 2500.0);
}

TEST(GroundSeen, EndsWhereItIsTooFarFromTheCamera) {
  PlaneCapture plane;
  plane.width_px = 60;
  plane.world_from_camera = {looking({-100.0, -1500.0, 700.0}, 10.0, 15.0),
                             looking({900.0, -1500.0, 750.0}, -20.0, 10.0),
                             looking({-900.0, 1500.0, 600.0}, 30.0, 165.0)};  // upside down
  expect_exact(plane, 3000.0, 3600.0);
}

TEST(GroundSeen, HasNoHolesBetweenPixelsThatAreFarApart) {
  // Hits lie 300 m and more apart.
  PlaneCapture plane;
  plane.width_px = 14;
  plane.height_px = 12;
  plane.focal_length_px = 20.0;
  plane.world_from_camera = {looking({0.0, -500.0, 6000.0}, 33.0, 80.0)};
  expect_exact(plane, kAnyDistance, 4000.0);
  plane.origin = {.lat_deg = -16.9, .lon_deg = 179.995, .height_m = 0.0};
  expect_exact(plane, kAnyDistance, 4000.0);
}

TEST(GroundSeen, HoldsTheCellOfEveryHitHoweverNearToItsBorder) {
  // Hits 3 m apart: most are not looked up, but known to be in the cell of the one before.
  PlaneCapture plane;
  plane.width_px = 256;
  plane.height_px = 192;
  plane.focal_length_px = 200.0;
  const geo::WorldFrame frame(plane.origin);
  for (int i = 0; i < 8; ++i)
    plane.world_from_camera.push_back(looking({137.0 * i, 411.0 * i, 600.0}, 37.0 * i, 90.0));
  for (int i = 0; i < 8; ++i) {
    PlaneCapture one = plane;
    one.world_from_camera = {plane.world_from_camera[static_cast<std::size_t>(i)]};
    const test::ScratchFolder folder;
    const GroundSeen seen = ground_seen(one.write(folder / "plane"), {});
    std::set<GroundCell> cells;
    for (int y = 0; y < one.height_px; ++y)
      for (int x = 0; x < one.width_px; ++x) {
        const PlaneCapture::Shown hit = one.shown(0, x, y);
        const geo::Geodetic place = frame.geodetic_from_world(one.world_from_camera[0].translation +
                                                              hit.range_m * hit.direction_world);
        cells.insert(ground_cell_at(place.lat_deg, place.lon_deg));
      }
    for (const GroundCell& cell : cells)
      EXPECT_TRUE(seen.holds(cell)) << cell.band << " " << cell.column;
  }
}

TEST(GroundSeen, GoesOnAcrossThe180DegreeMeridian) {
  PlaneCapture plane;
  plane.origin = {.lat_deg = -16.9, .lon_deg = 179.998, .height_m = 0.0};
  plane.world_from_camera = {looking({0.0, 0.0, 900.0}, 0.0, 90.0),
                             looking({-800.0, 200.0, 600.0}, 80.0, 40.0)};
  expect_exact(plane, 2500.0, 2600.0);
  plane.origin.lon_deg = -179.999;
  plane.origin.lat_deg = 66.0;
  expect_exact(plane, 2500.0, 2600.0);
}

TEST(GroundSeen, IsExactNearThePolesToo) {
  PlaneCapture plane;
  plane.origin = {.lat_deg = 88.9, .lon_deg = -100.0, .height_m = 0.0};
  plane.world_from_camera = {looking({100.0, 0.0, 900.0}, 50.0, 70.0)};
  expect_exact(plane, kAnyDistance, 1800.0);
}

TEST(GroundSeen, LeavesOutWhatLiesOutsideTheWorld) {
  PlaneCapture plane;
  plane.is_outside = [](const Vector3d& point) { return point.x() + 0.3 * point.y() > 50.0; };
  plane.world_from_camera = {looking({0.0, -200.0, 900.0}, 20.0, 75.0)};
  expect_exact(plane, kAnyDistance, 1600.0);
}

TEST(GroundSeen, IsNoneWhereOnlySkyIsShown) {
  PlaneCapture plane;
  plane.world_from_camera = {looking({0.0, 0.0, 900.0}, 0.0, -60.0)};
  const test::ScratchFolder folder;
  const GroundSeen seen = ground_seen(plane.write(folder / "sky"), {});
  EXPECT_EQ(seen.num_cells(), 0);
  EXPECT_EQ(ground_from_json(json_from_ground(seen), "ground.json"), seen);
}

TEST(GroundSeen, DoesNotDependOnThreads) {
  const test::ScratchFolder folder;
  const auto capture = capture::SequenceReader::open(
      test::write_tiny_capture(folder.path(), {.num_frames = 3, .has_tartan2 = false}));
  GroundSeen alone;
  {
    const core::ThreadLimit limit(1);
    alone = ground_seen(capture, {.ground = "made", .within_m = 30000.0});
  }
  const core::ThreadLimit limit(4);
  EXPECT_EQ(ground_seen(capture, {.ground = "made", .within_m = 30000.0}), alone);
  EXPECT_EQ(alone.ground, "made");
  EXPECT_EQ(alone.within_m, 30000.0);
}

TEST(GroundSeen, NeedsADistance) {
  PlaneCapture plane;
  plane.world_from_camera = {looking({0.0, 0.0, 900.0}, 0.0, 90.0)};
  const test::ScratchFolder folder;
  const capture::SequenceReader sequence = plane.write(folder / "plane");
  for (const double within_m : {0.0, -1.0, std::nan("")})
    EXPECT_THROW(ground_seen(sequence, {.within_m = within_m}), core::Error);
}

TEST(GroundIdentity, IsTheEarthsWhereAnyHeightWasMeasured) {
  world::WorldManifest manifest;
  manifest.input_hash = "0123456789abcdef";
  const auto add = [&](const char* kind) { manifest.sources.emplace_back().kind = kind; };
  add("procedural");
  add("sea");
  EXPECT_EQ(ground_identity(manifest), "0123456789abcdef");
  add("raster");
  EXPECT_EQ(ground_identity(manifest), "earth");
}

}  // namespace
}  // namespace terracast::batch
