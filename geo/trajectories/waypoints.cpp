#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/paths/flattened.h"
#include "geo/paths/flight.h"
#include "geo/paths/interpolating_spline.h"
#include "geo/paths/place.h"
#include "geo/trajectory.h"

namespace terracast::geo {
namespace {

struct Waypoint : Place {
  double speed_mps = 0.0;

  void describe(core::SchemaVisitor& visit) {
    Place::describe(visit);
    visit.key("speed_mps", speed_mps, "Speed here, reached smoothly; 0: the trajectory's speed.",
              core::between(0.0, 1000.0));
  }

  void validate() const {
    Place::validate();
    constexpr double kLeastSpeed_mps = 0.01;
    if (speed_mps > 0.0 && speed_mps < kLeastSpeed_mps) {
      core::fail(core::ErrorKind::Config,
                 "speed_mps = {} of a waypoint is less than {}; 0 takes the trajectory's speed",
                 speed_mps, kLeastSpeed_mps);
    }
  }
};

/// A spline in flattened coordinates, by the length of the chords.
class SplinePath final : public Path {
 public:
  SplinePath(InterpolatingSpline spline, const Flattened& flattened)
      : spline_(std::move(spline)), flattened_(flattened) {}

  PathPoint at(double u) const override {
    const InterpolatingSpline::Value value = spline_.at(u);
    return flattened_.world_from_flattened({value.value, value.first, value.second, value.third});
  }
  double end() const override { return spline_.parameters().back(); }
  bool is_closed() const override { return spline_.is_closed(); }
  std::vector<double> joints() const override { return spline_.parameters(); }

 private:
  InterpolatingSpline spline_;
  Flattened flattened_;
};

class Waypoints final : public TrajectoryKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.list("waypoints", waypoints_, "The places to pass through, in order; two or more.");
    visit.key("closed", is_closed_, "Fly from the last waypoint back to the first.");
    visit.key("laps", laps_, "How often a closed path is flown.", core::between(0.01, 1000.0));
    flight_.describe(visit);
  }

  void validate() const override {
    const std::size_t least = is_closed_ ? 3 : 2;
    if (waypoints_.size() < least) {
      core::fail(core::ErrorKind::Config, "{} waypoints; {} needs {} or more", waypoints_.size(),
                 is_closed_ ? "a closed path" : "a path", least);
    }
    if (!is_closed_ && laps_ != 1.0)
      core::fail(core::ErrorKind::Config, "laps = {} of an open path; set closed = true", laps_);
  }

  std::unique_ptr<TrajectoryKind> clone() const override {
    return std::make_unique<Waypoints>(*this);
  }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    validate();
    const Flattened flattened(context.frame.origin());
    std::vector<Eigen::Vector3d> points;
    std::vector<double> parameters;
    FlightPlan plan;
    const std::size_t num_places = waypoints_.size() + (is_closed_ ? 1 : 0);
    for (std::size_t i = 0; i < num_places; ++i) {
      const std::size_t index = i % waypoints_.size();
      const Waypoint& waypoint = waypoints_[index];
      const std::string what = fmt::format("waypoint {} (counted from 0)", index);
      const Eigen::Vector3d point =
          index < i ? points[index]
                    : flattened.flattened_from_world(resolve_place(waypoint, context, what));
      const double chord_m = points.empty() ? 0.0 : (point - points.back()).norm();
      constexpr double kLeastChord_m = 0.01;
      if (!points.empty() && chord_m < kLeastChord_m) {
        core::fail(core::ErrorKind::Config, "{} is where the one before it is ({:.3f} m away){}",
                   what, chord_m,
                   index < i ? "; a closed path returns to the first by itself" : "");
      }
      parameters.push_back(points.empty() ? 0.0 : parameters.back() + chord_m);
      points.push_back(point);
      const double speed_mps = waypoint.speed_mps > 0.0 ? waypoint.speed_mps : flight_.speed_mps;
      plan.speeds.push_back({parameters.back(), speed_mps});
    }
    plan.path = std::make_shared<SplinePath>(
        InterpolatingSpline(parameters, points, is_closed_, flight_.continuity_of_path()),
        flattened);
    plan.attitude = flight_.attitude();
    plan.laps = laps_;
    plan.how_to_raise = [parameters, count = waypoints_.size()](double u) {
      const auto after = std::lower_bound(parameters.begin() + 1, parameters.end() - 1, u);
      const auto i = static_cast<std::size_t>(after - parameters.begin());
      const double fraction = (u - parameters[i - 1]) / (parameters[i] - parameters[i - 1]);
      if (fraction < 0.1 || fraction > 0.9)
        return fmt::format("raise waypoint {} (counted from 0)",
                           (fraction < 0.5 ? i - 1 : i) % count);
      return fmt::format("raise waypoint {} or {} (counted from 0), or add one between", i - 1,
                         i % count);
    };
    return fly(plan, flight_, context);
  }

 private:
  std::vector<Waypoint> waypoints_;
  bool is_closed_ = false;
  double laps_ = 1.0;
  FlightOptions flight_;
};

}  // namespace

TrajectoryKindInfo waypoints_trajectory() {
  return {.name = "waypoints", .summary = "A smooth path through a list of places.", .make = [] {
            return std::unique_ptr<TrajectoryKind>(new Waypoints);
          }};
}

}  // namespace terracast::geo
