#include "geo/vehicles/quadrotor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "geo/air/flight_air.h"
#include "geo/gravity.h"
#include "geo/paths/above_ground.h"
#include "geo/paths/attitude.h"
#include "geo/paths/place.h"
#include "geo/paths/segment_times.h"
#include "geo/trajectory.h"
#include "geo/units.h"
#include "geo/vehicles/flown_quadrotor.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;
using Vector = std::array<Polynomial, 3>;  ///< of the world, by x along a piece

Vector derivative_of(const Vector& vector, double per_s) {
  Vector derivative;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    derivative[axis] = geo::derivative_of(vector[axis]);
    for (double& coefficient : derivative[axis]) coefficient *= per_s;
  }
  return derivative;
}

Polynomial dot(const Vector& a, const Vector& b) {
  Polynomial sum;
  for (std::size_t axis = 0; axis < 3; ++axis) add_to(sum, product_of(a[axis], b[axis]));
  return sum;
}

Polynomial along(const Vector& vector, const Eigen::Vector3d& unit) {
  Polynomial sum;
  for (std::size_t axis = 0; axis < 3; ++axis)
    add_to(sum, vector[axis], unit[static_cast<Eigen::Index>(axis)]);
  return sum;
}

Eigen::Vector3d value_of(const Vector& vector, double x) {
  return {geo::value_of(vector[0], x), geo::value_of(vector[1], x), geo::value_of(vector[2], x)};
}

/// Where the nose of a quadrotor points: the horizontal part of a vector.
struct Heading {
  enum class Kind { AlongPath, Fixed, TowardsPoint };
  Kind kind = Kind::AlongPath;
  double from_north_rad = 0.0;  ///< clockwise, of Fixed
  Eigen::Vector3d target_world = Eigen::Vector3d::Zero();
};

/// A quadrotor that flies a curve exactly.
class FlatFlight final : public Trajectory {
 public:
  FlatFlight(const WorldFrame& frame, LeastSnapCurve curve, const Heading& heading,
             double drag_per_s, double laps)
      : frame_(frame),
        curve_(std::move(curve)),
        heading_(heading),
        drag_per_s_(drag_per_s),
        laps_(laps) {
    for (std::size_t i = 0; i < curve_.num_pieces(); ++i) {
      const double per_s = 1.0 / curve_.piece_s(i);
      Vector direction;
      for (std::size_t axis = 0; axis < 3; ++axis)
        direction[axis] = curve_.direction_of(i, static_cast<int>(axis));
      const Vector rate = derivative_of(direction, per_s);
      directions_.push_back({direction, rate, derivative_of(rate, per_s)});
    }
  }

  const LeastSnapCurve& curve() const { return curve_; }
  const Vector& direction(std::size_t piece) const { return directions_[piece][0]; }
  double duration_s() const override { return laps_ * curve_.duration_s(); }

  MotionState at(double time_s) const override {
    TERRACAST_CHECK(std::isfinite(time_s), "time {} s of a motion", time_s);
    double on_curve_s = time_s;
    if (curve_.is_closed())
      on_curve_s -= curve_.duration_s() * std::floor(time_s / curve_.duration_s());
    const double inside_s = std::clamp(on_curve_s, 0.0, curve_.duration_s());
    LeastSnapCurve::Value motion = curve_.at(inside_s);
    if (inside_s != on_curve_s) {  // at rest
      const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
      motion = {motion.position, zero, zero, zero, zero};
    }
    const Turning turning = flat_turning(
        frame_, motion, heading_at(inside_s, on_curve_s - inside_s, motion), drag_per_s_);
    MotionState state;
    state.time_s = time_s;
    state.world_from_body = {.rotation = turning.world_from_body.normalized(),
                             .translation = motion.position};
    state.velocity_world_mps = motion.velocity;
    state.acceleration_world_mps2 = motion.acceleration;
    state.jerk_world_mps3 = motion.jerk;
    state.angular_velocity_body_radps = turning.angular_velocity_body_radps;
    state.angular_acceleration_body_radps2 = turning.angular_acceleration_body_radps2;
    return state;
  }

  std::vector<double> knots_s() const override {
    std::vector<double> knots_s;
    const double lap_s = curve_.duration_s();
    for (double lap_start_s = 0.0; lap_start_s < duration_s(); lap_start_s += lap_s)
      for (const double time_s : curve_.knots_s())
        if (lap_start_s + time_s <= duration_s()) knots_s.push_back(lap_start_s + time_s);
    knots_s.push_back(0.0);
    knots_s.push_back(duration_s());
    return sorted_knots(std::move(knots_s));
  }

  /// A share of the end pieces by which the heading goes on beyond the curve's ends, at most.
  static constexpr double kBeyond = 0.25;

 private:
  /// beyond_s   how much later than the end, or earlier than the beginning, that is
  Changing heading_at(double time_s, double beyond_s, const LeastSnapCurve::Value& motion) const {
    if (heading_.kind == Heading::Kind::TowardsPoint)
      return {heading_.target_world - motion.position, -motion.velocity, -motion.acceleration};
    if (heading_.kind == Heading::Kind::Fixed) {
      const Changing up = up_along(frame_, motion.position, motion.velocity, motion.acceleration);
      const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
      const Changing east = normalised(crossed({polar_axis_of(frame_), zero, zero}, up));
      const Changing north = crossed(up, east);
      const double sin = std::sin(heading_.from_north_rad), cos = std::cos(heading_.from_north_rad);
      return {sin * east.value + cos * north.value, sin * east.rate + cos * north.rate,
              sin * east.second + cos * north.second};
    }
    const std::size_t piece = curve_.piece_at(time_s);
    const double piece_s = curve_.piece_s(piece);
    double x = (time_s - curve_.knots_s()[piece]) / piece_s;
    const auto& [direction, rate, second] = directions_[piece];
    if (beyond_s == 0.0) return {value_of(direction, x), value_of(rate, x), value_of(second, x)};
    // The turning goes on and dies away: x moves by B tanh(t / B T), B the share beyond and T the piece's time.
    const double moved = std::tanh(beyond_s / (kBeyond * piece_s));
    const double pace = 1.0 - moved * moved;
    const double pace_rate = -2.0 * moved * pace / (kBeyond * piece_s);
    x += kBeyond * moved;
    return {value_of(direction, x), pace * value_of(rate, x),
            pace * pace * value_of(second, x) + pace_rate * value_of(rate, x)};
  }

  WorldFrame frame_;
  LeastSnapCurve curve_;
  Heading heading_;
  double drag_per_s_;
  double laps_;
  std::vector<std::array<Vector, 3>> directions_;  ///< with their derivatives by time
};

/// "t = 3.2 s (lat …, lon …)"
std::string text_of_time(const WorldFrame& frame, const LeastSnapCurve& curve, std::size_t piece,
                         double x) {
  const double time_s = curve.knots_s()[piece] + std::clamp(x, 0.0, 1.0) * curve.piece_s(piece);
  return fmt::format("t = {:.1f} s ({})", time_s,
                     text_of(frame.geodetic_from_world(curve.at(time_s).position)));
}

/// throws Input: a thrust that the rotors cannot give, at the extrema of its polynomials. Gravity is that of the piece's middle.
void check_thrust(const WorldFrame& frame, const LeastSnapCurve& curve,
                  const Quadrotor& quadrotor) {
  constexpr double kLeast_mps2 = 1.0;
  const double most_mps2 = quadrotor.max_thrust_mps2();
  const Eigen::Vector3d turning = 2.0 * earth_rate_world_radps(frame);
  for (std::size_t i = 0; i < curve.num_pieces(); ++i) {
    const double per_s = 1.0 / curve.piece_s(i);
    Vector position;
    for (std::size_t axis = 0; axis < 3; ++axis)
      position[axis] = curve.coordinate_of(i, static_cast<int>(axis));
    const Vector velocity = derivative_of(position, per_s);
    Vector without_drag = derivative_of(velocity, per_s);
    const Eigen::Vector3d gravity = gravity_world_mps2(frame, value_of(position, 0.5));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      without_drag[axis][0] -= gravity[k];
      for (std::size_t other = 0; other < 3; ++other) {
        const Eigen::Vector3d unit = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(other));
        add_to(without_drag[axis], velocity[other], turning.cross(unit)[k]);
      }
    }
    Vector with_drag = without_drag;
    for (std::size_t axis = 0; axis < 3; ++axis)
      add_to(with_drag[axis], velocity[axis], quadrotor.drag_per_s());
    const Extremum least = least_of(dot(with_drag, without_drag), 0.0, 1.0);
    if (least.value < kLeast_mps2 * kLeast_mps2)
      fail(ErrorKind::Input,
           "the quadrotor falls so fast at {} that its rotors would have to push down, or hardly "
           "at all; lower max_acceleration_mps2 below {:.1f}",
           text_of_time(frame, curve, i, least.x), kGravity_mps2);
    const Extremum most = greatest_of(dot(without_drag, without_drag), 0.0, 1.0);
    if (most.value > most_mps2 * most_mps2)
      fail(ErrorKind::Input,
           "the quadrotor needs a thrust of {:.2f} N at {}, and its rotors give {:.2f} N; lower "
           "max_acceleration_mps2 or max_jerk_mps3",
           quadrotor.mass_kg * std::sqrt(most.value), text_of_time(frame, curve, i, most.x),
           quadrotor.mass_kg * most_mps2);
  }
}

/// throws Input: a nose that has no direction somewhere
void check_heading(const WorldFrame& frame, const FlatFlight& flight, const Heading& heading) {
  if (heading.kind == Heading::Kind::Fixed) return;
  const LeastSnapCurve& curve = flight.curve();
  for (std::size_t i = 0; i < curve.num_pieces(); ++i) {
    const double middle_s = curve.knots_s()[i] + 0.5 * curve.piece_s(i);
    const Eigen::Vector3d up = frame.up_world(curve.at(middle_s).position);
    Vector vector = flight.direction(i);
    double begin = 0.0, end = 1.0;
    if (heading.kind == Heading::Kind::TowardsPoint) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        vector[axis] = curve.coordinate_of(i, static_cast<int>(axis));
        vector[axis][0] -= heading.target_world[static_cast<Eigen::Index>(axis)];
      }
    } else if (!curve.is_closed()) {
      begin = i == 0 ? -FlatFlight::kBeyond : 0.0;
      end = i + 1 == curve.num_pieces() ? 1.0 + FlatFlight::kBeyond : 1.0;
    }
    Polynomial level = dot(vector, vector);
    const double most = greatest_of(level, begin, end).value;
    const Polynomial upward = along(vector, up);
    add_to(level, product_of(upward, upward), -1.0);
    const Extremum least = least_of(level, begin, end);
    constexpr double kLeastDistance_m = 0.5, kLeastShare = 0.01;
    if (heading.kind == Heading::Kind::TowardsPoint &&
        least.value < kLeastDistance_m * kLeastDistance_m)
      fail(ErrorKind::Input,
           "the path passes above or below the place that the nose points to, or through it, at "
           "{}; lead it past it, or set another heading",
           text_of_time(frame, curve, i, least.x));
    if (heading.kind == Heading::Kind::AlongPath && least.value < kLeastShare * kLeastShare * most)
      fail(ErrorKind::Input,
           "the path is vertical or turns back on itself at {}, where a nose along it has no "
           "direction; lead it round there by a place to the side, or set heading = \"fixed\" or "
           "\"point\"",
           text_of_time(frame, curve, i, least.x));
  }
}

class QuadrotorFlight final : public TrajectoryKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.list("waypoints", waypoints_, "The places to pass through, in order; two or more.");
    visit.key("closed", is_closed_,
              "Fly from the last waypoint back to the first, without a rest; else it begins and "
              "ends at rest.");
    visit.key("laps", laps_, "How often a closed path is flown.", core::between(0.01, 1000.0));
    visit.key("max_speed_mps", max_speed_mps_, "Speed that the flight reaches at most.",
              core::between(0.01, 1000.0));
    visit.key("max_acceleration_mps2", max_acceleration_mps2_,
              "Acceleration that it reaches at most.", core::between(0.001, 1000.0));
    visit.key("max_jerk_mps3", max_jerk_mps3_,
              "Change of the acceleration, a second, that it reaches at most.",
              core::between(0.001, 100000.0));
    visit.key("timing", timing_,
              "How its time is dealt to the ways between waypoints: shortest (each as fast as "
              "the limits let it), or smoothest (the least snap for the time of the whole).",
              core::one_of({"shortest", "smoothest"}));
    visit.key("heading", heading_,
              "Where the body's x axis points, on the map: along the path, to heading_deg, or to "
              "look_at.",
              core::one_of({"path", "fixed", "point"}));
    visit.key("heading_deg", heading_deg_,
              "Direction of heading = \"fixed\", clockwise from north.",
              core::between(-360.0, 360.0));
    visit.list("look_at", look_at_, "The place that heading = \"point\" points to; one.");
    visit.section("vehicle", vehicle_,
                  "The quadrotor; sets are in configs/vehicles. Without one it has neither drag "
                  "nor a limit of thrust.");
    visit.key("min_agl_m", min_agl_m_,
              "Least height above the measured ground or water; a lower path is refused.",
              core::between(0.0, 100000.0));
    visit.key("mode", mode_,
              "flat: the path is flown exactly, in still air; flown: by a controller, with the "
              "vehicle's dynamics and in the wind.",
              core::one_of({"flat", "flown"}));
    visit.key("max_off_m", max_off_m_,
              "Distance from the planned place, at the same time, beyond which a flown flight is "
              "refused.",
              core::between(0.001, 1000.0));
    visit.section("control", control_, "How quickly the controller of a flown flight acts.");
    visit.section("wind", wind_, "Wind that a flown flight meets.");
  }

  void validate() const override {
    const std::size_t least = is_closed_ ? 3 : 2;
    if (waypoints_.size() < least)
      fail(ErrorKind::Config, "{} waypoints; {} needs {} or more", waypoints_.size(),
           is_closed_ ? "a closed path" : "a path", least);
    constexpr std::size_t kMostWaypoints = 1000;
    if (waypoints_.size() > kMostWaypoints)
      fail(ErrorKind::Config, "{} waypoints; at most {} are flown in one go", waypoints_.size(),
           kMostWaypoints);
    if (!is_closed_ && laps_ != 1.0)
      fail(ErrorKind::Config, "laps = {} of an open path; set closed = true", laps_);
    const bool is_to_point = heading_ == "point";
    if (look_at_.size() != (is_to_point ? 1 : 0))
      fail(ErrorKind::Config, "look_at has {} places, and heading = \"{}\" {}", look_at_.size(),
           heading_, is_to_point ? "needs one" : "uses none; set heading = \"point\"");
    if (heading_ != "fixed" && heading_deg_ != 0.0)
      fail(ErrorKind::Config, "heading_deg = {} counts with heading = \"fixed\" alone, not \"{}\"",
           heading_deg_, heading_);
    vehicle_.validate();
    wind_.validate();
    if (mode_ == "flown") return vehicle_.validate_dynamics();
    const bool has_control = control_.position_radps != 0.0 || control_.attitude_radps != 0.0;
    const char* unused = !wind_.is_calm()          ? "[wind]"
                         : has_control             ? "[control]"
                         : max_off_m_ != kMaxOff_m ? "max_off_m"
                                                   : nullptr;
    if (unused)
      fail(ErrorKind::Config,
           "{} counts with mode = \"flown\" alone, and the mode is \"{}\": the path is flown "
           "exactly",
           unused, mode_);
  }

  std::unique_ptr<TrajectoryKind> clone() const override {
    return std::make_unique<QuadrotorFlight>(*this);
  }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    validate();
    const MotionLimits limits{.speed_mps = max_speed_mps_,
                              .acceleration_mps2 = max_acceleration_mps2_,
                              .jerk_mps3 = max_jerk_mps3_};
    const Timing timing = timing_ == "shortest" ? Timing::Shortest : Timing::Smoothest;
    Heading heading;
    if (heading_ == "fixed")
      heading = {.kind = Heading::Kind::Fixed,
                 .from_north_rad = radians_from_degrees(heading_deg_)};
    if (heading_ == "point")
      heading = {.kind = Heading::Kind::TowardsPoint,
                 .target_world = resolve_place(look_at_.front(), context, "look_at")};
    auto flight = std::make_unique<FlatFlight>(
        context.frame, fit_within(resolve_points(context), is_closed_, limits, timing), heading,
        vehicle_.drag_per_s(), laps_);
    check_thrust(context.frame, flight->curve(), vehicle_);
    check_heading(context.frame, *flight, heading);
    check_ground(flight->curve(), context);
    if (mode_ == "flat") return flight;
    return build_flown(*flight, context);
  }

 private:
  std::vector<Eigen::Vector3d> resolve_points(const TrajectoryContext& context) const {
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < waypoints_.size(); ++i)
      points.push_back(
          resolve_place(waypoints_[i], context, fmt::format("waypoint {} (counted from 0)", i)));
    if (is_closed_) points.push_back(points.front());
    constexpr double kLeastWay_m = 0.01;
    for (std::size_t i = 1; i < points.size(); ++i) {
      const double way_m = (points[i] - points[i - 1]).norm();
      if (way_m < kLeastWay_m)
        fail(ErrorKind::Config,
             "waypoint {} (counted from 0) is where the one before it is ({:.3f} m away){}",
             i % waypoints_.size(), way_m,
             i == waypoints_.size() ? "; a closed path returns to the first by itself" : "");
    }
    return points;
  }

  std::unique_ptr<Trajectory> build_flown(const FlatFlight& plan,
                                          const TrajectoryContext& context) const {
    check_flown_time(plan.duration_s());
    std::shared_ptr<const FlightAir> air;
    if (!wind_.is_calm())
      air = std::make_shared<FlightAir>(air_along(plan, wind_, context,
                                                  settling_s(control_.resolved(vehicle_)),
                                                  kFlownBeyond_s, max_off_m_));
    FlightReport report;
    auto flown = fly(context.frame, plan, vehicle_, control_, air.get(), max_off_m_, report);
    flown->set_air(context.frame, air);
    if (context.log) {
      context.log->info("the quadrotor keeps within {:.2f} m of its path, farthest at t = {:.1f} s",
                        report.most_off_m, report.most_off_s);
      if (report.saturated_s > 0.0)
        context.log->warn(
            "the quadrotor's rotors are at their limits for {:.2f} s, first at t = {:.1f} s",
            report.saturated_s, report.first_saturated_s);
    }
    check_flown_height(*flown, context);
    return flown;
  }

  /// throws Config: longer than kMostFlown_s, with the time in which it settles
  void check_flown_time(double duration_s) const {
    const double settles_s = settling_s(control_.resolved(vehicle_));
    const double left_s = kMostFlown_s - kFlownBeyond_s - duration_s;
    if (settles_s <= left_s) return;
    const FlightControl usual = FlightControl{}.resolved(vehicle_);
    if (settling_s(usual) > left_s)
      fail(ErrorKind::Config,
           "the flight takes {:.0f} s and {:.0f} s before it to settle, and at most {:.0f} s are "
           "flown in one go; fly fewer laps, or a shorter or a faster way",
           duration_s, settles_s, kMostFlown_s);
    const bool is_position = control_.position_radps != 0.0;
    constexpr double kMargin = 1.1;  // more than two digits round off
    const double least = kMargin * (is_position ? usual.position_radps : usual.attitude_radps) *
                         settling_s(usual) / left_s;
    fail(ErrorKind::Config,
         "[control] {} = {} is so slow that the flight settles for {:.3g} s before it begins, and "
         "at most {:.0f} s are flown in one go; set {:.2g} or more, or leave it out, which sets "
         "{:.3g}",
         is_position ? "position_radps" : "attitude_radps",
         is_position ? control_.position_radps : control_.attitude_radps, settles_s, kMostFlown_s,
         least, is_position ? usual.position_radps : usual.attitude_radps);
  }

  void check_flown_height(const FlownMotion& flown, const TrajectoryContext& context) const {
    constexpr double kFaster = 2.0;
    const LowestPlace lowest = lowest_place_of(flown, kFaster * max_speed_mps_, context);
    if (!context.is_on_surface)
      refuse_too_low(lowest, min_agl_m_, "raise the waypoints by as much as it is blown down");
  }

  void check_ground(const LeastSnapCurve& curve, const TrajectoryContext& context) const {
    TERRACAST_CHECK(context.ground_height_m, "trajectories are held against the ground");
    constexpr double kSpacing_m = 5.0, kFewestSamples = 64.0;
    LowestPlace lowest{
        .agl_m = std::numeric_limits<double>::infinity(), .time_s = 0.0, .place = {}};
    for (std::size_t i = 0; i < curve.num_pieces(); ++i) {
      const double most_m = peaks_of(curve, i).speed_mps.size * curve.piece_s(i);
      const double count = std::max(std::ceil(most_m / kSpacing_m), kFewestSamples);
      for (double k = i == 0 ? 0.0 : 1.0; k <= count; k += 1.0) {
        const double time_s = curve.knots_s()[i] + curve.piece_s(i) * k / count;
        const Geodetic place = context.frame.geodetic_from_world(curve.at(time_s).position);
        const double agl_m =
            agl_on_path_m(place, context, [&] { return fmt::format("at t = {:.1f} s", time_s); });
        if (agl_m < lowest.agl_m) lowest = {agl_m, time_s, place};
      }
    }
    if (context.is_on_surface) return;
    const std::size_t piece = curve.piece_at(lowest.time_s);
    refuse_too_low(lowest, min_agl_m_,
                   fmt::format("raise waypoint {} or {} (counted from 0), or add one between",
                               piece, (piece + 1) % waypoints_.size()));
  }

  std::vector<Place> waypoints_;
  bool is_closed_ = false;
  double laps_ = 1.0;
  double max_speed_mps_ = 8.0;
  double max_acceleration_mps2_ = 4.0;
  double max_jerk_mps3_ = 15.0;
  std::string timing_ = "shortest";
  std::string heading_ = "path";
  double heading_deg_ = 0.0;
  std::vector<Place> look_at_;
  Quadrotor vehicle_;
  double min_agl_m_ = 5.0;
  std::string mode_ = "flat";
  static constexpr double kMaxOff_m = 2.0;
  double max_off_m_ = kMaxOff_m;
  FlightControl control_;
  WindOptions wind_;
};

}  // namespace

TrajectoryKindInfo quadrotor_trajectory() {
  return {.name = "quadrotor",
          .summary =
              "A quadrotor's flight of least snap through places, within limits of speed, "
              "acceleration and jerk.",
          .make = [] { return std::unique_ptr<TrajectoryKind>(new QuadrotorFlight); }};
}

}  // namespace terracast::geo
