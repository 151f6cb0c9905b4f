#include "job/traffic/ships.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>

#include "core/semantic_class.h"
#include "job/stages.h"
#include "job/traffic/ship_kinds.h"
#include "job/traffic/traffic_site.h"
#include "job/traffic/water_map.h"
#include "render/checked_plan.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "tests/support/traffic_town.h"
#include "world/lod.h"

namespace terracast::job {
namespace {

using namespace test;

/// A bay: sea south of a shore that winds, an island of 300 m, ever deeper away from the shore.
WaterAt bay(const Vector2d& at) {
  const double shore_y = 400.0 * std::sin(at.x() / 900.0);
  const double off_m = std::min(shore_y - at.y(), (at - Vector2d(600.0, -2500.0)).norm() - 300.0);
  if (off_m <= 0.0) return {};
  return {.is_water = true, .is_sea = true, .depth_m = off_m / 40.0};
}

std::vector<MovingThing> ships_of(const std::string& toml, const WaterSite& site,
                                  const std::vector<geo::BodyState>& frames) {
  const core::Log log("test", core::LogLevel::Off);
  const std::vector<TrafficOptions> options = {options_of("kind = \"ships\"\n" + toml)};
  return lay_out_ships(options, frames, frames.back().time_s, site, log);
}

const ShipKind& kind_of(const MovingThing& ship) {
  for (const ShipKind& kind : ship_kinds())
    if (kind.thing == ship.shape.thing) return kind;
  throw std::runtime_error(ship.shape.thing);
}

/// The least distance of two rectangles' corners and grids of points, of 41 by 11.
double gap_m(const MovingThing& a, const MovingThing& b, std::size_t frame) {
  const geo::BodyState& of_b = *b.states[frame];
  const double apart_m = (place_of(*a.states[frame]) - place_of(of_b)).norm();
  double least = apart_m - 0.5 * (size_of(a).norm() + size_of(b).norm());
  if (least > 300.0) return least;
  least = 1e300;
  for (int i = -20; i <= 20; ++i)
    for (int j = -5; j <= 5; ++j) {
      const Vector3d at = of_b.world_from_body.inverse() *
                          (a.states[frame]->world_from_body *
                           Vector3d(0.025 * i * size_of(a).x(), 0.1 * j * size_of(a).y(), 0.0));
      const Vector2d out = (at.head<2>().cwiseAbs() - 0.5 * size_of(b)).cwiseMax(0.0);
      least = std::min(least, out.norm());
    }
  return least;
}

const WaterSite kBay = {.water = bay, .standing = {}, .half_size_m = 8000.0, .obstacles = {}};
constexpr const char* kMany = "amount = 12.0\nreach_m = 4000.0\nmost = 5000\n";

TEST(Ships, KeepClearOfShoresAndShoalsAndOfEachOther) {
  const auto ships = ships_of(kMany, kBay, frames_at(0.5, 16, {0, -2500}));
  ASSERT_GT(ships.size(), 40U);
  std::map<std::string, int> num;
  for (const MovingThing& ship : ships) {
    ++num[ship.shape.thing];
    EXPECT_EQ(ship.ride, scene::Ride::Water);
    const ShipKind& kind = kind_of(ship);
    const double speed_mps = ship.states.front()->velocity_world_mps.norm();
    EXPECT_NEAR(speed_mps, kind.speed_mps, 0.15 * kind.speed_mps + 1e-9);
    for (std::size_t i = 0; i < ship.states.size(); ++i) {
      const geo::BodyState& state = *ship.states[i];
      EXPECT_NEAR(forward_of(state).dot(state.velocity_world_mps.head<2>()), speed_mps, 1e-9);
      EXPECT_NEAR(ship.gone_m[i], speed_mps * state.time_s, 1e-9);
      if (i > 0) {
        const double step_s = state.time_s - ship.states[i - 1]->time_s;
        EXPECT_LT((place_of(state) - place_of(*ship.states[i - 1]) -
                   step_s * state.velocity_world_mps.head<2>())
                      .norm(),
                  1e-9);
      }
      // Water all around, by rays of points 1 m apart, but for 15 m between the places that are looked at.
      const double off_m = kOffShore_m + 0.5 * size_of(ship).x() - 15.0;
      for (int turn = 0; turn < 24; ++turn) {
        const double angle = turn * 2.0 * 3.14159265358979 / 24.0;
        for (double out_m = 0.0; out_m < off_m; out_m += 1.0) {
          const WaterAt water =
              bay(place_of(state) + out_m * Vector2d(std::cos(angle), std::sin(angle)));
          ASSERT_TRUE(water.is_water) << ship.name;
          ASSERT_GT(water.depth_m, kind.draught_m) << ship.name;
        }
      }
    }
  }
  EXPECT_GT(num["sailing_yacht"], 10);
  EXPECT_GT(num.size(), 4U);
  for (std::size_t a = 0; a < ships.size(); ++a)
    for (std::size_t b = 0; b < ships.size(); ++b)
      for (std::size_t i = 0; a != b && i < 16; ++i)
        EXPECT_GT(gap_m(ships[a], ships[b], i),
                  0.25 * std::min(size_of(ships[a]).x(), size_of(ships[b]).x()))
            << ships[a].name << ' ' << ships[b].name;
}

TEST(Ships, AreAsManyAsIsAskedOfKindsByTheirShares) {
  const WaterSite ocean = {.water =
                               [](const Vector2d&) {
                                 return WaterAt{.is_water = true, .is_sea = true, .depth_m = 500.0};
                               },
                           .standing = {},
                           .half_size_m = 40000.0,
                           .obstacles = {}};
  std::map<std::string, double> num;
  double all = 0.0;
  constexpr int kSeeds = 20;
  constexpr double kReach_m = 5000.0, kAmount = 0.5;
  for (int seed = 1; seed <= kSeeds; ++seed)
    for (const MovingThing& ship :
         ships_of(fmt::format("amount = {}\nreach_m = {}\nmost = 5000\nseed = {}\n", kAmount,
                              kReach_m, seed),
                  ocean, std::vector<geo::BodyState>(1))) {
      num[ship.shape.thing] += 1.0;
      all += 1.0;
    }
  const double expected = kSeeds * kShipsPerKm2 * kAmount * 3.14159265358979 * 25.0;
  // Some give way to each other.
  EXPECT_LT(all, expected + 4.0 * std::sqrt(expected));
  EXPECT_GT(all, 0.9 * expected - 4.0 * std::sqrt(expected));
  for (const ShipKind& kind : ship_kinds()) {
    const double share = kind.share * all;
    EXPECT_NEAR(num[std::string(kind.thing)], share, 4.5 * std::sqrt(share) + 1.0) << kind.thing;
  }
}

TEST(Ships, GiveRoomToWhatStandsAndMovesInTheWaterAndLakesHaveNoMerchants) {
  const auto frames = frames_at(1.0, 6, {0, -2500});
  WaterSite site = kBay;
  for (int i = -40; i <= 40; ++i) site.standing.emplace_back(25.0 * i, -1800.0);
  Obstacle ferry{.states = {}, .length_m = 186.0, .width_m = 28.0};
  for (const geo::BodyState& frame : frames) {
    ferry.states.push_back(frame);
    ferry.states.back()->world_from_body.translation = {8.0 * frame.time_s, -3500.0, 0.0};
  }
  site.obstacles = {ferry};
  const auto ships = ships_of(kMany, site, frames);
  ASSERT_GT(ships.size(), 20U);
  for (const MovingThing& ship : ships)
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const Vector2d at = place_of(*ship.states[i]);
      for (const Vector2d& standing : site.standing)
        EXPECT_GE((at - standing).norm(), kOffShore_m + 0.5 * size_of(ship).x() - 1e-6);
      const Vector2d off =
          (at - Vector2d(8.0 * frames[i].time_s, -3500.0)).cwiseAbs() - Vector2d(93.0, 14.0);
      EXPECT_GT(off.cwiseMax(0.0).norm(), 0.5 * size_of(ship).y());
    }
  site.water = [](const Vector2d& at) {
    WaterAt water = bay(at);
    water.is_sea = false;
    return water;
  };
  for (const MovingThing& boat : ships_of(kMany, site, frames))
    EXPECT_EQ(boat.semantic_id, static_cast<std::uint32_t>(core::SemanticClass::Boat));
  for (const MovingThing& yacht :
       ships_of(std::string(kMany) + "things = [\"sailing_yacht\"]\n", site, frames))
    EXPECT_EQ(yacht.shape.thing, "sailing_yacht");
  test::expect_error(core::ErrorKind::Config, {"pontoon", "ships", "sailing_yacht"},
                     [] { options_of("kind = \"ships\"\nthings = [\"pontoon\"]\n"); });
}

TEST(Ships, AreTheSameFromOtherCamerasAndForOtherThreads) {
  const auto here = ships_of(kMany, kBay, frames_at(1.0, 6, {0, -2500}));
  const auto there = ships_of(kMany, kBay, frames_at(2.0, 11, {1500, -3000}));
  std::map<std::string, const MovingThing*> known;
  for (const MovingThing& ship : here) known.emplace(ship.name, &ship);
  int num_common = 0;
  for (const MovingThing& ship : there)
    if (const auto found = known.find(ship.name); found != known.end()) {
      ++num_common;
      for (std::size_t i = 0; i < 6; ++i)
        EXPECT_LT((place_of(*ship.states[2 * i]) - place_of(*found->second->states[i])).norm(),
                  1e-9);
    }
  EXPECT_GT(num_common, 20);
}

TEST(Ships, NobodyRunsAgroundInAWorldByItsOwnTiles) {
  const test::ScratchFolder folder;
  std::ofstream(folder / "job.toml") << R"(name = "coast"
[world]
name = "coast"
origin_lat_deg = 38.0
origin_lon_deg = 24.0
size_m = 8192.0
seed = 5
outside = "extend"
[[world.elevation]]
kind = "procedural"
landform = "islands"
vertical_datum = "egm96"
relief_m = 200.0
sea_level_m = 0.0
[detail]
cell_px = 16.0
finest_spacing_m = 8.0
[[rigs]]
name = "one"
[[rigs.cameras]]
name = "cam"
width_px = 64
height_px = 48
fx_px = 48.0
[[trajectories]]
name = "P000"
kind = "orbit"
rate_hz = 0.5
num_frames = 11
speed_mps = 40.0
radius_m = 1500.0
centre = {east_m = 0.0, north_m = 0.0, height_m = 400.0, above = "ground"}
[[traffic]]
kind = "ships"
amount = 10.0
reach_m = 5000.0
most = 1000
)";
  const core::Log log("test", core::LogLevel::Off);
  const core::Context context{.log = log};
  const Job job = prepare_job(load_run_config(folder / "job.toml", {}), context);
  const world::TileStore store = tile(job, folder / "world", context);
  render::SequencePlan plan = job.sequences.at(0);
  add_traffic(job, store, log, plan);
  ASSERT_GT(plan.moving.size(), 5U);
  const world::RayQuery query(
      store,
      world::choose_cut(store, render::viewpoints_of(plan.states, plan.cameras), plan.detail),
      job.config.tracing);
  const geo::WorldFrame frame(store.manifest().origin);
  // On the water at all times, which settling refuses otherwise, and upright.
  const scene::MovingBodies bodies(plan.moving, query, frame);
  WaterMap water(store);
  for (int i = 0; i < 11; ++i) {
    const auto states = bodies.states(i);
    for (std::size_t k = 0; k < states.size(); ++k) {
      ASSERT_TRUE(states[k]);
      const Vector3d& at = states[k]->world_from_body.translation;
      EXPECT_NEAR(at.z(), *query.surface_z_world(at.x(), at.y()), 1e-9);
      EXPECT_LT(
          (states[k]->world_from_body.rotation * Vector3d::UnitZ() - frame.up_world(at)).norm(),
          1e-7);
      const Vector2d half = 0.5 * tiler::find_thing(plan.moving[k].shape.thing)->size_m.head<2>();
      for (int a = -4; a <= 4; ++a)
        for (int b = -2; b <= 2; ++b) {
          const Vector3d corner =
              states[k]->world_from_body * Vector3d(0.25 * a * half.x(), 0.5 * b * half.y(), 0.0);
          const WaterAt there = water.at(corner.head<2>());
          EXPECT_TRUE(there.is_water);
          EXPECT_GT(there.depth_m, kind_of(plan.moving[k]).draught_m);
        }
    }
  }
}

}  // namespace
}  // namespace terracast::job
