#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "core/error.h"
#include "core/random.h"
#include "validate/body_pose.h"
#include "validate/checks/checker.h"
#include "validate/checks/contradictions.h"
#include "validate/checks/lidar_clouds.h"
#include "validate/geometry.h"
#include "validate/oracle/shown_geometry.h"
#include "validate/oracle_view.h"
#include "validate/readers/sensors.h"

/// Points of scanners: what their rows say of each other, where they lie by the poses at their own times, and whether they
/// lie on the world.
namespace terracast::validate {

namespace {

using Eigen::Vector3d;
using oracle::ExactHit;
using oracle::ExactRay;
using oracle::ExactWorld;

/// Rows of a frame's scans that are held against poses and the world.
constexpr std::size_t kMostRows = 400;
/// A point that is so far off is worth finding; what hides it leaves the check unseen.
constexpr double kWorthFinding_m = 0.05;

/// What a row says.
struct Row {
  double time_s = 0.0;
  Vector3d in_sensor = Vector3d::Zero();  ///< at the true range
  Vector3d local = Vector3d::Zero();
  double true_range_m = 0.0;
  std::uint32_t instance_id = 0;
  std::uint8_t class_id = 0;
};

/// Columns of a frame's scans.
class Scans {
 public:
  Scans(const Dataset& dataset, const SensorRecord& lidar, int frame)
      : name_(fmt::format("{}/{:06}.npy", lidar.file, frame)),
        table_(read_scans(dataset, lidar, frame)) {
    for (const NpyTable::Column& column : table_.columns)
      columns_[column.name] = table_.numbers(column.name, name_);
  }
  const std::string& name() const { return name_; }
  std::size_t size() const { return table_.num_rows; }
  double at(const char* column, std::size_t row) const { return columns_.at(column)[row]; }
  Vector3d point(const std::string& prefix, std::size_t row) const {
    return {at((prefix + "x_m").c_str(), row), at((prefix + "y_m").c_str(), row),
            at((prefix + "z_m").c_str(), row)};
  }
  /// The beam begins so near the sensor that its direction is that of the point, to what ranges are off by.
  Row row(std::size_t i) const {
    const Vector3d shown = point("", i);
    const double range_m = shown.norm();
    const double further_m = at("true_range_m", i) - at("range_m", i);
    return {.time_s = at("time_s", i),
            .in_sensor = range_m > 0.0 ? Vector3d(shown * (1.0 + further_m / range_m)) : shown,
            .local = point("local_", i),
            .true_range_m = at("true_range_m", i),
            .instance_id = static_cast<std::uint32_t>(at("instance_id", i)),
            .class_id = static_cast<std::uint8_t>(at("class_id", i))};
  }

 private:
  std::string name_;
  NpyTable table_;
  std::map<std::string, std::vector<double>> columns_;
};

/// A head's laser looks at one elevation.
void compare_ring(const SensorRecord& lidar, const Scans& scans, std::size_t row,
                  FileContradictions& found) {
  if (lidar.elevations_deg.empty()) return;
  const auto ring = static_cast<std::size_t>(scans.at("ring", row));
  const Vector3d point = scans.point("", row);
  const double range_m = point.norm();
  if (ring < lidar.elevations_deg.size() && !(range_m > 2.0 * lidar.beams_within_m)) return;
  // By where the beam begins, as the point sees it.
  const double off_deg = degrees_from_radians(std::asin(lidar.beams_within_m / range_m)) + 1e-9;
  const double elevation_deg =
      degrees_from_radians(std::asin(std::clamp(point.z() / range_m, -1.0, 1.0)));
  found.expect(ring < lidar.elevations_deg.size() &&
                   std::abs(elevation_deg - lidar.elevations_deg[ring]) <= off_deg,
               [&] {
                 return fmt::format("{}: row {} of ring {} is {:.3f} deg above the horizon",
                                    scans.name(), row, ring, elevation_deg);
               });
}

/// What rows must say of each other, whatever the world.
void compare_rows(const SensorRecord& lidar, const Sequence& sequence, int frame,
                  const Scans& scans, FileContradictions& found) {
  const double begin_s = frame / sequence.rate_hz;
  // The last frame's scan goes on for its own time.
  const double end_s = (frame + 1) / sequence.rate_hz + 1.0 / lidar.rate_hz;
  constexpr double kRounding_s = 1e-12;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const auto at = [&](const char* column) { return scans.at(column, i); };
    const auto say = [&](const char* words) {
      return fmt::format("{}: row {} {}", scans.name(), i, words);
    };
    found.expect(at("time_s") >= begin_s - kRounding_s * (1.0 + begin_s) && at("time_s") < end_s,
                 [&] { return say("is at another time than its frame's scans"); });
    const double returns = at("num_returns"), number = at("return_number");
    found.expect(number >= 1.0 && number <= returns,
                 [&] { return say("is a return beyond its pulse's"); });
    const double true_m = at("true_range_m");
    found.expect(true_m >= lidar.least_range_m - 1e-9 && true_m <= lidar.most_range_m + 1e-9,
                 [&] { return say("has a range outside the sensor's reach"); });
    // Of a million rows a right one is so far out once in 1e12 times.
    constexpr double kDeviations = 8.6;
    found.expect(
        std::abs(at("range_m") - true_m) <=
            kDeviations * lidar.range_noise_m + 0.5 * lidar.range_step_m + 1e-9 * true_m,
        [&] { return say("shows a range farther from the true one than its noise goes"); });
    constexpr double kFloat = 1e-6;
    found.expect(
        std::abs(at("reflectance") - at("power_per_m2") * true_m * true_m) <=
            kFloat * at("reflectance"),
        [&] { return say("has a reflectance that is not its power times the squared range"); });
    found.expect(at("incidence_rad") >= 0.0 && at("incidence_rad") <= 1.5707964,
                 [&] { return say("has an angle of incidence beyond a right one"); });
    found.expect(at("spread_m") >= 0.0, [&] { return say("has a spread below 0"); });
    compare_ring(lidar, scans, i, found);
    if (i == 0) continue;
    const double later_s = at("time_s") - scans.at("time_s", i - 1);
    found.expect(later_s >= 0.0, [&] { return say("is earlier than the one before"); });
    // Within a scan pulses are numbered on; the next scan begins anew.
    const double pulse = at("pulse"), pulse_before = scans.at("pulse", i - 1);
    const bool is_next_return = pulse == pulse_before && later_s == 0.0;
    if (is_next_return)
      found.expect(number == scans.at("return_number", i - 1) + 1.0 &&
                       returns == scans.at("num_returns", i - 1) &&
                       true_m > scans.at("true_range_m", i - 1),
                   [&] { return say("is not the next return of its pulse"); });
    else
      found.expect(
          number == 1.0 && scans.at("return_number", i - 1) == scans.at("num_returns", i - 1),
          [&] { return say("begins a pulse before the last one's returns are told"); });
    const bool is_new_scan = std::floor(at("time_s") * lidar.rate_hz + 1e-9) >
                             std::floor(scans.at("time_s", i - 1) * lidar.rate_hz + 1e-9);
    found.expect(is_next_return || is_new_scan || pulse > pulse_before,
                 [&] { return say("has a pulse's number below the one before"); });
  }
}

/// The body between frames: the polynomials through the poses of four frames about a time, and of three, which tell how
/// far they may be wrong.
class BodyBetween {
 public:
  BodyBetween(const Dataset& dataset, const Sequence& sequence)
      : rate_hz_(sequence.rate_hz), format_(dataset.format) {
    for (std::size_t frame = 0; frame < static_cast<std::size_t>(sequence.num_frames); ++frame)
      poses_.push_back(local_from_body(sequence, frame));
  }

  struct Placed {
    Pose local_from_body;
    double doubt_m = 0.0;
    double doubt_rad = 0.0;
  };
  /// Nothing where too few frames have poses.
  std::optional<Placed> at(double time_s) const {
    const double frame = time_s * rate_hz_;
    const auto nearest = static_cast<std::ptrdiff_t>(std::llround(frame));
    const double off = frame - static_cast<double>(nearest);
    const std::optional<Pose> known = pose(nearest);
    if (!known) return std::nullopt;
    const PoseRounding rounding = pose_rounding(format_, distance_m(*known));
    constexpr double kAtFrame = 1e-9;
    if (std::abs(off) <= kAtFrame) return Placed{*known, rounding.position_m, rounding.angle_rad};
    const auto first = static_cast<std::ptrdiff_t>(std::floor(frame)) - 1;
    const std::optional<Vector6> cubic = between(*known, first, 4, frame);
    const std::optional<Vector6> quadratic = between(*known, nearest - 1, 3, frame);
    if (!cubic || !quadratic) return std::nullopt;
    const Vector6 difference = *cubic - *quadratic;
    // Lagrange's polynomials of poses that are rounded: their weights' sums of magnitudes are below 2 between the middle two.
    return Placed{posed(*known, *cubic), 2.0 * rounding.position_m + difference.head<3>().norm(),
                  2.0 * rounding.angle_rad + difference.tail<3>().norm()};
  }

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  std::optional<Pose> pose(std::ptrdiff_t frame) const {
    if (frame < 0 || frame >= static_cast<std::ptrdiff_t>(poses_.size())) return std::nullopt;
    return poses_[static_cast<std::size_t>(frame)];
  }
  double distance_m(const Pose& at) const {
    return poses_[0] ? (at.translation - poses_[0]->translation).norm() : 0.0;
  }
  /// Place and turn against a pose nearby.
  static Vector6 against(const Pose& near, const Pose& other) {
    Vector6 six;
    six << other.translation - near.translation,
        rotation_vector(near.rotation.transpose() * other.rotation);
    return six;
  }
  static Pose posed(const Pose& near, const Vector6& six) {
    const Vector3d turn = six.tail<3>();
    const double angle = turn.norm();
    Pose pose = near;
    pose.translation += six.head<3>();
    if (angle > 0.0) pose.rotation *= Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
    return pose;
  }
  std::optional<Vector6> between(const Pose& near, std::ptrdiff_t first, int count,
                                 double frame) const {
    Vector6 sum = Vector6::Zero();
    for (int i = 0; i < count; ++i) {
      const std::optional<Pose> one = pose(first + i);
      if (!one) return std::nullopt;
      double weight = 1.0;
      for (int k = 0; k < count; ++k)
        if (k != i) weight *= (frame - static_cast<double>(first + k)) / (i - k);
      sum += weight * against(near, *one);
    }
    return sum;
  }

  double rate_hz_;
  std::string format_;
  std::vector<std::optional<Pose>> poses_;
};

/// The worst of several values by the share of what they may be.
struct WorstShare {
  double share = 0.0;
  double smallest_m = std::numeric_limits<double>::infinity();  ///< that some row would have shown
  std::int64_t num_compared = 0;
  std::string where;

  void note(double off_m, double allowed_m, const std::string& place) {
    ++num_compared;
    smallest_m = std::min(smallest_m, allowed_m);
    const double now = std::isfinite(off_m) && std::isfinite(allowed_m) ? off_m / allowed_m : 1e300;
    if (now <= share && !where.empty()) return;
    share = now;
    where = fmt::format("{}: {:.3g} m of {:.3g} m", place, off_m, allowed_m);
  }
  CheckResult result(const char* name) const {
    CheckResult result;
    result.name = name;
    result.value = share;
    result.bound = 1.0;
    result.unit = "of what rounding and poses allow";
    result.ok = result.is_within_bound();
    result.worst = where;
    result.smallest = smallest_m;
    return result;
  }
};

class LidarChecker : public Checker {
 public:
  explicit LidarChecker(const ValidateOptions& options)
      : world_(options.world),
        seed_(static_cast<std::uint64_t>(options.seed)),
        undulation_m_(options.undulation_m) {}

  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    std::vector<SensorRecord> lidars;
    try {
      lidars = read_sensors(dataset, sequence);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      return {};  // `sensors` tells of it
    }
    std::erase_if(lidars, [](const SensorRecord& sensor) { return sensor.kind != "lidar"; });
    if (lidars.empty()) return {skipped_result("lidar", "there is no lidar")};
    open_world(dataset, sequence);
    for (const SensorRecord& lidar : lidars) {
      compare(dataset, sequence, lidar);
      compare_clouds_of(dataset, sequence, lidar);
    }
    CheckResult rows = rows_.result("lidar");
    rows.summary = fmt::format(
        "What {} points of {} scanners say of themselves and of those beside them: times, pulses, "
        "returns, ranges, noise, power; and clouds of other forms beside them.",
        num_rows_, lidars.size());
    rows.reason = "They are told by the sensor's own rules.";
    rows.detects =
        "a file of another frame, rows or rings in another order, a range beyond its noise";
    return {rows, deskewed(), on_world(sequence)};
  }

 private:
  void open_world(const Dataset& dataset, const Sequence& sequence) {
    if (world_.empty() || sequence.geometry.empty()) return;
    try {
      const oracle::WorldFolder folder(world_);
      std::vector<oracle::TileKey> tiles;
      for (const oracle::ShownTile& tile :
           oracle::read_shown_geometry(dataset.root / sequence.geometry, sequence.geometry).tiles)
        tiles.push_back(tile.key);
      world_from_local_ = world_from_local(folder, sequence);
      exact_.emplace(folder, tiles, world_from_enu_of(folder), viewers(folder, tiles, sequence));
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input) throw;
      no_world_ = error.message();  // `oracle` tells of it
    }
  }
  oracle::Viewers viewers(const oracle::WorldFolder& folder, std::span<const oracle::TileKey> tiles,
                          const Sequence& sequence) const {
    for (const Camera& camera : sequence.cameras)
      for (const std::optional<Pose>& pose : camera.local_from_camera)
        if (pose)
          return ExactWorld::is_in_water(folder, tiles, world_from_local_ * pose->translation)
                     ? oracle::Viewers::InWater
                     : oracle::Viewers::AboveWater;
    return oracle::Viewers::AboveWater;
  }

  void compare(const Dataset& dataset, const Sequence& sequence, const SensorRecord& lidar) {
    const BodyBetween body(dataset, sequence);
    for (int frame = 0; frame < sequence.num_frames; ++frame) {
      std::optional<Scans> scans;
      try {
        scans.emplace(dataset, lidar, frame);
      } catch (const core::Error& error) {
        if (error.kind() != core::ErrorKind::Input) throw;
        rows_.expect(false, "{}", error.message());
        continue;
      }
      num_rows_ += static_cast<std::int64_t>(scans->size());
      compare_rows(lidar, sequence, frame, *scans, rows_);
      const std::size_t count = std::min(kMostRows, scans->size());
      for (std::size_t k = 0; k < count; ++k) {
        // One of each part of as many rows, by the seed.
        const std::size_t begin = k * scans->size() / count;
        const std::size_t end = (k + 1) * scans->size() / count;
        const std::size_t i =
            begin + core::random_bits(seed_, static_cast<std::uint64_t>(frame), k) % (end - begin);
        const Row row = scans->row(i);
        const std::string place = fmt::format("{}, row {}", scans->name(), i);
        const std::optional<BodyBetween::Placed> placed = body.at(row.time_s);
        if (placed) compare_place(lidar, row, *placed, place);
        if (exact_ && placed && lidar.num_rays == 1)
          compare_with_world(sequence, row,
                             placed->local_from_body * lidar.body_from_sensor.translation, place);
      }
      num_beams_ += lidar.num_rays == 1 ? 0 : 1;
    }
  }

  void compare_clouds_of(const Dataset& dataset, const Sequence& sequence,
                         const SensorRecord& lidar) {
    try {
      compare_clouds(dataset, sequence, lidar, undulation_m_, rows_);
    } catch (const core::Error& error) {
      // Scans that cannot be read were told of already.
      if (error.kind() != core::ErrorKind::Input) throw;
    }
  }

  /// Where the point lies by the pose at its own time, against where it is said to.
  void compare_place(const SensorRecord& lidar, const Row& row, const BodyBetween::Placed& placed,
                     const std::string& place) {
    const Pose local_from_sensor = placed.local_from_body * lidar.body_from_sensor;
    const double arm_m = (lidar.body_from_sensor * row.in_sensor).norm();
    // Beams that begin beside the sensor's middle: their noise is not along the place's own direction.
    const double sideways_m =
        lidar.range_noise_m > 0.0 || lidar.range_step_m > 0.0
            ? 10.0 * (lidar.range_noise_m + lidar.range_step_m) / std::max(1.0, row.true_range_m)
            : 0.0;
    constexpr double kRounding_m = 1e-7;
    place_.note((local_from_sensor * row.in_sensor - row.local).norm(),
                kRounding_m + placed.doubt_m + arm_m * placed.doubt_rad + sideways_m, place);
  }

  /// A metre before the point nothing stands, and at the point the world does.
  void compare_with_world(const Sequence& sequence, const Row& row, const Vector3d& eye_local,
                          const std::string& place) {
    if (sequence.moving &&
        std::any_of(sequence.moving->bodies.begin(), sequence.moving->bodies.end(),
                    [&](const MovingBody& one) { return one.instance_id == row.instance_id; })) {
      ++num_moving_;
      return;
    }
    const Vector3d point_world = world_from_local_ * row.local;
    const Vector3d to_eye = world_from_local_ * eye_local - point_world;
    const double before_m = std::min(1.0, 0.5 * to_eye.norm());
    if (!(before_m > 0.0)) return;
    const Vector3d direction = -to_eye.normalized();
    const Vector3d from = point_world - before_m * direction;
    constexpr double kThrough_m = OracleView::kThrough_m;
    const std::optional<ExactHit> hit = exact_->first_hit(
        ExactRay{from, from + kThrough_m * direction}, 4.0 * before_m / kThrough_m);
    const double sine = hit ? std::max(1e-6, std::abs(hit->normal_world.dot(direction))) : 1.0;
    // Coordinates of two frames, carried to the triangle's plane.
    constexpr double kRounding_m = 1e-6;
    const double off_m = hit ? std::abs(hit->t * kThrough_m - before_m) : 4.0 * before_m;
    surface_.note(off_m, kRounding_m / sine, place);
    if (!hit || off_m > kRounding_m / sine) return;
    rows_.expect(hit->object.has_value() ? hit->object->instance_id == row.instance_id &&
                                               hit->object->semantic_class == row.class_id
                                         : row.instance_id == 0,
                 "{}: instance {} of class {}, where the world has another", place, row.instance_id,
                 row.class_id);
  }

  CheckResult deskewed() const {
    constexpr const char* kName = "lidar_place";
    if (place_.num_compared == 0 || (place_.share <= 1.0 && !(place_.smallest_m < kWorthFinding_m)))
      return unseen_result(kName,
                           "the body moves too much between frames, or too few frames follow each "
                           "other, to tell where it is at a pulse's time");
    CheckResult result = place_.result(kName);
    result.summary = fmt::format(
        "{} points, carried by the sensor's mount and the body's pose at their own times, against "
        "their places in the sequence's frame.",
        place_.num_compared);
    result.reason =
        "What poses are rounded to, and by how much polynomials through three and through four of "
        "them differ at the pulse's time.";
    result.detects = "the frame's pose taken for the pulse's, pulses that are late, a mount, axes";
    return result;
  }

  CheckResult on_world(const Sequence& sequence) const {
    constexpr const char* kName = "lidar_surface";
    if (world_.empty() || sequence.geometry.empty())
      return skipped_result(kName, "no world to hold it against: give --world STORE");
    if (!no_world_.empty()) return unseen_result(kName, no_world_);
    if (surface_.num_compared == 0)
      return unseen_result(kName, num_beams_ > 0
                                      ? "points of beams of several rays are means over them"
                                      : "no point at a time at which the body's place is told");
    CheckResult result = surface_.result(kName);
    result.summary = fmt::format(
        "{} points against exact rays through the world's tiles, from a metre before them on; {} "
        "on "
        "what moves are left out.",
        surface_.num_compared, num_moving_);
    result.reason = "Coordinates are doubles; two frames' origins leave 1e-8 m of them.";
    result.detects = "a micrometre across the surface";
    return result;
  }

  std::filesystem::path world_;
  std::uint64_t seed_;
  Undulation undulation_m_;
  std::optional<ExactWorld> exact_;
  std::string no_world_;
  Pose world_from_local_;
  FileContradictions rows_;
  WorstShare place_, surface_;
  std::int64_t num_rows_ = 0, num_moving_ = 0, num_beams_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_lidar_check(const ValidateOptions& options) {
  return std::make_unique<LidarChecker>(options);
}

}  // namespace terracast::validate
