#include "geo/vehicles/flown_motion.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/paths/changing.h"
#include "geo/vehicles/flown_steps.h"

namespace terracast::geo {
namespace {

/// Derivatives by the share of a piece from those by time.
template <class Value>
Jet<Value> by_share(const Jet<Value>& by_time, double spacing_s) {
  return {by_time[0], spacing_s * by_time[1], spacing_s * spacing_s * by_time[2],
          spacing_s * spacing_s * spacing_s * by_time[3]};
}

Eigen::Vector4d parts_of(const Eigen::Quaterniond& rotation) {
  return {rotation.w(), rotation.x(), rotation.y(), rotation.z()};
}

Eigen::Quaterniond half(const Eigen::Vector3d& vector) {
  return {0.0, 0.5 * vector.x(), 0.5 * vector.y(), 0.5 * vector.z()};
}

}  // namespace

Jet<Eigen::Vector4d> rotation_jet(const Eigen::Quaterniond& rotation,
                                  const Eigen::Vector3d& turn_rate,
                                  const Eigen::Vector3d& turn_rate_first,
                                  const Eigen::Vector3d& turn_rate_second,
                                  const Eigen::Vector3d& earth_rate_world) {
  const Eigen::Quaterniond& q = rotation;
  const Eigen::Vector3d earth = q.conjugate() * earth_rate_world;
  const Eigen::Vector3d w = turn_rate - earth;
  const Eigen::Vector3d w_rate = turn_rate_first + w.cross(earth);
  const Eigen::Vector3d w_second = turn_rate_second + w_rate.cross(earth) - w.cross(w.cross(earth));
  const Eigen::Vector4d first = parts_of(q * half(w));
  const Eigen::Quaterniond q_rate(first[0], first[1], first[2], first[3]);
  const Eigen::Vector4d second_parts = parts_of(q_rate * half(w)) + parts_of(q * half(w_rate));
  const Eigen::Quaterniond q_second(second_parts[0], second_parts[1], second_parts[2],
                                    second_parts[3]);
  return {parts_of(q), first, second_parts,
          parts_of(q_second * half(w)) + 2.0 * parts_of(q_rate * half(w_rate)) +
              parts_of(q * half(w_second))};
}

FlownMotion::FlownMotion(double first_s, double spacing_s, const Eigen::Vector3d& place_world,
                         const std::vector<Node>& nodes, double duration_s)
    : first_s_(first_s), spacing_s_(spacing_s), duration_s_(duration_s) {
  TERRACAST_CHECK(nodes.size() >= 2 && spacing_s > 0.0 && first_s <= 0.0, "{} nodes from {} s on",
                  nodes.size(), first_s);
  Eigen::Vector3d begin_world = place_world;
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    const Node &begin = nodes[i], &end = nodes[i + 1];
    const auto place_jet = [&](const Node& node, const Eigen::Vector3d& moved) {
      return by_share<Eigen::Vector3d>({moved, node.velocity, node.acceleration, node.jerk},
                                       spacing_s);
    };
    pieces_.push_back(
        {.begin_world = begin_world,
         .moved = {place_jet(begin, Eigen::Vector3d::Zero()), place_jet(end, end.moved_world)},
         .rotation = {by_share(begin.rotation, spacing_s), by_share(end.rotation, spacing_s)},
         .air_way = {begin.air_way, end.air_way},
         .air_way_rate = {spacing_s * begin.air_way_rate, spacing_s * end.air_way_rate}});
    begin_world += end.moved_world;
  }
  TERRACAST_CHECK(duration_s <= last_s() + 1e-9, "nodes up to {} s of {} s", last_s(), duration_s);
}

FlownMotion::Place FlownMotion::place_at(double time_s) const {
  const double place = (time_s - first_s_) / spacing_s_;
  const double index = std::clamp(std::floor(place), 0.0, static_cast<double>(pieces_.size() - 1));
  return {static_cast<std::size_t>(index), place - index};
}

void FlownMotion::set_air(const WorldFrame& frame, std::shared_ptr<const FlightAir> air) {
  frame_ = frame;
  air_ = std::move(air);
}

Eigen::Vector3d FlownMotion::wind_world_mps(double time_s) const {
  if (!air_) return Eigen::Vector3d::Zero();
  const double inside_s = std::clamp(time_s, first_s_, last_s());
  const auto [index, x] = place_at(inside_s);
  const Piece& piece = pieces_[index];
  // Hermite's cubic.
  const double late = x * x * (3.0 - 2.0 * x);
  const Eigen::Vector3d way = (1.0 - late) * piece.air_way[0] + late * piece.air_way[1] +
                              x * (1.0 - x) * (1.0 - x) * piece.air_way_rate[0] -
                              x * x * (1.0 - x) * piece.air_way_rate[1];
  const MotionState state = inside(inside_s);
  return met_air(air_.get(), *frame_, inside_s, state.world_from_body.translation,
                 state.velocity_world_mps, way)
      .wind_world_mps;
}

MotionState FlownMotion::inside(double time_s) const {
  const auto [index, x] = place_at(time_s);
  const Piece& piece = pieces_[index];
  const double per_s = 1.0 / spacing_s_;
  const Jet<Eigen::Vector3d> moved = piece.moved.at(x);
  const Jet<Eigen::Vector4d> rotation = piece.rotation.at(x);
  const Turning turning =
      turning_of_parts(rotation[0], per_s * rotation[1], per_s * per_s * rotation[2]);
  MotionState state;
  state.time_s = time_s;
  state.world_from_body = {.rotation = turning.world_from_body.normalized(),
                           .translation = piece.begin_world + moved[0]};
  state.velocity_world_mps = per_s * moved[1];
  state.acceleration_world_mps2 = per_s * per_s * moved[2];
  state.jerk_world_mps3 = per_s * per_s * per_s * moved[3];
  state.angular_velocity_body_radps = turning.angular_velocity_body_radps;
  state.angular_acceleration_body_radps2 = turning.angular_acceleration_body_radps2;
  return state;
}

MotionState FlownMotion::at(double time_s) const {
  TERRACAST_CHECK(std::isfinite(time_s), "time {} s of a motion", time_s);
  const double inside_s = std::clamp(time_s, first_s_, last_s());
  MotionState state = inside(inside_s);
  if (inside_s == time_s) return state;
  const double beyond_s = time_s - inside_s;
  const Rigid3d pose = state.pose_after(beyond_s);
  state.time_s = time_s;
  state.world_from_body = pose;
  state.velocity_world_mps += beyond_s * state.acceleration_world_mps2;
  state.jerk_world_mps3.setZero();
  state.angular_acceleration_body_radps2.setZero();
  return state;
}

std::vector<double> FlownMotion::knots_s() const {
  std::vector<double> knots_s = {0.0, duration_s_};
  for (std::size_t i = 0; i <= pieces_.size(); ++i) {
    const double time_s = first_s_ + spacing_s_ * static_cast<double>(i);
    if (time_s > 0.0 && time_s < duration_s_) knots_s.push_back(time_s);
  }
  return sorted_knots(std::move(knots_s));
}

}  // namespace terracast::geo
