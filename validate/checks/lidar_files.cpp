#include "validate/checks/lidar_files.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/semantic_class.h"
#include "validate/checks/checker.h"
#include "validate/checks/contradictions.h"
#include "validate/checks/lidar_mistakes.h"
#include "validate/oracle_view.h"
#include "validate/readers/sensors.h"

/// A lidar's points in the format's own files: as many as its scans have, each where its own scan has it, labelled by its
/// class, and on what a camera sees.
namespace terracast::validate {

namespace {

using Eigen::Vector3d;

/// Points that are compared with depth, of a frame.
constexpr std::size_t kMostDepths = 2000;

/// The plane through a pixel and its neighbours, in the camera's frame: normal · point = 1.
struct SeenPlane {
  Vector3d normal;
  double bend = 0.0;  ///< how far the neighbours depart from it, as a share of their inverse depth
};
std::optional<SeenPlane> plane_at(const core::ImageF& depth_m, const Intrinsics& camera, int x,
                                  int y) {
  std::array<std::array<double, 3>, 3> inverse{};
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i) {
      const auto depth = static_cast<double>(depth_m(x + i, y + j));
      if (!(depth > 0.0) || !std::isfinite(depth)) return std::nullopt;
      inverse[static_cast<std::size_t>(j + 1)][static_cast<std::size_t>(i + 1)] = 1.0 / depth;
    }
  const double middle = inverse[1][1];
  const double along_x = 0.5 * (inverse[1][2] - inverse[1][0]);
  const double along_y = 0.5 * (inverse[2][1] - inverse[0][1]);
  double bend = 0.0;
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i)
      bend = std::max(
          bend, std::abs(inverse[static_cast<std::size_t>(j + 1)][static_cast<std::size_t>(i + 1)] -
                         (middle + i * along_x + j * along_y)));
  return SeenPlane{
      .normal = {along_x * camera.fx_px, along_y * camera.fy_px,
                 middle - along_x * (x + 0.5 - camera.cx_px) - along_y * (y + 0.5 - camera.cy_px)},
      .bend = bend / middle};
}

class LidarFilesChecker : public Checker {
 public:
  explicit LidarFilesChecker(const ValidateOptions& options) : is_trial_(options.is_trial) {}

  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    constexpr const char* kName = "lidar_files";
    if (!sequence.scans || is_trial_)
      return {skipped_result(kName, "the format's own files hold no lidar's points")};
    std::optional<DealtScans> dealt;
    try {
      dealt.emplace(dataset, sequence, *sequence.scans);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      files_.expect(false, "{}", error.message());
      return {files_.result(kName)};
    }
    compare(dataset, sequence, *dealt);
    CheckResult files = files_.result(kName);
    files.summary = fmt::format(
        "{} points of {}/{}, in {} files: counts, reflectance, labels, times and mount against its "
        "scans, sensors.json and dataset.json.",
        num_points_, sequence.scans->rig, sequence.scans->name, sequence.scans->points.size());
    files.reason = "They are the same numbers, rounded to float32.";
    files.detects =
        "points, labels or reflectance of another scan or form; a mount that is inverted or turned";
    std::vector<CheckResult> results = {files, place_result(), depth_result()};
    for (CheckResult& result : results)
      if (!result.ok) result.mistake = mistake_;
    return results;
  }

 private:
  void compare(const Dataset& dataset, const Sequence& sequence, DealtScans& dealt) {
    const FormatScans& scans = *sequence.scans;
    compare_mount(sequence, dealt.lidar());
    compare_times(sequence, dealt.lidar());
    read_instance_ids(dataset, scans);
    const Reader& reader = find_reader(dataset.format);
    std::int64_t num_expected = 0;
    for (int frame = 0; frame < sequence.num_frames; ++frame) {
      std::vector<ScanRow> rows;
      try {
        rows = dealt.rows(frame);
      } catch (const core::Error& error) {
        if (error.kind() != core::ErrorKind::Input) throw;
        files_.expect(false, "{}", error.message());
        continue;
      }
      num_expected += static_cast<std::int64_t>(rows.size());
      const auto number = static_cast<std::size_t>(frame);
      if (number >= scans.points.size() || scans.points[number].empty()) continue;
      const std::string& path = scans.points[number];
      const std::optional<std::vector<ScanPoint>> points =
          read_points(dataset, scans, path, rows.size());
      if (points && points->size() == rows.size())
        compare_points(dataset, sequence, dealt, frame, rows, *points, reader);
      else if (points)
        name_points(dataset, sequence, dealt, frame, rows, *points);
      if (points) num_points_ += static_cast<std::int64_t>(points->size());
      if (number < scans.labels.size() && !scans.labels[number].empty())
        compare_labels(dataset, dealt, frame, rows, scans.labels[number]);
    }
    files_.expect(scans.num_points == num_expected,
                  "dataset.json: {} points, where the scans have {}", scans.num_points,
                  num_expected);
    try {
      const std::int64_t num_after = dealt.num_after_last_frame();
      files_.expect(scans.num_after_last_frame == num_after,
                    "dataset.json: {} points after the last frame, where the scans have {}",
                    scans.num_after_last_frame, num_after);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input) throw;
      files_.expect(false, "{}", error.message());
    }
    if (scans.labels.empty()) return;
    files_.expect(scans.num_without_label == num_without_label_,
                  "dataset.json: other counts of points without a label than the scans have");
  }

  void name(const char* name, const std::string& words) {
    if (!mistake_) mistake_ = CheckResult::Mistake{name, words};
  }

  /// The mount in the format's files against those of dataset.json and sensors.json.
  void compare_mount(const Sequence& sequence, const SensorRecord& lidar) {
    const FormatScans& scans = *sequence.scans;
    if (scans.mount_file.empty() || scans.camera < 0) return;
    const Camera& camera = sequence.cameras[static_cast<std::size_t>(scans.camera)];
    if (!camera.body_from_camera) return;
    const Pose right = camera.body_from_camera->inverse() * lidar.body_from_sensor;
    const bool is_right = is_same_mount(scans.camera_from_points, right);
    files_.expect(is_right, "{}: the lidar's mount is not that of sensors.json", scans.mount_file);
    if (is_right) return;
    if (const auto mistake = mistake_of_mount(scans.camera_from_points, right))
      name(mistake->name.c_str(), scans.mount_file + ": " + mistake->words);
  }

  void compare_times(const Sequence& sequence, const SensorRecord& lidar) {
    const FormatScans& scans = *sequence.scans;
    // Time stamps have nine decimals.
    constexpr double kRounding_s = 1.1e-9;
    for (std::size_t i = 0; i < scans.middle_s.size(); ++i) {
      const double frame_s = static_cast<double>(i) / sequence.rate_hz;
      const double half_s = 0.5 / sequence.rate_hz;
      const bool is_last = i + 1 == static_cast<std::size_t>(sequence.num_frames);
      const double end_s = frame_s + (is_last ? std::min(half_s, 1.0 / lidar.rate_hz) : half_s);
      files_.expect(std::abs(scans.begin_s[i] - std::max(0.0, frame_s - half_s)) <= kRounding_s &&
                        std::abs(scans.middle_s[i] - frame_s) <= kRounding_s &&
                        std::abs(scans.end_s[i] - end_s) <= kRounding_s,
                    "scan {} begins, has its middle and ends at {}, {} and {} s", i,
                    scans.begin_s[i], scans.middle_s[i], scans.end_s[i]);
    }
  }

  void read_instance_ids(const Dataset& dataset, const FormatScans& scans) {
    if (scans.instances.empty() || !dataset.files.contains(scans.instances)) return;
    try {
      instances_ =
          parse_instances(core::read_text_file(dataset.root / scans.instances), scans.instances);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      files_.expect(false, "{}", error.message());
    }
  }

  /// Nothing where the file is no list of points, which is noted.
  std::optional<std::vector<ScanPoint>> read_points(const Dataset& dataset,
                                                    const FormatScans& scans,
                                                    const std::string& path,
                                                    std::size_t num_expected) {
    try {
      const std::vector<std::byte> bytes = core::read_file(dataset.root / path);
      if (!scans.is_ply && num_expected > 0 && bytes.size() == 32 * num_expected &&
          !parse_velodyne_float64(bytes).empty()) {
        files_.expect(false, "{}: its numbers are float64, where float32 is right", path);
        name("lidar_float64", fmt::format("{}: numbers are float64 where float32 is right: readers "
                                          "take each for two",
                                          path));
        return std::nullopt;
      }
      std::vector<ScanPoint> points =
          scans.is_ply ? parse_lidar_ply(bytes, path) : parse_velodyne(bytes, path);
      files_.expect(points.size() == num_expected, "{}: {} points, where its scans have {}", path,
                    points.size(), num_expected);
      return points;
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      files_.expect(false, "{}", error.message());
    }
    return std::nullopt;
  }

  void compare_points(const Dataset& dataset, const Sequence& sequence, DealtScans& dealt,
                      int frame, const std::vector<ScanRow>& rows,
                      const std::vector<ScanPoint>& points, const Reader& reader) {
    const FormatScans& scans = *sequence.scans;
    const std::string& path = scans.points[static_cast<std::size_t>(frame)];
    if (!scans.is_ply) compare_reflectance(rows, points, path);
    const std::optional<Pose> local_from_camera =
        scans.camera < 0 ? std::nullopt
                         : sequence.cameras[static_cast<std::size_t>(scans.camera)]
                               .local_from_camera[static_cast<std::size_t>(frame)];
    if (scans.is_deskewed && !local_from_camera) return;
    const PlacedRows placed(dataset, sequence, scans, local_from_camera, frame, rows);
    double worst = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double share = placed.share(points[i].place, i);
      worst = std::max(worst, share);
      if (share > place_share_ || place_worst_.empty()) {
        place_share_ = share;
        place_worst_ = fmt::format("{}, point {}: {:.3g} of what rounding allows", path, i, share);
      }
    }
    num_placed_ += static_cast<std::int64_t>(points.size());
    if (worst > 1.0) name_points(dataset, sequence, dealt, frame, rows, points);
    if (scans.is_deskewed) compare_depth(dataset, sequence, dealt, frame, rows, points, reader);
  }

  void name_points(const Dataset& dataset, const Sequence& sequence, DealtScans& dealt, int frame,
                   const std::vector<ScanRow>& rows, const std::vector<ScanPoint>& points) {
    if (mistake_) return;
    const FormatScans& scans = *sequence.scans;
    const auto other = [&](int at) -> std::optional<std::vector<ScanRow>> {
      if (at < 0 || at >= sequence.num_frames) return std::nullopt;
      return dealt.rows_if_whole(at);
    };
    const auto pose_at = [&](int at) -> std::optional<Pose> {
      if (scans.camera < 0) return std::nullopt;
      return sequence.cameras[static_cast<std::size_t>(scans.camera)]
          .local_from_camera[static_cast<std::size_t>(at)];
    };
    if (const auto mistake =
            mistake_of_points(dataset, sequence, frame, rows, points, other, pose_at))
      name(mistake->name.c_str(),
           scans.points[static_cast<std::size_t>(frame)] + ": " + mistake->words);
  }

  void compare_reflectance(const std::vector<ScanRow>& rows, const std::vector<ScanPoint>& points,
                           const std::string& path) {
    bool is_nothing = true, should_be = false;
    double factor = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double right = rows[i].reflectance;
      is_nothing = is_nothing && points[i].reflectance == 0.0;
      should_be = should_be || right > 0.0;
      if (right > 0.0) factor = points[i].reflectance / right;
      files_.expect(points[i].reflectance == right, [&] {
        return fmt::format("{}: point {} has the reflectance {}, not {}", path, i,
                           points[i].reflectance, right);
      });
    }
    if (is_nothing && should_be)
      name("lidar_reflectance_dropped",
           fmt::format("{}: reflectance is dropped: 0 of all points", path));
    constexpr double kBytes = 255.0;
    if (should_be && std::abs(factor / kBytes - 1.0) < 1e-3)
      name("lidar_reflectance_unit",
           fmt::format("{}: reflectance goes to 255, where 1 is right", path));
  }

  /// Against the planes that a camera sees.
  void compare_depth(const Dataset& dataset, const Sequence& sequence, const DealtScans& dealt,
                     int frame, const std::vector<ScanRow>& rows,
                     const std::vector<ScanPoint>& points, const Reader& reader) {
    const FormatScans& scans = *sequence.scans;
    // Points of wide beams are means; lines of a rolling shutter have places of their own.
    if (scans.depth_camera < 0 || dealt.lidar().num_rays != 1) return;
    const Camera& camera = sequence.cameras[static_cast<std::size_t>(scans.depth_camera)];
    const Camera& placing = sequence.cameras[static_cast<std::size_t>(scans.camera)];
    const auto number = static_cast<std::size_t>(frame);
    if (camera.shutter || !camera.intrinsics.is_sound() || camera.files[number].depth.empty() ||
        !camera.local_from_camera[number] || !placing.local_from_camera[number])
      return;
    core::ImageF depth_m;
    try {
      depth_m = reader.depth(dataset, camera, frame);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      return;  // `structure` tells of it
    }
    const Pose camera_from_points = camera.local_from_camera[number]->inverse() *
                                    *placing.local_from_camera[number] * scans.camera_from_points;
    const double noise_m =
        kDeviations * dealt.lidar().range_noise_m + 0.5 * dealt.lidar().range_step_m;
    const std::size_t step = std::max<std::size_t>(1, points.size() / kMostDepths);
    for (std::size_t i = 0; i < points.size(); i += step) {
      // Objects have parts that are thinner than a pixel; the ground has none.
      if (rows[i].instance_id != 0) continue;
      const Vector3d point = camera_from_points * points[i].place;
      if (!(point.z() > 0.0)) continue;
      const Eigen::Vector2d pixel = camera.intrinsics.pixel_from_point(point);
      if (!pixel.allFinite() || !camera.intrinsics.contains(pixel, 1.0)) continue;
      const auto plane = plane_at(depth_m, camera.intrinsics, static_cast<int>(pixel.x()),
                                  static_cast<int>(pixel.y()));
      constexpr double kMostBend = 0.01;
      if (!plane || plane->bend > kMostBend) continue;
      const double length = plane->normal.norm();
      const double off_m = std::abs(plane->normal.dot(point) - 1.0) / length;
      // The ground between two pixels' centres may leave their plane by as much as pixels are apart.
      const double allowed_m =
          noise_m + 2.0 * plane->bend / length +
          0.5 * point.z() / std::min(camera.intrinsics.fx_px, camera.intrinsics.fy_px);
      depth_shares_.push_back(off_m / allowed_m);
    }
  }

  void compare_labels(const Dataset& dataset, DealtScans& dealt, int frame,
                      const std::vector<ScanRow>& rows, const std::string& path) {
    std::vector<ScanLabel> labels;
    try {
      labels = parse_labels(core::read_file(dataset.root / path), path);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      files_.expect(false, "{}", error.message());
      return;
    }
    files_.expect(labels.size() == rows.size(), "{}: {} labels for {} points", path, labels.size(),
                  rows.size());
    bool is_right = labels.size() == rows.size();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::uint16_t right = dealt.label(rows[i]);
      if (right == 0) ++num_without_label_[class_name(rows[i].class_id)];
      if (i >= labels.size()) continue;
      const ScanLabel& label = labels[i];
      const bool is_known = is_semantic_kitti_label(label.label);
      files_.expect(is_known, [&] {
        return fmt::format("{}: point {} has the label {}, which SemanticKITTI has not", path, i,
                           label.label);
      });
      files_.expect(label.label == right, [&] {
        return fmt::format("{}: point {} of class {} has the label {}, not {}", path, i,
                           class_name(rows[i].class_id), label.label, right);
      });
      is_right = is_right && label.label == right;
      if (label.label == right) compare_instance(rows[i], label, path, i);
    }
    if (is_right || mistake_ || rows.empty()) return;
    if (const auto mistake = mistake_of_labels(dealt, frame, labels))
      name(mistake->name.c_str(), path + ": " + mistake->words);
  }

  void compare_instance(const ScanRow& row, const ScanLabel& label, const std::string& path,
                        std::size_t i) {
    if (!has_instances(label.label) || row.instance_id == 0) {
      files_.expect(label.instance == 0, [&] {
        return fmt::format("{}: point {} of label {} has the instance {}, not 0", path, i,
                           label.label, label.instance);
      });
      return;
    }
    const auto known = instances_.find({label.label, label.instance});
    files_.expect(known != instances_.end() && known->second == row.instance_id, [&] {
      return fmt::format("{}: point {} of instance {} is labelled as another one, {}", path, i,
                         row.instance_id, label.instance);
    });
  }

  static std::string class_name(std::int64_t class_id) {
    const auto names = core::semantic_class_names();
    return class_id >= 0 && static_cast<std::size_t>(class_id) < names.size()
               ? std::string(names[static_cast<std::size_t>(class_id)])
               : fmt::format("number {}", class_id);
  }

  CheckResult place_result() const {
    constexpr const char* kName = "lidar_files_place";
    if (num_placed_ == 0) return unseen_result(kName, "no file of points could be compared");
    CheckResult result;
    result.name = kName;
    result.value = place_share_;
    result.bound = 1.0;
    result.unit = "of what rounding allows";
    result.ok = result.is_within_bound();
    result.worst = place_worst_;
    result.summary = fmt::format(
        "{} points of the format's files, placed by its own poses and mount, against where their "
        "scans have them.",
        num_placed_);
    result.reason = "Coordinates are float32, and poses and mounts rounded to the format's digits.";
    result.detects =
        "points that are not carried to the frame's time (or are, where they should not be), of "
        "another scan, along other axes; an inverted mount";
    return result;
  }

  CheckResult depth_result() {
    constexpr const char* kName = "lidar_files_depth";
    constexpr std::size_t kLeast = 30;
    if (depth_shares_.size() < kLeast)
      return unseen_result(kName,
                           "too few points of the ground lie where a camera's depth is even");
    const auto middle =
        depth_shares_.begin() + static_cast<std::ptrdiff_t>(depth_shares_.size() / 2);
    std::nth_element(depth_shares_.begin(), middle, depth_shares_.end());
    CheckResult result;
    result.name = kName;
    result.value = *middle;
    result.bound = 1.0;
    result.unit = "of what pixels and noise allow";
    result.ok = result.is_within_bound();
    if (!result.ok)
      result.worst = fmt::format("half of {} points lie farther off", depth_shares_.size());
    result.summary = fmt::format(
        "Median distance of {} points of the ground from the plane through the depths of the nine "
        "pixels about them.",
        depth_shares_.size());
    result.reason =
        "Half a pixel on the ground, twice what the nine depart from their plane, and the range's "
        "noise; less than half of the points can be hidden from the camera.";
    result.detects = "points that lie elsewhere than what the camera sees, by more than a pixel";
    return result;
  }

  // Of a million ranges one is so far out once in 1e12 times.
  static constexpr double kDeviations = 8.6;
  bool is_trial_ = false;
  FileContradictions files_;
  std::optional<CheckResult::Mistake> mistake_;
  InstanceIds instances_;
  std::map<std::string, std::int64_t> num_without_label_;
  std::int64_t num_points_ = 0, num_placed_ = 0;
  double place_share_ = 0.0;
  std::string place_worst_;
  std::vector<double> depth_shares_;
};

}  // namespace

std::unique_ptr<Checker> make_lidar_files_check(const ValidateOptions& options) {
  return std::make_unique<LidarFilesChecker>(options);
}

}  // namespace terracast::validate
