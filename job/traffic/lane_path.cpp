#include "job/traffic/lane_path.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"

namespace terracast::job {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Ways that turn by less go straight on.
constexpr double kStraight_rad = 0.15;
/// From lane to lane over so many times the way across.
constexpr double kShift = 5.0;
/// Of a way, at either end, at most this share is part of curves.
constexpr double kMostShare = 0.45;
/// A curve is no farther beyond the end of its way.
constexpr double kMostBeyond_m = 15.0;
constexpr int kCurvePoints = 8;
/// Something long is on a deck before its middle is.
constexpr double kDeckReach_m = 8.0;

/// Whoever comes so near to the world's border is not inside.
constexpr double kBorder_m = 12.0;

using Path = std::vector<PathPoint>;

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

Path beside(const std::vector<Vector3d>& line, const Leg& leg, bool is_bridge) {
  Path path;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Vector2d at = line[i].head<2>();
    const Vector2d before = i > 0 ? (at - line[i - 1].head<2>()).normalized() : Vector2d::Zero();
    const Vector2d after =
        i + 1 < line.size() ? (line[i + 1].head<2>() - at).normalized() : Vector2d::Zero();
    const Vector2d tangent = (before + after).normalized();
    const double cosine = i > 0 && i + 1 < line.size() ? tangent.dot(after) : 1.0;
    const Vector2d right(tangent.y(), -tangent.x());
    PathPoint point{.at_world = at + leg.right_m / std::max(cosine, 0.7) * right,
                    .limit_mps = leg.limit_mps};
    if (is_bridge) point.deck_z_world = line[i].z();
    path.push_back(point);
  }
  return path;
}

double length_of(const Path& path) {
  double length_m = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i)
    length_m += (path[i + 1].at_world - path[i].at_world).norm();
  return length_m;
}

PathPoint between(const PathPoint& a, const PathPoint& b, double share) {
  const bool has_both = std::isfinite(a.deck_z_world) && std::isfinite(b.deck_z_world);
  return {.at_world = a.at_world + share * (b.at_world - a.at_world),
          .limit_mps = std::min(a.limit_mps, b.limit_mps),
          .deck_z_world = has_both ? a.deck_z_world + share * (b.deck_z_world - a.deck_z_world)
                          : std::isfinite(a.deck_z_world) ? a.deck_z_world
                                                          : b.deck_z_world,
          .is_deck_end = !has_both || a.is_deck_end || b.is_deck_end};
}

/// Takes so much from a path's end; below 0: it goes on straight. Two points stay.
void trim_end(Path& path, double by_m) {
  if (by_m < 0.0) {
    const Vector2d last = (path.back().at_world - path[path.size() - 2].at_world).normalized();
    PathPoint beyond = path.back();
    beyond.at_world += std::max(by_m, -kMostBeyond_m) * -last;
    path.push_back(beyond);
    return;
  }
  while (path.size() >= 2) {
    const double step_m = (path.back().at_world - path[path.size() - 2].at_world).norm();
    if (step_m > by_m) {
      path.back() = between(path.back(), path[path.size() - 2], by_m / step_m);
      return;
    }
    if (path.size() == 2) return;
    by_m -= step_m;
    path.pop_back();
  }
}

Vector2d end_direction(const Path& path) {
  return (path.back().at_world - path[path.size() - 2].at_world).normalized();
}

/// Where two legs meet, how much each gives up for the curve between them.
struct Cut {
  double before_m = 0.0;
  double after_m = 0.0;
};
Cut cut_between(const Path& before, const Path& after, const TurnRadii& radii) {
  const Vector2d a = end_direction(before);
  const Vector2d b = (after[1].at_world - after[0].at_world).normalized();
  const Vector2d gap = after.front().at_world - before.back().at_world;
  const double turn_rad = std::atan2(cross(a, b), a.dot(b));
  if (std::abs(turn_rad) < kStraight_rad) {
    const double across_m = std::abs(cross(a, gap));
    const double each_m = across_m < 0.05 ? 0.0 : kShift * across_m + 1.0;
    return {each_m, each_m};
  }
  // The two lines meet ahead_m beyond the end of the first, back_m before the start of the second.
  const double ahead_m = cross(gap, b) / cross(a, b);
  const double back_m = -cross(gap, a) / cross(a, b);
  const double radius_m = turn_rad < 0.0 ? radii.right_m : radii.left_m;
  const double reach_m = radius_m * std::min(std::tan(0.5 * std::abs(turn_rad)), 2.0);
  return {reach_m - ahead_m, reach_m - back_m};
}

/// Hermite's cubic between two ends, without these.
void add_curve(Path& path, const PathPoint& to, const Vector2d& to_direction) {
  const PathPoint from = path.back();
  const Vector2d from_direction = end_direction(path);
  const double chord_m = (to.at_world - from.at_world).norm();
  if (chord_m < 0.5) return;
  const double turn_rad = std::acos(std::clamp(from_direction.dot(to_direction), -1.0, 1.0));
  // Of a quarter of a circle, so that it is one nearly.
  const double speed_m = chord_m * (1.0 + 0.07 * turn_rad * turn_rad);
  for (int k = 1; k < kCurvePoints; ++k) {
    const double u = static_cast<double>(k) / kCurvePoints;
    PathPoint point = between(from, to, u);
    point.at_world = (2 * u * u * u - 3 * u * u + 1) * from.at_world +
                     (u * u * u - 2 * u * u + u) * speed_m * from_direction +
                     (3 * u * u - 2 * u * u * u) * to.at_world +
                     (u * u * u - u * u) * speed_m * to_direction;
    path.push_back(point);
  }
}

void join(Path& path, double last_length_m, Path next, const TurnRadii& radii) {
  const double next_length_m = length_of(next);
  const Cut cut = cut_between(path, next, radii);
  trim_end(path, std::min(cut.before_m, kMostShare * last_length_m));
  std::reverse(next.begin(), next.end());
  trim_end(next, std::min(cut.after_m, kMostShare * next_length_m));
  std::reverse(next.begin(), next.end());
  add_curve(path, next.front(), (next[1].at_world - next[0].at_world).normalized());
  path.insert(path.end(), next.begin(), next.end());
}

Path resampled(const Path& path, double spacing_m) {
  Path out = {path.front()};
  double to_next_m = spacing_m;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double step_m = (path[i + 1].at_world - path[i].at_world).norm();
    double done_m = 0.0;
    while (step_m - done_m >= to_next_m) {
      done_m += to_next_m;
      out.push_back(between(path[i], path[i + 1], done_m / step_m));
      to_next_m = spacing_m;
    }
    to_next_m -= step_m - done_m;
  }
  return out;
}

void spread_decks(Path& path, double spacing_m) {
  const auto reach = static_cast<std::ptrdiff_t>(std::ceil(kDeckReach_m / spacing_m));
  const Path known = path;
  const auto num = static_cast<std::ptrdiff_t>(path.size());
  for (std::ptrdiff_t i = 0; i < num; ++i)
    for (std::ptrdiff_t k = 1; k <= reach; ++k) {
      double& z = path[static_cast<std::size_t>(i)].deck_z_world;
      if (std::isfinite(z)) break;
      for (const std::ptrdiff_t near : {i - k, i + k})
        if (near >= 0 && near < num &&
            std::isfinite(known[static_cast<std::size_t>(near)].deck_z_world))
          z = known[static_cast<std::size_t>(near)].deck_z_world;
    }
  // Of what is beyond a path's ends it is not known that it is a deck.
  const auto is_on_deck = [&](std::ptrdiff_t i) {
    return i >= 0 && i < num && std::isfinite(known[static_cast<std::size_t>(i)].deck_z_world) &&
           !known[static_cast<std::size_t>(i)].is_deck_end;
  };
  for (std::ptrdiff_t i = 0; i < num; ++i)
    for (std::ptrdiff_t near = i - reach; near <= i + reach; ++near)
      if (!is_on_deck(near)) path[static_cast<std::size_t>(i)].is_deck_end = true;
}

}  // namespace

std::vector<PathPoint> lane_path(const WayGraph& graph, std::span<const Leg> legs,
                                 const TurnRadii& radii, double spacing_m) {
  TERRACAST_CHECK(!legs.empty() && spacing_m > 0.0, "a way over {} arms", legs.size());
  Path path;
  double last_length_m = 0.0;
  for (const Leg& leg : legs) {
    Path next = beside(graph.points(leg.arm), leg, graph.part(leg.arm).is_bridge);
    const double length_m = length_of(next);
    if (path.empty())
      path = std::move(next);
    else
      join(path, last_length_m, std::move(next), radii);
    last_length_m = length_m;
  }
  path = resampled(path, spacing_m);
  spread_decks(path, spacing_m);
  return path;
}

std::vector<PathPoint> cut_out(const std::vector<PathPoint>& path, double spacing_m, double lasts_s,
                               double behind_m, double& start_m) {
  constexpr double kBefore_m = 64.0;
  constexpr double kBeyond_m = 64.0;
  const double from_m =
      kBefore_m * std::max(std::floor((start_m - behind_m) / kBefore_m) - 1.0, 0.0);
  const auto first = static_cast<std::size_t>(std::lround(from_m / spacing_m));
  auto end = std::min(path.size(), static_cast<std::size_t>((start_m + kBeyond_m) / spacing_m));
  for (double left_s = lasts_s; left_s > 0.0 && end < path.size(); ++end)
    left_s -= spacing_m / path[end].limit_mps;
  start_m -= from_m + spacing_m;  // a curve begins at its second point
  if (first >= end) return {};
  return {path.begin() + static_cast<std::ptrdiff_t>(first),
          path.begin() + static_cast<std::ptrdiff_t>(end)};
}

/// Of a segment, by its parameter.
struct PathCurve::Local {
  Vector2d at;
  Vector2d first;
  Vector2d second;
};

PathCurve::PathCurve(std::vector<PathPoint> points) : points_(std::move(points)) {
  TERRACAST_CHECK(points_.size() >= 4, "a curve through {} points", points_.size());
  starts_m_ = {0.0};
  for (std::size_t k = 0; k + 3 < points_.size(); ++k)
    starts_m_.push_back(starts_m_.back() + length_of(k, 1.0));
}

PathCurve::Local PathCurve::local(std::size_t segment, double u) const {
  const auto p = [&](std::size_t k) -> const Vector2d& { return points_[segment + k].at_world; };
  const double v = 1.0 - u;
  return {(v * v * v * p(0) + (3 * u * u * u - 6 * u * u + 4) * p(1) +
           (3 * v * v * v - 6 * v * v + 4) * p(2) + u * u * u * p(3)) /
              6.0,
          0.5 * (-v * v * p(0) + (3 * u * u - 4 * u) * p(1) + (4 * v - 3 * v * v) * p(2) +
                 u * u * p(3)),
          v * p(0) + (3 * u - 2) * p(1) + (3 * v - 2) * p(2) + u * p(3)};
}

double PathCurve::length_of(std::size_t segment, double to_u) const {
  // Gauss's rule of five points.
  constexpr std::array<std::pair<double, double>, 5> kRule = {
      {{0.0, 0.5688888888888889},
       {-0.5384693101056831, 0.4786286704993665},
       {0.5384693101056831, 0.4786286704993665},
       {-0.9061798459386640, 0.2369268850561891},
       {0.9061798459386640, 0.2369268850561891}}};
  double sum = 0.0;
  for (const auto& [node, weight] : kRule)
    sum += weight * local(segment, 0.5 * to_u * (1.0 + node)).first.norm();
  return 0.5 * to_u * sum;
}

PathCurve::Place PathCurve::at(double at_m) const {
  const auto after = std::upper_bound(starts_m_.begin() + 1, starts_m_.end() - 1, at_m);
  const auto segment = static_cast<std::size_t>(after - starts_m_.begin()) - 1;
  const double in_m = std::max(at_m - starts_m_[segment], 0.0);
  double u = std::min(in_m / (starts_m_[segment + 1] - starts_m_[segment]), 1.0);
  for (int round = 0; round < 3; ++round)
    u = std::clamp(u - (length_of(segment, u) - in_m) / local(segment, u).first.norm(), 0.0, 1.0);
  const Local here = local(segment, u);
  const double speed = here.first.norm();
  // The curve is nearest to its middle points.
  const PathPoint& a = points_[segment + 1];
  const PathPoint& b = points_[segment + 2];
  return {.at_world = here.at,
          .tangent = here.first / speed,
          .curvature_per_m = cross(here.first, here.second) / (speed * speed * speed),
          .limit_mps = std::min(a.limit_mps, b.limit_mps),
          .deck_z_world = between(a, b, u).deck_z_world,
          .is_deck_end = a.is_deck_end || b.is_deck_end};
}

bool is_inside(const PathCurve& curve, double from_m, double to_m, double half_size_m) {
  for (double at_m = from_m;; at_m = std::min(at_m + 5.0, to_m)) {
    if (curve.at(at_m).at_world.cwiseAbs().maxCoeff() > half_size_m - kBorder_m) return false;
    if (at_m >= to_m) return true;
  }
}

}  // namespace terracast::job
