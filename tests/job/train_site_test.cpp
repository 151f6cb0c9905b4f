#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <set>

#include "job/stages.h"
#include "job/traffic/traffic_site.h"
#include "render/checked_plan.h"
#include "sensors/moving_record.h"
#include "tests/support/test_data.h"
#include "tiler/objects/things.h"
#include "world/lod.h"

namespace terracast::job {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// A light railway over gentle hills: straight, on a bridge of 120 m over a street, and through a bend.
std::string line_features() {
  const double north_m = 111147.0, east_m = 77464.0;
  std::string text;
  const auto add = [&](const std::vector<Vector2d>& places, const std::string& tags) {
    std::string line;
    for (const Vector2d& at : places)
      line += fmt::format("{}[{:.9f},{:.9f}]", line.empty() ? "" : ",", 7.0 + at.x() / east_m,
                          46.0 + at.y() / north_m);
    text += fmt::format(
        "{}{{\"type\":\"Feature\",\"properties\":{{{}}},\"geometry\":{{\"type\":\"LineString\","
        "\"coordinates\":[{}]}}}}",
        text.empty() ? "" : ",", tags, line);
  };
  const std::string rail = R"("railway":"light_rail","maxspeed":"60")";
  add({{-1000, 20}, {-60, 20}}, rail);
  add({{-60, 20}, {60, 20}}, rail + R"(,"bridge":"yes","layer":"1")");
  std::vector<Vector2d> bend = {{60, 20}, {200, 20}};
  for (int i = 1; i <= 20; ++i) {
    const double angle = 0.025 * i;  // of a circle of 400 m
    bend.emplace_back(200.0 + 400.0 * std::sin(angle), 20.0 + 400.0 * (1.0 - std::cos(angle)));
  }
  const Vector2d way(std::cos(0.5), std::sin(0.5));
  bend.push_back(bend.back() + 600.0 * way);
  add(bend, rail);
  add({{0, -600}, {0, 600}}, R"("highway":"secondary")");
  return "{\"type\":\"FeatureCollection\",\"features\":[" + text + "]}";
}

struct Line {
  explicit Line(const fs::path& folder)
      : job(prepare_job(load_run_config(written(folder), {}), context)),
        store(tile(job, folder / "world", context)) {}
  static fs::path written(const fs::path& folder) {
    std::ofstream(folder / "line.geojson", std::ios::binary) << line_features();
    std::ofstream(folder / "job.toml") << R"(name = "line"
[world]
name = "line"
origin_lat_deg = 46.0
origin_lon_deg = 7.0
size_m = 2048.0
outside = "extend"
[[world.elevation]]
kind = "fractal"
vertical_datum = "ellipsoid"
relief_m = 40.0
[[world.layer]]
kind = "roads"
files = ["line.geojson"]
[detail]
cell_px = 8.0
finest_spacing_m = 1.0
[[rigs]]
name = "one"
[[rigs.cameras]]
name = "cam"
width_px = 64
height_px = 48
fx_px = 48.0
[[trajectories]]
name = "P000"
kind = "waypoints"
rate_hz = 2.0
num_frames = 13
speed_mps = 6.0
waypoints = [
  {east_m = -100.0, north_m = -9.0, height_m = 30.0, above = "ground"},
  {east_m = 20.0, north_m = -8.0, height_m = 30.0, above = "ground"},
]
[[traffic]]
kind = "trains"
amount = 20.0
reach_m = 600.0
)";
    return folder / "job.toml";
  }
  /// Its sequence with the trains of a seed.
  render::SequencePlan plan_of(int seed) {
    job.config.traffic.at(0).seed = seed;
    render::SequencePlan plan = job.sequences.at(0);
    add_traffic(job, store, log, plan);
    return plan;
  }

  core::Log log{"test", core::LogLevel::Off};
  core::Context context{.log = log};
  Job job;
  world::TileStore store;
};

/// The top of the world's bridges' rails, or of whatever else of their metal, above a place; nothing: there are none.
std::optional<double> rails_z(const std::vector<world::Solid>& bridges, const Vector2d& at) {
  std::optional<double> top;
  for (const world::Solid& bridge : bridges) {
    const world::Shape& shape = bridge.levels.front().shape;
    for (const auto& triangle : shape.triangles) {
      if (shape.finishes[triangle.finish].material != world::Material::Metal) continue;
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

TEST(TrainSite, WheelsAreOnRailsOfBridgesAndOnTheGroundElsewhere) {
  const test::ScratchFolder folder;
  Line line(folder.path());
  const render::SequencePlan& still = line.job.sequences.at(0);
  const world::RayQuery query(
      line.store,
      world::choose_cut(line.store, render::viewpoints_of(still.states, still.cameras),
                        still.detail),
      line.job.config.tracing);
  const geo::WorldFrame frame(line.store.manifest().origin);
  std::vector<world::Solid> bridges;
  std::set<std::uint32_t> known;
  for (const world::TileInfo& info : line.store.manifest().tiles)
    for (const world::Solid& solid : line.store.load(info.id).objects.solids)
      if (known.insert(solid.provenance.instance_id).second) bridges.push_back(solid);
  ASSERT_FALSE(bridges.empty());
  int num_on_bridge = 0, num_on_ground = 0, num_cars = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    const render::SequencePlan plan = line.plan_of(seed);
    const scene::MovingBodies bodies(plan.moving, query, frame);
    const auto described = sensors::describe_moving(plan.moving);
    for (int i = 0; i < 13; ++i) {
      const auto states = bodies.states(i);
      for (std::size_t k = 0; k < states.size(); ++k) {
        if (described[k].is_part()) continue;
        ASSERT_TRUE(states[k]);
        ++num_cars;
        const geo::Rigid3d& world_from_car = states[k]->world_from_body;
        EXPECT_GT((world_from_car.rotation * Vector3d::UnitZ()).z(), 0.995);
        const double pivots_m = tiler::find_thing(described[k].thing)->pivots_m;
        for (const double along : {0.5, -0.5}) {
          // The middle between the four wheels of a bogie is as high as the mean of both its rails.
          const Vector3d bogie = world_from_car * Vector3d(along * pivots_m, 0.0, 0.0);
          const Vector3d left = world_from_car * Vector3d(along * pivots_m, 0.7535, 0.0);
          const Vector3d right = world_from_car * Vector3d(along * pivots_m, -0.7535, 0.0);
          const auto left_z = rails_z(bridges, left.head<2>());
          const auto right_z = rails_z(bridges, right.head<2>());
          if (left_z && right_z) {
            // Four rails' places on a plane: where a deck bends one is off it by so much.
            EXPECT_NEAR(bogie.z(), 0.5 * (*left_z + *right_z), 0.03) << described[k].name;
            ++num_on_bridge;
          } else if (std::abs(bogie.x()) > 80.0) {
            EXPECT_NEAR(bogie.z(), *query.surface_z_world(bogie.x(), bogie.y()), 0.05)
                << described[k].name << ' ' << bogie.transpose();
            ++num_on_ground;
          }
        }
      }
    }
  }
  EXPECT_GT(num_cars, 40);
  EXPECT_GT(num_on_bridge, 20);
  EXPECT_GT(num_on_ground, 40);
}

}  // namespace
}  // namespace terracast::job
