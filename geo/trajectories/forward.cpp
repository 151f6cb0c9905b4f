#include <cmath>
#include <numbers>

#include "geo/paths/flattened.h"
#include "geo/paths/flight.h"
#include "geo/paths/place.h"
#include "geo/trajectory.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

/// A swing to both sides: amplitude x sin(2 pi u / length).
struct Sway {
  double amplitude_m;
  double length_m;

  /// Value and the first three derivatives.
  Eigen::Vector4d at(double u) const {
    const double rate = 2.0 * std::numbers::pi / length_m;
    return {amplitude_m * std::sin(rate * u), amplitude_m * rate * std::cos(rate * u),
            -amplitude_m * rate * rate * std::sin(rate * u),
            -amplitude_m * rate * rate * rate * std::cos(rate * u)};
  }
};

/// A straight line in flattened coordinates with a sway to the side and in height, by its length.
class SwayingLinePath final : public Path {
 public:
  struct Line {
    Eigen::Vector3d start;  ///< flattened
    Eigen::Vector3d ahead;  ///< unit in the plane, and the climb a metre
    Eigen::Vector3d left;
    double length_m;
  };
  SwayingLinePath(const Flattened& flattened, const Line& line, const Sway& side,
                  const Sway& height)
      : flattened_(flattened), line_(line), side_(side), height_(height) {}

  PathPoint at(double u) const override {
    const Eigen::Vector4d side = side_.at(u);
    const Eigen::Vector4d height = height_.at(u);
    const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    return flattened_.world_from_flattened(
        {line_.start + u * line_.ahead + side[0] * line_.left + height[0] * up,
         line_.ahead + side[1] * line_.left + height[1] * up, side[2] * line_.left + height[2] * up,
         side[3] * line_.left + height[3] * up});
  }
  double end() const override { return line_.length_m; }
  bool is_closed() const override { return false; }
  std::vector<double> joints() const override { return {0.0, line_.length_m}; }

 private:
  Flattened flattened_;
  Line line_;
  Sway side_, height_;
};

class Forward final : public TrajectoryKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.section("start", start_, "Where the flight begins.");
    visit.key("heading_deg", heading_deg_,
              "Direction of flight at the start, clockwise from north.",
              core::between(-360.0, 360.0));
    visit.key("length_m", length_m_, "Length of the straight line.", core::between(1.0, 1000000.0));
    visit.key("climb_m", climb_m_, "Height gained along the whole line.",
              core::between(-10000.0, 10000.0));
    visit.key("sway_side_m", sway_side_m_, "Amplitude of the sway to both sides.",
              core::between(0.0, 1000.0));
    visit.key("sway_side_period_s", sway_side_period_s_, "Its period.", core::between(0.5, 3600.0));
    visit.key("sway_height_m", sway_height_m_, "Amplitude of the sway in height.",
              core::between(0.0, 1000.0));
    visit.key("sway_height_period_s", sway_height_period_s_, "Its period.",
              core::between(0.5, 3600.0));
    flight_.describe(visit);
  }

  std::unique_ptr<TrajectoryKind> clone() const override {
    return std::make_unique<Forward>(*this);
  }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    const Eigen::Vector3d start_world = resolve_place(start_, context, "start");
    const double heading = radians_from_degrees(heading_deg_);
    const Eigen::Vector3d heading_world =
        context.frame.world_from_enu(start_world) *
        Eigen::Vector3d(std::sin(heading), std::cos(heading), 0.0);
    const Eigen::Vector2d level = heading_world.head<2>().normalized();
    const Flattened flattened(context.frame.origin());
    SwayingLinePath::Line line;
    line.start = flattened.flattened_from_world(start_world);
    line.ahead = Eigen::Vector3d(level.x(), level.y(), climb_m_ / length_m_);
    line.left = Eigen::Vector3d(-level.y(), level.x(), 0.0);
    line.length_m = length_m_;
    FlightPlan plan;
    plan.path = std::make_shared<SwayingLinePath>(
        flattened, line, Sway{sway_side_m_, sway_side_period_s_ * flight_.speed_mps},
        Sway{sway_height_m_, sway_height_period_s_ * flight_.speed_mps});
    plan.attitude = flight_.attitude();
    plan.how_to_raise = [](double) { return "raise start.height_m or climb_m"; };
    return fly(plan, flight_, context);
  }

 private:
  Place start_{.height_m = 100.0};
  double heading_deg_ = 0.0;
  double length_m_ = 300.0;
  double climb_m_ = 0.0;
  double sway_side_m_ = 2.0;
  double sway_side_period_s_ = 12.0;
  double sway_height_m_ = 1.0;
  double sway_height_period_s_ = 9.0;
  FlightOptions flight_;
};

}  // namespace

TrajectoryKindInfo forward_trajectory() {
  return {.name = "forward", .summary = "A straight flight with a gentle sway.", .make = [] {
            return std::unique_ptr<TrajectoryKind>(new Forward);
          }};
}

}  // namespace terracast::geo
