#include "export/oxts.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "geo/paths/path_motion.h"

namespace terracast::exporters {
namespace {

constexpr double kPositionError_m = 1e-6;
constexpr double kVelocityError_mps = 1e-9;

/// Intrinsic turns about up, left and forward, in this order.
struct Angles {
  double roll_rad, pitch_rad, yaw_rad;

  Eigen::Quaterniond level_from_body() const {
    return Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
           Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX());
  }
};

Angles angles_of(const Eigen::Matrix3d& enu_from_body) {
  const Eigen::Matrix3d& r = enu_from_body;
  const double level = std::hypot(r(0, 0), r(1, 0));
  const double pitch_rad = std::atan2(-r(2, 0), level);
  // Nose straight up or down: roll and yaw turn about one axis, and the yaw takes all of it.
  constexpr double kLeastLevel = 1e-9;
  if (level < kLeastLevel) return {0.0, pitch_rad, std::atan2(-r(0, 1), r(1, 1))};
  return {std::atan2(r(2, 1), r(2, 2)), pitch_rad, std::atan2(r(1, 0), r(0, 0))};
}

std::string decimals(const Eigen::Vector3d& values, int count) {
  // Adding 0 turns -0 into 0.
  return fmt::format(" {:.{}f} {:.{}f} {:.{}f}", values.x() + 0.0, count, values.y() + 0.0, count,
                     values.z() + 0.0, count);
}

/// What a packet holds, in the axes of the body and in the east, north, up of its place.
struct Packet {
  geo::Geodetic place;
  Eigen::Matrix3d enu_from_body;
  Eigen::Vector3d velocity_enu, force_body, rate_body;
};

std::string packet(const Packet& p) {
  const Angles angles = angles_of(p.enu_from_body);
  const Eigen::Vector3d velocity_level =
      Eigen::AngleAxisd(-angles.yaw_rad, Eigen::Vector3d::UnitZ()) * p.velocity_enu;
  const Eigen::Quaterniond level_from_body = angles.level_from_body();
  std::string line =
      fmt::format("{:.13f} {:.13f} {:.6f}", p.place.lat_deg, p.place.lon_deg, p.place.height_m);
  line += decimals({angles.roll_rad, angles.pitch_rad, angles.yaw_rad}, 15);
  line += decimals({p.velocity_enu.y(), p.velocity_enu.x(), velocity_level.x()}, 9);
  line += fmt::format(" {:.9f} {:.9f}", velocity_level.y() + 0.0, p.velocity_enu.z() + 0.0);
  line += decimals(p.force_body, 9) + decimals(level_from_body * p.force_body, 9);
  line += decimals(p.rate_body, 12) + decimals(level_from_body * p.rate_body, 12);
  line += fmt::format(" {:.9f} {:.9f}", kPositionError_m, kVelocityError_mps);
  return line + " -1 -1 -1 -1 -1\n";
}

}  // namespace

std::string oxts_packet(const geo::WorldFrame& world, const capture::FrameRecord& record) {
  const Eigen::Vector3d& position_world = record.world_from_body.translation;
  const Eigen::Matrix3d enu_from_world = world.world_from_enu(position_world).transpose();
  const Eigen::Matrix3d enu_from_body =
      enu_from_world * record.world_from_body.rotation.toRotationMatrix();
  return packet(
      {.place = world.geodetic_from_world(position_world),
       .enu_from_body = enu_from_body,
       .velocity_enu = enu_from_world * record.velocity_world_mps,
       .force_body = enu_from_body.transpose() * (enu_from_world * record.acceleration_world_mps2 +
                                                  geo::kGravity_mps2 * Eigen::Vector3d::UnitZ()),
       .rate_body = record.angular_velocity_body_radps});
}

std::string oxts_packet_of_imu(const ImuState& state, const geo::Rigid3d& body_from_imu) {
  const geo::Rigid3d ecef_from_body = state.ecef_from_sensor * body_from_imu.inverse();
  const geo::Geodetic place = geo::geodetic_from_ecef(ecef_from_body.translation);
  const Eigen::Quaterniond enu_from_ecef =
      geo::WorldFrame(place).ecef_from_world().rotation.conjugate();
  const Eigen::Vector3d rate_body = body_from_imu.rotation * state.rate_on_earth_radps();
  const Eigen::Vector3d velocity_ecef =
      state.velocity_ecef_mps -
      ecef_from_body.rotation * rate_body.cross(body_from_imu.translation);
  return packet({.place = place,
                 .enu_from_body = (enu_from_ecef * ecef_from_body.rotation).toRotationMatrix(),
                 .velocity_enu = enu_from_ecef * velocity_ecef,
                 .force_body = body_from_imu.rotation * state.accel_mps2,
                 .rate_body = body_from_imu.rotation * state.gyro_radps});
}

std::string oxts_format() {
  return "lat:           latitude on WGS84, deg\n"
         "lon:           longitude on WGS84, deg\n"
         "alt:           height above the WGS84 ellipsoid, m\n"
         "roll:          rad, positive with the left side up\n"
         "pitch:         rad, positive with the nose down\n"
         "yaw:           rad, 0 east, counter-clockwise\n"
         "vn:            velocity to the north, m/s\n"
         "ve:            velocity to the east, m/s\n"
         "vf:            velocity forward, level, m/s\n"
         "vl:            velocity to the left, level, m/s\n"
         "vu:            velocity upwards, m/s\n"
         "ax:            specific force along the body's x (forward), m/s^2\n"
         "ay:            specific force along the body's y (left), m/s^2\n"
         "az:            specific force along the body's z (up), m/s^2\n"
         "af:            specific force forward, level, m/s^2\n"
         "al:            specific force to the left, level, m/s^2\n"
         "au:            specific force upwards, m/s^2\n"
         "wx:            turn rate about the body's x, rad/s\n"
         "wy:            turn rate about the body's y, rad/s\n"
         "wz:            turn rate about the body's z, rad/s\n"
         "wf:            turn rate about forward, level, rad/s\n"
         "wl:            turn rate about left, level, rad/s\n"
         "wu:            turn rate about up, rad/s\n"
         "pos_accuracy:  largest error of the position, m\n"
         "vel_accuracy:  largest error of the velocity, m/s\n"
         "navstat:       -1: there is no satellite receiver\n"
         "numsats:       -1: the same\n"
         "posmode:       -1: the same\n"
         "velmode:       -1: the same\n"
         "orimode:       -1: the same\n";
}

}  // namespace terracast::exporters
