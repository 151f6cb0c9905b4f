#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/paths/area.h"
#include "geo/paths/control_path.h"
#include "geo/paths/flight.h"
#include "geo/paths/ground_track.h"
#include "geo/paths/over_ground.h"
#include "geo/trajectory.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

class Facade final : public TrajectoryKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.list("wall", wall_,
               "The two ends of the wall on the map; the flight begins at the first.");
    visit.key(
        "side", side_,
        "On which side of the wall the flight is, seen from its first end towards its second.",
        core::one_of({"left", "right"}));
    visit.key("distance_m", distance_m_, "Distance of the flight to the wall.",
              core::between(0.5, 1000.0));
    visit.key("lowest_m", lowest_m_,
              "Height of the lowest row above the highest measured ground below the flight.",
              core::between(0.5, 10000.0));
    visit.key("highest_m", highest_m_, "The same of the highest row.", core::between(0.5, 10000.0));
    visit.key("row_spacing_m", row_spacing_m_,
              "Height between two rows, at most; they are spaced evenly.",
              core::between(kLeastSpacing_m, 1000.0));
    visit.key("speed_mps", speed_mps_, "Speed along the path.", core::between(0.01, 100.0));
    visit.key("continuity", continuity_,
              "Up to which derivative the path is continuous: second or fourth, for inertial "
              "sensors.",
              core::one_of({"second", "fourth"}));
    visit.key("min_agl_m", min_agl_m_, "Least height above the measured ground.",
              core::between(0.0, 100000.0));
  }

  void validate() const override {
    if (wall_.size() != 2)
      fail(ErrorKind::Config, "wall has {} places; it takes its two ends", wall_.size());
    if (highest_m_ < lowest_m_)
      fail(ErrorKind::Config, "highest_m = {} is below lowest_m = {}", highest_m_, lowest_m_);
    if (num_rows() > 1 && 2.0 * turn_radius_m() < kLeastSpacing_m)
      fail(ErrorKind::Config,
           "rows between lowest_m = {} and highest_m = {} are {:.2f} m apart; {} m are flown at "
           "least: make both the same, or set highest_m higher",
           lowest_m_, highest_m_, 2.0 * turn_radius_m(), kLeastSpacing_m);
    constexpr double kMostAcceleration_mps2 = 5.0;
    const double turning_mps2 = speed_mps_ * speed_mps_ / turn_radius_m();
    if (num_rows() > 1 && turning_mps2 > kMostAcceleration_mps2)
      fail(ErrorKind::Config,
           "half circles between rows {:.2f} m apart would take {:.1f} m/s^2, and up to {} are "
           "flown; fly at {:.2f} m/s, or set row_spacing_m higher",
           2.0 * turn_radius_m(), turning_mps2, kMostAcceleration_mps2,
           std::floor(100.0 * std::sqrt(kMostAcceleration_mps2 * turn_radius_m())) / 100.0);
  }

  std::unique_ptr<TrajectoryKind> clone() const override { return std::make_unique<Facade>(*this); }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    validate();
    const Eigen::Vector2d from = resolve_corner(wall_[0], context, "the wall's first end");
    const Eigen::Vector2d to = resolve_corner(wall_[1], context, "the wall's second end");
    const double length_m = (to - from).norm();
    constexpr double kLeastLength_m = 1.0;
    if (length_m < kLeastLength_m)
      fail(ErrorKind::Config, "the wall is {:.3f} m long; it takes {} m or more", length_m,
           kLeastLength_m);
    const Eigen::Vector2d ahead = (to - from) / length_m;
    const double to_left = side_ == "left" ? 1.0 : -1.0;
    const Eigen::Vector2d away = to_left * Eigen::Vector2d(-ahead.y(), ahead.x());
    TrackControls controls = controls_along(rows(length_m), turn_radius_m(),
                                            "Set row_spacing_m higher, or fly along less of it");
    for (Eigen::Vector3d& control : controls.controls) {
      const Eigen::Vector2d at = from + control.x() * ahead + distance_m_ * away;
      control = {at.x(), at.y(), control.y()};
    }
    const double foot_w_m = ground_w_m(controls.controls.front().head<2>(), 0.0, context);
    const double ground_w_m = highest_ground_w_m(controls, foot_w_m, context);
    for (Eigen::Vector3d& control : controls.controls) control.z() += ground_w_m;
    FlightPlan plan;
    plan.attitude.continuity = continuity_ == "fourth" ? Continuity::Fourth : Continuity::Second;
    plan.attitude.nose = Attitude::Nose::AlongDirection;
    plan.attitude.direction_world = {-away.x(), -away.y(), 0.0};
    plan.path = std::make_shared<ControlPath>(Flattened(context.frame.origin()), controls.controls,
                                              controls.spacing_m, plan.attitude.continuity);
    plan.how_to_raise = [](double) { return "raise lowest_m"; };
    plan.how_to_follow = "";
    FlightOptions flight;
    flight.speed_mps = speed_mps_;
    flight.min_agl_m = min_agl_m_;
    constexpr double kAnyClimb_deg = 91.0;  // it turns upwards from row to row
    flight.max_climb_deg = kAnyClimb_deg;
    return fly(plan, flight, context);
  }

 private:
  int num_rows() const {
    constexpr double kRounding = 1e-9;  // a height of whole spacings makes no row more
    return 1 + static_cast<int>(std::ceil((highest_m_ - lowest_m_) / row_spacing_m_ - kRounding));
  }
  /// Half of the height between two rows.
  double turn_radius_m() const {
    return num_rows() > 1 ? 0.5 * (highest_m_ - lowest_m_) / (num_rows() - 1) : 1.0;
  }

  /// The rows in the upright plane of the flight: x along the wall, y the height.
  GroundTrack rows(double length_m) const {
    GroundTrack track({0.0, lowest_m_}, {1.0, 0.0});
    for (int i = 0; i < num_rows(); ++i) {
      if (i > 0)
        track.turn_back(i % 2 == 1 ? 2.0 * turn_radius_m() : -2.0 * turn_radius_m(),
                        turn_radius_m());
      track.go_straight(length_m);
    }
    return track;
  }

  /// Steps of the path round narrower turns than these.
  static constexpr double kLeastSpacing_m = 1.0;

  std::vector<Corner> wall_;
  std::string side_ = "left";
  double distance_m_ = 10.0;
  double lowest_m_ = 6.0;
  double highest_m_ = 30.0;
  double row_spacing_m_ = 4.0;
  double speed_mps_ = 2.0;
  std::string continuity_ = "second";
  double min_agl_m_ = 3.0;
};

}  // namespace

TrajectoryKindInfo facade_trajectory() {
  return {.name = "facade",
          .summary = "Rows up a wall, to and fro, with the nose at it.",
          .make = [] { return std::unique_ptr<TrajectoryKind>(new Facade); }};
}

}  // namespace terracast::geo
