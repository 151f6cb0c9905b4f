#include "job/traffic/rail_car.h"

#include <cmath>

namespace terracast::job {
namespace {

using Eigen::Vector2d;

Vector2d left_of(const Vector2d& direction) { return {-direction.y(), direction.x()}; }

/// The place behind the front pivot at which a chord of the pivots' distance ends, by Newton's rule.
double rear_of(const PathCurve& curve, double front_m, const Vector2d& front, double pivots_m) {
  double rear_m = front_m - pivots_m;
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    const PathCurve::Place rear = curve.at(rear_m);
    const Vector2d chord = front - rear.at_world;
    rear_m -= (pivots_m - chord.norm()) / (chord.normalized().dot(rear.tangent));
  }
  return rear_m;
}

}  // namespace

CarMotion car_motion(const PathCurve& curve, double front_m, const Drive::Progress& progress,
                     double pivots_m) {
  const PathCurve::Place front = curve.at(front_m);
  CarMotion car;
  car.rear_m = rear_of(curve, front_m, front.at_world, pivots_m);
  const PathCurve::Place rear = curve.at(car.rear_m);
  const Vector2d chord = front.at_world - rear.at_world;
  car.at_world = 0.5 * (front.at_world + rear.at_world);
  car.forward = chord.normalized();
  // The distance of the pivots stays: along the chord both move alike.
  const double speed = progress.speed_mps;
  const double rear_speed = speed * chord.dot(front.tangent) / chord.dot(rear.tangent);
  const Vector2d of_front = speed * front.tangent, of_rear = rear_speed * rear.tangent;
  const Vector2d opening = of_front - of_rear;
  car.velocity_mps = 0.5 * (of_front + of_rear);
  car.turning_radps = left_of(car.forward).dot(opening) / chord.norm();
  const Vector2d front_acceleration =
      progress.acceleration_mps2 * front.tangent +
      speed * speed * front.curvature_per_m * left_of(front.tangent);
  const Vector2d rear_bend = rear_speed * rear_speed * rear.curvature_per_m * left_of(rear.tangent);
  const double rear_along =
      (chord.dot(front_acceleration - rear_bend) + opening.squaredNorm()) / chord.dot(rear.tangent);
  car.acceleration_mps2 = 0.5 * (front_acceleration + rear_along * rear.tangent + rear_bend);
  return car;
}

}  // namespace terracast::job
