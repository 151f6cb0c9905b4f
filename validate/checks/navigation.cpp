#include "validate/navigation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/body_pose.h"
#include "validate/checks/checker.h"
#include "validate/checks/contradictions.h"
#include "validate/geodesy.h"
#include "validate/oracle_view.h"
#include "validate/readers/nmea.h"
#include "validate/readers/sensors.h"
#include "validate/text.h"

/// The truth of receivers, barometers and magnetometers against the poses, by the validator's own WGS84, atmosphere and
/// magnetic field.
namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The share of what is allowed that is used, the worst of all samples.
class Share {
 public:
  void note(double size, double allowed, const std::string& where) {
    ++num_samples_;
    const double share = std::isfinite(size) && allowed > 0.0 ? size / allowed : 1e9;
    if (share <= worst_ && !where_.empty()) return;
    worst_ = share;
    where_ = where;
  }
  std::int64_t num_samples() const { return num_samples_; }

  CheckResult result(const char* name, const std::string& why_unseen) const {
    if (num_samples_ == 0) return unseen_result(name, why_unseen);
    CheckResult result;
    result.name = name;
    result.value = worst_;
    result.bound = 1.0;
    result.unit = "of what is allowed";
    result.worst = where_;
    result.ok = result.is_within_bound();
    return result;
  }

 private:
  double worst_ = 0.0;
  std::int64_t num_samples_ = 0;
  std::string where_;
};

std::string sample_of(const SensorRecord& sensor, std::size_t sample) {
  return fmt::format("{}, sample {}", sensor.file, sample);
}

/// What a receiver states, from a channel on.
struct Stated {
  Geodetic place;
  double altitude_msl_m;
  Vector3d velocity_ned_mps;

  explicit Stated(const double* channel)
      : place{channel[0], channel[1], channel[2]},
        altitude_msl_m(channel[3]),
        velocity_ned_mps(channel[4], channel[5], channel[6]) {}
  bool is_on_earth() const { return std::abs(place.lat_deg) <= 90.0; }
  Vector3d velocity_ecef_mps() const {
    const Vector3d enu(velocity_ned_mps.y(), velocity_ned_mps.x(), -velocity_ned_mps.z());
    return enu_from_ecef(place).transpose() * enu;
  }
};
constexpr std::size_t kSigmas = 7, kFix = 11, kTruth = 12;

/// UTC of the first frame in seconds since 1970; nothing where none is stated.
std::optional<double> start_of(const Sequence& sequence) {
  try {
    return 1e-9 * static_cast<double>(parse_utc_ns(sequence.utc_start, "utc_start"));
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Input) throw;
    return std::nullopt;
  }
}

/// How far a camera is from the body's reference point: attitudes of cameras carry the body's place by that.
double longest_arm_m(const Sequence& sequence) {
  double longest_m = 0.0;
  for (const Camera& camera : sequence.cameras)
    if (camera.body_from_camera)
      longest_m = std::max(longest_m, camera.body_from_camera->translation.norm());
  return longest_m;
}

/// Places of doubles of degrees, carried to the Earth's size.
constexpr double kPlaceRounding_m = 2e-8;

class NavigationChecker : public Checker {
 public:
  explicit NavigationChecker(const ValidateOptions& options)
      : undulation_m_(options.undulation_m) {}

  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    std::vector<SensorRecord> sensors;
    try {
      sensors = read_sensors(dataset, sequence);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      return {};  // `sensors` tells of it
    }
    std::erase_if(sensors, [](const SensorRecord& sensor) {
      return sensor.kind != "gnss" && sensor.kind != "barometer" && sensor.kind != "magnetometer";
    });
    if (sensors.empty())
      return {skipped_result("navigation", "there is no receiver, barometer or magnetometer")};
    for (const SensorRecord& sensor : sensors) {
      compare_with_poses(dataset, sequence, sensor);
      if (sensor.kind == "gnss") compare_speeds(sensor);
      if (sensor.kind == "gnss") compare_with_sigmas(sensor);
      if (sensor.kind == "gnss") compare_with_nmea(dataset, sequence, sensor);
      if (sensor.kind == "barometer") compare_pressures(sensor);
    }
    return results(sensors);
  }

 private:
  void compare_with_poses(const Dataset& dataset, const Sequence& sequence,
                          const SensorRecord& sensor) {
    const Pose ecef_from_enu = ecef_from_local(sequence.origin);
    const std::optional<Pose> first = local_from_body(sequence, 0);
    for (std::size_t k = 0; k < sensor.times_s.size(); ++k) {
      constexpr double kSameTime = 1e-9;
      const double frame = sensor.times_s[k] * sequence.rate_hz;
      if (std::abs(frame - std::round(frame)) > kSameTime || !sensor.is_known(k)) continue;
      const auto at = static_cast<std::size_t>(std::lround(frame));
      if (at >= static_cast<std::size_t>(sequence.num_frames)) continue;
      const std::optional<Pose> body = local_from_body(sequence, at);
      if (!body) continue;
      const double distance_m = first ? (body->translation - first->translation).norm() : 0.0;
      const PoseRounding rounding = pose_rounding(dataset.format, distance_m);
      const Pose ecef_from_sensor = ecef_from_enu * *body * sensor.body_from_sensor;
      const double arms_m = sensor.body_from_sensor.translation.norm() + longest_arm_m(sequence);
      const double off_m =
          kPlaceRounding_m + rounding.position_m + 2.0 * arms_m * rounding.angle_rad;
      if (sensor.kind == "magnetometer")
        compare_field(sequence, sensor, k, ecef_from_sensor, rounding);
      else
        compare_place(sensor, k, ecef_from_sensor.translation, off_m);
    }
  }

  void compare_place(const SensorRecord& sensor, std::size_t k, const Vector3d& right_ecef,
                     double off_m) {
    const double* row = sensor.row(k);
    const Geodetic right = geodetic_from_ecef(right_ecef);
    double altitude_m = row[2];
    if (sensor.kind == "gnss") {
      const Stated truth(row + kTruth);
      altitude_m = truth.altitude_msl_m;
      const Vector3d off = truth.is_on_earth()
                               ? Vector3d(ecef_from_geodetic(truth.place) - right_ecef)
                               : Vector3d::Constant(1e9);
      place_.note(off.norm(), off_m,
                  fmt::format("{}: {:.3g} m beside the antenna", sample_of(sensor, k), off.norm()));
    }
    if (const std::optional<double> off = off_sea_level_m(right, altitude_m, off_m))
      sea_level_.note(*off, off_m, fmt::format("{}: {:.3g} m", sample_of(sensor, k), *off));
  }

  /// By how much an altitude is beside all those of places so near: the geoid steps by centimetres from cell to cell of
  /// its grid.
  std::optional<double> off_sea_level_m(const Geodetic& place, double altitude_m,
                                        double near_m) const {
    if (!undulation_m_) return std::nullopt;
    constexpr double kEarth_m = 6.3e6;
    const double across_deg = degrees_from_radians(2.0 * near_m / kEarth_m);
    const double along_deg =
        across_deg / std::max(1e-6, std::cos(radians_from_degrees(place.lat_deg)));
    double least_m = std::numeric_limits<double>::infinity(), most_m = -least_m;
    for (const double north : {-1.0, 0.0, 1.0})
      for (const double east : {-1.0, 0.0, 1.0}) {
        const std::optional<double> undulation_m =
            undulation_m_(std::clamp(place.lat_deg + north * across_deg, -90.0, 90.0),
                          place.lon_deg + east * along_deg);
        if (!undulation_m) return std::nullopt;
        least_m = std::min(least_m, *undulation_m);
        most_m = std::max(most_m, *undulation_m);
      }
    const double stated_m = place.height_m - altitude_m;
    return std::max({0.0, least_m - stated_m, stated_m - most_m});
  }

  void compare_field(const Sequence& sequence, const SensorRecord& sensor, std::size_t k,
                     const Pose& ecef_from_sensor, const PoseRounding& rounding) {
    const std::optional<double> start_unix_s = start_of(sequence);
    if (!start_unix_s) {
      field_.note(1e9, 1.0, fmt::format("{}: utc_start is no time", sample_of(sensor, k)));
      return;
    }
    const double year = decimal_year(*start_unix_s + sensor.times_s[k]);
    const Vector3d right = ecef_from_sensor.rotation.transpose() *
                           magnetic_field_ecef_nt(ecef_from_sensor.translation, year);
    const double* row = sensor.row(k);
    const double off = (Vector3d(row[3], row[4], row[5]) - right).norm();
    // Sums of doubles in another order, and what the decimals leave of a turn.
    constexpr double kRounding_nt = 1e-5;
    field_.note(off, kRounding_nt + right.norm() * (1e-12 + 2.0 * rounding.angle_rad),
                fmt::format("{}: {:.3g} nT", sample_of(sensor, k), off));
  }

  /// By Simpson's rule over two steps, against the way between their ends; it errs by less than the rules of
  /// trapezoids and of the middle differ, there or a step beside.
  void compare_speeds(const SensorRecord& sensor) {
    const double step_s = 1.0 / sensor.rate_hz;
    const std::size_t count = sensor.times_s.size();
    std::vector<Vector3d> places, speeds;
    for (std::size_t k = 0; k < count; ++k) {
      const Stated truth(sensor.row(k) + kTruth);
      if (!truth.is_on_earth()) return;  // its places are wrong
      places.push_back(ecef_from_geodetic(truth.place));
      speeds.push_back(truth.velocity_ecef_mps());
    }
    const auto doubt_m = [&](std::size_t k) {
      return k < 1 || k + 1 >= count
                 ? 0.0
                 : step_s * (speeds[k - 1] - 2.0 * speeds[k] + speeds[k + 1]).norm();
    };
    for (std::size_t k = 1; k + 1 < count; ++k) {
      double allowed_m = doubt_m(k);
      if (k >= 2) allowed_m = std::max({allowed_m, doubt_m(k - 1), doubt_m(k - 2)});
      allowed_m = std::max({allowed_m, doubt_m(k + 1), doubt_m(k + 2)}) + 2.0 * kPlaceRounding_m;
      const double smallest_mps = allowed_m / (2.0 * step_s);
      // What would hide such an error shows nothing.
      constexpr double kWorthFinding_mps = 0.1;
      if (smallest_mps > kWorthFinding_mps || !sensor.is_known(k - 1) || !sensor.is_known(k + 1))
        continue;
      const Vector3d way = step_s / 3.0 * (speeds[k - 1] + 4.0 * speeds[k] + speeds[k + 1]);
      const double off_m = (places[k + 1] - places[k - 1] - way).norm();
      speed_.note(off_m, allowed_m,
                  fmt::format("{}: {:.3g} m/s", sample_of(sensor, k), off_m / (2.0 * step_s)));
    }
  }

  /// No normal deviate of a million is beyond 8; without errors what is shown is the truth.
  void compare_with_sigmas(const SensorRecord& sensor) {
    for (std::size_t k = 0; k < sensor.times_s.size(); ++k) {
      if (!sensor.is_known(k)) continue;
      const double* row = sensor.row(k);
      const Stated shown(row), truth(row + kTruth);
      const bool is_fix = row[kFix] == 1.0 || row[kFix] == 4.0 || row[kFix] == 5.0;
      if (!is_fix || !shown.is_on_earth() || !truth.is_on_earth()) {
        shown_.note(1e9, 1.0, fmt::format("{}: fix {}", sample_of(sensor, k), row[kFix]));
        continue;
      }
      const Vector3d enu = enu_from_ecef(truth.place) *
                           (ecef_from_geodetic(shown.place) - ecef_from_geodetic(truth.place));
      const Vector3d speed = shown.velocity_ned_mps - truth.velocity_ned_mps;
      const double* sigma = row + kSigmas;
      constexpr double kMost = 8.0;
      const auto note = [&](const char* what, double off, double sigma_of, double rounding) {
        shown_.note(std::abs(off), kMost * sigma_of + rounding,
                    fmt::format("{}: {} {:.3g} off, sigma {:.3g}", sample_of(sensor, k), what, off,
                                sigma_of));
      };
      note("east", enu.x(), sigma[0], kPlaceRounding_m);
      note("north", enu.y(), sigma[0], kPlaceRounding_m);
      note("height", enu.z(), sigma[1], kPlaceRounding_m);
      note("velocity_north_mps", speed.x(), sigma[2], 1e-9);
      note("velocity_east_mps", speed.y(), sigma[2], 1e-9);
      note("velocity_down_mps", speed.z(), sigma[3], 1e-9);
      // Heights above sea level go with those above the ellipsoid: by the geoid, or else but for its slope and its
      // steps from cell to cell.
      if (const std::optional<double> off_m =
              off_sea_level_m(shown.place, shown.altitude_msl_m, kPlaceRounding_m)) {
        note("altitude_msl_m", *off_m, 0.0, kPlaceRounding_m);
        continue;
      }
      constexpr double kSlope = 1e-3, kSteps_m = 0.1;
      note(
          "altitude_msl_m",
          shown.place.height_m - shown.altitude_msl_m - truth.place.height_m + truth.altitude_msl_m,
          0.0, kSteps_m + kSlope * enu.norm());
    }
  }

  /// The same fixes as NMEA has them, in its decimals. Datasets of earlier versions have none.
  void compare_with_nmea(const Dataset& dataset, const Sequence& sequence,
                         const SensorRecord& sensor) {
    const std::string path = sensor.file.substr(0, sensor.file.size() - 3) + "nmea";
    if (!dataset.files.contains(path)) return;
    try {
      const std::int64_t start_ns = parse_utc_ns(sequence.utc_start, "utc_start");
      const auto century =
          static_cast<int>(parse_integer(sequence.utc_start.substr(0, 2), "utc_start"));
      const std::vector<NmeaFix> fixes =
          parse_nmea(core::read_text_file(dataset.root / path), century, path);
      nmea_.expect(fixes.size() == sensor.times_s.size(), "{}: {} fixes, where {} were made", path,
                   fixes.size(), sensor.times_s.size());
      for (std::size_t k = 0; k < std::min(fixes.size(), sensor.times_s.size()); ++k)
        nmea_.expect(is_same(fixes[k], sensor.row(k), start_ns, sensor.times_s[k]),
                     "{}: fix {} is another than {}", path, k, sample_of(sensor, k));
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input) throw;
      nmea_.expect(false, "{}", error.message());
    }
  }
  static bool is_same(const NmeaFix& fix, const double* row, std::int64_t start_ns, double time_s) {
    const Stated shown(row);
    // Beside half of the last digit, doubles of angles and heights err by less than this.
    constexpr double kRounding = 1e-11;
    const auto is_near = [](double a, double b, double step) {
      return std::abs(a - b) <= 0.5 * step + kRounding;
    };
    constexpr double kAngle_deg = 1e-7 / 60.0, kLength_m = 1e-4;
    constexpr double kSpeed_mps = 1e-4 * 1852.0 / 3600.0;
    const double speed_mps = shown.velocity_ned_mps.head<2>().norm();
    const Eigen::Vector2d course(std::cos(radians_from_degrees(fix.course_deg)),
                                 std::sin(radians_from_degrees(fix.course_deg)));
    constexpr double kCourse_rad = 1e-4 * 0.0174533;
    const char mode = fix.kind == 4 ? 'R' : fix.kind == 5 ? 'F' : 'A';
    return fix.unix_ns == start_ns + std::llround(1e9 * time_s) &&
           is_near(fix.lat_deg, shown.place.lat_deg, kAngle_deg) &&
           is_near(fix.lon_deg, shown.place.lon_deg, kAngle_deg) &&
           is_near(fix.altitude_msl_m, shown.altitude_msl_m, kLength_m) &&
           is_near(fix.undulation_m, shown.place.height_m - shown.altitude_msl_m, kLength_m) &&
           is_near(fix.speed_mps, speed_mps, kSpeed_mps) &&
           (shown.velocity_ned_mps.head<2>() - speed_mps * course).norm() <=
               speed_mps * kCourse_rad &&
           fix.kind == static_cast<int>(row[kFix]) && fix.mode == mode &&
           is_near(fix.sigma_lat_m, row[kSigmas], kLength_m) &&
           is_near(fix.sigma_lon_m, row[kSigmas], kLength_m) &&
           is_near(fix.sigma_height_m, row[kSigmas + 1], kLength_m);
  }

  void compare_pressures(const SensorRecord& sensor) {
    for (std::size_t k = 0; k < sensor.times_s.size(); ++k) {
      if (!sensor.is_known(k)) continue;
      const double* row = sensor.row(k);
      const double right_pa =
          standard_pressure_pa(row[2], sensor.sea_level_pressure_pa, sensor.warmer_k);
      constexpr double kRounding = 1e-11;
      pressure_.note(std::abs(row[1] - right_pa), kRounding * right_pa,
                     fmt::format("{}: {:.9g} Pa, by its height {:.9g} Pa", sample_of(sensor, k),
                                 row[1], right_pa));
    }
  }

  std::vector<CheckResult> results(const std::vector<SensorRecord>& sensors) const {
    const auto has = [&](const char* kind) {
      return std::any_of(sensors.begin(), sensors.end(),
                         [&](const SensorRecord& sensor) { return sensor.kind == kind; });
    };
    const std::string no_frame = "no sample is at the time of a frame with a pose";
    std::vector<CheckResult> results;
    const auto add = [&](const Share& share, const char* name, const std::string& why_unseen,
                         const std::string& what, const char* reason, const char* detects) {
      CheckResult result = share.result(name, why_unseen);
      if (!result.skipped) {
        result.summary = fmt::format("{}: {} samples.", what, share.num_samples());
        result.reason = reason;
        result.detects = detects;
      }
      results.push_back(std::move(result));
    };
    if (has("gnss")) {
      add(place_, "navigation_position", no_frame,
          "True places of receivers against the poses, their lever arms and WGS84",
          "What poses are rounded to.",
          "a lever arm left out, samples late by one, heights above the geoid, radians");
      add(speed_, "navigation_velocity",
          "speeds change too much between samples to tell 0.1 m/s from their interpolation",
          "True velocities to the north, to the east and down, summed by Simpson's rule, against "
          "the way between the true places",
          "By how much the rules of trapezoids and of the middle differ, about each sample.",
          "exchanged axes, a sign, a lever arm left out of it, 0.1 m/s");
      add(shown_, "navigation_fixes", "there are no samples",
          "What receivers show against their truth, by the deviations that they state",
          "A normal deviate is beyond 8 once in 1e15.",
          "heights above the geoid for those above the ellipsoid, degrees for radians, deviations "
          "that are not those of the errors");
    }
    if (nmea_.num_compared > 0) {
      CheckResult nmea = nmea_.result("navigation_nmea");
      nmea.summary = fmt::format("{} fixes of NMEA's GGA, RMC and GST against the tables.",
                                 nmea_.num_compared);
      nmea.reason = "The decimals that are written.";
      nmea.detects = "knots for metres a second, minutes for degrees, a time of another second";
      results.push_back(std::move(nmea));
    }
    if (has("gnss") || has("barometer"))
      add(sea_level_, "navigation_sea_level",
          undulation_m_ ? no_frame + ", or no grid of EGM96 is at hand"
                        : "no grid of EGM96 is at hand",
          "True altitudes above mean sea level against the poses and EGM96",
          "What poses are rounded to.", "heights above the ellipsoid, a lever arm left out");
    if (has("barometer"))
      add(pressure_, "navigation_pressure", "there are no samples",
          "True pressures against ISO 2533 at their altitudes", "Rounding of doubles.",
          "1e-10 of the pressure: hectopascals, heights that are not geopotential ones");
    if (has("magnetometer"))
      add(field_, "navigation_field", no_frame,
          "True magnetic fields against the World Magnetic Model at poses and dates",
          "What the decimals of poses leave of a turn.",
          "another date by a day, exchanged axes, a sign, another unit");
    return results;
  }

  Undulation undulation_m_;
  Share place_, speed_, shown_, sea_level_, pressure_, field_;
  FileContradictions nmea_;
};

}  // namespace

std::unique_ptr<Checker> make_navigation_check(const ValidateOptions& options) {
  return std::make_unique<NavigationChecker>(options);
}

}  // namespace terracast::validate
