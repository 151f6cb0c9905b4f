#include <fmt/format.h>

#include <algorithm>

#include "validate/causes/trial.h"

/// Intrinsics and mounts: the format's files and dataset.json contradict each other, or one of them
/// the images; cameras of which something is swapped.
namespace terracast::validate {

namespace {

using Eigen::Vector3d;

const std::vector<std::string_view> kJudges = {
    "calibration",  "reprojection",       "flow", "stereo", "photometric",
    "georeference", "colmap_observations"};

/// What two sets of intrinsics differ by, in words: `found` against `right`.
struct Difference {
  std::string name, words, unit;
  double size = 0.0;
};
Difference difference_of(const Intrinsics& found, const Intrinsics& right) {
  const double scale = found.fx_px / right.fx_px;
  const Eigen::Vector2d offset(found.cx_px - right.cx_px, found.cy_px - right.cy_px);
  const bool is_focal_off = std::abs(scale - 1.0) > 1e-8;
  const bool is_centre_off = offset.norm() > 1e-7;
  const double scale_y = found.fy_px / right.fy_px;
  // Of another resolution everything is larger by one factor; half a pixel of a centre rule apart.
  const bool is_scaled =
      std::abs(scale_y - scale) < 1e-6 && std::abs(scale - 1.0) > 0.02 &&
      std::abs(found.cx_px - scale * right.cx_px) < 0.51 * std::max(1.0, scale) &&
      std::abs(found.cy_px - scale * right.cy_px) < 0.51 * std::max(1.0, scale);
  if (is_scaled)
    return {"calibration_of_other_size",
            fmt::format("calibration is stale: it is that of images of {:.0f} x {:.0f} px, {:.4g} "
                        "times as large",
                        scale * right.width_px, scale * right.height_px, scale),
            "times", scale};
  if (is_focal_off && is_centre_off)
    return {"calibration_stale",
            fmt::format("calibration is stale: focal length off by {:+.3f} % and principal point "
                        "off by ({:.2f}, {:.2f}) px",
                        100.0 * (scale - 1.0), offset.x(), offset.y()),
            "%", 100.0 * (scale - 1.0)};
  if (is_focal_off)
    return {"focal_length",
            fmt::format("focal length off by {:+.3f} %: {:.6g} px where {:.6g} px is right",
                        100.0 * (scale - 1.0), found.fx_px, right.fx_px),
            "%", 100.0 * (scale - 1.0)};
  const bool is_half = (offset.cwiseAbs() - Eigen::Vector2d(0.5, 0.5)).norm() < 1e-6;
  return {"principal_point",
          fmt::format("principal point off by ({:.4g}, {:.4g}) px{}", offset.x(), offset.y(),
                      is_half ? ": half a pixel, as by the other rule of pixel centres" : ""),
          "px", offset.norm()};
}

void add_intrinsics(std::vector<Hypothesis>& hypotheses) {
  for (const bool is_format_wrong : {true, false}) {
    Hypothesis h;
    h.checks = kJudges;
    h.rank = is_format_wrong ? 0 : 1;
    h.undo = [is_format_wrong](Trial& trial, Cause& cause) {
      std::vector<int> cameras;
      std::optional<Difference> first;
      for (int c = 0; c < trial.num_cameras(); ++c) {
        Camera& camera = trial.camera(c);
        if (!camera.stated || camera.intrinsics == *camera.stated) continue;
        // Images have the size that is found; one that only dataset.json states is wrong there.
        if (is_format_wrong && (camera.stated->width_px != camera.intrinsics.width_px ||
                                camera.stated->height_px != camera.intrinsics.height_px))
          return false;
        Intrinsics& wrong = is_format_wrong ? camera.intrinsics : *camera.stated;
        const Intrinsics right = is_format_wrong ? *camera.stated : camera.intrinsics;
        if (!first) first = difference_of(wrong, right);
        wrong = right;
        cameras.push_back(c);
      }
      if (!first) return false;
      // Cameras that dataset.json does not speak of share the calibration.
      if (is_format_wrong)
        for (int c = 0; c < trial.num_cameras(); ++c)
          if (Intrinsics& own = trial.camera(c).intrinsics; !trial.camera(c).stated) {
            const int width_px = own.width_px, height_px = own.height_px;
            own = trial.camera(cameras[0]).intrinsics;
            own.width_px = width_px;
            own.height_px = height_px;
          }
      cause.name = first->name;
      cause.size = first->size;
      cause.unit = first->unit;
      cause.camera = cameras.size() == 1 ? trial.camera(cameras[0]).name : "";
      cause.words = fmt::format("{}: {}{}", trial.camera_names(cameras), first->words,
                                is_format_wrong ? "" : " in dataset.json");
      // Images of the right size could not be read by the wrong one.
      if (first->name == "calibration_of_other_size") cause.explains = kUnfitSize;
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

/// Places a camera beside another as dataset.json says, in all frames.
void mount(Trial& trial, int camera, int reference) {
  const Camera& fixed = trial.camera(reference);
  Camera& moved = trial.camera(camera);
  const Pose fixed_from_moved = fixed.body_from_camera->inverse() * *moved.body_from_camera;
  // A grey camera that stands where the moved one does goes with it.
  for (Camera& other : trial.sequence.cameras)
    if (!other.body_from_camera && !other.local_from_camera.empty() && other.local_from_camera[0] &&
        moved.local_from_camera[0] &&
        (other.local_from_camera[0]->translation - moved.local_from_camera[0]->translation).norm() <
            1e-9)
      for (std::size_t i = 0; i < other.local_from_camera.size(); ++i)
        if (fixed.local_from_camera[i])
          other.local_from_camera[i] = *fixed.local_from_camera[i] * fixed_from_moved;
  for (std::size_t i = 0; i < moved.local_from_camera.size(); ++i)
    if (moved.local_from_camera[i] && fixed.local_from_camera[i])
      moved.local_from_camera[i] = *fixed.local_from_camera[i] * fixed_from_moved;
}

void set_baseline(Trial& trial) {
  if (!trial.sequence.stereo || trial.dataset->format.starts_with("tartanair")) return;
  const auto& left = trial.camera(trial.sequence.stereo->left).local_from_camera;
  const auto& right = trial.camera(trial.sequence.stereo->right).local_from_camera;
  for (std::size_t i = 0; i < left.size(); ++i)
    if (left[i] && right[i])
      trial.sequence.stereo->baseline_m = (left[i]->inverse() * *right[i]).translation.x();
}

void add_mounts(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails("calibration") && !symptoms.fails_result("georeference_rigidity")) return;
  const int num_cameras = symptoms.trial.num_cameras();
  const auto& all = symptoms.trial.sequence.cameras;
  const bool are_two = std::count_if(all.begin(), all.end(), [](const Camera& camera) {
                         return camera.body_from_camera.has_value();
                       }) == 2;
  for (int camera = 0; camera < num_cameras; ++camera)
    for (const bool is_format_wrong : {true, false}) {
      // Two mounts are held against each other: either may be wrong.
      if (!is_format_wrong && are_two && camera == 0) continue;
      Hypothesis h;
      h.checks = kJudges;
      h.rank = is_format_wrong ? 1 : 2;
      h.undo = [=](Trial& trial, Cause& cause) {
        const int reference = camera == 0 ? 1 : 0;
        if (trial.num_cameras() < 2 || !trial.camera(camera).body_from_camera ||
            !trial.camera(reference).body_from_camera)
          return false;
        const Camera& moved = trial.camera(camera);
        const Camera& fixed = trial.camera(reference);
        if (moved.local_from_camera.empty() || !moved.local_from_camera[0] ||
            !fixed.local_from_camera[0])
          return false;
        const Pose in_format = fixed.local_from_camera[0]->inverse() * *moved.local_from_camera[0];
        const Pose stated = fixed.body_from_camera->inverse() * *moved.body_from_camera;
        const Pose wrong = is_format_wrong ? in_format : stated;
        const Pose right = is_format_wrong ? stated : in_format;
        // A mount is one and the same in all frames.
        for (std::size_t i = 0; i < moved.local_from_camera.size(); ++i)
          if (moved.local_from_camera[i] && fixed.local_from_camera[i] &&
              ((fixed.local_from_camera[i]->inverse() * *moved.local_from_camera[i]).translation -
               in_format.translation)
                      .norm() > 1e-3)
            return false;
        const Vector3d off = wrong.translation - right.translation;
        const double turned_deg =
            degrees_from_radians(rotation_angle_rad(right.rotation.transpose() * wrong.rotation));
        if (off.norm() < 1e-4 && turned_deg < 1e-4) return false;
        const double length = right.translation.norm();
        const bool is_opposite =
            (wrong.translation + right.translation).norm() < 1e-3 && length > 0.01;
        const bool is_along =
            length > 0.01 && wrong.translation.cross(right.translation).norm() < 1e-3 * length;
        if (is_format_wrong)
          mount(trial, camera, reference);
        else
          trial.camera(camera).body_from_camera =
              *trial.camera(reference).body_from_camera * in_format;
        set_baseline(trial);
        cause.camera = trial.camera(camera).name;
        const std::string where = fmt::format(
            "{}{}{}", cause.camera,
            !is_format_wrong && are_two ? " against " + trial.camera(reference).name : "",
            is_format_wrong ? "" : " in dataset.json");
        if (turned_deg > 1e-4) {
          cause.name = "mount_rotation";
          cause.size = turned_deg;
          cause.unit = "deg";
          cause.words = fmt::format(
              "the mount of {} is turned by {:.4g} deg{}", where, turned_deg,
              off.norm() < 1e-3 ? "" : fmt::format(" and moved by {:.4g} m", off.norm()));
        } else if (is_opposite) {
          cause.name = "baseline_sign";
          cause.size = -2.0 * length;
          cause.unit = "m";
          cause.words = fmt::format("the baseline of {} has the opposite sign: {:.4g} m from {}",
                                    where, length, trial.camera(reference).name);
        } else if (is_along) {
          const double found_m = wrong.translation.dot(right.translation) / length;
          cause.name = "baseline";
          cause.size = found_m - length;
          cause.unit = "m";
          cause.words =
              fmt::format("the baseline of {} is {:.4f} m where {:.4f} m is right ({:+.2f} %)",
                          where, found_m, length, 100.0 * (found_m / length - 1.0));
        } else {
          cause.name = "mount_position";
          cause.size = off.norm();
          cause.unit = "m";
          cause.words = fmt::format(
              "the mount of {} is moved by ({:.4g}, {:.4g}, {:.4g}) m right, down, "
              "forward",
              where, off.x(), off.y(), off.z());
        }
        return true;
      };
      hypotheses.push_back(std::move(h));
    }
}

/// What may be swapped between two cameras.
struct Swap {
  const char* what;
  bool color, depth, pose;
};

void add_swaps(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  for (int a = 0; a < trial.num_cameras(); ++a)
    for (int b = a + 1; b < trial.num_cameras(); ++b)
      for (const Swap& swap :
           {Swap{"colours", true, false, false}, Swap{"depths", false, true, false},
            Swap{"images", true, true, false}, Swap{"poses", false, false, true}}) {
        if (swap.depth && (trial.image(a, 0).depth.empty() || trial.image(b, 0).depth.empty()))
          continue;
        Hypothesis h;
        h.checks =
            swap.pose ? std::vector<std::string_view>{"calibration", "georeference", "reprojection"}
            : swap.depth ? std::vector<std::string_view>{"reprojection", "photometric", "stereo"}
                         : std::vector<std::string_view>{"photometric", "stereo"};
        h.rank = swap.color && swap.depth ? 3 : 2;
        h.undo = [=](Trial& t, Cause& cause) {
          if (swap.pose) {
            std::swap(t.camera(a).local_from_camera, t.camera(b).local_from_camera);
          } else {
            for (int f = 0; f < t.num_frames(); ++f) {
              LoadedImage& first = t.edit(a, f);
              LoadedImage& second = t.edit(b, f);
              if (swap.color) {
                std::swap(first.color, second.color);
                std::swap(first.grey, second.grey);
              }
              if (swap.depth) std::swap(first.depth, second.depth);
            }
          }
          set_baseline(t);
          cause.name = "cameras_swapped";
          cause.words = fmt::format("{} of '{}' and '{}' are swapped", swap.what, t.camera(a).name,
                                    t.camera(b).name);
          return true;
        };
        // What no image shows better is no hypothesis worth its checks. Depths that fit no others leave no patches to
        // compare, and so nothing that fails.
        if (swap.color || swap.depth) {
          constexpr double kBetter = 0.95;
          Trial tried = trial;
          Cause ignored;
          h.undo(tried, ignored);
          if (swap.depth ? depth_disagreement(tried) > kBetter * symptoms.depth_disagreement()
                         : color_disagreement(tried) > kBetter * symptoms.color_disagreement())
            continue;
        }
        hypotheses.push_back(std::move(h));
      }
}

}  // namespace

void make_cameras_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (symptoms.fails_result("calibration_intrinsics")) add_intrinsics(hypotheses);
  add_mounts(symptoms, hypotheses);
  if (symptoms.fails("photometric") || symptoms.fails("stereo") || symptoms.fails("calibration") ||
      symptoms.fails("reprojection"))
    add_swaps(symptoms, hypotheses);
}

}  // namespace terracast::validate
