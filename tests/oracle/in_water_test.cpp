#include <gmpxx.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/random.h"
#include "tests/oracle/nothing_stands.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "validate/oracle/exact_world.h"
#include "world/lod.h"
#include "world/ray_query.h"

/// What the oracle's rays meet where those who look stand in water.
namespace terracast::oracle {
namespace {

using test::nothing_stands;
using test::on_height_lattice;
using test::ScratchFolder;

constexpr std::uint64_t kSeed = 20261124;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double random(std::uint64_t index, std::uint64_t number, double lowest, double highest) {
  return core::random_between(lowest, highest, kSeed, number, index);
}

/// A wet world with a cut of the finest tiles.
struct Wet {
  Wet(const std::filesystem::path& folder, const test::HeightFunction& surface_m,
      const test::HeightFunction& depth_m, const test::TinyWorldOptions& options = {})
      : store(test::make_wet_world(folder, surface_m, depth_m, options)),
        cut(world::finest_cut(store)),
        world(folder) {
    for (const world::CutTile& tile : cut) keys.push_back({tile.id.level, tile.id.x, tile.id.y});
  }
  ExactWorld seen_from_water() const {
    return ExactWorld(world, keys, nothing_stands, Viewers::InWater);
  }
  world::TileStore store;
  std::vector<world::CutTile> cut;
  WorldFolder world;
  std::vector<TileKey> keys;
};

// A level lake over a bed that falls to the east; heights and slope lie on the lattice.
TEST(OracleInWater, MeetsBedAndSurfaceWhereTheirEquationsPutThemToTheLastBit) {
  const ScratchFolder scratch;
  const auto bed_m = [](double x, double) { return -20.0 - x / 16.0; };
  const Wet wet(
      scratch.path(), [&](double x, double y) { return std::max(bed_m(x, y), 0.0); },
      [&](double x, double y) { return std::max(-bed_m(x, y), 0.0); });
  const ExactWorld seen = wet.seen_from_water();
  int num_bed = 0;
  int num_surface = 0;
  for (std::uint64_t i = 0; i < 300; ++i) {
    const ExactRay ray{{random(i, 1, -200, 200), random(i, 2, -300, 300), random(i, 3, -7, -0.5)},
                       {random(i, 4, -300, 300), random(i, 5, -300, 300), random(i, 6, -40, 20)}};
    const auto along = [&](int k) {
      return mpq_class(mpq_class(ray.through_world[k]) - mpq_class(ray.origin_world[k]));
    };
    const mpq_class x(ray.origin_world.x());
    const mpq_class z(ray.origin_world.z());
    const mpq_class to_bed = -(z + 20 + x / 16) / (along(2) + along(0) / 16);
    const mpq_class to_surface = -z / along(2);
    const bool is_up = along(2) > 0 && (to_bed < 0 || to_surface < to_bed);
    const mpq_class& t = is_up ? to_surface : to_bed;
    const Eigen::Vector3d point =
        ray.origin_world + t.get_d() * (ray.through_world - ray.origin_world);
    // The shore is at x = -320, the world's end at 1024.
    if (t < 0 || point.x() < -310.0 || point.head<2>().cwiseAbs().maxCoeff() > 1000.0) continue;
    const auto hit = seen.first_hit(ray);
    ASSERT_TRUE(hit) << i;
    EXPECT_EQ(hit->t, t.get_d()) << i;
    for (const Ground ground : hit->grounds)
      EXPECT_EQ(ground, is_up ? Ground::Lake : Ground::Seabed) << i;
    ++(is_up ? num_surface : num_bed);
    // A ray that ends at the point meets it, and one that ends before does not.
    EXPECT_FALSE(seen.first_hit(ray, 0.999 * hit->t)) << i;
  }
  EXPECT_GT(num_bed, 100);
  EXPECT_GT(num_surface, 30);
}

TEST(OracleInWater, TellsPlacesInWaterFromOthers) {
  const ScratchFolder scratch;
  const auto bed_m = [](double x, double) { return -20.0 - x / 16.0; };
  const Wet wet(
      scratch.path(), [&](double x, double y) { return std::max(bed_m(x, y), 0.0); },
      [&](double x, double y) { return std::max(-bed_m(x, y), 0.0); });
  const auto is_in_water = [&](double x, double z) {
    return ExactWorld::is_in_water(wet.world, wet.keys, {x, 0.0, z});
  };
  EXPECT_TRUE(is_in_water(100.0, -1.0));
  EXPECT_TRUE(is_in_water(100.0, -26.0));
  EXPECT_FALSE(is_in_water(100.0, 1.0));
  EXPECT_FALSE(is_in_water(-600.0, 10.0)) << "in the land";
  EXPECT_FALSE(is_in_water(5000.0, -1.0)) << "outside";
}

// Islands, shores and two levels of tiles: what the renderer's rays meet, whose code is another.
TEST(OracleInWater, AgreesWithTheRenderersRaysOnARoughBed) {
  const ScratchFolder scratch;
  const auto bed_m = [](double x, double y) {
    return on_height_lattice(14.0 * std::sin(x / 90.0) * std::cos(y / 70.0) +
                             std::sin(x / 5.0 + y / 7.0) - 4.0);
  };
  test::TinyWorldOptions options;
  options.refine = [](const world::TileId& id) { return id.x == 0; };
  const Wet wet(
      scratch.path(), [&](double x, double y) { return std::max(bed_m(x, y), 0.0); },
      [&](double x, double y) { return std::max(-bed_m(x, y), 0.0); }, options);
  const ExactWorld seen = wet.seen_from_water();
  const world::RayQuery whole(wet.store, wet.cut, {});
  const world::RayQuery below(whole, world::RayQuery::WithoutWater{.viewers_in_water = true});
  int num_bed = 0;
  int num_surface = 0;
  for (std::uint64_t i = 0; i < 600; ++i) {
    const Eigen::Vector3d origin(random(i, 1, -600, 600), random(i, 2, -600, 600),
                                 random(i, 3, -8.0, -0.3));
    if (bed_m(std::round(origin.x()), std::round(origin.y())) > origin.z() - 1.0) continue;
    const world::WorldRay ray{
        .origin_world = origin,
        .direction_world = {random(i, 4, -1, 1), random(i, 5, -1, 1), random(i, 6, -0.5, 0.5)}};
    world::SurfaceHit hit;
    world::SurfaceSample surface;
    below.intersect({&ray, 1}, {&hit, 1}, world::Coherence::Incoherent, {&surface, 1});
    const auto exact = seen.first_hit({origin, origin + ray.direction_world});
    ASSERT_EQ(exact.has_value(), !hit.is_sky()) << i;
    if (!exact) continue;
    // Clearances err by 12 * 2^-53 of 1000 m; rays close in by 1e-4 or more.
    EXPECT_NEAR(exact->t, hit.t, 1e-8 * (1.0 + hit.t)) << i;
    const bool is_surface = world::is_water(surface.cover);
    EXPECT_EQ(exact->normal_world.dot(ray.direction_world) > 0.0, is_surface) << i;
    ++(is_surface ? num_surface : num_bed);
  }
  EXPECT_GT(num_bed, 100);
  EXPECT_GT(num_surface, 100);
}

}  // namespace
}  // namespace terracast::oracle
