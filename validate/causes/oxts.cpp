#include <fmt/format.h>

#include <algorithm>

#include "validate/causes/trial.h"

/// KITTI raw's packets: units and axes of their angles, velocities, forces and rates.
namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kGravity_mps2 = 9.80665;

const std::vector<std::string_view> kJudges = {"oxts", "georeference", "reprojection",
                                               "georeference_origin"};

void set_angles(OxtsPacket& packet, double roll_rad, double pitch_rad, double yaw_rad) {
  packet.roll_rad = roll_rad;
  packet.pitch_rad = pitch_rad;
  packet.yaw_rad = yaw_rad;
  packet.level_from_imu = (Eigen::AngleAxisd(pitch_rad, Vector3d::UnitY()) *
                           Eigen::AngleAxisd(roll_rad, Vector3d::UnitX()))
                              .toRotationMatrix();
}

/// The rotation of the packet's axes into the east, north, up of its place, as angles.
void set_rotation(OxtsPacket& packet, const Matrix3d& enu_from_imu) {
  set_angles(packet, std::atan2(enu_from_imu(2, 1), enu_from_imu(2, 2)),
             -std::asin(std::clamp(enu_from_imu(2, 0), -1.0, 1.0)),
             std::atan2(enu_from_imu(1, 0), enu_from_imu(0, 0)));
}

/// Changes all packets and places the cameras by them again. What is level in a packet was made
/// with its angles and stays in its own axes.
bool change(Trial& trial, const std::function<void(OxtsPacket&)>& undo) {
  const Pose local_from_ecef = ecef_from_local(trial.sequence.origin).inverse();
  for (int c = 0; c < trial.num_cameras(); ++c) {
    auto& poses = trial.camera(c).local_from_camera;
    if (trial.sequence.oxts.empty() || !trial.sequence.oxts[0] || poses.empty() || !poses[0])
      return false;
    const Pose imu_from_camera =
        (local_from_ecef * trial.sequence.oxts[0]->ecef_from_imu()).inverse() * *poses[0];
    for (std::size_t f = 0; f < poses.size() && f < trial.sequence.oxts.size(); ++f) {
      if (!trial.sequence.oxts[f]) continue;
      OxtsPacket packet = *trial.sequence.oxts[f];
      undo(packet);
      poses[f] = local_from_ecef * packet.ecef_from_imu() * imu_from_camera;
    }
  }
  for (auto& packet : trial.sequence.oxts)
    if (packet) undo(*packet);
  return true;
}

void add(std::vector<Hypothesis>& hypotheses, const char* name, const char* words, int rank,
         const std::function<void(OxtsPacket&)>& undo) {
  Hypothesis h;
  h.checks = kJudges;
  h.rank = rank;
  h.undo = [=](Trial& trial, Cause& cause) {
    if (!change(trial, undo)) return false;
    cause.name = name;
    cause.words = fmt::format("OXTS packets: {}", words);
    return true;
  };
  hypotheses.push_back(std::move(h));
}

/// Level values made anew from the others, as a packet with the right angles has them.
void level_again(OxtsPacket& packet) {
  packet.velocity_level_mps =
      (packet.enu_from_level().transpose() * packet.velocity_enu_mps).head<2>();
  packet.force_level_mps2 = packet.level_from_imu * packet.force_imu_mps2;
  packet.rate_level_radps = packet.level_from_imu * packet.rate_imu_radps;
}

/// One rotation between the packets' attitudes and georeference.csv's, common to all: the east,
/// north, up of another place.
void add_other_place(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails_result("georeference_rotation")) return;
  Hypothesis h;
  h.checks = kJudges;
  h.rank = 3;
  h.undo = [](Trial& trial, Cause& cause) {
    const Pose ecef_from_frame = ecef_from_local(trial.sequence.origin);
    // Turn of the packets' axes in ECEF: what they are taken in against what they were made in.
    std::vector<Vector3d> turns;
    const Camera& camera = trial.camera(0);
    for (std::size_t f = 0; f < camera.georeference.size(); ++f) {
      if (!camera.georeference[f] || !camera.local_from_camera[f]) continue;
      const Matrix3d right = enu_from_ecef(camera.georeference[f]->place).transpose() *
                             camera.georeference[f]->enu_from_camera;
      turns.push_back(rotation_vector((ecef_from_frame * *camera.local_from_camera[f]).rotation *
                                      right.transpose()));
    }
    if (turns.size() < 2) return false;
    for (const Vector3d& turn : turns)
      if ((turn - turns[0]).norm() > 2e-5) return false;  // 0.001 deg
    const Matrix3d wrong_from_right =
        Eigen::AngleAxisd(turns[0].norm(), turns[0].normalized()).toRotationMatrix();
    // Packets were made in the axes of a place whose own are so turned: enu(own)^T enu(other) is the
    // turn, so that the other place's up is known.
    const Geodetic& place = trial.sequence.oxts[0]->place;
    const Matrix3d other = enu_from_ecef(place) * wrong_from_right;
    const Vector3d up = other.transpose().col(2);
    const double lat_deg = degrees_from_radians(std::asin(std::clamp(up.z(), -1.0, 1.0)));
    const double lon_deg = degrees_from_radians(std::atan2(up.y(), up.x()));
    const Matrix3d enu = enu_from_ecef({lat_deg, lon_deg, 0.0});
    // Only turns that are those of a place: its east is level.
    if ((enu - other).norm() > 5e-5) return false;
    const Vector3d away =
        enu_from_ecef(place) *
        (ecef_from_geodetic({lat_deg, lon_deg, place.height_m}) - ecef_from_geodetic(place));
    const bool is_done = change(trial, [&](OxtsPacket& packet) {
      const Matrix3d own = enu_from_ecef(packet.place);
      set_rotation(packet,
                   own * wrong_from_right.transpose() * own.transpose() * packet.enu_from_imu());
      level_again(packet);
    });
    if (!is_done) return false;
    cause.name = "angles_of_other_place";
    cause.size = 1e-3 * away.head<2>().norm();
    cause.unit = "km";
    cause.words = fmt::format(
        "OXTS packets: angles stand in the east, north, up of a place {:.1f} km east and {:.1f} km "
        "north, as of the world's origin, not in their own place's",
        1e-3 * away.x(), 1e-3 * away.y());
    return true;
  };
  hypotheses.push_back(std::move(h));
}

/// Gravity that was taken off forces, in one set of axes or in both: off the upward axis of the place, or off the upward
/// value of each set, as if the body were level.
void add_gravity(std::vector<Hypothesis>& hypotheses) {
  const auto add_up = [](OxtsPacket& p, double of_body_mps2, double of_level_mps2, bool is_level) {
    p.force_level_mps2.z() += of_level_mps2;
    p.force_imu_mps2 += of_body_mps2 * (is_level ? Vector3d(Vector3d::UnitZ())
                                                 : Vector3d(p.level_from_imu.transpose().col(2)));
  };
  add(hypotheses, "gravity",
      "forces have gravity downwards: at rest they are 9.8 m/s^2 down where up is meant", 1,
      [=](OxtsPacket& p) { add_up(p, 2.0 * kGravity_mps2, 2.0 * kGravity_mps2, false); });
  // Standard gravity, and what is often written for it.
  for (const double gravity : {kGravity_mps2, 9.81})
    for (const bool is_level : {false, true}) {
      add(hypotheses, "gravity",
          "forces lack gravity: at rest they are 0 where 9.8 m/s^2 upwards is meant", 1,
          [=](OxtsPacket& p) { add_up(p, gravity, gravity, is_level); });
      add(hypotheses, "gravity",
          "forces in the body's axes lack gravity: at rest they are 0 where 9.8 m/s^2 upwards is "
          "meant",
          1, [=](OxtsPacket& p) { add_up(p, gravity, 0.0, is_level); });
      add(hypotheses, "gravity",
          "forces in level axes lack gravity: at rest they are 0 where 9.8 m/s^2 upwards is meant",
          1, [=](OxtsPacket& p) { add_up(p, 0.0, gravity, is_level); });
    }
}

}  // namespace

void make_oxts_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (symptoms.trial.sequence.oxts.empty()) return;
  if (!symptoms.fails("oxts") && !symptoms.fails("georeference")) return;
  add(hypotheses, "angle_unit", "angles are in degrees where radians are meant", 1,
      [](OxtsPacket& p) {
        set_angles(p, radians_from_degrees(p.roll_rad), radians_from_degrees(p.pitch_rad),
                   radians_from_degrees(p.yaw_rad));
      });
  add(hypotheses, "angle_axes",
      "angles are those of north, east, down where east, north, up is meant (yaw clockwise from "
      "north, pitch up)",
      1, [](OxtsPacket& p) { set_angles(p, p.roll_rad, -p.pitch_rad, 0.5 * kPi - p.yaw_rad); });
  add(hypotheses, "angle_axes", "yaw counts from north, clockwise, where from east is meant", 2,
      [](OxtsPacket& p) { set_angles(p, p.roll_rad, p.pitch_rad, 0.5 * kPi - p.yaw_rad); });
  add(hypotheses, "angle_order", "roll and pitch are swapped", 2,
      [](OxtsPacket& p) { set_angles(p, p.pitch_rad, p.roll_rad, p.yaw_rad); });
  add(hypotheses, "velocity_order", "velocities to the north and to the east are swapped", 1,
      [](OxtsPacket& p) { std::swap(p.velocity_enu_mps.x(), p.velocity_enu_mps.y()); });
  add(hypotheses, "velocity_unit", "velocities are in km/h where m/s is meant", 1,
      [](OxtsPacket& p) {
        p.velocity_enu_mps /= 3.6;
        p.velocity_level_mps /= 3.6;
      });
  add(hypotheses, "rate_unit", "turn rates are in deg/s where rad/s is meant", 1,
      [](OxtsPacket& p) {
        p.rate_imu_radps *= kPi / 180.0;
        p.rate_level_radps *= kPi / 180.0;
      });
  add(hypotheses, "force_unit", "forces are in g where m/s^2 is meant", 1, [](OxtsPacket& p) {
    p.force_imu_mps2 *= kGravity_mps2;
    p.force_level_mps2 *= kGravity_mps2;
  });
  add_gravity(hypotheses);
  add_other_place(symptoms, hypotheses);
}

}  // namespace terracast::validate
