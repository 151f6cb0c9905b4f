#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "geo/gravity.h"
#include "geo/vehicles/flown_motion.h"
#include "geo/vehicles/rigid_body.h"

/// Flights by the equations of motion of a vehicle under control, in steps of 1 ms, as curves with nodes every 20 ms.
namespace terracast::geo {

/// How a flight went.
struct FlightReport {
  double most_off_m = 0.0;  ///< largest distance from the planned place at the same time
  double most_off_s = 0.0;  ///< when
  double saturated_s =
      0.0;  ///< how long the vehicle was to do more than it can, also before time 0
  double first_saturated_s = 0.0;
};

/// For so long after its end a flight goes on, so that shutters and sensors may look there.
inline constexpr double kFlownBeyond_s = 1.0;
/// Longest time that is flown in one go, with those before and after the flight.
inline constexpr double kMostFlown_s = 3600.0;
inline constexpr double kFlownStep_s = 1e-3;

/// The rotation with three derivatives, from turn rates against the stars and their derivatives.
Jet<Eigen::Vector4d> rotation_jet(const Eigen::Quaterniond& rotation,
                                  const Eigen::Vector3d& turn_rate,
                                  const Eigen::Vector3d& turn_rate_first,
                                  const Eigen::Vector3d& turn_rate_second,
                                  const Eigen::Vector3d& earth_rate_world);

/// What a vehicle's dynamics are to flown_along(): `State` with a rigid body first, whose position counts from an anchor,
/// and `kAirWay`; rates(time_s, state), start(time_s), planned(time_s), place_world(state), anchor_world(),
/// move_anchor(state), is_saturated(time_s, state).

/// Second derivative of a state by time: how its derivative changes along itself, by central differences of the fourth order.
template <class Dynamics>
typename Dynamics::State second_rates(const Dynamics& dynamics, double time_s,
                                      const typename Dynamics::State& state,
                                      const typename Dynamics::State& rates) {
  using State = typename Dynamics::State;
  constexpr double kNear_s = 2e-4;
  const auto along = [&](double offset_s) {
    return dynamics.rates(time_s + offset_s, State(state + offset_s * rates));
  };
  return (8.0 * (along(kNear_s) - along(-kNear_s)) -
          (along(2.0 * kNear_s) - along(-2.0 * kNear_s))) /
         (12.0 * kNear_s);
}

template <class Dynamics>
FlownMotion::Node node_of(const WorldFrame& frame, const Dynamics& dynamics, double time_s,
                          const typename Dynamics::State& state) {
  using State = typename Dynamics::State;
  const State rates = dynamics.rates(time_s, state);
  const State second = second_rates(dynamics, time_s, state, rates);
  return {.moved_world = state.template segment<3>(rigid_state::kPosition),
          .velocity = state.template segment<3>(rigid_state::kVelocity),
          .acceleration = rates.template segment<3>(rigid_state::kVelocity),
          .jerk = second.template segment<3>(rigid_state::kVelocity),
          .rotation = rotation_jet(
              rotation_in(state), state.template segment<3>(rigid_state::kTurnRate),
              rates.template segment<3>(rigid_state::kTurnRate),
              second.template segment<3>(rigid_state::kTurnRate), earth_rate_world_radps(frame)),
          .air_way = state.template segment<3>(Dynamics::kAirWay),
          .air_way_rate = rates.template segment<3>(Dynamics::kAirWay)};
}

/// A flight from `before_s` before time 0 on, from where it begins in the planned state.
/// more_before   times max_off_m that it may come off while it settles
/// refuse        refuse(planned, off_m, limit_text): throws; limit_text is "max_off_m = 2" or what else it was
/// report        filled, also when it fails
template <class Dynamics, class Refuse>
std::unique_ptr<FlownMotion> flown_along(const WorldFrame& frame, Dynamics& dynamics,
                                         double before_s, double duration_s, double max_off_m,
                                         double more_before, FlightReport& report,
                                         const Refuse& refuse) {
  using State = typename Dynamics::State;
  constexpr int kStepsANode = 20;
  constexpr double kNode_s = kStepsANode * kFlownStep_s;
  TERRACAST_CHECK(before_s + duration_s + kFlownBeyond_s <= kMostFlown_s,
                  "flights are bounded before they are flown");
  const auto nodes_before = static_cast<int>(std::ceil(before_s / kNode_s));
  const auto nodes_after = static_cast<int>(std::ceil((duration_s + kFlownBeyond_s) / kNode_s));
  // Times are multiples of the step, so that they are the same for any number of nodes before them.
  const auto time_of = [&](int node, int step) {
    return (node * kStepsANode + step) * kFlownStep_s;
  };
  report = {};
  State state = dynamics.start(time_of(-nodes_before, 0));
  const Eigen::Vector3d begin_world = dynamics.anchor_world();
  std::vector<FlownMotion::Node> nodes = {
      node_of(frame, dynamics, time_of(-nodes_before, 0), state)};
  const auto rates = [&](double time_s, const State& at) { return dynamics.rates(time_s, at); };
  for (int node = -nodes_before; node < nodes_after; ++node) {
    for (int step = 0; step < kStepsANode; ++step) {
      const double time_s = time_of(node, step);
      const bool counts = time_s >= 0.0 && time_s <= duration_s;
      const MotionState& planned = dynamics.planned(time_s);
      const double off_m =
          (dynamics.place_world(state) - planned.world_from_body.translation).norm();
      if (counts && off_m > report.most_off_m) {
        report.most_off_m = off_m;
        report.most_off_s = time_s;
      }
      if (dynamics.is_saturated(time_s, state)) {
        if (report.saturated_s == 0.0) report.first_saturated_s = time_s;
        report.saturated_s += kFlownStep_s;
      }
      if (!(off_m <= (counts ? max_off_m : more_before * max_off_m)))
        refuse(planned, off_m,
               counts ? fmt::format("max_off_m = {}", max_off_m)
                      : fmt::format("{:.0f} times max_off_m = {} while it settles", more_before,
                                    max_off_m));
      state = runge_kutta_step(state, time_s, kFlownStep_s, rates);
    }
    nodes.push_back(node_of(frame, dynamics, time_of(node + 1, 0), state));
    dynamics.move_anchor(state);
  }
  return std::make_unique<FlownMotion>(time_of(-nodes_before, 0), kNode_s, begin_world, nodes,
                                       duration_s);
}

}  // namespace terracast::geo
