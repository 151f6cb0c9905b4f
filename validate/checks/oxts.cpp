#include <fmt/format.h>

#include <algorithm>

#include "validate/checks/checker.h"
#include "validate/checks/motion_agreement.h"
#include "validate/sampling.h"

/// Packets of an inertial unit: velocity, specific force and turn rate against the differences of
/// the places and attitudes of the packets around them, in one frame for all; the level values
/// against the same in other axes; the packets' poses against those of the file beside them. Places
/// and attitudes as such are the poses that every other check works with.
namespace terracast::validate {

namespace {

/// What forces are given against: standard gravity, upwards.
constexpr double kGravity_mps2 = 9.80665;

/// A packet in the sequence's local frame.
StatedMotion motion_of(const OxtsPacket& packet, const Pose& local_from_ecef) {
  const Eigen::Matrix3d local_from_enu =
      local_from_ecef.rotation * enu_from_ecef(packet.place).transpose();
  return {local_from_ecef * packet.ecef_from_imu(), local_from_enu * packet.velocity_enu_mps,
          local_from_enu * (packet.enu_from_imu() * packet.force_imu_mps2 -
                            kGravity_mps2 * Eigen::Vector3d::UnitZ()),
          packet.rate_imu_radps};
}

/// The same vector in level axes, and what a packet says of it there.
double contradiction(const OxtsPacket& packet) {
  const Eigen::Vector3d velocity_level =
      packet.enu_from_level().transpose() * packet.velocity_enu_mps;
  return std::max(
      {(velocity_level.head<2>() - packet.velocity_level_mps).norm(),
       (packet.level_from_imu * packet.force_imu_mps2 - packet.force_level_mps2).norm(),
       (packet.level_from_imu * packet.rate_imu_radps - packet.rate_level_radps).norm()});
}

CheckResult levelled_result(const Sequence& sequence) {
  CheckResult result;
  result.name = "oxts_levelled";
  result.bound = 1e-6;
  result.unit = "m/s, m/s^2, rad/s";
  for (std::size_t i = 0; i < sequence.oxts.size(); ++i)
    if (sequence.oxts[i])
      note_worst(result, contradiction(*sequence.oxts[i]), fmt::format("frame {}", i));
  result.ok = result.is_within_bound();
  result.summary =
      "Largest difference between velocity, force and turn rate in level axes (forward, left, up), "
      "and the same turned there from the other axes by the packet's angles.";
  result.reason = "Nine decimals leave 2e-9.";
  result.detects = "a sign, an order or an angle in one value of one packet";
  return result;
}

/// Poses of the packets, relative to the first, against those of the file beside them.
std::vector<CheckResult> pose_results(const Sequence& sequence) {
  CheckResult position, rotation;
  position.name = "oxts_pose_position";
  position.bound = 1e-3;
  position.unit = "m";
  rotation.name = "oxts_pose_rotation";
  rotation.bound = 1e-3;
  rotation.unit = "deg";
  const std::vector<Pose>& stated = sequence.first_from_camera0;
  if (stated.empty())
    return {skipped_result(position.name, "no poses beside the packets"),
            skipped_result(rotation.name, "no poses beside the packets")};
  const auto ecef_from_camera0 = [&](std::size_t frame) {
    return sequence.oxts[frame]->ecef_from_imu() * sequence.camera0_from_imu.inverse();
  };
  for (std::size_t i = 0; i < sequence.oxts.size() && i < stated.size(); ++i) {
    if (!sequence.oxts[0] || !sequence.oxts[i]) continue;
    const Pose found = ecef_from_camera0(0).inverse() * ecef_from_camera0(i);
    const std::string where = fmt::format("frame {}", i);
    note_worst(position, (found.translation - stated[i].translation).norm(), where);
    note_worst(
        rotation,
        degrees_from_radians(rotation_angle_rad(found.rotation.transpose() * stated[i].rotation)),
        where);
  }
  position.summary =
      "Camera 0 of each frame in camera 0 of the first: by packets, calibration and WGS84, against "
      "poses.txt.";
  position.reason = rotation.reason = "Places are good to 1e-6 m, angles to 1e-9 rad.";
  position.detects = "2 mm; places on a map instead of the globe; axes of another place";
  rotation.summary = "The same for rotations.";
  rotation.detects = "0.01 deg of one packet's angles";
  for (CheckResult* result : {&position, &rotation}) result->ok = result->is_within_bound();
  return {position, rotation};
}

class OxtsChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    if (sequence.oxts.empty())
      return {skipped_result("oxts", "the format holds no packets of an inertial unit")};
    const Pose local_from_ecef = ecef_from_local(sequence.origin).inverse();
    std::vector<std::optional<StatedMotion>> motions;
    for (const std::optional<OxtsPacket>& packet : sequence.oxts) {
      motions.emplace_back();
      if (!packet) continue;
      motions.back() = motion_of(*packet, local_from_ecef);
    }
    const double step_s = 1.0 / sequence.rate_hz;
    const double speed_mps = typical_speed_mps(motions);
    std::vector<CheckResult> results;
    results.push_back(motion_result(
        motions, step_s, kVelocity, 0.01 * speed_mps,
        {"oxts_velocity", 0.05, "%",
         "Steps between the places of packets against the mean of their velocities, by "
         "the speed.",
         "Half the smallest error that must be found.",
         "0.1 % of velocity; north and east swapped; velocities of another frame"}));
    results.push_back(motion_result(
        motions, step_s, kAcceleration, 1.0,
        {"oxts_acceleration", 0.05, "m/s^2",
         "Changes of velocity between packets against the mean of their specific forces, "
         "turned into the east, north, up of their places, less gravity.",
         "Half the smallest error that must be found.",
         "0.1 m/s^2; gravity that is missing or points down; forces in level axes"}));
    results.push_back(motion_result(
        motions, step_s, kTurnRate, radians_from_degrees(1.0),
        {"oxts_turn_rate", 0.05, "deg/s",
         "Turns between the attitudes of packets against the mean of their turn rates.",
         "Half the smallest error that must be found.", "0.1 deg/s; rates in level axes; a sign"}));
    results.push_back(levelled_result(sequence));
    for (CheckResult& result : pose_results(sequence)) results.push_back(std::move(result));
    return results;
  }
};

}  // namespace

std::unique_ptr<Checker> make_oxts_check(const ValidateOptions&) {
  return std::make_unique<OxtsChecker>();
}

}  // namespace terracast::validate
