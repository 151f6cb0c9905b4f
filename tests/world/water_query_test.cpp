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
