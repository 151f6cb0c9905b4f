#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "validate/body_between.h"
#include "validate/causes/sensor_trial.h"

/// Poses, times, axes, ranges and rings of scanners' points.
namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Columns of a frame's scans that causes look at.
class ScanRows {
 public:
  ScanRows(NpyTable& table, const std::string& file) : table_(table), file_(file) {}

  std::size_t size() const { return table_.num_rows; }
  double at(const char* name, std::size_t row) const {
    return table_.number(table_.column(name, file_), row);
  }
  void set(const char* name, std::size_t row, double value) {
    table_.set_number(table_.column(name, file_), row, value);
  }
  Vector3d point(const std::array<const char*, 3>& names, std::size_t row) const {
    return {at(names[0], row), at(names[1], row), at(names[2], row)};
  }
  void set_point(const std::array<const char*, 3>& names, std::size_t row, const Vector3d& value) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      set(names[axis], row, value[static_cast<Eigen::Index>(axis)]);
  }

 private:
  NpyTable& table_;
  std::string file_;
};

constexpr std::array kShownPoint = {"x_m", "y_m", "z_m"};
constexpr std::array kLocalPoint = {"local_x_m", "local_y_m", "local_z_m"};
constexpr std::array kLocalOrigin = {"local_origin_x_m", "local_origin_y_m", "local_origin_z_m"};

/// frame   whose scans they are
using ChangeScans = std::function<void(ScanRows&, int frame)>;

SensorHypothesis scan_cause(const char* name, std::string words, int rank,
                            const ChangeScans& change) {
  return simple_cause(name, std::move(words), rank, [=](SensorRecord& lidar) {
    const auto before = lidar.change_scans;
    lidar.change_scans = [=, file = lidar.file](NpyTable& scans, int frame) {
      if (before) before(scans, frame);
      ScanRows rows(scans, file);
      change(rows, frame);
    };
    return true;
  });
}

/// A point with what poses say of it.
struct PlacedPoint {
  double time_s;
  Vector3d shown, local;
  Pose local_from_sensor;
  Vector3d velocity_mps;  ///< of the shown point's place, by the sensor's motion
};

std::vector<PlacedPoint> placed_points(const SensorSymptoms& symptoms, const BodyBetween& body) {
  std::vector<PlacedPoint> points;
  constexpr std::size_t kMostOfAFrame = 50;
  const SensorRecord& lidar = symptoms.sensor;
  for (int frame = 0; frame < symptoms.sequence.num_frames; ++frame) {
    NpyTable table = read_scans(symptoms.dataset, lidar, frame);
    const ScanRows rows(table, lidar.file);
    const std::size_t stride = std::max<std::size_t>(1, rows.size() / kMostOfAFrame);
    for (std::size_t row = 0; row < rows.size(); row += stride) {
      const double time_s = rows.at("time_s", row);
      constexpr double kStep_s = 1e-4;
      const auto now = body.at(time_s), before = body.at(time_s - kStep_s),
                 after = body.at(time_s + kStep_s);
      if (!now || !before || !after) continue;
      // With the truth's range, whatever the noise.
      Vector3d shown = rows.point(kShownPoint, row);
      const double range_m = std::max(shown.norm(), 1e-3);
      shown *= 1.0 + (rows.at("true_range_m", row) - rows.at("range_m", row)) / range_m;
      const Vector3d in_body = lidar.body_from_sensor * shown;
      points.push_back(
          {.time_s = time_s,
           .shown = shown,
           .local = rows.point(kLocalPoint, row),
           .local_from_sensor = now->local_from_body * lidar.body_from_sensor,
           .velocity_mps = (after->local_from_body * in_body - before->local_from_body * in_body) /
                           (2.0 * kStep_s)});
    }
  }
  return points;
}

/// The time between pulses of one laser's cycle: the smallest step that is no rounding, of most rows.
double firing_of(const SensorSymptoms& symptoms) {
  const NpyTable table = read_scans(symptoms.dataset, symptoms.sensor, 0);
  const std::vector<double> times_s = table.numbers("time_s", symptoms.sensor.file);
  std::vector<double> steps_s;
  constexpr double kSame_s = 1e-9;
  for (std::size_t i = 1; i < times_s.size(); ++i)
    if (times_s[i] - times_s[i - 1] > kSame_s) steps_s.push_back(times_s[i] - times_s[i - 1]);
  if (steps_s.empty()) return 0.0;
  return *std::min_element(steps_s.begin(), steps_s.end());
}

/// Times that are late by what fits best.
void add_times(const SensorSymptoms& symptoms, const std::vector<PlacedPoint>& points,
               std::vector<SensorHypothesis>& hypotheses) {
  double product = 0.0, squares = 0.0;
  for (const PlacedPoint& point : points) {
    product += point.velocity_mps.dot(point.local - point.local_from_sensor * point.shown);
    squares += point.velocity_mps.squaredNorm();
  }
  if (!(squares > 0.0)) return;
  const double later_s = product / squares;  // the right time is so much later
  const double firing_s = firing_of(symptoms);
  const double firings = firing_s > 0.0 ? later_s / firing_s : 0.0;
  const bool is_whole = std::abs(firings) > 0.5 && std::abs(firings) < 1000.0 &&
                        std::abs(firings - std::round(firings)) < 0.05;
  // Of a whole number of firings the time is known better than by the fit.
  const double right_s = is_whole ? std::round(firings) * firing_s : later_s;
  if (!(std::abs(right_s) > 1e-9)) return;
  SensorHypothesis h = scan_cause("lidar_late", "", 2, [=](ScanRows& rows, int) {
    for (std::size_t row = 0; row < rows.size(); ++row)
      rows.set("time_s", row, rows.at("time_s", row) + right_s);
  });
  const auto undo = h.undo;
  h.undo = [=](SensorRecord& lidar, Cause& cause) {
    if (!undo(lidar, cause)) return false;
    cause.size = right_s;
    cause.unit = "s";
    cause.words = fmt::format(
        "points are {:.6g} s {} than their rows say{}", std::abs(right_s),
        right_s > 0.0 ? "later" : "earlier",
        is_whole ? fmt::format(", which is {:g} firing{}", std::abs(std::round(firings)),
                               std::abs(std::round(firings)) == 1.0 ? "" : "s")
                 : "");
    return true;
  };
  hypotheses.push_back(std::move(h));
}

/// Points placed by one pose where each pulse has its own: that of the frame, or of the scan's beginning.
void add_frame_pose(const SensorSymptoms& symptoms, const std::shared_ptr<const BodyBetween>& body,
                    std::vector<SensorHypothesis>& hypotheses) {
  const auto add_one = [&](const char* words,
                           const std::function<double(double, int)>& taken_at_s) {
    hypotheses.push_back(
        scan_cause("lidar_frame_pose", words, 1, [body, taken_at_s](ScanRows& rows, int frame) {
          for (std::size_t row = 0; row < rows.size(); ++row) {
            const double time_s = rows.at("time_s", row);
            const auto now = body->at(time_s), taken = body->at(taken_at_s(time_s, frame));
            if (!now || !taken) continue;
            const Pose local_from_wrong = now->local_from_body * taken->local_from_body.inverse();
            for (const auto& names : {kLocalPoint, kLocalOrigin})
              rows.set_point(names, row, local_from_wrong * rows.point(names, row));
          }
        }));
  };
  add_one("points are placed by the frame's pose where the pulse's own is meant",
          [rate_hz = symptoms.sequence.rate_hz](double, int frame) { return frame / rate_hz; });
  add_one("points are placed by the pose at their scan's beginning where the pulse's own is meant",
          [rate_hz = symptoms.sensor.rate_hz](double time_s, int) {
            return std::floor(time_s * rate_hz + 1e-9) / rate_hz;
          });
}

void add_axes(const std::vector<PlacedPoint>& points, std::vector<SensorHypothesis>& hypotheses) {
  std::vector<VectorPair> pairs;
  for (const PlacedPoint& point : points)
    pairs.push_back({point.local_from_sensor.inverse() * point.local, point.shown});
  const auto axes = exchange_of_axes(pairs);
  if (!axes) return;
  hypotheses.push_back(scan_cause(
      "lidar_axes", fmt::format("axes of points are exchanged: {}", words_of_axes(*axes)), 1,
      [m = Matrix3d(axes->transpose())](ScanRows& rows, int) {
        for (std::size_t row = 0; row < rows.size(); ++row)
          rows.set_point(kShownPoint, row, m * rows.point(kShownPoint, row));
      }));
}

/// Ranges that are one coordinate of the point.
void add_ranges(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  const NpyTable first = read_scans(symptoms.dataset, symptoms.sensor, 0);
  const std::string& file = symptoms.sensor.file;
  const std::vector<double> ranges = first.numbers("range_m", file);
  for (const char* axis : kShownPoint) {
    const std::vector<double> coordinates = first.numbers(axis, file);
    const bool is_it =
        !ranges.empty() &&
        std::equal(ranges.begin(), ranges.end(), coordinates.begin(), [](double range, double x) {
          return std::abs(range - std::abs(x)) <= 1e-9 * (1.0 + range);
        });
    if (!is_it) continue;
    hypotheses.push_back(scan_cause(
        "lidar_range_axis",
        fmt::format("ranges are along the {} axis where along the beam is meant", axis[0]), 1,
        [](ScanRows& rows, int) {
          for (std::size_t row = 0; row < rows.size(); ++row) {
            const double wrong_m = rows.at("range_m", row);
            const double right_m = rows.point(kShownPoint, row).norm();
            const double error_m = rows.at("true_range_m", row) - wrong_m;
            rows.set("range_m", row, right_m);
            rows.set("true_range_m", row, right_m + error_m);
          }
        }));
  }
}

void add_rings(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  const std::size_t count = symptoms.sensor.elevations_deg.size();
  if (count < 2) return;
  const auto most = static_cast<double>(count - 1);
  hypotheses.push_back(scan_cause("lidar_ring_order", "rings are numbered from the other end", 1,
                                  [=](ScanRows& rows, int) {
                                    for (std::size_t row = 0; row < rows.size(); ++row)
                                      rows.set("ring", row, most - rows.at("ring", row));
                                  }));
  // By elevation, where the firing order is meant, and the other way round.
  std::vector<std::size_t> by_elevation(count), place(count);
  for (std::size_t i = 0; i < count; ++i) by_elevation[i] = i;
  std::stable_sort(by_elevation.begin(), by_elevation.end(), [&](std::size_t a, std::size_t b) {
    return symptoms.sensor.elevations_deg[a] < symptoms.sensor.elevations_deg[b];
  });
  for (std::size_t i = 0; i < count; ++i) place[by_elevation[i]] = i;
  if (by_elevation == place) return;
  hypotheses.push_back(scan_cause(
      "lidar_ring_order", "rings are numbered by elevation where the order of firing is meant", 1,
      [=](ScanRows& rows, int) {
        for (std::size_t row = 0; row < rows.size(); ++row) {
          const auto ring = static_cast<std::size_t>(rows.at("ring", row));
          if (ring < count) rows.set("ring", row, static_cast<double>(by_elevation[ring]));
        }
      }));
}

}  // namespace

void make_lidar_causes(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  if (symptoms.sensor.kind != "lidar" || !symptoms.fails("lidar")) return;
  add_rings(symptoms, hypotheses);
  add_ranges(symptoms, hypotheses);
  const auto body = std::make_shared<const BodyBetween>(symptoms.dataset, symptoms.sequence);
  const std::vector<PlacedPoint> points = placed_points(symptoms, *body);
  if (points.empty()) return;
  add_frame_pose(symptoms, body, hypotheses);
  add_axes(points, hypotheses);
  if (symptoms.fails("lidar_place")) add_times(symptoms, points, hypotheses);
}

}  // namespace terracast::validate
