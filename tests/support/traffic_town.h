#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/toml_reader.h"
#include "job/traffic/traffic.h"
#include "tiler/objects/things.h"

/// Towns on a plane for tests of traffic, and what is true of what goes there.
namespace terracast::test {

using Eigen::Vector2d;
using Eigen::Vector3d;
using job::Obstacle;
using job::TrafficOptions;
using job::WayGraph;
using scene::MovingThing;
using world::kHeightStep_m;
using world::WayKind;
using world::WayPart;

inline std::int32_t steps(double value_m) {
  return static_cast<std::int32_t>(std::lround(value_m / kHeightStep_m));
}

/// Ways on a plane, which meet where their ends are one place.
class Town {
 public:
  WayPart& add(WayKind kind, const std::vector<Vector2d>& points, double half_m, int num_lanes) {
    WayPart part;
    part.feature = network.parts.size() + 1;
    part.kind = kind;
    part.num_lanes = static_cast<std::uint8_t>(num_lanes);
    part.half_width_steps = steps(half_m);
    part.lanes_left_steps = steps(half_m - 0.3);
    part.lanes_right_steps = -part.lanes_left_steps;
    for (const Vector2d& at : points)
      part.points_steps.emplace_back(steps(at.x()), steps(at.y()), 0);
    part.from_node = node(points.front());
    part.to_node = node(points.back());
    network.parts.push_back(part);
    return network.parts.back();
  }
  world::WayNetwork network;

 private:
  std::uint32_t node(const Vector2d& at) {
    const auto [found, is_new] =
        nodes_.try_emplace({std::lround(at.x()), std::lround(at.y())}, network.num_nodes);
    network.num_nodes += is_new ? 1 : 0;
    return found->second;
  }
  std::map<std::pair<long, long>, std::uint32_t> nodes_;
};

/// A checkerboard of streets 150 m apart over 1.5 km: every third a primary one of four lanes, one row of one-way
/// streets, sidewalks along all; bends in the columns. Footways run through the blocks.
inline Town checkerboard() {
  Town town;
  constexpr int kNum = 11;
  const auto corner = [](int i, int j) { return Vector2d(150.0 * (i - 5), 150.0 * (j - 5)); };
  for (int j = 0; j < kNum; ++j)
    for (int i = 0; i < kNum; ++i) {
      if (i + 1 < kNum) {
        const bool is_main = j % 3 == 0;
        WayPart& row =
            town.add(is_main ? WayKind::Primary : WayKind::Residential,
                     {corner(i, j), corner(i + 1, j)}, is_main ? 7.0 : 3.0, is_main ? 4 : 2);
        row.sidewalk_steps = steps(1.8);
        if (j == 4 || j == 5) {
          row.num_lanes = 1;
          (j == 4 ? row.may_go_backward : row.may_go_forward) = false;
        }
      }
      if (j + 1 < kNum) {
        const Vector2d middle = 0.5 * (corner(i, j) + corner(i, j + 1)) + Vector2d(6.0, 0.0);
        WayPart& column =
            town.add(WayKind::Tertiary, {corner(i, j), middle, corner(i, j + 1)}, 3.25, 2);
        column.sidewalk_steps = steps(1.8);
        column.max_speed_kmph = 40;
      }
      if (i + 1 < kNum && j + 1 < kNum)
        town.add(WayKind::Footway,
                 {corner(i, j) + Vector2d(40, 30), corner(i, j) + Vector2d(110, 120)}, 1.2, 1);
    }
  return town;
}

inline TrafficOptions options_of(const std::string& toml) {
  TrafficOptions options;
  core::TomlDocument::parse(toml, "traffic.toml").read(options);
  return options;
}

inline std::vector<geo::BodyState> frames_at(double rate_hz, int count,
                                             const Vector2d& from = {10, 20}) {
  std::vector<geo::BodyState> frames(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    geo::BodyState& frame = frames[static_cast<std::size_t>(i)];
    frame.time_s = i / rate_hz;
    frame.world_from_body.translation << from + Vector2d(5.0 * frame.time_s, 0.0), 60.0;
  }
  return frames;
}

inline std::vector<MovingThing> traffic_of(const world::WayNetwork& network,
                                           const std::string& toml,
                                           const std::vector<geo::BodyState>& frames,
                                           double duration_s = 0.0,
                                           std::vector<Obstacle> obstacles = {}) {
  const WayGraph ways(network);
  const core::Log log("test", core::LogLevel::Off);
  const std::vector<TrafficOptions> options = {options_of(toml)};
  return lay_out_traffic(
      options, frames, std::max(duration_s, frames.back().time_s),
      {.ways = ways, .half_size_m = 2000.0, .obstacles = std::move(obstacles), .standing = {}},
      log);
}

inline constexpr const char* kBusy = "amount = 3.0\nreach_m = 500.0\nmost = 1000\n";

/// Of a place, the nearest part of a network, by all its segments.
struct Nearest {
  const WayPart* part = nullptr;
  double distance_m = 1e300;
  double left_m = 0.0;  ///< of the line
  Vector2d direction;
  double to_node_m = 1e300;  ///< from the ends of all parts
  double outside_m = 1e300;  ///< of all paving; below 0: on it
};
inline Nearest nearest(const world::WayNetwork& network, const Vector2d& at, bool of_roads) {
  Nearest best;
  for (const WayPart& part : network.parts) {
    if ((part.kind < WayKind::Track) != of_roads) continue;
    for (std::size_t i = 0; i + 1 < part.points_steps.size(); ++i) {
      const Vector2d a = part.at_world(i), b = part.at_world(i + 1);
      const double t = std::clamp((at - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
      const Vector2d off = at - a - t * (b - a);
      best.outside_m = std::min(best.outside_m, off.norm() - part.half_width_steps * kHeightStep_m);
      if (off.norm() >= best.distance_m) continue;
      best.part = &part;
      best.distance_m = off.norm();
      best.direction = (b - a).normalized();
      best.left_m = best.direction.x() * off.y() - best.direction.y() * off.x();
    }
    for (const std::size_t end : {std::size_t{0}, part.points_steps.size() - 1})
      best.to_node_m = std::min(best.to_node_m, (at - part.at_world(end)).norm());
  }
  return best;
}

inline Vector2d size_of(const MovingThing& thing) {
  return tiler::find_thing(thing.shape.thing)->size_m.head<2>();
}
inline Vector2d place_of(const geo::BodyState& state) {
  return state.world_from_body.translation.head<2>();
}
inline Vector2d forward_of(const geo::BodyState& state) {
  return (state.world_from_body.rotation * Vector3d::UnitX()).head<2>();
}

/// Whether a box holds any of the points of a grid over another.
inline bool boxes_overlap(const MovingThing& a, const MovingThing& b, std::size_t frame) {
  const geo::BodyState& of_a = *a.states[frame];
  const geo::BodyState& of_b = *b.states[frame];
  if ((place_of(of_a) - place_of(of_b)).norm() > 22.0) return false;
  for (int i = -10; i <= 10; ++i)
    for (int j = -4; j <= 4; ++j) {
      const Vector3d point = of_a.world_from_body *
                             Vector3d(0.05 * i * size_of(a).x(), 0.125 * j * size_of(a).y(), 0.0);
      const Vector3d in_b = of_b.world_from_body.inverse() * point;
      if (std::abs(in_b.x()) < 0.5 * size_of(b).x() && std::abs(in_b.y()) < 0.5 * size_of(b).y())
        return true;
    }
  return false;
}

inline void expect_nothing_meets(const std::vector<MovingThing>& things) {
  for (std::size_t frame = 0; frame < things.front().states.size(); ++frame)
    for (std::size_t i = 0; i < things.size(); ++i)
      for (std::size_t j = 0; j < things.size(); ++j)
        ASSERT_FALSE(i != j && boxes_overlap(things[i], things[j], frame))
            << things[i].name << " and " << things[j].name << " at frame " << frame;
}

}  // namespace terracast::test
