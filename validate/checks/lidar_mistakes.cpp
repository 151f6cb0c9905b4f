#include "validate/checks/lidar_mistakes.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Mistake = CheckResult::Mistake;

/// Axes that are exchanged or turned round, but for those that are as they were.
struct OtherAxes {
  Matrix3d wrong_from_right;
  std::string words;  ///< "x is y, y is -x, z is z"
};
const std::vector<OtherAxes>& other_axes() {
  static const std::vector<OtherAxes> kAll = [] {
    std::vector<OtherAxes> all;
    std::array<int, 3> order = {0, 1, 2};
    do {
      for (int signs = 0; signs < 8; ++signs) {
        OtherAxes axes{.wrong_from_right = Matrix3d::Zero(), .words = {}};
        for (int row = 0; row < 3; ++row) {
          const bool is_back = (signs >> row & 1) != 0;
          const int from = order[static_cast<std::size_t>(row)];
          axes.wrong_from_right(row, from) = is_back ? -1.0 : 1.0;
          axes.words += fmt::format("{}{} is {}{}", row == 0 ? "" : ", ", "xyz"[row],
                                    is_back ? "-" : "", "xyz"[from]);
        }
        if (!axes.wrong_from_right.isIdentity()) all.push_back(std::move(axes));
      }
    } while (std::next_permutation(order.begin(), order.end()));
    return all;
  }();
  return kAll;
}

/// Whether nearly all points are where rows have them, after a change of their places.
bool explains(const PlacedRows& placed, const std::vector<ScanPoint>& points,
              const std::function<Vector3d(const Vector3d&)>& change) {
  std::size_t num_right = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    num_right += placed.share(change(points[i].place), i) <= 1.0 ? 1 : 0;
  constexpr double kNearlyAll = 0.99;
  return !points.empty() &&
         static_cast<double>(num_right) >= kNearlyAll * static_cast<double>(points.size());
}

const char* neighbour(int step) { return step > 0 ? "next" : "previous"; }

/// Of points that are those of their own scan.
std::optional<Mistake> mistake_of_places(const Dataset& dataset, const Sequence& sequence,
                                         int frame, const std::vector<ScanRow>& rows,
                                         const std::vector<ScanPoint>& points,
                                         const std::function<std::optional<Pose>(int)>& pose_at) {
  const FormatScans& scans = *sequence.scans;
  const PlacedRows placed(dataset, sequence, scans, pose_at(frame), frame, rows);
  const auto as_it_is = [](const Vector3d& place) { return place; };
  FormatScans otherwise = scans;
  otherwise.is_deskewed = !scans.is_deskewed;
  const bool has_mount = otherwise.camera >= 0 && pose_at(frame).has_value();
  if ((!otherwise.is_deskewed || has_mount) &&
      explains(PlacedRows(dataset, sequence, otherwise, pose_at(frame), frame, rows), points,
               as_it_is))
    return scans.is_deskewed
               ? Mistake{"lidar_not_deskewed",
                         "points are not deskewed: they are where they were at their pulses' "
                         "times, not carried to the frame's"}
               : Mistake{"lidar_deskewed",
                         "points are carried to the frame's time, where the format has them as "
                         "they were at their pulses'"};
  for (const OtherAxes& axes : other_axes()) {
    const Matrix3d back = axes.wrong_from_right.transpose();
    if (explains(placed, points, [&](const Vector3d& place) -> Vector3d { return back * place; }))
      return Mistake{"lidar_axes", "points are along other axes than the format's: " + axes.words};
  }
  return std::nullopt;
}

}  // namespace

bool is_same_mount(const Pose& mount, const Pose& right) {
  // Thirteen digits, of two files.
  constexpr double kDigits = 1e-9;
  return (mount.rotation - right.rotation).cwiseAbs().maxCoeff() <= kDigits &&
         (mount.translation - right.translation).norm() <=
             kDigits * (1.0 + right.translation.norm());
}

std::optional<Mistake> mistake_of_mount(const Pose& mount, const Pose& right) {
  if (is_same_mount(mount, right.inverse()))
    return Mistake{"lidar_mount_inverted",
                   "the lidar's mount is inverted: it takes the camera's points to the lidar"};
  for (const OtherAxes& axes : other_axes())
    if (is_same_mount(mount, Pose{right.rotation * axes.wrong_from_right, right.translation}))
      return Mistake{
          "lidar_mount_axes",
          "the lidar's mount is of other axes than x forward, y left, z up: " + axes.words};
  if (is_same_mount({mount.rotation, right.translation}, right))
    return Mistake{"lidar_mount_moved",
                   fmt::format("the lidar's mount is {:.4g} m beside the right one",
                               (mount.translation - right.translation).norm())};
  return std::nullopt;
}

std::optional<Mistake> mistake_of_points(
    const Dataset& dataset, const Sequence& sequence, int frame, const std::vector<ScanRow>& rows,
    const std::vector<ScanPoint>& points,
    const std::function<std::optional<std::vector<ScanRow>>(int)>& other,
    const std::function<std::optional<Pose>(int)>& pose_at) {
  const FormatScans& scans = *sequence.scans;
  if (rows.size() == points.size())
    if (const auto mistake = mistake_of_places(dataset, sequence, frame, rows, points, pose_at))
      return mistake;
  for (const int step : {1, -1}) {
    const auto others = other(frame + step);
    if (!others || others->size() != points.size()) continue;
    if (scans.is_deskewed && !pose_at(frame + step)) continue;
    if (explains(PlacedRows(dataset, sequence, scans, pose_at(frame + step), frame + step, *others),
                 points, [](const Vector3d& place) { return place; }))
      return Mistake{"lidar_points_of_other_scan",
                     fmt::format("points are those of the {} scan", neighbour(step))};
  }
  return std::nullopt;
}

std::optional<Mistake> mistake_of_labels(DealtScans& dealt, int frame,
                                         const std::vector<ScanLabel>& labels) {
  const auto are_of = [&](const std::vector<ScanRow>& rows, const auto& label_of) {
    if (rows.size() != labels.size() || rows.empty()) return false;
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (label_of(labels[i]) != dealt.label(rows[i])) return false;
    return true;
  };
  const auto lower = [](const ScanLabel& label) { return label.label; };
  const auto upper = [](const ScanLabel& label) { return label.instance; };
  const std::optional<std::vector<ScanRow>> own = dealt.rows_if_whole(frame);
  if (own && are_of(*own, upper))
    return Mistake{"lidar_labels_halves",
                   "labels have the class in the upper 16 bits, where the lower are right"};
  for (const int step : {1, -1}) {
    if (frame + step < 0 || frame + step >= dealt.num_frames()) continue;
    const std::optional<std::vector<ScanRow>> other = dealt.rows_if_whole(frame + step);
    if (other && are_of(*other, lower))
      return Mistake{"lidar_labels_of_other_scan",
                     fmt::format("labels are those of the {} scan", neighbour(step))};
  }
  return std::nullopt;
}

}  // namespace terracast::validate
