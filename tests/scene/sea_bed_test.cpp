#include "world/sea_bed.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "scene/ground/ground.h"
#include "tests/tiler/planted_layer.h"
#include "tiler/bed_site.h"

/// What stands on the bed of the sea, against what is painted there and how deep it lies: a bed that falls to the
/// east, the sea's surface at 300 m.
namespace terracast::test {
namespace {

using Eigen::Vector2d;
using world::Instance;
using world::TileId;

constexpr double kSurface_m = 300.0;

struct Sea final : tiler::LayerSite, tiler::BedSite {
  static constexpr double kSlope = 0.08;
  explicit Sea(double bed_slope = kSlope) : slope(bed_slope) {}
  static double depth_at(const Vector2d& place, double slope = kSlope) {
    return std::max(slope * place.x(), 0.0);
  }
  /// Distance to the nearest of what others hold: a mole.
  static double room_m(const Vector2d& place) { return std::abs(place.y() - 100.0) - 6.0; }

  double ground_z_world(const Vector2d&) const override { return kSurface_m; }
  world::Cover cover(const Vector2d& place) const override {
    return depth_at(place, slope) > 0.0 ? world::Cover::Sea : world::Cover::Bare;
  }
  bool is_free(const Vector2d& place, double radius_m) const override {
    return is_unheld(place, radius_m) && depth_at(place + Vector2d(radius_m, 0.0), slope) <= 0.0;
  }
  double water_depth_m(const Vector2d& place) const override { return depth_at(place, slope); }
  bool is_unheld(const Vector2d& place, double radius_m) const override {
    return room_m(place) >= radius_m;
  }

  double slope;
};

std::vector<Instance> on(const TileId& id, double slope = Sea::kSlope) {
  world::TileObjects objects;
  planted().layer->add_objects(id, Sea(slope), objects);
  return objects.instances;
}

/// Of some tiles of 256 m what stands on the bed; without what reaches in from beside them.
std::vector<Instance> all_on_bed(double slope = Sea::kSlope) {
  std::vector<Instance> all;
  for (int x = 0; x < 2; ++x)
    for (int y = -1; y < 1; ++y) {
      const TileId id{0, x, y};
      for (const Instance& instance : on(id, slope)) {
        const Vector2d at = Planted::place_of(instance);
        if (Sea::depth_at(at, slope) > 0.0 && world::tile_at(0, at.x(), at.y()) == id)
          all.push_back(instance);
      }
    }
  return all;
}

/// What is painted on the bed, seen from near by.
struct Painted {
  float red;    ///< sand sends a quarter back, seagrass a thirtieth
  float grown;  ///< share of seagrass, which lies in its own shade
};
std::vector<Painted> painted(const std::vector<Vector2d>& places, double slope = Sea::kSlope) {
  using scene::kLanes;
  const auto world_seed = static_cast<std::uint64_t>(planted().surface->options().seed);
  scene::Climate climate;
  climate.seed = world::sea_bed::noise_seed(world_seed);
  const scene::Ground ground(climate);
  std::vector<Painted> all;
  for (std::size_t first = 0; first < places.size(); first += core::kLanes) {
    scene::GroundPlaces packet_places;
    for (int lane = 0; lane < core::kLanes; ++lane) {
      const Vector2d& at =
          places[std::min(first + static_cast<std::size_t>(lane), places.size() - 1)];
      world::SurfaceSample surface;
      surface.spacing_m = 1.0;
      surface.cover = world::Cover::Seabed;
      packet_places.set(lane, {at.x(), at.y(), kSurface_m - Sea::depth_at(at, slope)},
                        Eigen::Vector3d(slope, 0.0, 1.0).normalized(), surface, 1e-3);
      packet_places.sea_depth_m[lane] = Sea::depth_at(at, slope);
    }
    scene::GroundPacket packet;
    ground.set(packet_places, packet);
    scene::GroundLook look;
    ground.look(packet, look);
    for (int lane = 0; lane < core::kLanes && all.size() < places.size(); ++lane)
      all.push_back({look.albedo[0][lane], (0.95f - look.openness[lane]) / 0.15f});
  }
  return all;
}

bool is_seagrass(const Instance& instance) { return planted().is_a(instance, "seagrass"); }

TEST(SeaBed, SeagrassStandsOnTheBedWhereItIsPaintedAndBelowTheSurface) {
  std::vector<Vector2d> places;
  std::size_t num_boulders = 0;
  for (const Instance& instance : all_on_bed()) {
    const Vector2d at = Planted::place_of(instance);
    const double foot_z = instance.place_steps.z() * world::kHeightStep_m;
    EXPECT_NEAR(foot_z, kSurface_m - Sea::depth_at(at), 2.0 * world::kHeightStep_m);
    EXPECT_LT(foot_z + planted().height_m(instance), kSurface_m - 0.29);
    EXPECT_GE(Sea::room_m(at), planted().reach_m(instance) - 0.01);
    if (is_seagrass(instance)) {
      places.push_back(at);
    } else {
      EXPECT_TRUE(planted().is_a(instance, "boulder")) << planted().name_of(instance);
      EXPECT_LT(foot_z + planted().height_m(instance), kSurface_m - 1.99);
      ++num_boulders;
    }
  }
  // 20 ha, a third of them meadow with a tuft on each 14 m2; a boulder on each 3000 m2.
  EXPECT_GT(places.size(), 2000U);
  EXPECT_GT(num_boulders, 20U);
  EXPECT_LT(num_boulders, 400U);
  // Half sand and half seagrass, which are 0.245 and 0.03, give 0.15; shells and grains vary sand by a fifth.
  for (const Painted& one : painted(places)) EXPECT_LT(one.red, 0.19f);
  // Seagrass ends where the light does, and where waves break.
  for (const Vector2d& at : places) {
    EXPECT_GT(Sea::depth_at(at), 1.2);
    EXPECT_LT(Sea::depth_at(at), 32.1);
  }
}

/// How much of the places where a meadow is painted, up to 32 m deep, has plants near.
void expect_plants_where_painted(double slope, std::size_t least_places) {
  std::vector<Vector2d> plants;
  for (const Instance& instance : all_on_bed(slope))
    if (is_seagrass(instance)) plants.push_back(Planted::place_of(instance));
  std::vector<Vector2d> places;
  for (double x = 3.2 / slope; x < 28.0 / slope; x += 0.4 / slope)
    for (double y = -240.0; y < 80.0; y += 5.0) places.emplace_back(x, y);
  const std::vector<Painted> look = painted(places, slope);
  std::size_t num_grown = 0, num_with_plants = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (look[i].grown < 0.95f) continue;  // amid a meadow
    ++num_grown;
    // Places that are strewn are 4.2 m apart at least, and leave no gap as wide as twice that.
    const bool has_plant = std::any_of(plants.begin(), plants.end(), [&](const Vector2d& at) {
      return (at - places[i]).norm() < 6.0;
    });
    num_with_plants += has_plant ? 1 : 0;
  }
  ASSERT_GT(num_grown, least_places) << slope;
  EXPECT_GT(static_cast<double>(num_with_plants), 0.98 * static_cast<double>(num_grown)) << slope;
}

TEST(SeaBed, WhereverSeagrassIsPaintedPlantsStandNear) {
  expect_plants_where_painted(Sea::kSlope, 500);
  expect_plants_where_painted(0.16, 300);
}

/// How far the feet of a tuft's sheaves, of its finest shape, are above the bed at most, where they are
/// on the side to which it falls.
double feet_above_bed_m(const Instance& instance, double slope) {
  const auto& vertices =
      planted().layer->prototypes()[instance.prototype].levels.front().shape.vertices_steps;
  int lowest = 0;
  for (const Eigen::Vector3i& vertex : vertices) lowest = std::min(lowest, vertex.z());
  double highest = -1e9;
  for (const Eigen::Vector3i& vertex : vertices)
    if (2 * vertex.z() < lowest)
      highest = std::max(highest, vertex.z() + slope * vertex.head<2>().cast<double>().norm());
  const double bed_z = kSurface_m - Sea::depth_at(Planted::place_of(instance), slope);
  return (instance.place_steps.z() + highest * instance.scale / 4096.0) * world::kHeightStep_m -
         bed_z;
}

TEST(SeaBed, SheavesOfSeagrassHaveTheirFeetInBedsOfAnySlope) {
  for (const double slope : {0.08, 0.16, 0.2}) {
    std::size_t num_tufts = 0;
    for (const Instance& instance : all_on_bed(slope)) {
      if (!is_seagrass(instance)) continue;
      ++num_tufts;
      const Vector2d at = Planted::place_of(instance);
      const double foot_z = instance.place_steps.z() * world::kHeightStep_m;
      EXPECT_LE(feet_above_bed_m(instance, slope), 0.002) << slope;
      // No more than half of it is buried at its middle.
      EXPECT_GE(foot_z + 0.5 * planted().height_m(instance),
                kSurface_m - Sea::depth_at(at, slope) - 0.002)
          << slope;
      EXPECT_LT(foot_z + planted().height_m(instance), kSurface_m - 0.29);
    }
    EXPECT_GT(num_tufts, 500U) << slope;
  }
}

TEST(SeaBed, CliffsBearNoSeagrassAndNoneIsPaintedThere) {
  std::vector<Vector2d> places;
  for (const Instance& instance : all_on_bed(0.3)) EXPECT_FALSE(is_seagrass(instance));
  for (double x = 0.0; x < 200.0; x += 1.0)
    for (double y = -240.0; y < 80.0; y += 5.0) places.emplace_back(x, y);
  for (const Painted& one : painted(places, 0.3)) EXPECT_LT(one.grown, 0.01f);
}

TEST(SeaBed, TilesOfAnySizeHoldTheSame) {
  std::map<std::uint32_t, Instance> parts;
  for (int x = 0; x < 2; ++x)
    for (int y = 0; y < 2; ++y)
      for (const Instance& instance : on({-1, x, y}))
        parts.emplace(instance.provenance.instance_id, instance);
  std::size_t num_whole = 0;
  for (const Instance& instance : on({0, 0, 0})) {
    const Vector2d at = Planted::place_of(instance);
    if (world::tile_at(0, at.x(), at.y()) != TileId{0, 0, 0}) continue;
    ASSERT_TRUE(parts.contains(instance.provenance.instance_id));
    EXPECT_EQ(parts.at(instance.provenance.instance_id), instance);
    ++num_whole;
  }
  EXPECT_GT(num_whole, 300U);
  // A metre is two pixels on tiles of level 0: none on coarser ones.
  for (const Instance& instance : on({1, 0, 0})) {
    const Vector2d at = Planted::place_of(instance);
    if (world::tile_at(1, at.x(), at.y()) == TileId{1, 0, 0} && is_seagrass(instance)) {
      EXPECT_LT(instance.coarsest_level, 1);
    }
  }
}

}  // namespace
}  // namespace terracast::test
