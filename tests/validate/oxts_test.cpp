#include "validate/readers/oxts.h"

#include <gtest/gtest.h>

#include <map>

#include "core/error.h"
#include "validate/checks/checker.h"

/// The check of inertial packets on a circle in closed form, at frames near and far apart.
namespace terracast::validate {
namespace {

/// Speed 30 m/s on a level circle of 300 m about a place, left-hand.
Sequence circle(double step_s, double velocity_factor = 1.0) {
  Sequence sequence;
  sequence.origin = {42.5, 1.5, 1200.0};
  sequence.rate_hz = 1.0 / step_s;
  sequence.num_frames = 12;
  const double rate_radps = 0.1, radius_m = 300.0, gravity_mps2 = 9.80665;
  const Pose ecef_from_scene = ecef_from_local(sequence.origin);
  for (int i = 0; i < sequence.num_frames; ++i) {
    const double angle_rad = rate_radps * step_s * i;
    const Eigen::Vector3d outward(std::cos(angle_rad), std::sin(angle_rad), 0.0);
    const Eigen::Vector3d ahead(-outward.y(), outward.x(), 0.0);
    OxtsPacket packet;
    packet.place = geodetic_from_ecef(ecef_from_scene * Eigen::Vector3d(radius_m * outward));
    const Eigen::Matrix3d enu_from_scene = enu_from_ecef(packet.place) * ecef_from_scene.rotation;
    const Eigen::Vector3d nose = enu_from_scene * ahead;
    packet.yaw_rad = std::atan2(nose.y(), nose.x());
    packet.velocity_enu_mps = velocity_factor * radius_m * rate_radps * nose;
    packet.velocity_level_mps =
        (packet.enu_from_level().transpose() * packet.velocity_enu_mps).head<2>();
    const Eigen::Vector3d force_enu =
        enu_from_scene * (-radius_m * rate_radps * rate_radps * outward) +
        gravity_mps2 * Eigen::Vector3d::UnitZ();
    packet.force_imu_mps2 = packet.force_level_mps2 = packet.enu_from_imu().transpose() * force_enu;
    packet.rate_imu_radps = packet.rate_level_radps = rate_radps * Eigen::Vector3d::UnitZ();
    sequence.oxts.emplace_back(packet);
  }
  return sequence;
}

std::map<std::string, CheckResult> check(const Sequence& sequence) {
  std::map<std::string, CheckResult> results;
  for (const CheckInfo& info : checks())
    if (info.name == "oxts")
      for (const CheckResult& result : info.make({})->finish({}, sequence))
        results[result.name] = result;
  return results;
}

TEST(ValidateOxts, ACircleIsRight) {
  for (const double step_s : {0.1, 1.0})
    for (const auto& [name, result] : check(circle(step_s))) {
      EXPECT_TRUE(result.ok) << name << " = " << result.value << " " << result.worst;
      EXPECT_EQ(result.skipped, name.starts_with("oxts_pose")) << name << " " << result.worst;
    }
}

/// Half a radian from frame to frame: differences say nothing of the motion between.
TEST(ValidateOxts, FramesFarApartAreUnseenNotWrong) {
  const auto results = check(circle(8.0));
  for (const char* name : {"oxts_velocity", "oxts_acceleration"}) {
    EXPECT_TRUE(results.at(name).ok) << results.at(name).value;
    EXPECT_TRUE(results.at(name).is_unseen) << name << " = " << results.at(name).value;
  }
}

TEST(ValidateOxts, WrongVelocitiesAreFoundAtAnyRate) {
  EXPECT_FALSE(check(circle(0.1, 1.001)).at("oxts_velocity").ok);
  EXPECT_FALSE(check(circle(1.0, 1.001)).at("oxts_velocity").ok);
  EXPECT_FALSE(check(circle(8.0, 1.05)).at("oxts_velocity").ok);
}

TEST(ValidateOxts, GarbageIsAnInputError) {
  std::string packet = "42 1 900";
  for (int i = 3; i < 23; ++i) packet += " 0";
  packet += " 1e-6 1e-9 -1 -1 -1 -1 -1";  // accuracies, and that there is no receiver
  EXPECT_EQ(parse_oxts(packet + "\n", "f").place.height_m, 900.0);
  for (const std::string& text : {std::string(), packet + " 0\n", packet + "\n" + packet,
                                  "91" + packet.substr(2), "nan" + packet.substr(2)})
    EXPECT_THROW(parse_oxts(text, "f"), core::Error) << text;
}

}  // namespace
}  // namespace terracast::validate
