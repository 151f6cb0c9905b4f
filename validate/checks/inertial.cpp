#include "validate/inertial.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "validate/body_pose.h"
#include "validate/checks/checker.h"
#include "validate/geodesy.h"
#include "validate/oracle_view.h"
#include "validate/readers/sensors.h"

/// The truth of IMUs, integrated from frame to frame by a mechanisation of the validator's own, against the poses.
namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Longest window; beyond it the rounding of attitudes dominates.
constexpr double kLongest_s = 10.0;
/// In gravities, and in degrees a second: what is larger in all windows is not seen.
constexpr double kWorthFinding = 0.01;
/// Most windows of an IMU, spread over the sequence.
constexpr std::size_t kMostWindows = 20;

std::vector<InertialReading> truth_of(const SensorRecord& imu) {
  std::vector<InertialReading> readings;
  for (std::size_t k = 0; k < imu.times_s.size(); ++k) {
    const double* row = &imu.values[k * imu.num_channels + 6];
    readings.push_back({{row[0], row[1], row[2]}, {row[3], row[4], row[5]}});
  }
  return readings;
}

/// The sensor at frames in a row.
struct Window {
  std::size_t first_frame = 0;
  std::vector<double> times_s;  ///< of its frames
  std::vector<Pose> ecef_from_sensor;

  double after_s(std::size_t frame) const { return times_s[frame] - times_s[0]; }
};

/// Differences between integrated states and poses, of each frame after the first.
struct Arrival {
  std::vector<Vector3d> off_m;  ///< the speed at the first frame being what fits best
  std::vector<Vector3d> turned_rad;
};

Arrival arrive(const Window& window, const std::vector<InertialLeg>& legs) {
  const std::size_t count = window.times_s.size();
  Vector3d velocity =
      (window.ecef_from_sensor[1].translation - window.ecef_from_sensor[0].translation) /
      window.after_s(1);
  Arrival arrival;
  // Places follow the first speed but for the Earth's turning, twice its angle: each round leaves so much of its error.
  constexpr int kMostRounds = 20;
  constexpr double kSettled_m = 1e-9;
  for (int round = 0; round < kMostRounds; ++round) {
    InertialState state{window.ecef_from_sensor[0].translation, velocity,
                        window.ecef_from_sensor[0].rotation};
    arrival = {};
    Vector3d sum = Vector3d::Zero();
    double squares = 0.0;
    for (std::size_t i = 1; i < count; ++i) {
      state = integrate(state, legs[i - 1]);
      const Pose& right = window.ecef_from_sensor[i];
      arrival.off_m.push_back(state.place_ecef - right.translation);
      arrival.turned_rad.push_back(
          rotation_vector(right.rotation.transpose() * state.ecef_from_sensor));
      sum += window.after_s(i) * arrival.off_m.back();
      squares += window.after_s(i) * window.after_s(i);
    }
    const Vector3d correction = sum / squares;
    if (!(correction.norm() * window.after_s(count - 1) > kSettled_m)) break;
    velocity -= correction;
  }
  return arrival;
}

/// The worst of a quantity, by the share of what it may be.
struct Worst {
  double share = 0.0;
  double smallest =
      std::numeric_limits<double>::infinity();  ///< error that some frame would have shown
  std::string where;

  void note(double size, double allowed, double seen_from, const std::string& place) {
    if (seen_from < smallest) smallest = seen_from;
    const double now = std::isfinite(size) && std::isfinite(allowed) ? size / allowed : 1e300;
    if (now <= share && !where.empty()) return;
    share = now;
    where = place;
  }
  /// Beyond its bound it is seen, however little could be.
  bool is_seen() const { return !where.empty() && (share > 1.0 || smallest < kWorthFinding); }
};

class InertialChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    std::vector<SensorRecord> sensors;
    try {
      sensors = read_sensors(dataset, sequence);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      return {};  // `sensors` tells of it
    }
    std::erase_if(sensors, [](const SensorRecord& sensor) { return sensor.kind != "imu"; });
    if (sensors.empty()) return {skipped_result("inertial", "there is no IMU")};
    std::vector<Worst> places, turns;
    for (const SensorRecord& imu : sensors) {
      place_ = turn_ = {};
      compare(dataset, sequence, imu);
      places.push_back(place_);
      turns.push_back(turn_);
    }
    CheckResult place = result("inertial_position", sensors, places);
    place.detects =
        "gravity of another sign or size, no Coriolis force, a lever arm left out, exchanged axes, "
        "samples that are late by one";
    CheckResult turn = result("inertial_rotation", sensors, turns);
    turn.detects = "the Earth's turning left out, degrees for radians, exchanged axes, a sign";
    return {place, turn};
  }

 private:
  CheckResult result(const char* name, const std::vector<SensorRecord>& sensors,
                     const std::vector<Worst>& worst) const {
    CheckResult result;
    result.name = name;
    result.bound = 1.0;
    result.unit = "of what rounding and sampling allow";
    std::size_t num_seen = 0;
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      if (!worst[i].is_seen()) {
        result.unseen_parts.push_back(sensors[i].rig + "/" + sensors[i].name);
        continue;
      }
      if (num_seen++ > 0 && worst[i].share <= result.value) continue;
      result.value = worst[i].share;
      result.worst = worst[i].where;
    }
    if (num_seen == 0)
      return unseen_result(
          name, "too few frames in a row, or too few samples for what moves between them");
    result.ok = result.is_within_bound();
    result.summary = fmt::format(
        "The truth of {} IMUs, integrated over {} stretches of up to {} s against the poses, the "
        "speed at the first frame of each being what fits best.",
        num_seen, num_windows_, kLongest_s);
    result.reason =
        "What poses are rounded to, and by how much other interpolations of the samples read "
        "otherwise, step by step.";
    return result;
  }

  void compare(const Dataset& dataset, const Sequence& sequence, const SensorRecord& imu) {
    const InertialSamples samples(truth_of(imu), imu.rate_hz, imu.is_integrated);
    const std::array<InertialSamples, 2> others = {samples.thinned(), samples.of_lower_order()};
    if (!others[0].are_enough()) return;
    const Pose ecef_from_enu = ecef_from_local(sequence.origin);
    const auto num_frames = static_cast<std::size_t>(sequence.num_frames);
    const auto per_window = static_cast<std::size_t>(std::clamp(
        std::floor(kLongest_s * sequence.rate_hz), 2.0, static_cast<double>(num_frames)));
    const std::size_t stride = std::max(per_window, (num_frames + kMostWindows - 1) / kMostWindows);
    for (std::size_t first = 0; first + 2 < num_frames; first += stride) {
      Window window;
      for (std::size_t frame = first; frame <= first + per_window && frame < num_frames; ++frame) {
        const std::optional<Pose> body = local_from_body(sequence, frame);
        const double time_s = static_cast<double>(frame) / sequence.rate_hz;
        if (time_s > samples.last_s() + 1e-9) break;
        if (!body) {
          if (window.times_s.size() >= 3) break;
          window = {};
          continue;
        }
        if (window.times_s.empty()) window.first_frame = frame;
        window.times_s.push_back(time_s);
        window.ecef_from_sensor.push_back(ecef_from_enu * *body * imu.body_from_sensor);
      }
      const std::size_t count = window.times_s.size();
      if (count >= 3 && window.after_s(count - 1) <= 2.0 * kLongest_s)
        compare(dataset, sequence, imu, window, samples, others);
    }
  }

  void compare(const Dataset& dataset, const Sequence& sequence, const SensorRecord& imu,
               const Window& window, const InertialSamples& samples,
               const std::array<InertialSamples, 2>& others) {
    ++num_windows_;
    const std::size_t count = window.times_s.size();
    std::vector<InertialLeg> legs, coarse;
    std::vector<InertialDoubt> doubts;
    InertialDoubt doubt;
    // What the speed that fits best takes of an acceleration, and of what is in doubt.
    double squares = 0.0, cubes = 0.0, doubtful = 0.0;
    for (std::size_t i = 1; i < count; ++i) {
      const double from_s = window.times_s[i - 1], to_s = window.times_s[i];
      legs.push_back(leg_of(samples, from_s, to_s));
      coarse.push_back(leg_of(others[0], from_s, to_s));
      doubt.gather(legs.back(), others);
      doubts.push_back(doubt);
      const double t = window.after_s(i);
      squares += t * t;
      cubes += 0.5 * t * t * t;
      doubtful += t * doubt.place_m;
    }
    const Arrival whole = arrive(window, legs), half = arrive(window, coarse);
    const std::optional<Pose> first = local_from_body(sequence, 0);
    const double distance_m =
        first ? (ecef_from_local(sequence.origin) * *first * imu.body_from_sensor.translation -
                 window.ecef_from_sensor[0].translation)
                    .norm()
              : 0.0;
    const PoseRounding rounding = pose_rounding(dataset.format, distance_m);
    // Coordinates of the Earth's size are rounded to 1e-9 m; motions' derivatives are right to 1e-9 of the largest. A frame
    // whose attitude is off tilts gravity by as much.
    constexpr double kRounding_m = 1e-7, kRounding_rad = 1e-11, kGravity_mps2 = 9.81;
    constexpr double kMotion_mps2 = 1e-8;
    for (std::size_t i = 0; i < whole.off_m.size(); ++i) {
      const double t = window.after_s(i + 1);
      const double allowed_m =
          kRounding_m + 4.0 * rounding.position_m + 0.5 * kMotion_mps2 * t * t +
          0.5 * kGravity_mps2 * (2.0 * rounding.angle_rad + kRounding_rad) * t * t +
          doubts[i].place_m + t * doubtful / squares +
          2.0 * (whole.off_m[i] - half.off_m[i]).norm();
      const double allowed_rad = kRounding_rad + 4.0 * rounding.angle_rad + doubts[i].turn_rad +
                                 2.0 * (whole.turned_rad[i] - half.turned_rad[i]).norm();
      const std::string where =
          fmt::format("{}, frame {} from frame {}: {:.3g} m, {:.3g} deg", imu.file,
                      window.first_frame + i + 1, window.first_frame, whole.off_m[i].norm(),
                      degrees_from_radians(whole.turned_rad[i].norm()));
      // What an acceleration leaves after the fit.
      const double left_s2 = std::abs(0.5 * t * t - t * cubes / squares);
      place_.note(whole.off_m[i].norm(), allowed_m, allowed_m / left_s2 / kGravity_mps2, where);
      turn_.note(whole.turned_rad[i].norm(), allowed_rad, degrees_from_radians(allowed_rad / t),
                 where);
    }
  }

  Worst place_, turn_;
  int num_windows_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_inertial_check(const ValidateOptions&) {
  return std::make_unique<InertialChecker>();
}

}  // namespace terracast::validate
