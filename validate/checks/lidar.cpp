#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/random.h"
#include "validate/body_between.h"
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
/// The columns of a lidar's files, in their order.
enum class In : std::size_t {
  Time,
  X,
  Y,
  Z,
  Range,
  TrueRange,
  Spread,
  Power,
  Reflectance,
  Incidence,
  Ring,
  Pulse,
  Return,
  Returns,
  Class,
  Instance,
  LocalX,
  LocalY,
  LocalZ,
  OriginX,
  OriginY,
  OriginZ
};

/// A frame's scans.
class Scans {
 public:
  Scans(const Dataset& dataset, const SensorRecord& lidar, int frame)
      : name_(fmt::format("{}/{:06}.npy", lidar.file, frame)),
        table_(read_scans(dataset, lidar, frame)) {}
  const std::string& name() const { return name_; }
  std::size_t size() const { return table_.num_rows; }
  double at(In column, std::size_t row) const {
    return table_.number(table_.columns[static_cast<std::size_t>(column)], row);
  }
  /// x, y, z from a column on.
  Vector3d point(In first, std::size_t row) const {
    Vector3d point;
    for (std::size_t axis = 0; axis < 3; ++axis)
      point[static_cast<int>(axis)] =
          at(static_cast<In>(static_cast<std::size_t>(first) + axis), row);
    return point;
  }

 private:
  std::string name_;
  NpyTable table_;
};

/// A head's laser looks at one elevation.
void compare_ring(const SensorRecord& lidar, const Scans& scans, std::size_t row,
                  FileContradictions& found) {
  if (lidar.elevations_deg.empty()) return;
  const auto ring = static_cast<std::size_t>(scans.at(In::Ring, row));
  const Vector3d point = scans.point(In::X, row);
  const double range_m = point.norm();
  if (ring < lidar.elevations_deg.size() && !(range_m > 2.0 * lidar.beams_within_m)) return;
  // By where the beam begins, as the point sees it.
  const double off_deg = degrees_from_radians(std::asin(lidar.beams_within_m / range_m)) + 1e-9;
  const double elevation_deg =
      degrees_from_radians(std::atan2(point.z(), std::hypot(point.x(), point.y())));
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
    const auto at = [&](In column) { return scans.at(column, i); };
    const auto say = [&](const char* words) {
      return fmt::format("{}: row {} {}", scans.name(), i, words);
    };
    found.expect(at(In::Time) >= begin_s - kRounding_s * (1.0 + begin_s) && at(In::Time) < end_s,
                 [&] { return say("is at another time than its frame's scans"); });
    const double returns = at(In::Returns), number = at(In::Return);
    found.expect(number >= 1.0 && number <= returns,
                 [&] { return say("is a return beyond its pulse's"); });
    const double true_m = at(In::TrueRange);
    found.expect(true_m >= lidar.least_range_m - 1e-9 && true_m <= lidar.most_range_m + 1e-9,
                 [&] { return say("has a range outside the sensor's reach"); });
    // Of a million rows a right one is so far out once in 1e12 times.
    constexpr double kDeviations = 8.6;
    found.expect(
        std::abs(at(In::Range) - true_m) <=
            kDeviations * lidar.range_noise_m + 0.5 * lidar.range_step_m + 1e-9 * true_m,
        [&] { return say("shows a range farther from the true one than its noise goes"); });
    // A beam begins at most so far from the sensor's middle, from which the point counts.
    const double norm_m = scans.point(In::X, i).norm();
    found.expect(
        std::abs(norm_m - std::abs(at(In::Range))) <= lidar.beams_within_m + 1e-9 * (1.0 + norm_m),
        [&] { return say("has a range that is not its point's distance"); });
    // Both are rounded to a float32; the faintest powers lose digits.
    constexpr double kFloat = 1e-6, kFaintest = 1.2e-38;
    found.expect(
        std::abs(at(In::Reflectance) - at(In::Power) * true_m * true_m) <=
            kFloat * at(In::Reflectance) + kFaintest * true_m * true_m,
        [&] { return say("has a reflectance that is not its power times the squared range"); });
    found.expect(at(In::Incidence) >= 0.0 && at(In::Incidence) <= 1.5707964,
                 [&] { return say("has an angle of incidence beyond a right one"); });
    found.expect(at(In::Spread) >= 0.0, [&] { return say("has a spread below 0"); });
    compare_ring(lidar, scans, i, found);
    if (i == 0) continue;
    const double later_s = at(In::Time) - scans.at(In::Time, i - 1);
    found.expect(later_s >= 0.0, [&] { return say("is earlier than the one before"); });
    // Within a scan pulses are numbered on; the next scan begins anew.
    const double pulse = at(In::Pulse), pulse_before = scans.at(In::Pulse, i - 1);
    const bool is_next_return = pulse == pulse_before && later_s == 0.0;
    if (is_next_return)
      found.expect(number == scans.at(In::Return, i - 1) + 1.0 &&
                       returns == scans.at(In::Returns, i - 1) &&
                       true_m > scans.at(In::TrueRange, i - 1),
                   [&] { return say("is not the next return of its pulse"); });
    else
      found.expect(number == 1.0 && scans.at(In::Return, i - 1) == scans.at(In::Returns, i - 1),
                   [&] { return say("begins a pulse before the last one's returns are told"); });
    // At a scan's border a time may be rounded to either side.
    const double turns = at(In::Time) * lidar.rate_hz,
                 turns_before = scans.at(In::Time, i - 1) * lidar.rate_hz;
    const double rounding = 1e-9 + 1e-15 * turns;
    const bool is_new_scan = std::floor(turns + rounding) > std::floor(turns_before - rounding);
    found.expect(is_next_return || is_new_scan || pulse > pulse_before,
                 [&] { return say("has a pulse's number below the one before"); });
  }
}

/// The largest of a lidar's values as shares of what is allowed.
struct WorstShare {
  double share = 0.0;
  std::int64_t num_compared = 0;
  std::string where;

  void note(double off_m, double allowed_m, const std::string& place) {
    ++num_compared;
    const double now = std::isfinite(off_m) && std::isfinite(allowed_m) ? off_m / allowed_m : 1e300;
    if (now <= share && !where.empty()) return;
    share = now;
    where = fmt::format("{}: {:.3g} m of {:.3g} m", place, off_m, allowed_m);
  }
};

CheckResult result_of(const char* name, const WorstShare& worst) {
  CheckResult result;
  result.name = name;
  result.value = worst.share;
  result.bound = 1.0;
  result.unit = "of what rounding and poses allow";
  result.ok = result.is_within_bound();
  result.worst = worst.where;
  return result;
}

/// What the places of a lidar's points show.
struct Places {
  std::string sensor;  ///< "rig/name"
  WorstShare worst;
  /// Whether some point would be displaced by three times what is allowed, if the frame's pose were taken for the pulse's.
  bool would_show_frame_pose = false;
  std::vector<double> allowed_m;

  bool is_seen() const {
    return worst.num_compared > 0 && (worst.share > 1.0 || would_show_frame_pose);
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
        "Rows of {} points of {} scanners, each and against the one before: times, pulses, "
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
    places_.push_back({.sensor = lidar.rig + "/" + lidar.name, .worst = {}, .allowed_m = {}});
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
        const std::size_t row =
            begin + core::random_bits(seed_, static_cast<std::uint64_t>(frame), k) % (end - begin);
        compare_place(lidar, body, *scans, row);
        if (exact_ && lidar.num_rays == 1) compare_with_world(sequence, *scans, row);
      }
    }
    num_beams_ += lidar.num_rays == 1 ? 0 : 1;
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

  /// The point by the pose at its own time, against where it is said to be.
  void compare_place(const SensorRecord& lidar, const BodyBetween& body, const Scans& scans,
                     std::size_t row) {
    const double time_s = scans.at(In::Time, row);
    const std::optional<BodyBetween::Placed> placed = body.at(time_s);
    const std::optional<Pose> frame = body.at_frame_before(time_s);
    if (!placed || !frame) return;
    // A beam's direction is its point's, but for where it begins.
    const Vector3d shown = scans.point(In::X, row);
    const double range_m = std::max(shown.norm(), 1e-3);
    const double further_m = scans.at(In::TrueRange, row) - scans.at(In::Range, row);
    const Vector3d in_body = lidar.body_from_sensor * Vector3d(shown * (1.0 + further_m / range_m));
    const double sideways_m = std::abs(further_m) * std::min(1.0, lidar.beams_within_m / range_m);
    constexpr double kRounding_m = 1e-7;
    const double allowed_m =
        kRounding_m + placed->doubt_m + in_body.norm() * placed->doubt_rad + sideways_m;
    const Vector3d local = scans.point(In::LocalX, row);
    const std::string place = fmt::format("{}, row {}", scans.name(), row);
    Places& places = places_.back();
    places.worst.note((placed->local_from_body * in_body - local).norm(), allowed_m, place);
    // The beam begins near the sensor.
    const Vector3d middle = placed->local_from_body * lidar.body_from_sensor.translation;
    const double apart_m = (scans.point(In::OriginX, row) - middle).norm();
    places.worst.note(std::max(0.0, apart_m - lidar.beams_within_m), allowed_m,
                      place + ", where its beam begins");
    places.allowed_m.push_back(allowed_m);
    const double displaced_m = (placed->local_from_body * in_body - *frame * in_body).norm();
    places.would_show_frame_pose |= displaced_m > 3.0 * allowed_m;
  }

  /// From where its beam begins nothing stands before the point, and at the point the world does.
  void compare_with_world(const Sequence& sequence, const Scans& scans, std::size_t row) {
    const auto instance = static_cast<std::uint32_t>(scans.at(In::Instance, row));
    if (sequence.moving) {
      // What moves may also hide the world.
      ++num_moving_;
      return;
    }
    const Vector3d from = world_from_local_ * scans.point(In::OriginX, row);
    const Vector3d point = world_from_local_ * scans.point(In::LocalX, row);
    const double range_m = (point - from).norm();
    if (!(range_m > 0.0)) return;
    const Vector3d direction = (point - from) / range_m;
    // Coordinates of two frames, carried to the triangle's plane.
    constexpr double kRounding_m = 1e-6;
    const auto hit_from = [&](const Vector3d& start) {
      return exact_->first_hit(ExactRay{start, start + OracleView::kThrough_m * direction},
                               (range_m + 1.0) / OracleView::kThrough_m);
    };
    const auto off_of = [&](const std::optional<ExactHit>& hit) {
      return hit ? std::abs(hit->t * OracleView::kThrough_m - range_m) : range_m;
    };
    const std::optional<ExactHit> hit = hit_from(from);
    const double sine = hit ? std::max(1e-6, std::abs(hit->normal_world.dot(direction))) : 1.0;
    const double allowed_m = kRounding_m / sine;
    if (off_of(hit) > allowed_m && is_at_edge(from, direction, hit_from, off_of, allowed_m)) {
      ++num_at_edges_;
      return;
    }
    const std::string place = fmt::format("{}, row {}", scans.name(), row);
    surface_.note(off_of(hit), allowed_m, place);
    if (!hit || off_of(hit) > allowed_m) return;
    rows_.expect(
        hit->object.has_value()
            ? hit->object->instance_id == instance &&
                  hit->object->semantic_class == static_cast<std::uint8_t>(scans.at(In::Class, row))
            : instance == 0,
        "{}: instance {} of class {}, where the world has another", place, instance,
        scans.at(In::Class, row));
  }

  /// Whether a ray that rounding moves meets the point after all: it passes an edge.
  template <class HitFrom, class OffOf>
  static bool is_at_edge(const Vector3d& from, const Vector3d& direction, const HitFrom& hit_from,
                         const OffOf& off_of, double allowed_m) {
    constexpr double kRounding_m = 1e-7;
    const Vector3d aside = direction.unitOrthogonal();
    for (const Vector3d& side : {aside, Vector3d(direction.cross(aside))})
      for (const double sign : {-1.0, 1.0})
        if (off_of(hit_from(from + sign * kRounding_m * side)) <= allowed_m + kRounding_m)
          return true;
    return false;
  }

  CheckResult deskewed() const {
    constexpr const char* kName = "lidar_place";
    WorstShare worst;
    std::vector<std::string> unseen;
    std::vector<double> allowed_m;
    for (const Places& places : places_) {
      if (!places.is_seen()) {
        unseen.push_back(places.sensor);
        continue;
      }
      allowed_m.insert(allowed_m.end(), places.allowed_m.begin(), places.allowed_m.end());
      worst.num_compared += places.worst.num_compared;
      if (places.worst.share < worst.share && !worst.where.empty()) continue;
      worst.share = places.worst.share;
      worst.where = places.worst.where;
    }
    if (allowed_m.empty())
      return unseen_result(kName,
                           "the body moves too much between frames, or too few frames follow each "
                           "other, to say where it is at a pulse's time");
    CheckResult result = result_of(kName, worst);
    result.unseen_parts = std::move(unseen);
    const auto middle = allowed_m.begin() + static_cast<std::ptrdiff_t>(allowed_m.size() / 2);
    std::nth_element(allowed_m.begin(), middle, allowed_m.end());
    result.smallest = *middle;
    result.summary = fmt::format(
        "{} points and beginnings of beams, by the sensor's mount and the body's pose at their own "
        "times, against their places in the sequence's frame.",
        worst.num_compared);
    result.reason =
        "What poses are rounded to, several times the difference of polynomials through other "
        "frames' poses, and noise across a beam that begins beside the sensor's middle.";
    result.detects = "the frame's pose taken for the pulse's, pulses that are late, a mount, axes";
    return result;
  }

  CheckResult on_world(const Sequence& sequence) const {
    constexpr const char* kName = "lidar_surface";
    if (world_.empty() || sequence.geometry.empty())
      return skipped_result(kName, "no world to compare with: give --world STORE");
    if (!no_world_.empty()) return unseen_result(kName, no_world_);
    if (surface_.num_compared == 0)
      return unseen_result(kName, num_moving_ > 0 ? "what moves may hide the world"
                                  : num_beams_ > 0
                                      ? "points of beams of several rays are means over them"
                                      : "there are no points");
    CheckResult result = result_of(kName, surface_);
    result.smallest = 1e-6;
    result.summary = fmt::format(
        "{} points against exact rays through the world's tiles, from where their beams begin; {} "
        "within rounding of an edge are left out.",
        surface_.num_compared, num_at_edges_);
    result.reason = "Coordinates are doubles; two frames' origins leave 1e-8 m of them.";
    result.detects = "a micrometre across the surface, a point behind something";
    return result;
  }

  std::filesystem::path world_;
  std::uint64_t seed_;
  Undulation undulation_m_;
  std::optional<ExactWorld> exact_;
  std::string no_world_;
  Pose world_from_local_;
  FileContradictions rows_;
  std::vector<Places> places_;
  WorstShare surface_;
  std::int64_t num_rows_ = 0, num_moving_ = 0, num_beams_ = 0, num_at_edges_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_lidar_check(const ValidateOptions& options) {
  return std::make_unique<LidarChecker>(options);
}

}  // namespace terracast::validate
