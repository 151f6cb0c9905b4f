#include "geo/paths/ground_track.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/error.h"

namespace terracast::geo {
namespace {

Eigen::Vector2d left_of(const Eigen::Vector2d& v) { return {-v.y(), v.x()}; }

/// The angle by which one direction turns into another, to a side (1: left, -1: right): 0 to 2 pi.
double turn_between(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double side) {
  const double left_rad = std::atan2(left_of(from).dot(to), from.dot(to));
  const double angle = side * left_rad;
  constexpr double kNone_rad = 1e-12;  // which rounding would make a full turn
  return angle < -kNone_rad ? angle + 2.0 * std::numbers::pi : std::max(angle, 0.0);
}

/// A turn, a straight way and a turn.
struct Connection {
  double first_rad, straight_m, second_rad;  ///< turns positive: to the left
};

}  // namespace

Eigen::Vector2d GroundTrack::Piece::at(double along_m) const {
  if (curvature == 0.0) return start + along_m * ahead;
  const double angle = along_m * curvature;
  return start + (std::sin(angle) * ahead + (1.0 - std::cos(angle)) * left_of(ahead)) / curvature;
}

void GroundTrack::add(double length_m, double curvature) {
  TERRACAST_CHECK(length_m >= 0.0, "a piece of {} m", length_m);
  if (length_m == 0.0) return;
  pieces_.push_back({length_m_, length_m, position_, ahead_, curvature});
  position_ = pieces_.back().at(length_m);
  const double angle = length_m * curvature;
  ahead_ = (std::cos(angle) * ahead_ + std::sin(angle) * left_of(ahead_)).normalized();
  length_m_ += length_m;
}

void GroundTrack::turn(double angle_rad, double radius_m) {
  add(std::abs(angle_rad) * radius_m, (angle_rad < 0.0 ? -1.0 : 1.0) / radius_m);
}

// The swing out by an angle a, the turn by 180 degrees + 2 a and the swing in are circles that touch:
// the first centre lies a radius outside the line, the middle one half-way between the lines, and
// they are two radii apart, so that cos a = (distance / 2 + radius) / (2 radius).
void GroundTrack::turn_back(double left_m, double radius_m) {
  const double side = left_m < 0.0 ? -1.0 : 1.0;
  const double distance_m = std::abs(left_m);
  if (distance_m >= 2.0 * radius_m) {
    turn(side * 0.5 * std::numbers::pi, radius_m);
    go_straight(distance_m - 2.0 * radius_m);
    turn(side * 0.5 * std::numbers::pi, radius_m);
    return;
  }
  const double swing_rad = std::acos((0.5 * distance_m + radius_m) / (2.0 * radius_m));
  turn(-side * swing_rad, radius_m);
  turn(side * (std::numbers::pi + 2.0 * swing_rad), radius_m);
  turn(-side * swing_rad, radius_m);
}

// The straight way touches the circles of both turns: outside of both where they turn to the same side, between them else, which needs
// centres two radii apart (Dubins 1957).
void GroundTrack::go_to(const Eigen::Vector2d& place, const Eigen::Vector2d& ahead,
                        double radius_m) {
  std::optional<Connection> shortest;
  double least_m = 0.0;
  for (const double first : {1.0, -1.0})
    for (const double second : {1.0, -1.0}) {
      const Eigen::Vector2d between = (place + second * radius_m * left_of(ahead)) -
                                      (position_ + first * radius_m * left_of(ahead_));
      const double across_m = (second - first) * radius_m;
      const double straight_m2 = between.squaredNorm() - across_m * across_m;
      if (straight_m2 < 0.0) continue;
      const double straight_m = std::sqrt(straight_m2);
      // The way's direction: between = straight_m * way + across_m * left_of(way).
      const Eigen::Vector2d way =
          between.norm() > 0.0
              ? Eigen::Vector2d((straight_m * between - across_m * left_of(between)) /
                                between.squaredNorm())
              : ahead_;
      const Connection connection{.first_rad = first * turn_between(ahead_, way, first),
                                  .straight_m = straight_m,
                                  .second_rad = second * turn_between(way, ahead, second)};
      const double length_m = straight_m + radius_m * (std::abs(connection.first_rad) +
                                                       std::abs(connection.second_rad));
      if (!shortest || length_m < least_m) {
        shortest = connection;
        least_m = length_m;
      }
    }
  turn(shortest->first_rad, radius_m);
  go_straight(shortest->straight_m);
  turn(shortest->second_rad, radius_m);
}

Eigen::Vector2d GroundTrack::at(double length_m) const {
  TERRACAST_CHECK(!pieces_.empty(), "an empty track");
  const auto after =
      std::upper_bound(pieces_.begin() + 1, pieces_.end(), length_m,
                       [](double value, const Piece& piece) { return value < piece.begin_m; });
  const Piece& piece = *(after - 1);
  return piece.at(length_m - piece.begin_m);
}

}  // namespace terracast::geo
