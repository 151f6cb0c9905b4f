#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/body_pose.h"
#include "validate/checks/checker.h"
#include "validate/checks/contradictions.h"
#include "validate/geodesy.h"
#include "validate/gps_orbit.h"
#include "validate/oracle/shown_geometry.h"
#include "validate/oracle_view.h"
#include "validate/readers/rinex.h"
#include "validate/readers/sensors.h"
#include "validate/signal_air.h"
#include "validate/text.h"

/// Observations of satellites: against the poses, the broadcast orbits, each other, RINEX and the world that hides some.
namespace terracast::validate {

namespace {

using Eigen::Vector3d;
using oracle::ExactHit;
using oracle::ExactRay;
using oracle::ExactWorld;

constexpr double kLight_mps = 299792458.0;
constexpr double kWave_m = kLight_mps / 1575.42e6;
/// No normal deviate of a million is beyond it.
constexpr double kDeviations = 8.0;

/// A row of a receiver's files.
struct Row {
  double time_s = 0.0;
  int prn = 0;
  double azimuth_deg = 0.0, elevation_deg = 0.0;
  bool is_visible = false;
  int class_id = 0;
  std::uint32_t instance_id = 0;
  double pseudorange_m = 0.0, carrier_cycles = 0.0, doppler_hz = 0.0;
  double range_m = 0.0, range_rate_mps = 0.0;
  double receiver_clock_s = 0.0, satellite_clock_s = 0.0;
  double ionosphere_m = 0.0, troposphere_m = 0.0;
  Vector3d satellite_ecef = Vector3d::Zero();
  int num_visible = 0;
  std::array<double, 4> dilution{};  ///< horizontal, vertical, of place, of time

  double slant() const { return 1.0 / std::sin(radians_from_degrees(elevation_deg)); }
  double delays_m() const {
    return range_m + kLight_mps * (receiver_clock_s - satellite_clock_s) + troposphere_m;
  }
};

std::vector<Row> rows_of(const NpyTable& table) {
  std::vector<Row> rows(table.num_rows);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::size_t column = 0;
    const auto next = [&] { return table.number(table.columns[column++], i); };
    Row& row = rows[i];
    row.time_s = next();
    row.prn = static_cast<int>(next());
    row.azimuth_deg = next();
    row.elevation_deg = next();
    row.is_visible = next() != 0.0;
    row.class_id = static_cast<int>(next());
    row.instance_id = static_cast<std::uint32_t>(next());
    row.pseudorange_m = next();
    row.carrier_cycles = next();
    row.doppler_hz = next();
    row.range_m = next();
    row.range_rate_mps = next();
    row.receiver_clock_s = next();
    row.satellite_clock_s = next();
    row.ionosphere_m = next();
    row.troposphere_m = next();
    for (int axis = 0; axis < 3; ++axis) row.satellite_ecef[axis] = next();
    row.num_visible = static_cast<int>(next());
    for (double& one : row.dilution) one = next();
  }
  return rows;
}

/// The share of what is allowed that is used, the worst of all.
struct Share {
  double worst = 0.0;
  std::int64_t num = 0;
  std::string where;

  void note(double off, double allowed, const std::string& place) {
    ++num;
    const double share = std::isfinite(off) && allowed > 0.0 ? off / allowed : 1e9;
    if (share <= worst && !where.empty()) return;
    worst = share;
    where = fmt::format("{}: {:.3g} of {:.3g}", place, off, allowed);
  }
  CheckResult result(const char* name, const char* why_unseen) const {
    if (num == 0) return unseen_result(name, why_unseen);
    CheckResult result;
    result.name = name;
    result.value = worst;
    result.bound = 1.0;
    result.unit = "of what is allowed";
    result.worst = where;
    result.ok = result.is_within_bound();
    return result;
  }
};

/// Seconds by which GPS time is ahead of UTC, by IERS's Bulletin C.
double leap_seconds(double unix_s) {
  constexpr std::array<std::int64_t, 18> kDays = {4199,  4564,  4929,  5660,  6574,  7305,
                                                  7670,  8217,  8582,  8947,  9496,  10043,
                                                  10592, 13149, 14245, 15522, 16617, 17167};
  return static_cast<double>(std::count_if(kDays.begin(), kDays.end(), [&](std::int64_t day) {
    return unix_s >= 86400.0 * static_cast<double>(day);
  }));
}

/// The sequence's start in GPS time, in nanoseconds since 1980-01-06.
std::optional<std::int64_t> gps_start_ns(const Sequence& sequence) {
  try {
    const std::int64_t unix_ns = parse_utc_ns(sequence.utc_start, "utc_start");
    constexpr std::int64_t kEpoch_s = 315964800;
    const std::int64_t leaps_s = std::llround(leap_seconds(1e-9 * static_cast<double>(unix_ns)));
    return unix_ns + (leaps_s - kEpoch_s) * 1'000'000'000;
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Input) throw;
    return std::nullopt;
  }
}

/// A receiver's rows, file by file.
struct Receiver {
  const SensorRecord* sensor = nullptr;
  std::vector<Row> rows;
  std::vector<std::pair<int, std::uint32_t>> places;  ///< frame and row of its file, of each row
  std::int64_t start_ns = 0;                          ///< GPS time of the sequence's start
  RinexNavigation navigation = {};
  std::map<int, std::vector<NavigationRecord>> orbits = {};  ///< by PRN, in the order of time

  /// Of a satellite and a time of the sequence: the record nearest in time, and the time since it; nothing: there is none.
  struct Orbit {
    const NavigationRecord* record;
    double since_s;
  };
  std::optional<Orbit> orbit(int prn, double time_s) const {
    const auto found = orbits.find(prn);
    if (found == orbits.end()) return std::nullopt;
    std::optional<Orbit> nearest;
    for (const NavigationRecord& record : found->second) {
      const std::int64_t since_ns = start_ns - 1'000'000'000 * std::llround(record.toe_gps_s());
      const double since_s = 1e-9 * static_cast<double>(since_ns) + time_s;
      if (!nearest || std::abs(since_s) < std::abs(nearest->since_s))
        nearest = Orbit{&record, since_s};
    }
    return nearest;
  }

  std::string file(const char* name) const { return sensor->file + "/" + name; }
  std::string name(std::size_t row) const {
    return fmt::format("{}/{:06}.npy, row {}", sensor->file, places[row].first, places[row].second);
  }
};

class SignalsChecker : public Checker {
 public:
  explicit SignalsChecker(const ValidateOptions& options)
      : world_(options.world), undulation_m_(options.undulation_m) {}

  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    std::vector<SensorRecord> sensors;
    try {
      sensors = read_sensors(dataset, sequence);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      return {};  // `sensors` names it
    }
    std::erase_if(sensors,
                  [](const SensorRecord& sensor) { return sensor.kind != "gnss_observations"; });
    if (sensors.empty())
      return {skipped_result("signals", "there is no receiver of satellites' signals")};
    open_world(dataset, sequence);
    for (const SensorRecord& sensor : sensors) {
      Receiver receiver{.sensor = &sensor, .rows = {}, .places = {}};
      read_rows(dataset, sequence, receiver);
      compare_rows(receiver);
      compare_epochs(receiver);
      compare_tracks(receiver);
      compare_with_files(dataset, sequence, receiver);
      compare_with_poses(dataset, sequence, receiver);
    }
    return results();
  }

 private:
  void read_rows(const Dataset& dataset, const Sequence& sequence, Receiver& receiver) {
    for (int frame = 0; frame < sequence.num_frames; ++frame) try {
        std::uint32_t number = 0;
        for (Row& row : rows_of(read_scans(dataset, *receiver.sensor, frame))) {
          receiver.places.emplace_back(frame, number++);
          // At a frame's border a time may be rounded to either side.
          const double frames = row.time_s * sequence.rate_hz;
          rows_.expect(frames > frame - 1e-6 &&
                           (frames < frame + 1.0 + 1e-6 || frame + 1 == sequence.num_frames),
                       "{}: at the time of another frame",
                       receiver.name(receiver.places.size() - 1));
          receiver.rows.push_back(std::move(row));
        }
      } catch (const core::Error& error) {
        if (error.kind() != core::ErrorKind::Input) throw;
        rows_.expect(false, "{}", error.message());
      }
  }

  /// What a row says of itself.
  void compare_rows(const Receiver& receiver) {
    const GnssSettings& settings = receiver.sensor->gnss;
    std::map<int, double> whole_waves;
    for (std::size_t i = 0; i < receiver.rows.size(); ++i) {
      const Row& row = receiver.rows[i];
      const std::string name = receiver.name(i);
      rows_.expect(row.prn >= 1 && row.prn <= 32, "{}: PRN {}", name, row.prn);
      rows_.expect(row.elevation_deg >= settings.mask_deg - 1e-9 && row.elevation_deg <= 90.0,
                   "{}: {} deg above the horizon, below the mask", name, row.elevation_deg);
      const bool is_open = std::isfinite(row.pseudorange_m) && std::isfinite(row.carrier_cycles) &&
                           std::isfinite(row.doppler_hz);
      rows_.expect(row.is_visible == is_open, "{}: {}visible, and has {} signals", name,
                   row.is_visible ? "" : "in", is_open ? "its" : "no");
      rows_.expect(!row.is_visible || (row.class_id == 0 && row.instance_id == 0),
                   "{}: visible, and hidden by class {}", name, row.class_id);
      const double clock_s =
          1e-6 * settings.clock_offset_us + 1e-9 * settings.clock_drift_ppb * row.time_s;
      rows_.expect(std::abs(row.receiver_clock_s - clock_s) <= 1e-16 + 1e-12 * std::abs(clock_s),
                   "{}: a clock {:.9g} s ahead, by its settings {:.9g} s", name,
                   row.receiver_clock_s, clock_s);
      if (!row.is_visible || !is_open) continue;
      // Doubles of 2.5e7 m, and of 1.3e8 cycles.
      constexpr double kRounding_m = 1e-7;
      code_.note(std::abs(row.pseudorange_m - row.delays_m() - row.ionosphere_m),
                 kRounding_m + kDeviations * settings.pseudorange_noise_m * row.slant(),
                 name + ", m");
      const double waves = row.carrier_cycles - (row.delays_m() - row.ionosphere_m) / kWave_m;
      const auto first = whole_waves.try_emplace(row.prn, std::round(waves)).first;
      code_.note(std::abs(waves - first->second),
                 1e-6 + kDeviations * 1e-3 * settings.carrier_noise_mm / kWave_m * row.slant(),
                 name + ", cycles beside a whole number that stays");
    }
  }

  /// What rows of one epoch say of each other.
  void compare_epochs(const Receiver& receiver) {
    const std::vector<Row>& rows = receiver.rows;
    for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
      while (end < rows.size() && rows[end].time_s == rows[begin].time_s) ++end;
      Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
      int num_visible = 0;
      for (std::size_t i = begin; i < end; ++i) {
        rows_.expect(i == begin || rows[i].prn > rows[i - 1].prn,
                     "{}: PRN {} behind {} of the same epoch", receiver.name(i), rows[i].prn,
                     i == begin ? 0 : rows[i - 1].prn);
        rows_.expect(rows[i].receiver_clock_s == rows[begin].receiver_clock_s,
                     "{}: another clock than the row before", receiver.name(i));
        if (!rows[i].is_visible) continue;
        ++num_visible;
        const double elevation = radians_from_degrees(rows[i].elevation_deg);
        const double azimuth = radians_from_degrees(rows[i].azimuth_deg);
        const Eigen::Vector4d line(std::cos(elevation) * std::sin(azimuth),
                                   std::cos(elevation) * std::cos(azimuth), std::sin(elevation),
                                   1.0);
        normal += line * line.transpose();
      }
      for (std::size_t i = begin; i < end; ++i) {
        rows_.expect(rows[i].num_visible == num_visible, "{}: {} are visible, not {}",
                     receiver.name(i), num_visible, rows[i].num_visible);
        compare_dilution(rows[i], normal, num_visible, receiver.name(i));
      }
      if (begin == 0) continue;
      // Above a low mask there is always a satellite, and so a row.
      constexpr double kLowMask_deg = 10.0;
      const double steps = (rows[begin].time_s - rows[begin - 1].time_s) * receiver.sensor->rate_hz;
      rows_.expect(steps > 0.0 && (receiver.sensor->gnss.mask_deg > kLowMask_deg ||
                                   std::abs(steps - 1.0) < 1e-3),
                   "{}: {:.6g} epochs behind the row before", receiver.name(begin), steps);
    }
  }

  void compare_dilution(const Row& row, const Eigen::Matrix4d& normal, int num_visible,
                        const std::string& name) {
    const Eigen::Vector4d variances = normal.inverse().diagonal();
    const bool is_open = num_visible < 4 || !(variances.minCoeff() > 0.0);
    // Where the sky is nearly singular digits go: what is left is not worth comparing.
    constexpr double kMost = 1e4;
    const std::array<double, 4> right = {
        std::sqrt(variances[0] + variances[1]), std::sqrt(variances[2]),
        std::sqrt(variances[0] + variances[1] + variances[2]), std::sqrt(variances[3])};
    constexpr double kFloat = 1e-6;
    for (std::size_t k = 0; k < right.size(); ++k) {
      if (!is_open && !(right[k] < kMost)) continue;
      rows_.expect(is_open ? (num_visible >= 4 || std::isinf(row.dilution[k]))
                           : std::abs(row.dilution[k] - right[k]) <= kFloat * (1.0 + right[k]),
                   "{}: dilution of precision {:.6g}, by the directions {:.6g}", name,
                   row.dilution[k], right[k]);
    }
  }

  /// Ranges from epoch to epoch, satellite by satellite: Simpson's rule over two steps, which errs by less than the
  /// rules of trapezoids and of the middle differ.
  void compare_tracks(const Receiver& receiver) {
    const double step_s = 1.0 / receiver.sensor->rate_hz;
    std::map<int, std::vector<std::size_t>> tracks;
    for (std::size_t i = 0; i < receiver.rows.size(); ++i)
      tracks[receiver.rows[i].prn].push_back(i);
    for (const auto& [prn, track] : tracks) {
      const auto row = [&](std::size_t k) -> const Row& { return receiver.rows[track[k]]; };
      const auto is_next = [&](std::size_t k) {
        return std::abs(row(k + 1).time_s - row(k).time_s - step_s) < 1e-3 * step_s;
      };
      const auto doubt_m = [&](std::size_t k) {
        if (k < 1 || k + 1 >= track.size() || !is_next(k - 1) || !is_next(k)) return 0.0;
        return step_s * std::abs(row(k - 1).range_rate_mps - 2.0 * row(k).range_rate_mps +
                                 row(k + 1).range_rate_mps);
      };
      for (std::size_t k = 1; k + 1 < track.size(); ++k) {
        if (!is_next(k - 1) || !is_next(k)) continue;
        double allowed_m = std::max({doubt_m(k - 1), doubt_m(k), doubt_m(k + 1)}) + 1e-7;
        if (k >= 2) allowed_m = std::max(allowed_m, doubt_m(k - 2));
        allowed_m = std::max(allowed_m, doubt_m(k + 2));
        const double way_m =
            step_s / 3.0 *
            (row(k - 1).range_rate_mps + 4.0 * row(k).range_rate_mps + row(k + 1).range_rate_mps);
        rate_.note(std::abs(row(k + 1).range_m - row(k - 1).range_m - way_m), allowed_m,
                   receiver.name(track[k]) + ", m");
      }
    }
  }

  void compare_with_poses(const Dataset& dataset, const Sequence& sequence,
                          const Receiver& receiver) {
    const Pose ecef_from_enu = ecef_from_local(sequence.origin);
    const std::optional<Pose> first = local_from_body(sequence, 0);
    std::size_t epoch = 0;  // the first row of the same time
    for (std::size_t i = 0; i < receiver.rows.size(); ++i) {
      if (receiver.rows[i].time_s != receiver.rows[epoch].time_s) epoch = i;
      const Row& row = receiver.rows[i];
      const double frame = row.time_s * sequence.rate_hz;
      if (std::abs(frame - std::round(frame)) > 1e-9) continue;
      const auto at = static_cast<std::size_t>(std::lround(frame));
      if (at >= static_cast<std::size_t>(sequence.num_frames)) continue;
      const std::optional<Pose> body = local_from_body(sequence, at);
      if (!body) continue;
      const double distance_m = first ? (body->translation - first->translation).norm() : 0.0;
      const PoseRounding rounding = pose_rounding(dataset.format, distance_m);
      const Vector3d& arm_body = receiver.sensor->body_from_sensor.translation;
      double arms_m = arm_body.norm();
      for (const Camera& camera : sequence.cameras)
        if (camera.body_from_camera) arms_m += camera.body_from_camera->translation.norm();
      const double off_m = 1e-6 + rounding.position_m + 2.0 * arms_m * rounding.angle_rad;
      const Vector3d antenna_local = *body * arm_body;
      const Vector3d antenna_ecef = ecef_from_enu * antenna_local;
      const Vector3d way = row.satellite_ecef - antenna_ecef;
      range_.note(std::abs(way.norm() - row.range_m), off_m, receiver.name(i) + ", m");
      const Vector3d enu = enu_from_ecef(geodetic_from_ecef(antenna_ecef)) * way;
      const double elevation = std::atan2(enu.z(), std::hypot(enu.x(), enu.y()));
      const double azimuth = std::atan2(enu.x(), enu.y());
      const double turned = std::hypot(
          elevation - radians_from_degrees(row.elevation_deg),
          std::cos(elevation) * std::remainder(azimuth - radians_from_degrees(row.azimuth_deg),
                                               2.0 * std::numbers::pi));
      range_.note(turned, 1e-12 + off_m / 2e7 + 1e-7 / 6.4e6, receiver.name(i) + ", rad");
      if (i == epoch) find_missing_rows(receiver, epoch, antenna_ecef);
      compare_air(receiver, i, geodetic_from_ecef(antenna_ecef), azimuth, elevation);
      compare_with_world(sequence, receiver, i, antenna_local, off_m);
    }
  }

  /// Satellites of navigation.rnx that stand above the mask have a row.
  void find_missing_rows(const Receiver& receiver, std::size_t epoch,
                         const Vector3d& antenna_ecef) {
    const double time_s = receiver.rows[epoch].time_s;
    std::set<int> stated;
    for (std::size_t i = epoch; i < receiver.rows.size() && receiver.rows[i].time_s == time_s; ++i)
      stated.insert(receiver.rows[i].prn);
    const Vector3d up = enu_from_ecef(geodetic_from_ecef(antenna_ecef)).row(2).transpose();
    for (const auto& [prn, records] : receiver.orbits) {
      if (stated.contains(prn)) continue;
      const std::optional<Receiver::Orbit> orbit = receiver.orbit(prn, time_s);
      double range_m = 2.2e7;
      Vector3d way = Vector3d::Zero();
      for (int step = 0; step < 4; ++step) {
        way = sent_signal(*orbit->record, orbit->since_s, range_m).place_ecef - antenna_ecef;
        range_m = way.norm();
      }
      const double elevation_deg = degrees_from_radians(std::asin(way.dot(up) / range_m));
      constexpr double kRounding_deg = 1e-6;
      rows_.expect(elevation_deg < receiver.sensor->gnss.mask_deg + kRounding_deg,
                   "{}: PRN {} is {:.3f} deg above the horizon and has no row",
                   receiver.name(epoch), prn, elevation_deg);
    }
  }

  /// What the air delays, by models of the validator's own.
  void compare_air(const Receiver& receiver, std::size_t i, const Geodetic& antenna,
                   double azimuth_rad, double elevation_rad) {
    const Row& row = receiver.rows[i];
    const GnssSettings& settings = receiver.sensor->gnss;
    const double second_of_day =
        std::fmod(1e-9 * static_cast<double>(receiver.start_ns), 86400.0) + row.time_s;
    const double ionosphere_m =
        settings.has_ionosphere ? klobuchar_m(receiver.navigation.alpha, receiver.navigation.beta,
                                              antenna, azimuth_rad, elevation_rad, second_of_day)
                                : 0.0;
    // Numbers of navigation.rnx have five digits; directions are exact to 1e-12.
    air_.note(std::abs(row.ionosphere_m - ionosphere_m), 1e-6 + 1e-6 * ionosphere_m,
              receiver.name(i) + ", m of the ionosphere");
    double troposphere_m = 0.0;
    if (settings.has_troposphere) {
      const std::optional<double> undulation_m =
          undulation_m_ ? undulation_m_(antenna.lat_deg, antenna.lon_deg) : std::nullopt;
      if (!undulation_m) return;
      troposphere_m = saastamoinen_m(radians_from_degrees(antenna.lat_deg),
                                     antenna.height_m - *undulation_m, elevation_rad);
    }
    // The geoid's grid steps by centimetres, of which a metre is 3e-4 m at the zenith.
    air_.note(std::abs(row.troposphere_m - troposphere_m), 1e-6 + 3e-5 * row.slant(),
              receiver.name(i) + ", m of the troposphere");
  }

  void open_world(const Dataset& dataset, const Sequence& sequence) {
    if (world_.empty() || sequence.geometry.empty()) return;
    try {
      const oracle::WorldFolder folder(world_);
      std::vector<oracle::TileKey> tiles;
      for (const oracle::ShownTile& tile :
           oracle::read_shown_geometry(dataset.root / sequence.geometry, sequence.geometry).tiles)
        tiles.push_back(tile.key);
      world_from_local_ = world_from_local(folder, sequence);
      exact_.emplace(folder, tiles, world_from_enu_of(folder), oracle::Viewers::AboveWater);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input) throw;
      no_world_ = error.message();  // `oracle` names it
    }
  }

  /// What hides a satellite, along an exact ray to it.
  void compare_with_world(const Sequence& sequence, const Receiver& receiver, std::size_t i,
                          const Vector3d& antenna_local, double off_m) {
    if (!exact_) return;
    if (sequence.moving || receiver.sensor->gnss.plants_pass) {
      ++num_uncertain_;
      return;
    }
    const Row& row = receiver.rows[i];
    const Vector3d from = world_from_local_ * antenna_local;
    const Pose ecef_from_enu = ecef_from_local(sequence.origin);
    const Vector3d to_local =
        ecef_from_enu.rotation.transpose() * (row.satellite_ecef - ecef_from_enu.translation);
    const Vector3d direction = (world_from_local_ * to_local - from).normalized();
    constexpr double kReach_m = 2e5;
    const auto hides = [&](const Vector3d& start) {
      return exact_->first_hit(ExactRay{start, start + OracleView::kThrough_m * direction},
                               kReach_m / OracleView::kThrough_m);
    };
    const std::optional<ExactHit> hit = hides(from);
    const auto agrees = [&](const std::optional<ExactHit>& one) {
      if (row.is_visible || !one) return row.is_visible == !one;
      if (!one->object) return row.instance_id == 0U;
      return row.instance_id == one->object->instance_id &&
             row.class_id == static_cast<int>(one->object->semantic_class);
    };
    if (!agrees(hit)) {
      // Within rounding of an edge either is right.
      const Vector3d aside = direction.unitOrthogonal();
      for (const Vector3d& side : {aside, Vector3d(direction.cross(aside))})
        for (const double sign : {-1.0, 1.0})
          if (agrees(hides(from + sign * 2.0 * off_m * side))) {
            ++num_at_edges_;
            return;
          }
    }
    hidden_.expect(agrees(hit), "{}: PRN {} is {}, and the world {}", receiver.name(i), row.prn,
                   row.is_visible ? "visible" : "hidden",
                   !hit ? "does not hide it" : "hides it by another thing");
  }

  void compare_with_files(const Dataset& dataset, const Sequence& sequence, Receiver& receiver) {
    const std::optional<std::int64_t> start_ns = gps_start_ns(sequence);
    if (!start_ns) {
      files_.expect(false, "utc_start is no time");
      return;
    }
    try {
      const auto text_of = [&](const char* name) {
        const std::string path = receiver.file(name);
        if (!dataset.files.contains(path))
          core::fail(core::ErrorKind::Input, "{}: it is missing", path);
        return core::read_text_file(dataset.root / path);
      };
      receiver.start_ns = *start_ns;
      receiver.navigation =
          parse_rinex_navigation(text_of("navigation.rnx"), receiver.file("navigation.rnx"));
      for (const NavigationRecord& record : receiver.navigation.records)
        receiver.orbits[record.prn].push_back(record);
      compare_orbits(receiver);
      compare_observations(
          receiver, *start_ns,
          parse_rinex_observations(text_of("observations.rnx"), receiver.file("observations.rnx")));
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input) throw;
      files_.expect(false, "{}", error.message());
    }
  }

  void compare_orbits(const Receiver& receiver) {
    const GnssSettings& settings = receiver.sensor->gnss;
    for (std::size_t i = 0; i < receiver.rows.size(); ++i) {
      const Row& row = receiver.rows[i];
      const std::optional<Receiver::Orbit> orbit = receiver.orbit(row.prn, row.time_s);
      if (!orbit) {
        files_.expect(false, "{}: no orbit of PRN {}", receiver.file("navigation.rnx"), row.prn);
        continue;
      }
      const auto sent_at = [&](double later_s) {
        return sent_signal(*orbit->record, orbit->since_s + later_s, row.range_m);
      };
      // Half way between two records either holds; they agree to a millimetre.
      const SentSignal sent = sent_at(0.0);
      orbits_.note((sent.place_ecef - row.satellite_ecef).norm(), 2e-3, receiver.name(i) + ", m");
      orbits_.note(std::abs(sent.clock_s - row.satellite_clock_s), 1e-15, receiver.name(i) + ", s");
      if (!row.is_visible) continue;
      constexpr double kStep_s = 0.5;
      const double clock_rate =
          1e-9 * settings.clock_drift_ppb -
          (sent_at(kStep_s).clock_s - sent_at(-kStep_s).clock_s) / (2.0 * kStep_s);
      code_.note(
          std::abs(row.doppler_hz + (row.range_rate_mps + kLight_mps * clock_rate) / kWave_m),
          1e-6 + kDeviations * settings.doppler_noise_hz * row.slant(), receiver.name(i) + ", Hz");
    }
  }

  void compare_observations(const Receiver& receiver, std::int64_t start_ns,
                            const std::vector<RinexEpoch>& epochs) {
    constexpr double kStep_s = 1e-7;
    std::size_t num_rows = 0, num_stated = 0;
    std::map<std::pair<std::int64_t, int>, const RinexObservation*> stated;
    for (const RinexEpoch& epoch : epochs)
      for (const RinexObservation& one : epoch.satellites) {
        stated[{epoch.gps_steps, one.prn}] = &one;
        ++num_stated;
      }
    std::set<int> before, now;  // satellites of the epoch before that were visible, and of this one
    for (std::size_t i = 0; i < receiver.rows.size(); ++i) {
      const Row& row = receiver.rows[i];
      if (i > 0 && row.time_s != receiver.rows[i - 1].time_s) {
        before = std::move(now);
        now.clear();
      }
      if (!row.is_visible) continue;
      now.insert(row.prn);
      ++num_rows;
      const double by_clock_s =
          1e-9 * static_cast<double>(start_ns % 100) + row.time_s + row.receiver_clock_s;
      // Half way between two stamps either is right.
      std::int64_t steps = std::llround(by_clock_s / kStep_s) - 1;
      auto found = stated.end();
      for (int k = 0; k < 3 && found == stated.end(); ++k, ++steps)
        if (std::abs(by_clock_s - static_cast<double>(steps) * kStep_s) <= 0.5001 * kStep_s)
          found = stated.find({start_ns / 100 + steps, row.prn});
      --steps;
      if (found == stated.end()) {
        files_.expect(false, "{}: no observation of PRN {} at {} s",
                      receiver.file("observations.rnx"), row.prn, by_clock_s);
        continue;
      }
      // Ranges count from the stamp; the format has three decimals.
      const double left_m = kLight_mps * (by_clock_s - static_cast<double>(steps) * kStep_s);
      constexpr double kHalf = 0.5e-3 + 1e-6;
      files_.expect(
          std::abs(found->second->pseudorange_m - (row.pseudorange_m - left_m)) <= kHalf &&
              std::abs(found->second->carrier_cycles - (row.carrier_cycles - left_m / kWave_m)) <=
                  kHalf &&
              std::abs(found->second->doppler_hz - row.doppler_hz) <= kHalf &&
              found->second->is_new == !before.contains(row.prn),
          "{}: PRN {} at {} s has other signals than {}", receiver.file("observations.rnx"),
          row.prn, by_clock_s, receiver.name(i));
    }
    files_.expect(num_rows == num_stated && stated.size() == num_stated,
                  "{}: {} observations, where {} were made", receiver.file("observations.rnx"),
                  num_stated, num_rows);
  }

  std::vector<CheckResult> results() const {
    std::vector<CheckResult> all;
    const auto add = [&](CheckResult result, const std::string& summary, const char* reason,
                         const char* detects) {
      if (!result.skipped) {
        result.summary = summary;
        result.reason = reason;
        result.detects = detects;
      }
      all.push_back(std::move(result));
    };
    add(rows_.result("signals"),
        fmt::format("{} statements of rows about satellites, epochs and dilution of precision.",
                    rows_.num_compared),
        "They follow from each other.", "rows of another frame, a count, a dilution");
    add(code_.result("signals_observables", "no satellite is visible"),
        fmt::format("{} pseudoranges, carrier phases and Doppler shifts against ranges, clocks, "
                    "air and the noise that is stated.",
                    code_.num),
        "A normal deviate is beyond 8 once in 1e15; doubles of 2.5e7 m.",
        "a sign of a clock or of the ionosphere, cycles for metres, Doppler of the other sign");
    add(air_.result("signals_air", "no epoch is at the time of a frame with a pose"),
        fmt::format(
            "{} delays by ionosphere and troposphere against Klobuchar's and Saastamoinen's "
            "models, by the validator's own sums.",
            air_.num),
        "The geoid's grid steps by centimetres, of which the troposphere keeps micrometres.",
        "a model that is left out, semicircles for radians, another day's numbers");
    add(range_.result("signals_range", "no epoch is at the time of a frame with a pose"),
        fmt::format("{} ranges and directions from the antenna, by the poses, to the satellites.",
                    range_.num),
        "What poses are rounded to.",
        "a lever arm left out, azimuth from east, an epoch late by one");
    add(rate_.result("signals_range_rate", "no satellite has three epochs after each other"),
        fmt::format("{} range rates, summed by Simpson's rule, against ranges.", rate_.num),
        "By how much the rules of trapezoids and of the middle differ, about each epoch.",
        "a sign, a velocity of the receiver or of the satellite left out");
    add(orbits_.result("signals_orbits", "no row has an orbit in navigation.rnx"),
        fmt::format("{} places and clocks of satellites against navigation.rnx, by the validator's "
                    "own reckoning of IS-GPS-200.",
                    orbits_.num),
        "Two neighbouring records agree to a millimetre.",
        "UTC for GPS time, the Earth's turn while signals travel, another satellite's orbit");
    add(files_.result("signals_rinex"),
        fmt::format("{} observations of observations.rnx against the rows.", files_.num_compared),
        "Three decimals.", "a satellite that is missing, stamps by another clock");
    if (world_.empty() || !exact_)
      all.push_back(
          no_world_.empty()
              ? skipped_result("signals_hidden", "no world to compare with: give --world STORE")
              : unseen_result("signals_hidden", no_world_));
    else if (hidden_.num_compared == 0)
      all.push_back(unseen_result("signals_hidden",
                                  num_uncertain_ > 0
                                      ? "what moves may hide satellites, and plants let them pass"
                                      : "no epoch is at the time of a frame with a pose"));
    else
      add(hidden_.result("signals_hidden"),
          fmt::format("{} satellites, hidden or not, against exact rays through the world's tiles; "
                      "{} within rounding of an edge are left out.",
                      hidden_.num_compared, num_at_edges_),
          "Rays through exact predicates.", "a satellite behind a ridge that is called visible");
    return all;
  }

  std::filesystem::path world_;
  Undulation undulation_m_;
  std::optional<ExactWorld> exact_;
  std::string no_world_;
  Pose world_from_local_;
  FileContradictions rows_, files_, hidden_;
  Share code_, range_, rate_, orbits_, air_;
  std::int64_t num_uncertain_ = 0, num_at_edges_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_signals_check(const ValidateOptions& options) {
  return std::make_unique<SignalsChecker>(options);
}

}  // namespace terracast::validate
