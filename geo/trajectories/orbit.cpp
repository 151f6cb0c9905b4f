#include <cmath>
#include <numbers>

#include "geo/paths/flight.h"
#include "geo/paths/place.h"
#include "geo/trajectory.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

/// A circle in the plane of two unit vectors, by its length.
class CirclePath final : public Path {
 public:
  /// start, ahead   unit vectors: from the centre to the start, and of the motion there
  CirclePath(const Eigen::Vector3d& centre_world, double radius_m, const Eigen::Vector3d& start,
             const Eigen::Vector3d& ahead)
      : centre_world_(centre_world), radius_m_(radius_m), start_(start), ahead_(ahead) {}

  PathPoint at(double u) const override {
    const double angle = u / radius_m_;
    const Eigen::Vector3d out = std::cos(angle) * start_ + std::sin(angle) * ahead_;
    const Eigen::Vector3d along = std::cos(angle) * ahead_ - std::sin(angle) * start_;
    return {centre_world_ + radius_m_ * out, along, -out / radius_m_,
            -along / (radius_m_ * radius_m_)};
  }
  double end() const override { return 2.0 * std::numbers::pi * radius_m_; }
  bool is_closed() const override { return true; }
  std::vector<double> joints() const override { return {0.0, end()}; }

 private:
  Eigen::Vector3d centre_world_;
  double radius_m_;
  Eigen::Vector3d start_, ahead_;
};

/// What lifts the circle's plane so that its mean height is the centre's: the plane is flat and the
/// Earth is not.
double rise_to_mean_height_m(const CirclePath& circle, double height_m, const WorldFrame& frame) {
  constexpr int kNumPlaces = 16;
  double sum_m = 0.0;
  for (int i = 0; i < kNumPlaces; ++i) {
    const Eigen::Vector3d at = circle.at(circle.end() * i / kNumPlaces).position_world;
    sum_m += height_m - frame.geodetic_from_world(at).height_m;
  }
  return sum_m / kNumPlaces;
}

class Orbit final : public TrajectoryKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.section("centre", centre_, "The circle's centre; its height is the circle's.");
    visit.key("radius_m", radius_m_, "Radius of the circle.", core::between(1.0, 100000.0));
    visit.key("direction", direction_, "Turning left (anticlockwise seen from above) or right.",
              core::one_of({"left", "right"}));
    visit.key("start_azimuth_deg", start_azimuth_deg_,
              "Direction from the centre to the start, clockwise from north.",
              core::between(-360.0, 360.0));
    visit.key("laps", laps_, "How often the circle is flown.", core::between(0.001, 1000.0));
    visit.key("face", face_, "The body looks ahead, or level towards the centre and does not bank.",
              core::one_of({"forward", "centre"}));
    flight_.describe(visit);
  }

  std::unique_ptr<TrajectoryKind> clone() const override { return std::make_unique<Orbit>(*this); }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    const Eigen::Vector3d centre_world = resolve_place(centre_, context, "centre");
    const Eigen::Matrix3d world_from_enu = context.frame.world_from_enu(centre_world);
    const double azimuth = radians_from_degrees(start_azimuth_deg_);
    const double turn = direction_ == "left" ? 1.0 : -1.0;
    const Eigen::Vector3d start =
        world_from_enu * Eigen::Vector3d(std::sin(azimuth), std::cos(azimuth), 0.0);
    const Eigen::Vector3d up = world_from_enu.col(2);
    const Eigen::Vector3d ahead = turn * up.cross(start);
    const CirclePath flat(centre_world, radius_m_, start, ahead);
    const double height_m = context.frame.geodetic_from_world(centre_world).height_m;
    const double rise_m = rise_to_mean_height_m(flat, height_m, context.frame);
    FlightPlan plan;
    plan.path = std::make_shared<CirclePath>(centre_world + rise_m * up, radius_m_, start, ahead);
    plan.attitude = flight_.attitude();
    if (face_ == "centre") {
      plan.attitude.nose = Attitude::Nose::TowardsPoint;
      plan.attitude.target_world = centre_world;
      plan.attitude.bank.reset();
    }
    plan.laps = laps_;
    plan.how_to_raise = [](double) { return "raise centre.height_m"; };
    return fly(plan, flight_, context);
  }

 private:
  Place centre_{.height_m = 100.0};
  double radius_m_ = 200.0;
  std::string direction_ = "left";
  double start_azimuth_deg_ = 0.0;
  double laps_ = 1.0;
  std::string face_ = "forward";
  FlightOptions flight_;
};

}  // namespace

TrajectoryKindInfo orbit_trajectory() {
  return {.name = "orbit", .summary = "A level circle round a place.", .make = [] {
            return std::unique_ptr<TrajectoryKind>(new Orbit);
          }};
}

}  // namespace terracast::geo
