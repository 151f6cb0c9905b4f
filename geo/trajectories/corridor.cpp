#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "geo/paths/area.h"
#include "geo/paths/control_path.h"
#include "geo/paths/flight.h"
#include "geo/paths/ground_track.h"
#include "geo/paths/over_ground.h"
#include "geo/paths/place.h"
#include "geo/trajectory.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;
using Polyline = std::vector<Eigen::Vector2d>;

Eigen::Vector2d direction_at(const Polyline& line, std::size_t leg) {
  return (line[leg + 1] - line[leg]).normalized();
}

/// Turn from one leg to the next, positive to the left.
double bend_at(const Polyline& line, std::size_t corner) {
  const Eigen::Vector2d before = direction_at(line, corner - 1), after = direction_at(line, corner);
  return std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after));
}

/// The line `left_m` to the left of a line: its legs moved aside, and cut where they meet.
Polyline moved_aside(const Polyline& line, double left_m) {
  Polyline moved;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Eigen::Vector2d ahead = direction_at(line, i + 1 < line.size() ? i : i - 1);
    Eigen::Vector2d left(-ahead.y(), ahead.x());
    if (i > 0 && i + 1 < line.size()) {
      const Eigen::Vector2d before = direction_at(line, i - 1);
      const Eigen::Vector2d middle = left + Eigen::Vector2d(-before.y(), before.x());
      left = 2.0 / middle.squaredNorm() * middle;
    }
    moved.push_back(line[i] + left_m * left);
  }
  return moved;
}

class Corridor final : public TrajectoryKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.list("line", line_,
               "The places along the middle of the corridor, in order; two or more.");
    visit.key("num_lines", num_lines_,
              "Parallel lines along it, flown there and back, from the rightmost one on.",
              core::between(1.0, 100.0));
    visit.key("line_spacing_m", line_spacing_m_, "Distance between them.",
              core::between(0.1, 10000.0));
    visit.key("profile", profile_,
              "terrain: height_m above the ground below, smoothed. level: at one height, height_m "
              "above the highest measured ground below the path.",
              core::one_of({"terrain", "level"}));
    visit.key("height_m", height_m_, "Height above the ground, as profile says.",
              core::between(1.0, 20000.0));
    visit.key("speed_mps", speed_mps_, "Speed along the path.", core::between(0.01, 1000.0));
    attitude_.describe(visit);
    visit.key("min_agl_m", min_agl_m_, "Least height above the measured ground.",
              core::between(0.0, 100000.0));
    visit.key("follow_length_m", follow_length_m_,
              "Length on both sides over which profile = \"terrain\" smooths the ground.",
              core::between(10.0, 20000.0));
    visit.key("max_climb_deg", max_climb_deg_, "Steepest climb or descent.",
              core::between(1.0, 80.0));
  }

  void validate() const override {
    constexpr std::size_t kMostPlaces = 10000;
    if (line_.size() < 2 || line_.size() > kMostPlaces)
      fail(ErrorKind::Config, "line has {} places; a corridor takes 2 to {}", line_.size(),
           kMostPlaces);
    if (min_agl_m_ > height_m_)
      fail(ErrorKind::Config, "min_agl_m = {} is more than height_m = {}", min_agl_m_, height_m_);
  }

  std::unique_ptr<TrajectoryKind> clone() const override {
    return std::make_unique<Corridor>(*this);
  }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    validate();
    const double radius_m = attitude_.turn_radius_m(speed_mps_);
    TrackControls controls = controls_along(track_along(resolve_line(context), radius_m, context),
                                            radius_m, "Fly fewer lines, or a shorter corridor");
    if (profile_ == "level") {
      const double lowest_w_m = ground_w_m(controls.controls.front().head<2>(), 0.0, context);
      const double level_w_m = highest_ground_w_m(controls, lowest_w_m, context) + height_m_;
      for (Eigen::Vector3d& control : controls.controls) control.z() = level_w_m;
    } else {
      follow_terrain({.height_m = height_m_,
                      .min_agl_m = min_agl_m_,
                      .follow_length_m = follow_length_m_,
                      .max_climb_deg = max_climb_deg_,
                      .continuity = attitude_.continuity_of_path()},
                     context, controls);
    }
    FlightOptions flight;
    static_cast<AttitudeOptions&>(flight) = attitude_;
    flight.speed_mps = speed_mps_;
    flight.min_agl_m = min_agl_m_;
    flight.terrain_following = profile_ == "terrain";
    flight.follow_length_m = follow_length_m_;
    flight.max_climb_deg = max_climb_deg_;
    FlightPlan plan;
    plan.path = std::make_shared<ControlPath>(Flattened(context.frame.origin()), controls.controls,
                                              controls.spacing_m, attitude_.continuity_of_path());
    plan.attitude = attitude_.attitude();
    plan.how_to_raise = [](double) { return "raise height_m"; };
    plan.how_to_follow = "set profile = \"terrain\"";
    return fly(plan, flight, context);
  }

 private:
  Polyline resolve_line(const TrajectoryContext& context) const {
    Polyline line;
    for (std::size_t i = 0; i < line_.size(); ++i) {
      const std::string what = fmt::format("place {} of the line (counted from 0)", i);
      line.push_back(resolve_corner(line_[i], context, what));
      constexpr double kLeastLeg_m = 0.1;
      if (i > 0 && (line[i] - line[i - 1]).norm() < kLeastLeg_m)
        fail(ErrorKind::Config, "{} is where the one before it is", what);
    }
    return line;
  }

  // Lines of even number are flown along the corridor, the others back.
  GroundTrack track_along(const Polyline& middle, double radius_m,
                          const TrajectoryContext& context) const {
    const auto left_of_middle_m = [&](std::int64_t line) {
      return (static_cast<double>(line) - 0.5 * static_cast<double>(num_lines_ - 1)) *
             line_spacing_m_;
    };
    const Polyline first = moved_aside(middle, left_of_middle_m(0));
    GroundTrack track(first.front(), direction_at(first, 0));
    for (std::int64_t i = 0; i < num_lines_; ++i) {
      Polyline line = moved_aside(middle, left_of_middle_m(i));
      const bool is_back = i % 2 == 1;
      if (is_back) std::reverse(line.begin(), line.end());
      go_along(line, radius_m, context, track);
      if (i + 1 < num_lines_)
        track.turn_back(is_back ? -line_spacing_m_ : line_spacing_m_, radius_m);
    }
    return track;
  }

  /// Corners are rounded by a circle that touches both legs.
  void go_along(const Polyline& line, double radius_m, const TrajectoryContext& context,
                GroundTrack& track) const {
    double taken_m = 0.0;  // of the leg, by the circle at its beginning
    for (std::size_t leg = 0; leg + 1 < line.size(); ++leg) {
      const bool is_last = leg + 2 == line.size();
      const double bend_rad = is_last ? 0.0 : bend_at(line, leg + 1);
      const double needed_m = radius_m * std::tan(0.5 * std::abs(bend_rad));
      const double leg_m = (line[leg + 1] - line[leg]).norm();
      if (!(leg_m >= taken_m + needed_m)) {
        const Eigen::Vector3d place(line[leg].x(), line[leg].y(), 0.0);
        fail(ErrorKind::Config,
             "a leg of {:.1f} m that begins at {} is too short for the turns at its ends, which "
             "take {:.1f} m of it with a radius of {:.1f} m; fly slower, bank more, or lead the "
             "line more gently",
             leg_m, text_of(context.frame.geodetic_from_world(place)), taken_m + needed_m,
             radius_m);
      }
      track.go_straight(leg_m - taken_m - needed_m);
      track.turn(bend_rad, radius_m);
      taken_m = needed_m;
    }
  }

  std::vector<Corner> line_;
  std::int64_t num_lines_ = 1;
  double line_spacing_m_ = 50.0;
  std::string profile_ = "terrain";
  double height_m_ = 80.0;
  double speed_mps_ = 15.0;
  AttitudeOptions attitude_;
  double min_agl_m_ = 5.0;
  double follow_length_m_ = 100.0;
  double max_climb_deg_ = 30.0;
};

}  // namespace

TrajectoryKindInfo corridor_trajectory() {
  return {.name = "corridor",
          .summary = "Lines along a road, river or power line, level or over the terrain.",
          .make = [] { return std::unique_ptr<TrajectoryKind>(new Corridor); }};
}

}  // namespace terracast::geo
