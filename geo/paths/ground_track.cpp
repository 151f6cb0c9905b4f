#include "geo/paths/ground_track.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace terracast::geo {
namespace {

Eigen::Vector2d left_of(const Eigen::Vector2d& v) { return {-v.y(), v.x()}; }

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

Eigen::Vector2d GroundTrack::at(double length_m) const {
  TERRACAST_CHECK(!pieces_.empty(), "an empty track");
  const auto after =
      std::upper_bound(pieces_.begin() + 1, pieces_.end(), length_m,
                       [](double value, const Piece& piece) { return value < piece.begin_m; });
  const Piece& piece = *(after - 1);
  return piece.at(length_m - piece.begin_m);
}

}  // namespace terracast::geo
