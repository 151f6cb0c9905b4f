#include <fmt/format.h>

#include <limits>

#include "validate/checks/checker.h"

/// What the format's own files say of the cameras against what dataset.json says.
namespace terracast::validate {

namespace {

/// A model's own parameters move places in its plane by about as much where those are near 1, and the image by
/// focal lengths more.
double difference_of_models(const Intrinsics& a, const Intrinsics& b) {
  const std::vector<double>& p = a.plane->parameters();
  const std::vector<double>& q = b.plane->parameters();
  if (a.plane->model() != b.plane->model() || p.size() != q.size())
    return std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) largest = std::max(largest, std::abs(p[i] - q[i]));
  return largest * std::max(a.fx_px, a.fy_px);
}

class CalibrationChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    CheckResult intrinsics;
    intrinsics.name = "calibration_intrinsics";
    intrinsics.bound = 1e-6;
    intrinsics.unit = "px";
    CheckResult rotation;
    rotation.name = "calibration_rotation";
    rotation.bound = 1e-3;
    rotation.unit = "deg";
    CheckResult position;
    position.name = "calibration_position";
    position.bound = 1e-3;
    position.unit = "m";
    std::size_t num_cameras = 0, num_mounts = 0, num_pairs = 0;
    const Camera* reference = nullptr;
    for (const Camera& camera : sequence.cameras) {
      if (!camera.stated) continue;
      const Intrinsics& a = camera.intrinsics;
      const Intrinsics& b = *camera.stated;
      double difference = std::max({std::abs(a.fx_px - b.fx_px), std::abs(a.fy_px - b.fy_px),
                                    std::abs(a.cx_px - b.cx_px), std::abs(a.cy_px - b.cy_px),
                                    std::abs(1.0 * a.width_px - b.width_px),
                                    std::abs(1.0 * a.height_px - b.height_px)});
      if (a.plane && b.plane) difference = std::max(difference, difference_of_models(a, b));
      note_worst(intrinsics, difference, camera.name);
      ++num_cameras;
      if (!camera.body_from_camera) continue;
      ++num_mounts;
      if (reference == nullptr) {
        reference = &camera;
        continue;
      }
      // Mounts are rigid: in every frame the cameras stand to each other as dataset.json says.
      const Pose stated = reference->body_from_camera->inverse() * *camera.body_from_camera;
      for (std::size_t i = 0;
           i < camera.local_from_camera.size() && i < reference->local_from_camera.size(); ++i) {
        if (!camera.local_from_camera[i] || !reference->local_from_camera[i]) continue;
        const Pose found =
            reference->local_from_camera[i]->inverse() * *camera.local_from_camera[i];
        const std::string where =
            fmt::format("{} against {}, frame {}", camera.name, reference->name, i);
        note_worst(
            rotation,
            degrees_from_radians(rotation_angle_rad(stated.rotation.transpose() * found.rotation)),
            where);
        note_worst(position, (stated.translation - found.translation).norm(), where);
        ++num_pairs;
      }
    }
    intrinsics.summary = fmt::format(
        "Largest difference of size, focal lengths, principal point (pixel centres at +0.5) and a "
        "model's own parameters (times the focal length; +inf of another model) between the "
        "format's files and dataset.json, of {} cameras.",
        num_cameras);
    intrinsics.reason = "The format's files hold at least nine digits.";
    intrinsics.detects = "1e-5 px; half a pixel of a wrong centre rule";
    rotation.summary = fmt::format(
        "Cameras against the first camera of dataset.json in {} pairs of poses.", num_pairs);
    rotation.reason = position.reason = "Poses of nine digits leave 1e-6 deg and 1e-5 m.";
    rotation.detects = "0.01 deg between the cameras of a rig";
    position.summary =
        "The same for positions: the baseline of a stereo pair, the offsets of a rig.";
    position.detects = "2 mm of baseline";
    std::vector<CheckResult> results{intrinsics, rotation, position};
    for (CheckResult& result : results) result.ok = result.value <= result.bound;
    if (num_cameras == 0)
      results[0] = unseen_result(results[0].name, "dataset.json says nothing of the cameras");
    for (const std::size_t i : {1, 2}) {
      if (num_mounts < 2)
        results[i] = skipped_result(results[i].name, "no camera stands beside another");
      else if (num_pairs == 0)
        results[i] = unseen_result(results[i].name, "no two cameras have poses of one frame");
    }
    return results;
  }
};

}  // namespace

std::unique_ptr<Checker> make_calibration_check(const ValidateOptions&) {
  return std::make_unique<CalibrationChecker>();
}

}  // namespace terracast::validate
