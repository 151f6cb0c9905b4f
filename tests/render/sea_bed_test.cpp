#include "world/sea_bed.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "render/material.h"
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
  static double depth_at(const Vector2d& place) { return std::max(0.08 * place.x(), 0.0); }
  /// Distance to the nearest of what others hold: a mole.
  static double room_m(const Vector2d& place) { return std::abs(place.y() - 100.0) - 6.0; }

  double ground_z_world(const Vector2d&) const override { return kSurface_m; }
  world::Cover cover(const Vector2d& place) const override {
    return depth_at(place) > 0.0 ? world::Cover::Sea : world::Cover::Bare;
  }
  bool is_free(const Vector2d& place, double radius_m) const override {
    return is_unheld(place, radius_m) && depth_at(place + Vector2d(radius_m, 0.0)) <= 0.0;
  }
  double water_depth_m(const Vector2d& place) const override { return depth_at(place); }
  bool is_unheld(const Vector2d& place, double radius_m) const override {
    return room_m(place) >= radius_m;
  }
};

std::vector<Instance> on(const TileId& id) {
  world::TileObjects objects;
  planted().layer->add_objects(id, Sea(), objects);
  return objects.instances;
}

/// Of some tiles of 256 m what stands on the bed; without what reaches in from beside them.
std::vector<Instance> all_on_bed() {
  std::vector<Instance> all;
  for (int x = 0; x < 2; ++x)
    for (int y = -1; y < 1; ++y) {
      const TileId id{0, x, y};
      for (const Instance& instance : on(id)) {
        const Vector2d at = Planted::place_of(instance);
        if (Sea::depth_at(at) > 0.0 && world::tile_at(0, at.x(), at.y()) == id)
          all.push_back(instance);
      }
    }
  return all;
}

/// Red of what is painted on the bed, seen from near by: sand sends a quarter back, seagrass a thirtieth.
std::vector<float> painted_red(const std::vector<Vector2d>& places) {
  using render::kLanes;
  const auto world_seed = static_cast<std::uint64_t>(planted().surface->options().seed);
  render::Climate climate;
  climate.seed = world::sea_bed::noise_seed(world_seed);
  const render::Ground ground(climate);
  std::vector<float> red;
  for (std::size_t first = 0; first < places.size(); first += kLanes) {
    render::GroundPlaces packet_places;
    for (int lane = 0; lane < kLanes; ++lane) {
      const Vector2d& at =
          places[std::min(first + static_cast<std::size_t>(lane), places.size() - 1)];
      world::SurfaceSample surface;
      surface.spacing_m = 1.0;
      surface.cover = world::Cover::Seabed;
      packet_places.set(lane, {at.x(), at.y(), kSurface_m - Sea::depth_at(at)},
                        Eigen::Vector3d(0.08, 0.0, 1.0).normalized(), surface, 1e-3);
      packet_places.sea_depth_m[lane] = Sea::depth_at(at);
    }
    render::GroundPacket packet;
    ground.set(packet_places, packet);
    render::GroundLook look;
    ground.look(packet, look);
    for (int lane = 0; lane < kLanes && red.size() < places.size(); ++lane)
      red.push_back(look.albedo[0][lane]);
  }
  return red;
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
      ++num_boulders;
    }
  }
  // 20 ha, a third of them meadow with a tuft on each 14 m2; a boulder on each 3000 m2.
  EXPECT_GT(places.size(), 2000U);
  EXPECT_GT(num_boulders, 20U);
  EXPECT_LT(num_boulders, 400U);
  // Half sand and half seagrass, which are 0.245 and 0.03, give 0.15; shells and grains vary sand by a fifth.
  for (const float red : painted_red(places)) EXPECT_LT(red, 0.19f);
  // Seagrass ends where the light does, and where waves break.
  for (const Vector2d& at : places) {
    EXPECT_GT(Sea::depth_at(at), 1.2);
    EXPECT_LT(Sea::depth_at(at), 32.1);
  }
}

TEST(SeaBed, WhereverSeagrassIsPaintedPlantsStandNear) {
  std::vector<Vector2d> plants;
  for (const Instance& instance : all_on_bed())
    if (is_seagrass(instance)) plants.push_back(Planted::place_of(instance));
  std::vector<Vector2d> places;
  for (double x = 40.0; x < 350.0; x += 5.0)
    for (double y = -240.0; y < 80.0; y += 5.0) places.emplace_back(x, y);
  const std::vector<float> red = painted_red(places);
  std::size_t num_grown = 0, num_with_plants = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (red[i] > 0.06f) continue;  // amid a meadow
    ++num_grown;
    // Places that are strewn are 4.2 m apart at least, and leave no gap as wide as twice that.
    const bool has_plant = std::any_of(plants.begin(), plants.end(), [&](const Vector2d& at) {
      return (at - places[i]).norm() < 6.0;
    });
    num_with_plants += has_plant ? 1 : 0;
  }
  ASSERT_GT(num_grown, 500U);
  EXPECT_GT(static_cast<double>(num_with_plants), 0.98 * static_cast<double>(num_grown));
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
