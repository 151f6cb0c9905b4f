#include "geo/paths/changing.h"

#include <Eigen/Geometry>
#include <cmath>

#include "geo/units.h"

namespace terracast::geo {
namespace {

/// Second derivative, along w, of the point of the ellipsoid whose normal is u, where u moves with a
/// constant velocity w. That point is D u / sqrt(u.D u), D = diag(a^2, a^2, b^2).
Eigen::Vector3d foot_second(const Eigen::Vector3d& u, const Eigen::Vector3d& w,
                            const Eigen::Vector3d& polar_axis) {
  constexpr double kA2 = kWgs84SemiMajorAxis_m * kWgs84SemiMajorAxis_m;
  constexpr double kB2 = kA2 * (1.0 - kWgs84Flattening) * (1.0 - kWgs84Flattening);
  const auto scaled = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
    return kA2 * v + (kB2 - kA2) * polar_axis.dot(v) * polar_axis;
  };
  const Eigen::Vector3d du = scaled(u), dw = scaled(w);
  const double q0 = u.dot(du), q1 = u.dot(dw), q2 = w.dot(dw);
  const double root = std::sqrt(q0);
  const double inverse_rate = -q1 / (q0 * root);
  const double inverse_second = (3.0 * q1 * q1 / q0 - q2) / (q0 * root);
  return inverse_second * du + 2.0 * inverse_rate * dw;
}

}  // namespace

Eigen::Vector3d polar_axis_of(const WorldFrame& frame) {
  return frame.ecef_from_world().rotation.conjugate() * Eigen::Vector3d::UnitZ();
}

Changing normalised(const Changing& v) {
  const double length = v.value.norm();
  const Eigen::Vector3d unit = v.value / length;
  const double length_rate = unit.dot(v.rate);
  const Eigen::Vector3d rate = (v.rate - unit * length_rate) / length;
  const double length_second = rate.dot(v.rate) + unit.dot(v.second);
  return {unit, rate, (v.second - 2.0 * length_rate * rate - length_second * unit) / length};
}

Changing crossed(const Changing& a, const Changing& b) {
  return {a.value.cross(b.value), a.rate.cross(b.value) + a.value.cross(b.rate),
          a.second.cross(b.value) + 2.0 * a.rate.cross(b.rate) + a.value.cross(b.second)};
}

Changing without(const Changing& v, const Changing& unit) {
  const double along = unit.value.dot(v.value);
  const double along_rate = unit.rate.dot(v.value) + unit.value.dot(v.rate);
  const double along_second =
      unit.second.dot(v.value) + 2.0 * unit.rate.dot(v.rate) + unit.value.dot(v.second);
  return {
      v.value - along * unit.value, v.rate - along_rate * unit.value - along * unit.rate,
      v.second - along_second * unit.value - 2.0 * along_rate * unit.rate - along * unit.second};
}

// The normal turns by the ellipsoid's two curvatures: in the
// meridian by north speed / (M + h), across it by east speed / (N + h). Its second derivative is what
// makes that of (foot of the point) + height * normal the point's acceleration.
Changing up_along(const WorldFrame& frame, const Eigen::Vector3d& position,
                  const Eigen::Vector3d& velocity, const Eigen::Vector3d& acceleration) {
  const Geodetic place = frame.geodetic_from_world(position);
  const Eigen::Matrix3d enu = frame.world_from_enu(position);
  const double sin_lat = std::sin(radians_from_degrees(place.lat_deg));
  const double e2 = kWgs84Flattening * (2.0 - kWgs84Flattening);
  const double w2 = 1.0 - e2 * sin_lat * sin_lat;
  const double prime_vertical_m = kWgs84SemiMajorAxis_m / std::sqrt(w2);
  const double meridian_m = prime_vertical_m * (1.0 - e2) / w2;
  const Eigen::Vector3d rate =
      enu.col(0) * (enu.col(0).dot(velocity) / (prime_vertical_m + place.height_m)) +
      enu.col(1) * (enu.col(1).dot(velocity) / (meridian_m + place.height_m));
  const Eigen::Vector3d left = acceleration - foot_second(enu.col(2), rate, polar_axis_of(frame)) -
                               2.0 * enu.col(2).dot(velocity) * rate;
  return {enu.col(2), rate,
          enu.col(0) * (enu.col(0).dot(left) / (prime_vertical_m + place.height_m)) +
              enu.col(1) * (enu.col(1).dot(left) / (meridian_m + place.height_m)) -
              rate.squaredNorm() * enu.col(2)};
}

Turning turning_of(const Changing& forward, const Changing& left, const Changing& up) {
  Eigen::Matrix3d world_from_axes;
  world_from_axes << forward.value, left.value, up.value;
  // Each axis e turns as w x e, and the sum of e x (w x e) over three axes is 2 w.
  const Eigen::Vector3d angular_velocity =
      0.5 *
      (forward.value.cross(forward.rate) + left.value.cross(left.rate) + up.value.cross(up.rate));
  const Eigen::Vector3d angular_acceleration =
      0.5 * (forward.value.cross(forward.second) + left.value.cross(left.second) +
             up.value.cross(up.second));
  return {Eigen::Quaterniond(world_from_axes), world_from_axes.transpose() * angular_velocity,
          world_from_axes.transpose() * angular_acceleration};
}

// With p the vector and q = p / |p|, the body turns at 2 q* q' (its vector part), which changes at
// 2 q* q'': the other term, q'* q', has no vector part.
Turning turning_of_parts(const Eigen::Vector4d& value, const Eigen::Vector4d& rate,
                         const Eigen::Vector4d& second) {
  const double length = value.norm();
  const Eigen::Vector4d unit = value / length;
  const double length_rate = unit.dot(rate);
  const Eigen::Vector4d unit_rate = (rate - unit * length_rate) / length;
  const double length_second = unit_rate.dot(rate) + unit.dot(second);
  const Eigen::Vector4d unit_second =
      (second - 2.0 * length_rate * unit_rate - length_second * unit) / length;
  const Eigen::Quaterniond rotation(unit[0], unit[1], unit[2], unit[3]);
  const Eigen::Quaterniond turning(unit_rate[0], unit_rate[1], unit_rate[2], unit_rate[3]);
  const Eigen::Quaterniond changing(unit_second[0], unit_second[1], unit_second[2], unit_second[3]);
  return {rotation, 2.0 * (rotation.conjugate() * turning).vec(),
          2.0 * (rotation.conjugate() * changing).vec()};
}

}  // namespace terracast::geo
