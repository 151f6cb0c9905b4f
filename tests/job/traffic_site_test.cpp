#include "job/traffic/traffic_site.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "core/error.h"
#include "job/stages.h"
#include "job/traffic/traffic.h"
#include "render/checked_plan.h"
#include "sensors/moving_record.h"
#include "tests/support/expect_error.h"
#include "tests/support/street_job.h"
#include "tests/support/test_data.h"
#include "tiler/objects/things.h"
#include "world/lod.h"

namespace terracast::job {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr const char* kRig = R"([[rigs]]
name = "one"
[[rigs.cameras]]
name = "cam"
width_px = 64
height_px = 48
fx_px = 48.0

)";

/// A job over the streets, its world tiled, and the plan of its sequence with traffic.
struct Streets {
  Streets(const fs::path& folder, const std::string& layers, const std::string& traffic,
          int num_frames)
      : job(prepare_job(load_run_config(written(folder, layers, traffic, num_frames), {}),
                        context)),
        store(tile(job, folder / "world", context)),
        plan(job.sequences.at(0)) {
    add_traffic(job, store, log, plan);
  }
  static fs::path written(const fs::path& folder, const std::string& layers,
                          const std::string& traffic, int num_frames) {
    std::ofstream(folder / "job.toml")
        << test::street_job_text(folder, num_frames, layers, kRig + traffic);
    return folder / "job.toml";
  }

  core::Log log{"test", core::LogLevel::Off};
  core::Context context{.log = log};
  Job job;
  world::TileStore store;
  render::SequencePlan plan;
};

/// The top of a world's bridge above a place, by all its triangles; nothing: it is not there.
std::optional<double> deck_z(const std::vector<world::Solid>& bridges, const Vector2d& at) {
  std::optional<double> top;
  for (const world::Solid& bridge : bridges) {
    const world::Shape& shape = bridge.levels.front().shape;
    for (const auto& triangle : shape.triangles) {
      if (shape.finishes[triangle.finish].material != world::Material::Asphalt) continue;
      std::array<Vector3d, 3> p;
      for (std::size_t k = 0; k < 3; ++k)
        p[k] = (bridge.origin_steps + shape.vertices_steps[triangle.corners[k]]).cast<double>() *
               world::kHeightStep_m;
      const Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
      if (normal.z() < 0.5 * normal.norm()) continue;
      bool is_inside = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2d step = (p[(k + 1) % 3] - p[k]).head<2>(), off = at - p[k].head<2>();
        is_inside &= step.x() * off.y() - step.y() * off.x() >= 0.0;
      }
      if (!is_inside) continue;
      const double z = p[0].z() - normal.head<2>().dot(at - p[0].head<2>()) / normal.z();
      top = std::max(top.value_or(-1e300), z);
    }
  }
  return top;
}

TEST(TrafficSite, RidesTheGroundAndOverBridgesTheirDecks) {
  const test::ScratchFolder folder;
  const Streets streets(folder.path(), "",
                        "[[traffic]]\namount = 6.0\nmost = 200\n[[traffic]]\nkind = \"people\"\n"
                        "amount = 8.0\n",
                        12);
  const world::RayQuery query(
      streets.store,
      world::choose_cut(streets.store,
                        render::viewpoints_of(streets.plan.states, streets.plan.cameras),
                        streets.plan.detail),
      streets.job.config.tracing);
  const geo::WorldFrame frame(streets.store.manifest().origin);
  const scene::MovingBodies bodies(streets.plan.moving, query, frame);
  std::vector<world::Solid> bridges;
  std::set<std::uint32_t> known;
  for (const world::TileInfo& info : streets.store.manifest().tiles)
    for (const world::Solid& solid : streets.store.load(info.id).objects.solids)
      if (known.insert(solid.provenance.instance_id).second) bridges.push_back(solid);
  ASSERT_EQ(bridges.size(), 1U);

  const auto described = sensors::describe_moving(streets.plan.moving);
  int num_on_deck = 0, num_below = 0, num_on_ground = 0, num_at_ends = 0;
  double before_s = 0.0;
  std::vector<std::optional<geo::BodyState>> before;
  for (int i = 0; i < 12; ++i) {
    const auto states = bodies.states(i);
    for (std::size_t k = 0; k < states.size(); ++k) {
      if (described[k].is_part()) continue;
      ASSERT_TRUE(states[k]);
      const Vector3d& at = states[k]->world_from_body.translation;
      const double ground_z = *query.surface_z_world(at.x(), at.y());
      const auto deck = deck_z(bridges, at.head<2>());
      const Vector3d& goes = states[k]->velocity_world_mps;
      const bool comes_over =
          std::abs(at.x() + 15.0) < 5.0 && std::abs(goes.y()) > std::abs(goes.x());
      const bool is_end = std::abs(std::abs(at.y()) - 40.0) < 9.0;
      // Its four corners stand on what may bulge by so much between them.
      constexpr double kBulge_m = 0.12;
      if (deck && comes_over && !is_end) {
        EXPECT_NEAR(at.z(), *deck, kBulge_m) << described[k].name;
        ++num_on_deck;
      } else if (comes_over && is_end) {
        EXPECT_NEAR(at.z(), std::max(ground_z, deck.value_or(-1e300)), 0.4) << described[k].name;
        ++num_at_ends;
      } else {
        EXPECT_NEAR(at.z(), ground_z, 3 * kBulge_m) << described[k].name << at.transpose();
        ++num_on_ground;
        if (deck && at.z() < *deck - 3.0) ++num_below;
      }
      // What is a vehicle's is level across the road and leans no more than roads are steep.
      EXPECT_GT((states[k]->world_from_body.rotation * Vector3d::UnitZ()).z(), 0.97);
      // It climbs as it says: over half a second, at less than 1 m/s^2 or so of bends in its profile.
      if (before.empty() || described[k].thing == "person" || is_end) continue;
      const double climbed =
          (at.z() - before[k]->world_from_body.translation.z()) / (states[k]->time_s - before_s);
      EXPECT_NEAR(climbed,
                  0.5 * (states[k]->velocity_world_mps.z() + before[k]->velocity_world_mps.z()),
                  0.6)
          << described[k].name;
    }
    before = states;
    before_s = 0.5 * i;
  }
  EXPECT_GT(num_on_deck, 10);
  EXPECT_GT(num_at_ends, 3);
  EXPECT_GT(num_below, 5) << "the main street goes under it";
  EXPECT_GT(num_on_ground, 200);
}

TEST(TrafficSite, LeavesOutWhoWouldMeetVehiclesThatStandInTheWorld) {
  const test::ScratchFolder folder;
  const std::string objects = R"([[world.layer]]
kind = "objects"
files = ["streets.geojson"]
traffic = 2.0
lamp_spacing_m = 20.0

)";
  const Streets streets(folder.path(), objects,
                        "[[traffic]]\namount = 6.0\nmost = 300\n"
                        "[[traffic]]\nkind = \"people\"\namount = 5.0\nmost = 300\n",
                        5);
  // The standing ones, by their places and sizes.
  struct Standing {
    Vector2d at;
    double z;
    double heading_rad;
    Vector2d size_m;
  };
  std::vector<Standing> standing;
  int num_lamps = 0;
  for (const world::TileInfo& info : streets.store.manifest().tiles)
    for (const world::Instance& instance : streets.store.load(info.id).objects.instances) {
      const std::string& name = streets.store.manifest().prototypes[instance.prototype].name;
      standing.push_back({instance.place_steps.head<2>().cast<double>() * world::kHeightStep_m,
                          instance.place_steps.z() * world::kHeightStep_m,
                          instance.heading * 2.0 * 3.14159265358979 / 65536.0,
                          tiler::find_thing(name.substr(0, name.find(' ')))->size_m.head<2>()});
      if (!name.ends_with("lamp")) continue;
      standing.back().size_m = {0.2, 0.2};  // its post
      ++num_lamps;
    }
  ASSERT_GT(standing.size(), 10U);
  ASSERT_GT(num_lamps, 10);
  ASSERT_GT(streets.plan.moving.size(), 3U);
  int num_near = 0;
  for (const scene::MovingThing& thing : streets.plan.moving) {
    const Vector2d size_m = tiler::find_thing(thing.shape.thing)->size_m.head<2>();
    for (const auto& state : thing.states)
      for (const Standing& other : standing) {
        const double z = state->world_from_body.translation.z();  // of a deck, or far below all
        if (z > other.z + 3.0) continue;                          // it goes over it on the bridge
        if ((other.at - state->world_from_body.translation.head<2>()).norm() > 15.0) continue;
        ++num_near;
        const geo::Rigid3d body_from_world = state->world_from_body.inverse();
        for (int i = -8; i <= 8; ++i)
          for (int j = -3; j <= 3; ++j) {
            const Vector2d in_other(i * other.size_m.x() / 16.0, j * other.size_m.y() / 6.0);
            const Vector2d at = other.at + Eigen::Rotation2Dd(other.heading_rad) * in_other;
            const Vector3d in_body = body_from_world * Vector3d(at.x(), at.y(), z);
            EXPECT_FALSE(std::abs(in_body.x()) < 0.5 * size_m.x() &&
                         std::abs(in_body.y()) < 0.5 * size_m.y())
                << thing.name;
          }
      }
  }
  EXPECT_GT(num_near, 20);
}

TEST(TrafficSite, LampsLeaveRoomToWalkAndDriveBy) {
  const std::string traffic =
      "[[traffic]]\namount = 6.0\nmost = 1000\n"
      "[[traffic]]\nkind = \"people\"\namount = 5.0\nmost = 1000\n";
  const test::ScratchFolder folder;
  const Streets streets(folder.path(),
                        "[[world.layer]]\nkind = \"objects\"\nfiles = [\"streets.geojson\"]\n"
                        "traffic = 0.0\nlamp_spacing_m = 20.0\n\n",
                        traffic, 5);
  int num_lamps = 0;
  for (const world::TileInfo& info : streets.store.manifest().tiles)
    num_lamps += static_cast<int>(streets.store.load(info.id).objects.instances.size());
  ASSERT_GT(num_lamps, 10);
  const auto counts = [](const std::vector<scene::MovingThing>& things) {
    std::map<std::string, double> num;
    for (const scene::MovingThing& thing : things)
      num[thing.name.substr(0, thing.name.find('-'))] += 1.0;
    return num;
  };
  // The same streets without lamps; the cameras are too high to be in the way.
  const WayGraph ways(streets.store.load_ways());
  const auto& states = streets.plan.states;
  auto dark = counts(lay_out_traffic(
      streets.job.config.traffic, states, states.back().time_s,
      {.ways = ways, .half_size_m = 1024.0, .obstacles = {}, .standing = {}}, streets.log));
  auto lit = counts(streets.plan.moving);
  for (const char* kind : {"vehicle", "walker"}) {
    ASSERT_GT(dark[kind], 20.0);
    RecordProperty(kind, fmt::format("{} of {}", lit[kind], dark[kind]));
    // Who meets no lamp stays; where one is left out, who would give way to it stays instead.
    EXPECT_GE(lit[kind], 0.9 * dark[kind]) << kind << " " << lit[kind] << " of " << dark[kind];
    EXPECT_LE(lit[kind], dark[kind] * 1.1) << kind;
  }
}

TEST(TrafficSite, SequencesThatSeeEachOtherHaveTheSameTraffic) {
  const test::ScratchFolder folder;
  std::string text =
      test::street_job_text(folder.path(), 9, "", std::string(kRig) + R"([[trajectories]]
name = "P001"
shown_as = "van"
min_agl_m = 0.5
kind = "waypoints"
rate_hz = 1.0
num_frames = 5
speed_mps = 5.0
waypoints = [
  {east_m = 60.0, north_m = 150.0, height_m = 1.2, above = "ground"},
  {east_m = 60.0, north_m = 10.0, height_m = 1.2, above = "ground"},
]

[[traffic]]
amount = 10.0
most = 1000
reach_m = 200.0

[[traffic]]
kind = "people"
amount = 10.0
most = 1000
reach_m = 200.0
)");
  const auto height = text.find("north_m = -9.0, height_m = 9.0");
  text.replace(height, 30, "north_m = -2.0, height_m = 1.0");
  const auto second = text.find("north_m = -8.0, height_m = 9.0");
  text.replace(second, 30, "north_m = -2.0, height_m = 1.0");
  text.replace(text.find("name = \"P000\""), 13,
               "name = \"P000\"\nshown_as = \"hatchback\"\nmin_agl_m = 0.5");
  std::ofstream(folder / "job.toml") << text;
  const core::Log log("test", core::LogLevel::Off);
  const core::Context context{.log = log};
  const Job job = prepare_job(load_run_config(folder / "job.toml", {}), context);
  const world::TileStore store = tile(job, folder / "world", context);
  std::array<std::map<std::string, std::map<double, Vector2d>>, 2> seen;
  for (std::size_t k = 0; k < 2; ++k) {
    render::SequencePlan plan = job.sequences.at(k);
    add_traffic(job, store, log, plan);
    for (const scene::MovingThing& thing : plan.moving)
      if (thing.ride == scene::Ride::Way)
        for (const auto& state : thing.states)
          seen[k][thing.name][state->time_s] = state->world_from_body.translation.head<2>();
  }
  // Whoever is near the cameras of both at times that both have is in both, and there at the same place.
  int num_common = 0;
  for (std::size_t k = 0; k < 2; ++k)
    for (const auto& [name, places] : seen[k]) {
      double nearest_m = 1e300;
      for (const geo::BodyState& frame : job.sequences.at(1 - k).states)
        if (const auto at = places.find(frame.time_s); at != places.end())
          nearest_m = std::min(nearest_m,
                               (at->second - frame.world_from_body.translation.head<2>()).norm());
      const auto found = seen[1 - k].find(name);
      if (found == seen[1 - k].end()) {
        EXPECT_GT(nearest_m, 200.0) << name;
        continue;
      }
      ++num_common;
      for (const auto& [time_s, at] : places)
        if (const auto there = found->second.find(time_s); there != found->second.end()) {
          EXPECT_LT((there->second - at).norm(), 1e-9) << name;
        }
    }
  EXPECT_GT(num_common, 40);
  // And nobody is where either body goes: on the lane of each, by places alone.
  for (const auto& [name, places] : seen[0])
    for (const auto& sequence : job.sequences)
      for (const geo::BodyState& frame : sequence.states)
        if (const auto at = places.find(frame.time_s); at != places.end()) {
          EXPECT_GT((at->second - frame.world_from_body.translation.head<2>()).norm(), 1.0)
              << name << " " << sequence.name << " " << frame.time_s << " "
              << at->second.transpose();
        }
}

TEST(TrafficSite, AWorldWithoutWaysIsRefused) {
  const test::ScratchFolder folder;
  const core::Log log("test", core::LogLevel::Off);
  const core::Context context{.log = log};
  const auto job_of = [&](const char* file, bool has_roads, const std::string& traffic) {
    std::string text = test::street_job_text(folder.path(), 2, "", std::string(kRig) + traffic);
    const auto at = text.find("[[world.layer]]");
    if (!has_roads) text.erase(at, text.find("[detail]") - at);
    std::ofstream(folder / file) << text;
    return prepare_job(load_run_config(folder / file, {}), context);
  };
  const std::vector<std::string> words = {"no ways", "roads", "[[traffic]]"};
  // By its config, before anything runs.
  test::expect_error(core::ErrorKind::Config, words,
                     [&] { job_of("roadless.toml", false, "[[traffic]]\n"); });
  // By a world that was tiled by another.
  const Job bare = job_of("bare.toml", false, "");
  const world::TileStore store = tile(bare, folder / "world", context);
  const Job job = job_of("job.toml", true, "[[traffic]]\n");
  render::SequencePlan plan = job.sequences.at(0);
  test::expect_error(core::ErrorKind::Input, words, [&] { add_traffic(job, store, log, plan); });
}

}  // namespace
}  // namespace terracast::job
