#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "core/random.h"
#include "tests/support/brute_terrain.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "tests/world/rays.h"
#include "world/ray_query.h"

namespace terracast::world {
namespace {

using test::cast;
using test::kInfinity;

using test::make_wet_world;

double on_lattice(double value_m) { return test::on_height_lattice(value_m); }

/// All tiles of a store that no finer one covers.
std::vector<CutTile> leaves_of(const TileStore& store) { return finest_cut(store); }

TEST(WithoutWater, TheGroundIsTheBedAndMeetsTheLandAtTheShores) {
  const test::ScratchFolder folder;
  // Hills that stand out of a lake at 0, tiles of two levels.
  const auto bed_m = [](double x, double y) {
    return on_lattice(30.0 * std::sin(x / 90.0) * std::cos(y / 70.0) - 4.0);
  };
  const auto surface_m = [&](double x, double y) { return std::max(bed_m(x, y), 0.0); };
  const auto depth_m = [&](double x, double y) { return surface_m(x, y) - bed_m(x, y); };
  test::TinyWorldOptions options;
  options.refine = [](const TileId& id) { return id.x == 0; };
  const TileStore wet = make_wet_world(folder / "wet", surface_m, depth_m, options);
  const TileStore dry = test::make_tiny_world(folder / "dry", bed_m, options);
  const RayQuery whole(wet, leaves_of(wet), {});
  const RayQuery bed(whole, RayQuery::WithoutWater{});
  const test::BruteTerrain brute(dry, leaves_of(dry));
  int num_beds = 0;
  for (std::uint64_t i = 0; i < 1500; ++i) {
    const auto draw = [&](std::uint64_t k, double low, double high) {
      return core::random_between(low, high, 3, k, i);
    };
    const WorldRay ray{
        .origin_world = {draw(1, -900, 900), draw(2, -900, 900), draw(3, 40.0, 90.0)},
        .direction_world = {draw(4, -1, 1), draw(5, -1, 1), draw(6, -1.0, -0.05)}};
    const double t = brute.first_crossing(ray.origin_world, ray.direction_world, 0.0, kInfinity);
    SurfaceHit hit;
    SurfaceSample surface;
    bed.intersect({&ray, 1}, {&hit, 1}, Coherence::Incoherent, {&surface, 1});
    if (std::isinf(t)) {
      EXPECT_TRUE(hit.is_sky()) << i;
      continue;
    }
    // Clearances err by 12 * 2^-53 of 1000 m times slopes below 1; rays close in by 1e-3 or more.
    EXPECT_NEAR(hit.t, t, 1e-8) << i;
    const Eigen::Vector3d point = ray.origin_world + t * ray.direction_world;
    if (point.z() < -1.5) {
      EXPECT_EQ(surface.cover, Cover::Seabed);
      ++num_beds;
    } else if (point.z() > 1.5) {
      EXPECT_EQ(surface.cover, Cover::Land);
    }
    // The whole world's first crossing is never behind.
    EXPECT_LE(cast(whole, ray).t, hit.t + 1e-8);
  }
  EXPECT_GT(num_beds, 300);
}

// Between a wet and a dry corner of a cell the bed's triangles lie below the land's: there a ray that has come out of the
// water may meet the bed's triangle behind the water's surface, and must not go on to it.
TEST(WithoutWater, RaysFromShallowWaterEndAtItsSurfaceBeforeABeach) {
  const test::ScratchFolder folder;
  // Beaches of a few degrees around islets in a pond at 0, so small that it is level: 40 m off the Earth has curved
  // away by an eighth of a step of heights.
  const auto bed_m = [](double x, double y) {
    return on_lattice(0.6 * std::sin(x / 11.0) * std::cos(y / 9.0) - 0.1);
  };
  const auto surface_m = [&](double x, double y) { return std::max(bed_m(x, y), 0.0); };
  const auto depth_m = [&](double x, double y) { return surface_m(x, y) - bed_m(x, y); };
  test::TinyWorldOptions options;
  options.refine = [](const TileId&) { return true; };
  const TileStore wet = make_wet_world(folder / "wet", surface_m, depth_m, options);
  const TileStore dry = test::make_tiny_world(folder / "dry", bed_m, options);
  const TileStore land = test::make_tiny_world(folder / "land", surface_m, options);
  const RayQuery whole(wet, leaves_of(wet), {});
  const RayQuery query(whole, RayQuery::WithoutWater{.viewers_in_water = true});
  const test::BruteTerrain bed(dry, leaves_of(dry));
  const test::BruteTerrain surface(land, leaves_of(land));
  const auto has_corner_at_0 = [&](double x, double y) {
    bool is_there = false;
    for (const double corner_x : {std::floor(x), std::ceil(x)})
      for (const double corner_y : {std::floor(y), std::ceil(y)})
        is_there = is_there || bed_m(corner_x, corner_y) == 0.0;
    return is_there;
  };
  int num_surface = 0, num_bed = 0, num_behind = 0;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const auto draw = [&](std::uint64_t k, double low, double high) {
      return core::random_between(low, high, 7, k, i);
    };
    const double x = draw(1, -40, 40), y = draw(2, -40, 40);
    const double deep_m = -bed.ground_z(x, y);
    if (!(deep_m > 0.01)) continue;
    const Eigen::Vector3d origin(x, y, -deep_m * draw(3, 0.05, 0.95));
    // Every other ray looks up the beach, little less steep than it.
    const Eigen::Vector2d uphill(bed.ground_z(x + 1.0, y) - bed.ground_z(x - 1.0, y),
                                 bed.ground_z(x, y + 1.0) - bed.ground_z(x, y - 1.0));
    const Eigen::Vector2d ahead = i % 2 == 0 ? uphill.normalized() : Eigen::Vector2d::Zero();
    const Eigen::Vector3d direction(ahead.x() + draw(4, -1, 1), ahead.y() + draw(5, -1, 1),
                                    draw(6, -0.05, 0.1));
    const double t_bed = bed.first_crossing(origin, direction, 0.0, kInfinity);
    const double t_surface = surface.first_crossing(origin, direction, 0.0, kInfinity);
    const double t = std::min(t_bed, t_surface);
    const Eigen::Vector3d met = origin + t * direction;
    if (!(met.head<2>().cwiseAbs().maxCoeff() < 60.0)) continue;
    // At a shore facets are land or water by the corner that counts most: land too where a dry corner lies at 0.
    if (t_surface < t_bed && (met.z() > 1e-9 || has_corner_at_0(met.x(), met.y()))) continue;
    const WorldRay ray{.origin_world = origin, .direction_world = direction};
    SurfaceHit hit;
    SurfaceSample sample;
    query.intersect({&ray, 1}, {&hit, 1}, Coherence::Incoherent, {&sample, 1});
    EXPECT_NEAR(hit.t, t, 1e-6 * (1.0 + t)) << i << ", bed at " << t_bed;
    if (t_surface < t_bed) {
      ++num_surface;
      // Where the way through the air ends soon: at the shore that the ray looked at.
      if ((t_bed - t_surface) * direction.norm() < 3.0) ++num_behind;
    } else {
      ++num_bed;
    }
  }
  EXPECT_GT(num_surface, 1000);
  EXPECT_GT(num_bed, 500);
  EXPECT_GT(num_behind, 20);
}

class InWater : public testing::Test {
 protected:
  // A level lake at 0 over a bed that falls to the east; land rises at the western end.
  static double bed_m(double x) { return -20.0 - 0.05 * x; }
  InWater()
      : store(make_wet_world(
            folder.path() / "world",
            [](double x, double) { return std::max(on_lattice(bed_m(x)), 0.0); },
            [](double x, double) { return std::max(-on_lattice(bed_m(x)), 0.0); })),
        whole(store, leaves_of(store), {}),
        query(whole, RayQuery::WithoutWater{.viewers_in_water = true}) {}

  test::ScratchFolder folder;
  TileStore store;
  RayQuery whole;
  RayQuery query;
};

TEST_F(InWater, RaysMeetTheBedOrTheSurfaceFromBelow) {
  int num_surface = 0;
  int num_bed = 0;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const auto draw = [&](std::uint64_t k, double low, double high) {
      return core::random_between(low, high, 5, k, i);
    };
    const Eigen::Vector3d origin(draw(1, -300, 300), draw(2, -300, 300), draw(3, -4.5, -0.5));
    const Eigen::Vector3d direction(draw(4, -1, 1), draw(5, -1, 1), draw(6, -1, 1));
    // Planes: z = 0 upward, z = -20 - x / 20 downward.
    const double t_up = direction.z() > 0.0 ? -origin.z() / direction.z() : kInfinity;
    const double closing = direction.z() + 0.05 * direction.x();
    const double gap = origin.z() + 20.0 + 0.05 * origin.x();
    const double t_down = closing < 0.0 ? -gap / closing : kInfinity;
    const double t = std::min(t_up, t_down);
    const Eigen::Vector3d point = origin + t * direction;
    if (!(point.head<2>().cwiseAbs().maxCoeff() < 380.0)) continue;  // land begins at x = -400
    const WorldRay ray{.origin_world = origin, .direction_world = direction};
    SurfaceHit hit;
    SurfaceSample surface;
    query.intersect({&ray, 1}, {&hit, 1}, Coherence::Incoherent, {&surface, 1});
    ASSERT_FALSE(hit.is_sky()) << i;
    if (t_up < t_down) {
      EXPECT_NEAR(hit.t, t, 1e-11 * (1.0 + t)) << i;  // a level surface; coordinates of 400 m
      EXPECT_EQ(surface.cover, Cover::Lake);
      ++num_surface;
    } else {
      // The bed is rounded to half a step of height.
      EXPECT_NEAR(hit.t, t, 0.5 * kHeightStep_m / std::abs(closing) + 1e-11) << i;
      EXPECT_EQ(surface.cover, Cover::Seabed);
      ++num_bed;
    }
    // A ray to the very point says that it is seen, from another place in the water too.
    const Eigen::Vector3d met = origin + hit.t * direction;
    const Eigen::Vector3d other(0.0, 0.0, -2.0);
    const WorldRay back{.origin_world = other, .direction_world = met - other, .t_max = 1.0 + 1e-6};
    EXPECT_NEAR(cast(query, back).t, 1.0, 1e-9) << i;
  }
  EXPECT_GT(num_surface, 200);
  EXPECT_GT(num_bed, 200);
}

TEST_F(InWater, LightPassesTheSurface) {
  const WorldRay up{.origin_world = {10.0, 20.0, -5.0}, .direction_world = {0.1, 0.0, 1.0}};
  std::uint8_t is_blocked = 1;
  query.occluded({&up, 1}, {&is_blocked, 1});
  EXPECT_EQ(is_blocked, 0);
  EXPECT_NEAR(query.surface_z_world(0.0, 0.0).value(), -20.0, kHeightStep_m);
  EXPECT_NEAR(whole.surface_z_world(0.0, 0.0).value(), 0.0, kHeightStep_m);
}

}  // namespace
}  // namespace terracast::world
