#include <vector>

#include "core/error.h"
#include "geo/paths/flight.h"
#include "geo/paths/place.h"
#include "geo/paths/spline_path.h"
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
    const SplineThroughPlaces spline =
        spline_through(std::vector<Place>(waypoints_.begin(), waypoints_.end()), is_closed_,
                       flight_.continuity_of_path(), context);
    FlightPlan plan;
    plan.path = spline.path;
    for (std::size_t i = 0; i < spline.parameters.size(); ++i) {
      const double speed_mps = waypoints_[i % waypoints_.size()].speed_mps;
      plan.speeds.push_back(
          {spline.parameters[i], speed_mps > 0.0 ? speed_mps : flight_.speed_mps});
    }
    plan.attitude = flight_.attitude();
    plan.laps = laps_;
    plan.how_to_raise = spline.how_to_raise;
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
