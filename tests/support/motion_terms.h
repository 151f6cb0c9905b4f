#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "geo/body_state.h"

/// Motions about a frame's time, written out once more from their definition.
namespace terracast::test {

/// Terms that count as much as the motions of tests do.
inline geo::MotionTerms lively_terms() {
  geo::MotionTerms terms;
  terms.reach_s = 0.1;
  terms.position_world = {Eigen::Vector3d(3.0, -2.0, 1.0), {-5.0, 4.0, 2.0}, {4.0, 6.0, -8.0}};
  terms.turning_body = {
      Eigen::Vector3d(0.5, -0.3, 0.4), {-0.6, 0.8, 0.5}, {1.0, 1.0, -1.0}, {2.0, -1.0, 1.0}};
  return terms;
}

/// A body so much after a frame's time.
struct BodyThen {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d place;

  BodyThen(const geo::BodyState& state, double t)
      : rotation(state.world_from_body.rotation.toRotationMatrix()),
        place(state.world_from_body.translation + t * state.velocity_world_mps +
              0.5 * t * t * state.acceleration_world_mps2) {
    const geo::MotionTerms& terms = state.terms;
    const double inside_s = std::clamp(t, -terms.reach_s, terms.reach_s);
    const auto add = [&](const auto& vectors, int power, Eigen::Vector3d& sum) {
      for (const Eigen::Vector3d& vector : vectors) {
        sum +=
            (std::pow(inside_s, power) + (t - inside_s) * power * std::pow(inside_s, power - 1)) *
            vector;
        ++power;
      }
    };
    add(terms.position_world, 3, place);
    Eigen::Vector3d turn = t * (state.angular_velocity_body_radps - terms.spin_body_radps);
    add(terms.turning_body, 2, turn);
    for (const Eigen::Vector3d& vector : {turn, Eigen::Vector3d(t * terms.spin_body_radps)})
      if (vector.norm() > 0.0)
        rotation =
            rotation * Eigen::AngleAxisd(vector.norm(), vector.normalized()).toRotationMatrix();
  }
};

}  // namespace terracast::test
