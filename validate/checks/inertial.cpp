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

/// Windows are so long at most: from there on what attitudes are rounded to outweighs.
constexpr double kLongest_s = 10.0;
/// In gravities, and in degrees a second: what is larger in all windows is not seen.
constexpr double kWorthFinding = 0.01;
/// Of each IMU, spread over the sequence.
constexpr int kMostWindows = 20;

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
};

/// What integration arrives at beside the poses.
struct Arrival {
  std::vector<Vector3d>
      off_m;  ///< of each frame after the first, the speed of the first being what fits best
  std::vector<Vector3d> turned_rad;
};

Arrival arrive(const Window& window, const InertialSamples& samples) {
  const std::size_t count = window.times_s.size();
  const double start_s = window.times_s[0];
  Vector3d velocity =
      (window.ecef_from_sensor[1].translation - window.ecef_from_sensor[0].translation) /
      (window.times_s[1] - start_s);
  Arrival arrival;
  // Places follow the first speed but for a thousandth, by the Earth's turning: each round leaves so much of its error.
  constexpr int kRounds = 4;
  for (int round = 0; round <= kRounds; ++round) {
    InertialState state{window.ecef_from_sensor[0].translation, velocity,
                        window.ecef_from_sensor[0].rotation};
    arrival = {};
    Vector3d sum = Vector3d::Zero();
    double squares = 0.0;
    for (std::size_t i = 1; i < count; ++i) {
      state = integrate(state, samples, window.times_s[i - 1], window.times_s[i]);
      const Pose& right = window.ecef_from_sensor[i];
      const double after_s = window.times_s[i] - start_s;
      arrival.off_m.push_back(state.place_ecef - right.translation);
      arrival.turned_rad.push_back(
          rotation_vector(right.rotation.transpose() * state.ecef_from_sensor));
      sum += after_s * arrival.off_m.back();
      squares += after_s * after_s;
    }
    velocity -= sum / squares;
  }
  return arrival;
}

/// The worst of a quantity, by the share of what it may be.
struct Worst {
  double share = 0.0;
  double smallest =
      std::numeric_limits<double>::infinity();  ///< error that some window would have shown
  std::string where;

  void note(double size, double allowed, double seen_from, const std::string& place) {
    smallest = std::min(smallest, seen_from);
    const double now = std::isfinite(size) ? size / allowed : 1e300;
    if (now <= share && !where.empty()) return;
    share = now;
    where = place;
  }
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
    for (const SensorRecord& imu : sensors) compare(dataset, sequence, imu);
    CheckResult place = result("inertial_position", place_);
    place.summary = fmt::format(
        "Specific force and turn rate of {} IMUs, their truth, integrated over {} stretches of up "
        "to {} s "
        "against the poses, the speed at the first frame being what fits best.",
        sensors.size(), num_windows_, kLongest_s);
    place.detects =
        "gravity of another sign or size, no Coriolis force, a lever arm left out, exchanged axes, "
        "samples that are late by one";
    CheckResult turn = result("inertial_rotation", turn_);
    turn.summary = "The same for attitudes.";
    turn.detects = "the Earth's turning left out, degrees for radians, exchanged axes, a sign";
    return {place, turn};
  }

 private:
  static CheckResult result(const char* name, const Worst& worst) {
    if (worst.where.empty() || !(worst.smallest < kWorthFinding))
      return unseen_result(
          name, "too few frames in a row, or too few samples for what moves between them");
    CheckResult result;
    result.name = name;
    result.value = worst.share;
    result.bound = 1.0;
    result.unit = "of what rounding and sampling allow";
    result.ok = result.is_within_bound();
    result.worst = worst.where;
    result.reason =
        "What poses are rounded to, and twice what integrating every second sample, and by "
        "polynomials of a lower degree, differs by.";
    return result;
  }

  void compare(const Dataset& dataset, const Sequence& sequence, const SensorRecord& imu) {
    const InertialSamples samples(truth_of(imu), imu.rate_hz, imu.is_integrated);
    const InertialSamples half = samples.thinned();
    if (!half.are_enough()) return;
    const Pose ecef_from_enu = ecef_from_local(sequence.origin);
    const auto per_window =
        static_cast<std::size_t>(std::max(2.0, std::floor(kLongest_s * sequence.rate_hz)));
    const auto num_frames = static_cast<std::size_t>(sequence.num_frames);
    const std::size_t stride = std::max(per_window, (num_frames + kMostWindows - 1) / kMostWindows);
    for (std::size_t first = 0; first + 2 < num_frames; first += stride) {
      Window window;
      window.first_frame = first;
      for (std::size_t frame = first; frame <= first + per_window && frame < num_frames; ++frame) {
        const std::optional<Pose> body = local_from_body(sequence, frame);
        const double time_s = static_cast<double>(frame) / sequence.rate_hz;
        if (!body || time_s > half.last_s()) break;
        window.times_s.push_back(time_s);
        window.ecef_from_sensor.push_back(ecef_from_enu * *body * imu.body_from_sensor);
      }
      if (window.times_s.size() >= 3) compare(dataset, imu, window, samples, half);
    }
  }

  void compare(const Dataset& dataset, const SensorRecord& imu, const Window& window,
               const InertialSamples& samples, const InertialSamples& half) {
    ++num_windows_;
    const Arrival whole = arrive(window, samples);
    const std::array<Arrival, 2> others = {arrive(window, half),
                                           arrive(window, samples.of_lower_order())};
    const double distance_m =
        (window.ecef_from_sensor.back().translation - window.ecef_from_sensor[0].translation)
            .norm();
    const PoseRounding rounding = pose_rounding(dataset.format, distance_m);
    for (std::size_t i = 0; i < whole.off_m.size(); ++i) {
      const double after_s = window.times_s[i + 1] - window.times_s[0];
      // What other ways through the samples come to: where the force jumps, as on an arm of a body that begins to turn,
      // each has an error of its own.
      const auto off_between = [&](std::vector<Vector3d> Arrival::*off) {
        double sum = 0.0;
        for (const Arrival& other : others) sum += ((whole.*off)[i] - (other.*off)[i]).norm();
        return sum;
      };
      // Coordinates of the Earth's size are rounded to 1e-9 m. A frame whose attitude is off tilts gravity by as much.
      constexpr double kRounding_m = 1e-7, kRounding_rad = 1e-11, kGravity_mps2 = 9.81;
      // Motions' derivatives are right to 1e-9 of the largest.
      constexpr double kMotion_mps2 = 1e-8;
      const double allowed_m = kRounding_m + 4.0 * rounding.position_m +
                               0.5 * kMotion_mps2 * after_s * after_s +
                               0.5 * kGravity_mps2 * 2.0 * rounding.angle_rad * after_s * after_s +
                               2.0 * off_between(&Arrival::off_m);
      const double allowed_rad =
          kRounding_rad + 4.0 * rounding.angle_rad + 2.0 * off_between(&Arrival::turned_rad);
      const std::string where =
          fmt::format("{}, frame {} from frame {}: {:.3g} m, {:.3g} deg", imu.file,
                      window.first_frame + i + 1, window.first_frame, whole.off_m[i].norm(),
                      degrees_from_radians(whole.turned_rad[i].norm()));
      // As shares of gravity, and of a degree a second.
      place_.note(whole.off_m[i].norm(), allowed_m,
                  2.0 * allowed_m / (after_s * after_s) / kGravity_mps2, where);
      turn_.note(whole.turned_rad[i].norm(), allowed_rad,
                 degrees_from_radians(allowed_rad / after_s), where);
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
