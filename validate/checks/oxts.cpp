#include <fmt/format.h>

#include <algorithm>

#include "validate/checks/checker.h"
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
struct Motion {
  Pose local_from_imu;
  Eigen::Vector3d velocity;
  Eigen::Vector3d acceleration;
  Eigen::Vector3d rate_imu;
};

Motion motion_of(const OxtsPacket& packet, const Pose& local_from_ecef) {
  const Eigen::Matrix3d local_from_enu =
      local_from_ecef.rotation * enu_from_ecef(packet.place).transpose();
  return {local_from_ecef * packet.ecef_from_imu(), local_from_enu * packet.velocity_enu_mps,
          local_from_enu * (packet.enu_from_imu() * packet.force_imu_mps2 -
                            kGravity_mps2 * Eigen::Vector3d::UnitZ()),
          packet.rate_imu_radps};
}

/// What packets say over a step, held against what they differ by.
struct Quantity {
  /// What is left of the differences when the mean is taken off.
  Eigen::Vector3d (*residual)(const Motion& from, const Motion& to, double step_s);
  /// What the mean would be off by if all change happened at one end of the step.
  Eigen::Vector3d (*variation)(const Motion& from, const Motion& to, double step_s);
};

/// The mean of the velocities is that of the trapezoid with its ends' accelerations: exact for
/// motions of the fourth degree.
constexpr Quantity kVelocity = {
    [](const Motion& from, const Motion& to, double step_s) -> Eigen::Vector3d {
      return (to.local_from_imu.translation - from.local_from_imu.translation) / step_s -
             0.5 * (from.velocity + to.velocity) +
             (step_s / 12.0) * (to.acceleration - from.acceleration);
    },
    [](const Motion& from, const Motion& to, double step_s) -> Eigen::Vector3d {
      return (step_s / 12.0) * (to.acceleration - from.acceleration);
    }};
constexpr Quantity kAcceleration = {
    [](const Motion& from, const Motion& to, double step_s) -> Eigen::Vector3d {
      return (to.velocity - from.velocity) / step_s - 0.5 * (from.acceleration + to.acceleration);
    },
    [](const Motion& from, const Motion& to, double) -> Eigen::Vector3d {
      return 0.5 * (to.acceleration - from.acceleration);
    }};
constexpr Quantity kTurnRate = {
    [](const Motion& from, const Motion& to, double step_s) -> Eigen::Vector3d {
      const Eigen::Matrix3d turn =
          from.local_from_imu.rotation.transpose() * to.local_from_imu.rotation;
      return rotation_vector(turn) / step_s - 0.5 * (from.rate_imu + to.rate_imu);
    },
    [](const Motion& from, const Motion& to, double) -> Eigen::Vector3d {
      return 0.5 * (to.rate_imu - from.rate_imu);
    }};

/// Medians of sizes over all steps.
struct Agreement {
  double value = 0.0;      ///< of the residuals
  double curvature = 0.0;  ///< of what residuals of one step and of two differ by
  double variation = 0.0;
  std::size_t num_steps = 0;
  std::size_t worst_frame = 0;
};

Agreement agreement_of(const std::vector<std::optional<Motion>>& motions, double step_s,
                       const Quantity& quantity) {
  Agreement agreement;
  std::vector<double> sizes, curvatures, variations;
  double largest = -1.0;
  for (std::size_t i = 0; i + 1 < motions.size(); ++i) {
    if (!motions[i] || !motions[i + 1]) continue;
    const Eigen::Vector3d one = quantity.residual(*motions[i], *motions[i + 1], step_s);
    sizes.push_back(one.norm());
    variations.push_back(quantity.variation(*motions[i], *motions[i + 1], step_s).norm());
    if (one.norm() > largest) {
      largest = one.norm();
      agreement.worst_frame = i;
    }
    if (i + 2 >= motions.size() || !motions[i + 2]) continue;
    const Eigen::Vector3d next = quantity.residual(*motions[i + 1], *motions[i + 2], step_s);
    const Eigen::Vector3d two = quantity.residual(*motions[i], *motions[i + 2], 2.0 * step_s);
    curvatures.push_back((two - 0.5 * (one + next)).norm());
  }
  agreement.num_steps = sizes.size();
  agreement.value = median(sizes);
  agreement.curvature = median(curvatures);
  agreement.variation = median(variations);
  return agreement;
}

struct Description {
  const char* name;
  double bound;
  const char* unit;
  const char* summary;
  const char* reason;
  const char* detects;
};

CheckResult result_of(const Agreement& agreement, double unit, const Description& description) {
  if (agreement.num_steps < 2)
    return unseen_result(description.name, "fewer than three packets in a row");
  CheckResult result;
  result.name = description.name;
  result.value = agreement.value / unit;
  result.bound = description.bound;
  result.unit = description.unit;
  const double curvature = agreement.curvature / unit;
  // What the motion does between frames grows with the step, fourfold and more, until a step holds a
  // whole turn of it; a mistake does not. Residuals of a right dataset are a third of what they grow
  // by, or of the changes in a step.
  result.skipped = result.is_unseen =
      !result.is_within_bound() && curvature > result.bound &&
      result.value <= 0.5 * std::max(curvature, agreement.variation / unit);
  result.ok = result.skipped || result.is_within_bound();
  result.worst =
      result.skipped
          ? fmt::format("frames are too far apart: what the motion does between them is {:.2g} {}",
                        curvature, result.unit)
          : fmt::format("largest between frames {} and {}", agreement.worst_frame,
                        agreement.worst_frame + 1);
  result.summary =
      fmt::format("{} Median of {} steps; what two steps differ by from one is {:.2g}.",
                  description.summary, agreement.num_steps, curvature);
  result.reason = description.reason;
  result.detects = description.detects;
  return result;
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
    std::vector<std::optional<Motion>> motions;
    std::vector<double> speeds_mps;
    for (const std::optional<OxtsPacket>& packet : sequence.oxts) {
      motions.emplace_back();
      if (!packet) continue;
      motions.back() = motion_of(*packet, local_from_ecef);
      speeds_mps.push_back(motions.back()->velocity.norm());
    }
    const double step_s = 1.0 / sequence.rate_hz;
    // Where hardly anything moves, against 1 m/s.
    const double speed_mps = std::max(median(speeds_mps), 1.0);
    std::vector<CheckResult> results;
    results.push_back(
        result_of(agreement_of(motions, step_s, kVelocity), 0.01 * speed_mps,
                  {"oxts_velocity", 0.05, "%",
                   "Steps between the places of packets against the mean of their velocities, by "
                   "the speed.",
                   "Half the smallest error that must be found.",
                   "0.1 % of velocity; north and east swapped; velocities of another frame"}));
    results.push_back(
        result_of(agreement_of(motions, step_s, kAcceleration), 1.0,
                  {"oxts_acceleration", 0.05, "m/s^2",
                   "Changes of velocity between packets against the mean of their specific forces, "
                   "turned into the east, north, up of their places, less gravity.",
                   "Half the smallest error that must be found.",
                   "0.1 m/s^2; gravity that is missing or points down; forces in level axes"}));
    results.push_back(result_of(
        agreement_of(motions, step_s, kTurnRate), radians_from_degrees(1.0),
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
