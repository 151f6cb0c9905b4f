#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "geo/air/flight_air.h"
#include "geo/paths/above_ground.h"
#include "geo/paths/flight.h"
#include "geo/paths/place.h"
#include "geo/paths/spline_path.h"
#include "geo/trajectory.h"
#include "geo/vehicles/flown_wing.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

class FixedWingPlan final : public TrajectoryKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.list("waypoints", waypoints_, "The places to pass through, in order; two or more.");
    visit.key("closed", is_closed_, "Fly from the last waypoint back to the first.");
    visit.key("laps", laps_, "How often a closed path is flown.", core::between(0.01, 1000.0));
    visit.key("speed_mps", flight_.speed_mps,
              "Speed over the ground along the path, which the plan keeps to in any wind.",
              core::between(1.0, 340.0));
    visit.section("vehicle", vehicle_, "The aircraft; sets are in configs/vehicles.");
    limits_.describe(visit);
    visit.key("max_climb_deg", flight_.max_climb_deg,
              "Steepest climb or descent; a steeper path is refused.", core::between(1.0, 60.0));
    visit.key("min_agl_m", flight_.min_agl_m,
              "Least height above the measured ground or water; a lower path is refused.",
              core::between(0.0, 100000.0));
    visit.key("terrain_following", flight_.terrain_following,
              "Raise the path smoothly where it would be lower than min_agl_m.");
    visit.key("follow_length_m", flight_.follow_length_m,
              "Length on both sides over which a raised place is smoothed.",
              core::between(10.0, 20000.0));
    visit.key("mode", mode_,
              "flat: the path is flown exactly, in the mean wind; flown: by a controller, with the "
              "aircraft's dynamics, gusts and turbulence.",
              core::one_of({"flat", "flown"}));
    visit.key("max_off_m", max_off_m_,
              "Distance from the planned place, at the same time, beyond which a flown flight is "
              "refused.",
              core::between(0.001, 1000.0));
    visit.section("control", control_, "How quickly the controller of a flown flight acts.");
    visit.section("wind", wind_, "Wind.");
  }

  void validate() const override {
    const std::size_t least = is_closed_ ? 3 : 2;
    constexpr std::size_t kMostWaypoints = 1000;
    if (waypoints_.size() < least)
      fail(ErrorKind::Config, "{} waypoints; {} needs {} or more", waypoints_.size(),
           is_closed_ ? "a closed path" : "a path", least);
    if (waypoints_.size() > kMostWaypoints)
      fail(ErrorKind::Config, "{} waypoints; at most {} are flown in one go", waypoints_.size(),
           kMostWaypoints);
    if (!is_closed_ && laps_ != 1.0)
      fail(ErrorKind::Config, "laps = {} of an open path; set closed = true", laps_);
    vehicle_.validate();
    wind_.validate();
    if (mode_ == "flown") {
      if (!vehicle_.has_rudder() && vehicle_.lateral_departure_per_rad() <= 0.0)
        fail(ErrorKind::Config,
             "the vehicle has no rudder, and its ailerons turn its nose out of a bank that they "
             "hold (lateral control departure parameter yaw.beta - roll.beta yaw.aileron / "
             "roll.aileron = {:.2g}, not above 0): no controller of its surfaces flies it; set "
             "mode = \"flat\"",
             vehicle_.lateral_departure_per_rad());
      return;
    }
    if (wind_.turbulence != "none" || !wind_.gusts.empty())
      fail(ErrorKind::Config,
           "{} of [wind] counts with mode = \"flown\" alone; flat flights have a mean wind",
           wind_.gusts.empty() ? "turbulence" : "gusts");
    const WingControl usual;
    const bool has_control = control_.position_radps != usual.position_radps ||
                             control_.attitude_radps != usual.attitude_radps ||
                             control_.wind_s != usual.wind_s;
    if (has_control || max_off_m_ != kMaxOff_m)
      fail(ErrorKind::Config,
           "{} counts with mode = \"flown\" alone, and the mode is \"{}\": the path is flown "
           "exactly",
           has_control ? "[control]" : "max_off_m", mode_);
  }

  std::unique_ptr<TrajectoryKind> clone() const override {
    return std::make_unique<FixedWingPlan>(*this);
  }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    validate();
    const SplineThroughPlaces spline =
        spline_through(waypoints_, is_closed_, Continuity::Fourth, context);
    FlightOptions options = flight_;
    options.continuity = "fourth";
    options.bank = "none";  // the attitude is the aircraft's own
    const FlightPlan plan{.path = spline.path,
                          .speeds = {},
                          .attitude = options.attitude(),
                          .laps = laps_,
                          .how_to_raise = spline.how_to_raise};
    std::unique_ptr<Trajectory> path = geo::fly(plan, options, context);
    check_time(path->duration_s());
    WindOptions mean = wind_;
    mean.turbulence = "none";
    mean.turbulence_speed_mps = 0.0;
    mean.gusts.clear();
    std::shared_ptr<const FlightAir> mean_air;
    if (!mean.is_calm())
      mean_air = std::make_shared<FlightAir>(
          air_along(*path, mean, context, kFlownBeyond_s, kFlownBeyond_s, 0.0));
    const CoordinatedFlight flight(context.frame, vehicle_);
    std::optional<double> lap_s;
    if (is_closed_) lap_s = path->duration_s() / laps_;
    auto flat = std::make_unique<FlatWingFlight>(flight, std::move(path), lap_s, mean_air, limits_);
    if (mode_ == "flat") return flat;
    return build_flown(flight, *flat, context);
  }

 private:
  std::unique_ptr<Trajectory> build_flown(const CoordinatedFlight& flight, const Trajectory& plan,
                                          const TrajectoryContext& context) const {
    std::shared_ptr<const FlightAir> air;
    if (!wind_.is_calm())
      air = std::make_shared<FlightAir>(
          air_along(plan, wind_, context, 0.0, kFlownBeyond_s, max_off_m_));
    FlightReport report;
    auto flown = geo::fly(flight, plan, control_, air.get(), max_off_m_, report);
    flown->set_air(context.frame, air);
    if (context.log) {
      context.log->info("the aircraft keeps within {:.2f} m of its path, farthest at t = {:.1f} s",
                        report.most_off_m, report.most_off_s);
      if (report.saturated_s > 0.0)
        context.log->warn(
            "the aircraft's controls are at their limits for {:.2f} s, first at t = {:.1f} s",
            report.saturated_s, report.first_saturated_s);
    }
    constexpr double kFaster = 1.5;
    const LowestPlace lowest = lowest_place_of(*flown, kFaster * flight_.speed_mps, context);
    if (!context.is_on_surface)
      refuse_too_low(lowest, flight_.min_agl_m,
                     "raise the waypoints by as much as it is blown down");
    return flown;
  }

  /// throws Config: longer than is flown in one go
  void check_time(double duration_s) const {
    constexpr double kMostFlat_s = 10.0 * kMostFlown_s;
    const double most_s = mode_ == "flown" ? kMostFlown_s - kFlownBeyond_s : kMostFlat_s;
    if (duration_s > most_s)
      fail(ErrorKind::Config,
           "the flight takes {:.0f} s, and at most {:.0f} s are flown in one go with mode = "
           "\"{}\"; fly fewer laps, or a shorter or a faster way",
           duration_s, most_s, mode_);
  }

  std::vector<Place> waypoints_;
  bool is_closed_ = false;
  double laps_ = 1.0;
  FixedWing vehicle_;
  WingLimits limits_;
  FlightOptions flight_ = usual_flight();
  std::string mode_ = "flat";
  static constexpr double kMaxOff_m = 10.0;
  double max_off_m_ = kMaxOff_m;
  WingControl control_;
  WindOptions wind_;

  static FlightOptions usual_flight() {
    FlightOptions options;
    options.speed_mps = 25.0;
    options.min_agl_m = 30.0;
    options.max_climb_deg = 20.0;
    return options;
  }
};

}  // namespace

TrajectoryKindInfo fixed_wing_trajectory() {
  return {.name = "fixed_wing",
          .summary =
              "A fixed-wing aircraft's flight through places, as its wing, propeller and control "
              "surfaces can fly it.",
          .make = [] { return std::unique_ptr<TrajectoryKind>(new FixedWingPlan); }};
}

}  // namespace terracast::geo
