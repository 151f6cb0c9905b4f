#include "validate/readers/sensors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "core/error.h"
#include "validate/body_pose.h"
#include "validate/checks/checker.h"
#include "validate/checks/contradictions.h"
#include "validate/oracle/shown_geometry.h"
#include "validate/oracle_view.h"

/// Samples of sensors beside cameras: their times and mounts, and ranges by exact rays through the world's tiles.
namespace terracast::validate {

namespace {

using oracle::ExactHit;
using oracle::ExactRay;
using oracle::ExactWorld;

/// Samples are taken at k / rate, from the first frame's time to before a frame's time after the last.
void compare_times(const SensorRecord& sensor, const Sequence& sequence,
                   FileContradictions& found) {
  // Doubles of seconds; the product of k and 1 / rate may be rounded otherwise than the quotient.
  const auto rounding_s = [](double time_s) { return 1e-12 * std::max(1.0, time_s); };
  for (std::size_t k = 0; k < sensor.times_s.size(); ++k) {
    const double right_s = static_cast<double>(k) / sensor.rate_hz;
    found.expect(std::abs(sensor.times_s[k] - right_s) <= rounding_s(right_s), [&] {
      return fmt::format("{}: sample {} is at {} s, at {} Hz", sensor.file, k, sensor.times_s[k],
                         sensor.rate_hz);
    });
  }
  if (sensor.is_scan) return;  // `lidar` reads them
  const double last_frame_s = (sequence.num_frames - 1) / sequence.rate_hz;
  const double end_s = sequence.num_frames / sequence.rate_hz;
  const double last_s = sensor.times_s.empty() ? -1.0 : sensor.times_s.back();
  const double next_s = last_s + 1.0 / sensor.rate_hz;
  found.expect(last_s < end_s + rounding_s(end_s) &&
                   (next_s > last_frame_s - rounding_s(end_s) || sensor.times_s.empty()),
               "{}: {} samples at {} Hz beside {} frames at {} Hz", sensor.file,
               sensor.times_s.size(), sensor.rate_hz, sequence.num_frames, sequence.rate_hz);
}

void compare_ranges_with_settings(const SensorRecord& sensor, FileContradictions& found) {
  if (!measures_ranges(sensor)) return;
  for (std::size_t k = 0; k < sensor.times_s.size(); ++k) {
    const double range_m = sensor.row(k)[sensor.num_channels - 1];
    found.expect(
        range_m >= sensor.least_range_m &&
            (range_m <= sensor.most_range_m || range_m == std::numeric_limits<double>::infinity()),
        "{}: range {} of sample {} is outside {} to {} m", sensor.file, range_m, k,
        sensor.least_range_m, sensor.most_range_m);
  }
}

/// The body's pose that follows from the rig's mount is one and the same for all that the rig carries.
void compare_mounts(const std::vector<SensorRecord>& sensors, FileContradictions& found) {
  constexpr double kMountRounding = 1e-9;
  std::map<std::string, Pose> body_from_rig;
  for (const SensorRecord& sensor : sensors) {
    const Pose pose = sensor.body_from_sensor * sensor.rig_from_sensor.inverse();
    const auto [known, is_new] = body_from_rig.emplace(sensor.rig, pose);
    found.expect(is_new || ((known->second.rotation - pose.rotation).norm() < kMountRounding &&
                            (known->second.translation - pose.translation).norm() < kMountRounding),
                 "{}: its two mounts put the rig {} elsewhere than another sensor's", sensor.file,
                 sensor.rig);
  }
}

/// Where IMUs say that they are at frames' times, against the poses.
void compare_states(const Dataset& dataset, const Sequence& sequence, const SensorRecord& sensor,
                    FileContradictions& found) {
  const Pose ecef_from_enu = ecef_from_local(sequence.origin);
  const std::optional<Pose> first = local_from_body(sequence, 0);
  for (std::size_t k = 0; k < sensor.times_s.size(); ++k) {
    const std::optional<ImuState> state = sensor.imu_state(k);
    const double frame = sensor.times_s[k] * sequence.rate_hz;
    constexpr double kSameTime = 1e-9;
    if (!state || !sensor.is_known(k) || std::abs(frame - std::round(frame)) > kSameTime ||
        frame > static_cast<double>(sequence.num_frames) - 0.5)
      continue;
    const auto body = local_from_body(sequence, static_cast<std::size_t>(std::lround(frame)));
    if (!body || !first) continue;
    const PoseRounding rounding =
        pose_rounding(dataset.format, (body->translation - first->translation).norm());
    // Coordinates of the Earth's size are rounded to 1e-9 m, in several steps.
    constexpr double kRounding_m = 1e-7, kRounding_rad = 1e-11;
    const Pose right = ecef_from_enu * *body * sensor.body_from_sensor;
    const double off_m = (right.translation - state->ecef_from_sensor.translation).norm();
    const double off_rad =
        rotation_angle_rad(right.rotation.transpose() * state->ecef_from_sensor.rotation);
    found.expect(off_m <= kRounding_m + 4.0 * rounding.position_m +
                              rounding.angle_rad * sensor.body_from_sensor.translation.norm() &&
                     off_rad <= kRounding_rad + 4.0 * rounding.angle_rad,
                 "{}: sample {} stands {:.3g} m and {:.3g} deg off the pose of its frame",
                 sensor.file, k, off_m, degrees_from_radians(off_rad));
  }
}

/// Ranges at the frames' times against the first of the world's surfaces.
class RangeComparison {
 public:
  RangeComparison(const Dataset& dataset, const Sequence& sequence,
                  const std::filesystem::path& world)
      : dataset_(dataset), sequence_(sequence), folder_(world) {
    const oracle::ShownGeometry geometry =
        oracle::read_shown_geometry(dataset.root / sequence.geometry, sequence.geometry);
    for (const oracle::ShownTile& tile : geometry.tiles) tiles_.push_back(tile.key);
    world_from_local_ = world_from_local(folder_, sequence);
    world_.emplace(folder_, tiles_, world_from_enu_of(folder_), viewers());
  }

  void compare(const SensorRecord& sensor) {
    for (std::size_t k = 0; k < sensor.times_s.size(); ++k) {
      const double frame = sensor.times_s[k] * sequence_.rate_hz;
      constexpr double kSameTime = 1e-9;
      if (std::abs(frame - std::round(frame)) > kSameTime) continue;
      const auto at = static_cast<std::size_t>(std::lround(frame));
      if (at >= static_cast<std::size_t>(sequence_.num_frames)) continue;
      if (const auto body = local_from_body(sequence_, at)) compare(sensor, k, at, *body);
    }
  }

  CheckResult result() {
    CheckResult result;
    result.name = "sensors_range";
    if (num_compared_ == 0)
      return unseen_result(
          result.name, "no sample at a frame's time is sure to meet what stands, off its edges");
    result.value = worst_;
    result.bound = 1.0;
    result.unit = "of what rounding allows";
    result.ok = result.is_within_bound();
    result.worst = worst_place_;
    result.summary = fmt::format(
        "{} samples of rangefinders at frames' times against exact rays; {} that may have met what "
        "moves, {} within the poses' rounding of an edge, and those between frames, are left out.",
        num_compared_, num_left_out_, num_at_edges_);
    result.reason =
        "Ranges are doubles; the poses' decimals, carried to the triangle's plane, are what is "
        "allowed.";
    result.detects = "1 mm of range, 1 mm or 0.001 degrees of a mount, at 45 degrees from 100 m";
    return result;
  }

 private:
  /// All that a sequence carries stands above the water or all in it; its first camera tells (docs/render.md).
  oracle::Viewers viewers() const {
    for (const Camera& camera : sequence_.cameras)
      for (const std::optional<Pose>& pose : camera.local_from_camera)
        if (pose)
          return ExactWorld::is_in_water(folder_, tiles_, world_from_local_ * pose->translation)
                     ? oracle::Viewers::InWater
                     : oracle::Viewers::AboveWater;
    return oracle::Viewers::AboveWater;
  }

  std::optional<ExactHit> first_hit(const SensorRecord& sensor, const Eigen::Vector3d& near,
                                    const Eigen::Vector3d& direction) const {
    return world_->first_hit(ExactRay{near, near + OracleView::kThrough_m * direction},
                             (sensor.most_range_m - sensor.least_range_m) / OracleView::kThrough_m);
  }

  /// Whether all rays from about a place meet the plane that the ray from there does, or all of them nothing.
  /// off_m     how far about
  /// on_plane_m   how well ranges show the plane
  bool is_one_surface(const SensorRecord& sensor, const Pose& world_from_sensor,
                      const Eigen::Vector3d& near, const std::optional<ExactHit>& hit, double off_m,
                      double on_plane_m) const {
    const Eigen::Vector3d direction = world_from_sensor.rotation.col(0);
    // Along the ray, too: what stands where its reach begins or ends. Across, four as far as the corners of a square
    // around all places so near.
    const double across_m = std::numbers::sqrt2 * off_m;
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {-1.0, 1.0}) {
        const Eigen::Vector3d from =
            near + sign * (axis == 0 ? off_m : across_m) * world_from_sensor.rotation.col(axis);
        const std::optional<ExactHit> beside = first_hit(sensor, from, direction);
        if (beside.has_value() != hit.has_value()) return false;
        if (!hit) continue;
        const double plane_m =
            hit->normal_world.dot(hit->point_world - from) / hit->normal_world.dot(direction);
        // A ray within the plane meets it nowhere: NaN.
        if (!(std::abs(beside->t * OracleView::kThrough_m - plane_m) <= on_plane_m)) return false;
      }
    return true;
  }

  void compare(const SensorRecord& sensor, std::size_t k, std::size_t frame, const Pose& body) {
    const Pose local_from_sensor = body * sensor.body_from_sensor;
    if (may_meet_what_moves(local_from_sensor, frame)) {
      ++num_left_out_;
      return;
    }
    const Pose world_from_sensor = world_from_local_ * local_from_sensor;
    const Eigen::Vector3d direction = world_from_sensor.rotation.col(0);
    const Eigen::Vector3d near = world_from_sensor.translation + sensor.least_range_m * direction;
    const std::optional<ExactHit> hit = first_hit(sensor, near, direction);
    const double exact_m = hit ? sensor.least_range_m + hit->t * OracleView::kThrough_m
                               : sensor.most_range_m;  // so far at least
    // A micrometre of places, and what the decimals leave of a turn, against the triangle's plane.
    const PoseRounding rounding = pose_rounding(dataset_.format, distance_m(frame));
    const double off_m = 1e-6 + rounding.position_m + exact_m * rounding.angle_rad;
    const double sine = hit ? std::max(1e-6, std::abs(hit->normal_world.dot(direction))) : 1.0;
    const double allowed_m = off_m / sine;
    constexpr double kOfAllowed = 1e-3;  // what a neighbouring plane may add
    if (!is_one_surface(sensor, world_from_sensor, near, hit, off_m, kOfAllowed * allowed_m)) {
      ++num_at_edges_;
      return;
    }
    ++num_compared_;
    const double stored_m = sensor.values[k * sensor.num_channels];
    const std::string where = fmt::format("{}, sample {}", sensor.file, k);
    if (!hit || std::isinf(stored_m)) {
      if (hit.has_value() == std::isinf(stored_m)) note(1e9, where + ": a range without a surface");
      return;
    }
    note(std::abs(stored_m - exact_m) / allowed_m,
         fmt::format("{}: range {:.9g} m, exact {:.9g} m", where, stored_m, exact_m));
  }

  double distance_m(std::size_t frame) const {
    const auto first = local_from_body(sequence_, 0), now = local_from_body(sequence_, frame);
    return first && now ? (now->translation - first->translation).norm() : 0.0;
  }

  /// Bodies count as spheres around their boxes; of a box that is not stated nothing is sure.
  bool may_meet_what_moves(const Pose& local_from_sensor, std::size_t frame) const {
    if (!sequence_.moving) return false;
    const auto ray = Eigen::ParametrizedLine<double, 3>(local_from_sensor.translation,
                                                        local_from_sensor.rotation.col(0));
    for (std::size_t i = 0; i < sequence_.moving->bodies.size(); ++i) {
      const MovingState* state =
          sequence_.moving->state(static_cast<int>(frame), static_cast<int>(i) + 1);
      if (state == nullptr) continue;
      const Eigen::AlignedBox3d& box = sequence_.moving->bodies[i].box_m;
      if (box.isEmpty()) return true;
      const Eigen::Vector3d center = state->local_from_body * box.center();
      if (ray.distance(center) <= 0.5 * box.diagonal().norm()) return true;
    }
    return false;
  }

  void note(double share, std::string where) {
    if (share <= worst_ && !worst_place_.empty()) return;
    worst_ = share;
    worst_place_ = std::move(where);
  }

  const Dataset& dataset_;
  const Sequence& sequence_;
  oracle::WorldFolder folder_;
  std::vector<oracle::TileKey> tiles_;
  Pose world_from_local_;
  std::optional<ExactWorld> world_;
  std::int64_t num_compared_ = 0, num_left_out_ = 0, num_at_edges_ = 0;
  double worst_ = 0.0;
  std::string worst_place_;
};

class SensorsChecker : public Checker {
 public:
  explicit SensorsChecker(const ValidateOptions& options) : world_(options.world) {}

  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    FileContradictions found;
    std::vector<SensorRecord> sensors;
    try {
      sensors = read_sensors(dataset, sequence);
    } catch (const core::Error& error) {
      if (error.kind() == core::ErrorKind::Interrupted) throw;
      found.expect(false, "{}", error.message());
    }
    if (sensors.empty() && found.count == 0)
      return {skipped_result("sensors", "there are no sensors beside the cameras")};
    for (const SensorRecord& sensor : sensors) {
      compare_times(sensor, sequence, found);
      compare_ranges_with_settings(sensor, found);
      compare_states(dataset, sequence, sensor, found);
    }
    compare_mounts(sensors, found);
    CheckResult result = found.result("sensors");
    result.summary = fmt::format(
        "sensors.json and the samples of {} sensors: names, channels, times k / rate, mounts, and "
        "where IMUs are at "
        "frames' times.",
        sensors.size());
    result.reason = "They are doubles, and samples are taken at whole steps.";
    result.detects =
        "a sample that is missing or late; another header; a mount of no rotation; an IMU's state "
        "of another time";
    return {result, ranges(dataset, sequence, sensors)};
  }

 private:
  CheckResult ranges(const Dataset& dataset, const Sequence& sequence,
                     const std::vector<SensorRecord>& sensors) const {
    constexpr const char* kName = "sensors_range";
    const auto is_rangefinder = [](const SensorRecord& s) { return s.kind == "rangefinder"; };
    if (std::none_of(sensors.begin(), sensors.end(), is_rangefinder))
      return skipped_result(kName, "no rangefinder");
    if (world_.empty() || sequence.geometry.empty())
      return skipped_result(kName, "no world to hold it against: give --world STORE");
    try {
      RangeComparison comparison(dataset, sequence, world_);
      for (const SensorRecord& sensor : sensors)
        if (is_rangefinder(sensor)) comparison.compare(sensor);
      return comparison.result();
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input) throw;
      return unseen_result(kName, error.message());  // `oracle` tells of the world
    }
  }

  std::filesystem::path world_;
};

}  // namespace

std::unique_ptr<Checker> make_sensors_check(const ValidateOptions& options) {
  return std::make_unique<SensorsChecker>(options);
}

}  // namespace terracast::validate
