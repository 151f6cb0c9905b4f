#include <cmath>
#include <numbers>

#include "geo/paths/flattened.h"
#include "geo/paths/flight.h"
#include "geo/paths/place.h"
#include "geo/trajectory.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

/// A rounded rectangle in flattened coordinates: with c the squareness, an angle t goes to
/// (sin t + c sin 3t, 1 - (cos t - c cos 3t)), which is a circle for c = 0 and has straight middles
/// of its sides for c = 1/9, where their curvature is nought. Its height rises and falls once.
class RoundedLoopPath final : public Path {
 public:
  struct Shape {
    Eigen::Vector3d start;  ///< flattened: the middle of the first side
    Eigen::Vector3d ahead;  ///< unit, in the plane
    Eigen::Vector3d inwards;
    double length_m, width_m, rise_m;
    double squareness;
  };
  RoundedLoopPath(const Flattened& flattened, const Shape& shape)
      : flattened_(flattened),
        shape_(shape),
        // Between the perimeters of the ellipse and the rectangle, so that u is about a length.
        angle_per_u_(2.0 * std::numbers::pi / (1.7 * (shape.length_m + shape.width_m))) {}

  PathPoint at(double u) const override {
    const double c = shape_.squareness;
    const double t = u * angle_per_u_;
    const double half_length_m = 0.5 * shape_.length_m / (1.0 - c);
    const double half_width_m = 0.5 * shape_.width_m / (1.0 - c);
    const double half_rise_m = 0.5 * shape_.rise_m;
    const Eigen::Vector4d along(
        std::sin(t) + c * std::sin(3.0 * t), std::cos(t) + 3.0 * c * std::cos(3.0 * t),
        -std::sin(t) - 9.0 * c * std::sin(3.0 * t), -std::cos(t) - 27.0 * c * std::cos(3.0 * t));
    const Eigen::Vector4d across((1.0 - c) - (std::cos(t) - c * std::cos(3.0 * t)),
                                 std::sin(t) - 3.0 * c * std::sin(3.0 * t),
                                 std::cos(t) - 9.0 * c * std::cos(3.0 * t),
                                 -std::sin(t) + 27.0 * c * std::sin(3.0 * t));
    const Eigen::Vector4d rise(1.0 - std::cos(t), std::sin(t), std::cos(t), -std::sin(t));
    const auto combined = [&](int derivative) -> Eigen::Vector3d {
      return std::pow(angle_per_u_, derivative) *
             (half_length_m * along[derivative] * shape_.ahead +
              half_width_m * across[derivative] * shape_.inwards +
              half_rise_m * rise[derivative] * Eigen::Vector3d::UnitZ());
    };
    return flattened_.world_from_flattened(
        {shape_.start + combined(0), combined(1), combined(2), combined(3)});
  }
  double end() const override { return 2.0 * std::numbers::pi / angle_per_u_; }
  bool is_closed() const override { return true; }
  std::vector<double> joints() const override { return {0.0, end()}; }

 private:
  Flattened flattened_;
  Shape shape_;
  double angle_per_u_;
};

class Loop final : public TrajectoryKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.section("start", start_, "Where the loop begins and ends: the middle of its first side.");
    visit.key("heading_deg", heading_deg_,
              "Direction of flight at the start, clockwise from north.",
              core::between(-360.0, 360.0));
    visit.key("length_m", length_m_, "Extent along the heading.", core::between(2.0, 200000.0));
    visit.key("width_m", width_m_, "Extent across it.", core::between(2.0, 200000.0));
    visit.key("height_change_m", height_change_m_, "Height gained half-way round, and lost again.",
              core::between(-10000.0, 10000.0));
    visit.key("roundness", roundness_, "1: an ellipse; 0: a rectangle with wide round corners.",
              core::between(0.0, 1.0));
    visit.key("direction", direction_, "Turning left (anticlockwise seen from above) or right.",
              core::one_of({"left", "right"}));
    visit.key("laps", laps_, "How often the loop is flown; a little over 1 sees the start again.",
              core::between(0.01, 1000.0));
    flight_.describe(visit);
  }

  std::unique_ptr<TrajectoryKind> clone() const override { return std::make_unique<Loop>(*this); }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    const Eigen::Vector3d start_world = resolve_place(start_, context, "start");
    const double heading = radians_from_degrees(heading_deg_);
    const Eigen::Vector3d heading_world =
        context.frame.world_from_enu(start_world) *
        Eigen::Vector3d(std::sin(heading), std::cos(heading), 0.0);
    const Eigen::Vector2d level = heading_world.head<2>().normalized();
    const double turn = direction_ == "left" ? 1.0 : -1.0;
    const Flattened flattened(context.frame.origin());
    RoundedLoopPath::Shape shape;
    shape.start = flattened.flattened_from_world(start_world);
    shape.ahead = Eigen::Vector3d(level.x(), level.y(), 0.0);
    shape.inwards = turn * Eigen::Vector3d(-level.y(), level.x(), 0.0);
    shape.length_m = length_m_;
    shape.width_m = width_m_;
    shape.rise_m = height_change_m_;
    shape.squareness = (1.0 - roundness_) / 9.0;
    FlightPlan plan;
    plan.path = std::make_shared<RoundedLoopPath>(flattened, shape);
    plan.attitude = flight_.attitude();
    plan.laps = laps_;
    plan.how_to_raise = [](double) { return "raise start.height_m or height_change_m"; };
    return fly(plan, flight_, context);
  }

 private:
  Place start_{.height_m = 100.0};
  double heading_deg_ = 0.0;
  double length_m_ = 200.0;
  double width_m_ = 120.0;
  double height_change_m_ = 10.0;
  double roundness_ = 0.3;
  std::string direction_ = "left";
  double laps_ = 1.05;
  FlightOptions flight_;
};

}  // namespace

TrajectoryKindInfo loop_trajectory() {
  return {.name = "loop", .summary = "A rounded loop that returns to its start.", .make = [] {
            return std::unique_ptr<TrajectoryKind>(new Loop);
          }};
}

}  // namespace terracast::geo
