#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "validate/causes/trial.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// COLMAP's points: where their observations stand, of which image they are, their colours.
namespace terracast::validate {

namespace {

/// An observation, its point as the file has it, and where the image was.
struct Seen {
  const ColmapObservation* observation;
  Eigen::Vector3d point;
  View view;
};
std::vector<Seen> seen_points(const Trial& trial) {
  std::vector<Seen> seen;
  for (const auto& [id, image] : trial.model->images) {
    const std::size_t slash = image.name.rfind('/');
    if (slash == std::string::npos || image.name.size() < slash + 7) continue;
    const int c = trial.sequence.camera_index(image.name.substr(0, slash));
    const int f = std::atoi(image.name.c_str() + slash + 1) - trial.first_frame;
    if (c < 0 || f < 0 || f >= trial.num_frames()) continue;
    const auto view = view_at(trial.sequence, c, f, &trial.image(c, f));
    if (!view) continue;
    for (const ColmapObservation& observation : image.observations) {
      const auto point = trial.model->points.find(observation.point_id);
      if (point == trial.model->points.end()) continue;
      const auto& p = point->second.position;
      seen.push_back({&observation, {p[0], p[1], p[2]}, *view});
    }
  }
  return seen;
}

/// Half a pixel, or another constant, added to all observations.
void add_offset(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  std::vector<double> off_x, off_y;
  for (const Seen& seen : seen_points(symptoms.trial)) {
    const auto at = Transfer::of_local_point(seen.view, seen.point);
    if (!at || !(at->distance_b_m > 0.0)) continue;
    off_x.push_back(seen.observation->x_px - at->pixel.x());
    off_y.push_back(seen.observation->y_px - at->pixel.y());
  }
  if (off_x.size() < 50) return;
  const Eigen::Vector2d offset(median(off_x), median(off_y));
  if (!(offset.norm() > 1e-5)) return;
  Hypothesis h;
  h.checks = {"colmap_observations"};
  h.rank = 1;
  h.undo = [offset](Trial& t, Cause& cause) {
    auto model = std::make_shared<ColmapModel>(*t.model);
    for (auto& [id, image] : model->images)
      for (ColmapObservation& seen : image.observations) {
        seen.x_px -= offset.x();
        seen.y_px -= offset.y();
      }
    t.model = std::move(model);
    const bool is_half = (offset.cwiseAbs() - Eigen::Vector2d(0.5, 0.5)).norm() < 1e-6;
    cause.name = "observations_offset";
    cause.size = offset.norm();
    cause.unit = "px";
    cause.words = fmt::format(
        "observations of points3D are off by ({:.4g}, {:.4g}) px{}", offset.x(), offset.y(),
        is_half ? ": pixel centres stand at whole numbers where +0.5 is meant" : "");
    return true;
  };
  hypotheses.push_back(std::move(h));
}

/// Each image has the observations of the same camera's next or last frame.
void add_shifts(std::vector<Hypothesis>& hypotheses) {
  for (const int shift : {1, -1}) {
    Hypothesis h;
    h.checks = {"colmap_observations"};
    h.rank = 2;
    h.undo = [shift](Trial& t, Cause& cause) {
      auto model = std::make_shared<ColmapModel>(*t.model);
      std::map<std::pair<std::string, int>, std::int64_t> by_place;
      for (const auto& [id, image] : model->images) {
        const std::size_t slash = image.name.rfind('/');
        if (slash != std::string::npos && image.name.size() >= slash + 7)
          by_place[{image.name.substr(0, slash), std::atoi(image.name.c_str() + slash + 1)}] = id;
      }
      for (const auto& [place, id] : by_place) {
        const auto from = by_place.find({place.first, place.second - shift});
        auto& list = model->images.at(id).observations;
        if (from == by_place.end())
          list.clear();
        else
          list = t.model->images.at(from->second).observations;
      }
      t.model = std::move(model);
      cause.name = "tracks_of_other_frame";
      cause.size = shift;
      cause.unit = "frames";
      cause.words = fmt::format(
          "points3D have another frame's tracks: the observations of each image are those of the "
          "frame {}",
          shift > 0 ? "after" : "before");
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

/// Places: true = linear * file + offset.
struct Affine {
  Eigen::Matrix3d linear;
  Eigen::Vector3d offset;
};

/// The affine map that brings the points to where their observations see them: with a ray's direction d through a
/// camera at c, the point q has d x (R (q - c)) = 0, which is linear in the map.
std::optional<Affine> fit_affine(const std::vector<Seen>& seen) {
  constexpr std::size_t kEnough = 100;
  if (seen.size() < kEnough) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Seen& one : seen) middle += one.point / static_cast<double>(seen.size());
  double size = 0.0;
  for (const Seen& one : seen)
    size += (one.point - middle).norm() / static_cast<double>(seen.size());
  if (!(size > 0.0)) return std::nullopt;
  using Row = Eigen::Matrix<double, 1, 12>;
  Eigen::Matrix<double, 12, 12> normal = Eigen::Matrix<double, 12, 12>::Zero();
  Eigen::Matrix<double, 12, 1> right = Eigen::Matrix<double, 12, 1>::Zero();
  for (const Seen& one : seen) {
    const Eigen::Vector2d pixel(one.observation->x_px, one.observation->y_px);
    const Eigen::Vector3d d = one.view.camera->intrinsics.ray_from_pixel(pixel).normalized();
    Eigen::Matrix3d cross;
    cross << 0, -d.z(), d.y(), d.z(), 0, -d.x(), -d.y(), d.x(), 0;
    const Pose pose = pose_of_line(one.view, pixel);
    const Eigen::Matrix3d m = cross * pose.rotation.transpose();
    const Eigen::Vector3d from = (one.point - middle) / size;
    for (int r = 0; r < 3; ++r) {
      Row row;
      for (int k = 0; k < 3; ++k) row.segment<3>(3 * k) = from[k] * m.row(r);
      row.tail<3>() = m.row(r);
      normal += row.transpose() * row;
      right += row.transpose() * (m.row(r) * pose.translation).value();
    }
  }
  const Eigen::LDLT<Eigen::Matrix<double, 12, 12>> factored(normal);
  if (factored.info() != Eigen::Success || factored.rcond() < 1e-13) return std::nullopt;
  const Eigen::Matrix<double, 12, 1> x = factored.solve(right);
  Affine affine;
  for (int k = 0; k < 3; ++k) affine.linear.col(k) = x.segment<3>(3 * k) / size;
  affine.offset = x.tail<3>() - affine.linear * middle;
  return affine;
}

/// What was done to the points, of which `undo` is the opposite, in words; nothing of what is neither moved, nor scaled,
/// nor turned.
bool describe(const Affine& undo, Cause& cause) {
  constexpr double kNone = 1e-6;  // of the linear part
  constexpr double kNone_m = 1e-3;
  const double scale = std::cbrt(std::abs(undo.linear.determinant()));
  if (!(scale > 0.0)) return false;
  const Eigen::Matrix3d turn = undo.linear / scale;
  if ((turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-5) return false;
  Eigen::Matrix3d swap;
  swap << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  const Eigen::Vector3d moved = -undo.linear.inverse() * undo.offset;
  const bool is_moved = undo.offset.norm() > kNone_m;
  const bool is_scaled = std::abs(scale - 1.0) > kNone;
  const double turned_deg = degrees_from_radians(rotation_angle_rad(turn));
  struct Unit {
    double factor;
    const char* words;
  };
  cause.name = "points_moved";
  if ((turn - swap).norm() < kNone) {
    cause.name = "points_axes";
    cause.words = "points3D stand in north, east, down where east, north, up is meant";
  } else if (const Eigen::Matrix3d whole = turn.array().round();
             (turn - whole).norm() < kNone && !whole.isIdentity()) {
    cause.name = "points_axes";
    cause.words = "points3D stand in other axes than the poses";
  } else if ((turn - Eigen::Matrix3d::Identity()).norm() > kNone) {
    cause.name = "points_turned";
    cause.size = turned_deg;
    cause.unit = "deg";
    cause.words = fmt::format("points3D are turned by {:.4g} deg", turned_deg);
  } else if (is_scaled) {
    cause.name = "points_scaled";
    cause.size = 1.0 / scale;
    cause.unit = "times";
    cause.words = fmt::format("points3D are scaled by {:.6g}", cause.size);
    for (const Unit& unit : {Unit{1e3, "millimetres"}, Unit{1e2, "centimetres"},
                             Unit{1e-3, "kilometres"}, Unit{1.0 / 0.3048, "feet"}})
      if (std::abs(scale * unit.factor - 1.0) < 1e-6)
        cause.words = fmt::format("points3D are in {} where metres are meant", unit.words);
  } else if (is_moved) {
    cause.size = moved.norm();
    cause.unit = "m";
    cause.words = fmt::format("points3D are moved by ({:.4g}, {:.4g}, {:.4g}) m", moved.x(),
                              moved.y(), moved.z());
    return true;
  } else {
    return false;
  }
  if (is_moved)
    cause.words +=
        fmt::format(" and moved by ({:.4g}, {:.4g}, {:.4g}) m", moved.x(), moved.y(), moved.z());
  return true;
}

/// Points that stand elsewhere than all their observations see them, all in one way.
void add_places(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const std::optional<Affine> undo = fit_affine(seen_points(symptoms.trial));
  Cause found;
  if (!undo || !describe(*undo, found)) return;
  Hypothesis h;
  h.checks = {"colmap_observations", "colmap_point_depths"};
  h.rank = 1;
  h.undo = [undo = *undo, found](Trial& t, Cause& cause) {
    auto model = std::make_shared<ColmapModel>(*t.model);
    for (auto& [id, point] : model->points) {
      auto& p = point.position;
      const Eigen::Vector3d right = undo.linear * Eigen::Vector3d(p[0], p[1], p[2]) + undo.offset;
      p = {right.x(), right.y(), right.z()};
    }
    t.model = std::move(model);
    cause = found;
    return true;
  };
  hypotheses.push_back(std::move(h));
}

}  // namespace

void make_colmap_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.trial.model) return;
  if (symptoms.fails_result("colmap_reprojection")) {
    add_offset(symptoms, hypotheses);
    add_places(symptoms, hypotheses);
    add_shifts(hypotheses);
  }
  if (symptoms.fails_result("colmap_color")) {
    Hypothesis h;
    h.checks = {"colmap_point_colors"};
    h.rank = 1;
    h.undo = [](Trial& t, Cause& cause) {
      auto model = std::make_shared<ColmapModel>(*t.model);
      for (auto& [id, point] : model->points) std::swap(point.color[0], point.color[2]);
      t.model = std::move(model);
      cause.name = "channel_order";
      cause.words =
          "colours of points3D and of the images stand in another order: one of them is blue, "
          "green, "
          "red (BGR)";
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

}  // namespace terracast::validate
