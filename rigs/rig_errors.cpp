#include "rigs/rig_errors.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "capture/camera_draws.h"
#include "core/error.h"
#include "geo/camera_model.h"
#include "geo/frames.h"
#include "geo/units.h"

namespace terracast::rigs {
namespace {

using capture::CameraDraws;
using core::ErrorKind;
using core::fail;

/// Yaw, pitch and roll of rotation_of_euler_deg. A camera that looks straight up or down is taken to have
/// no roll: yaw says it all.
Eigen::Vector3d euler_deg_of(const Eigen::Matrix3d& turn) {
  constexpr double kUpright = 1e-9;
  const double level = std::hypot(turn(0, 0), turn(1, 0));
  const double pitch = std::atan2(-turn(2, 0), level);
  const bool is_upright = level < kUpright;
  const double yaw =
      is_upright ? std::atan2(-turn(0, 1), turn(1, 1)) : std::atan2(turn(1, 0), turn(0, 0));
  const double roll = is_upright ? 0.0 : std::atan2(turn(2, 1), turn(2, 2));
  return {geo::degrees_from_radians(yaw), geo::degrees_from_radians(pitch),
          geo::degrees_from_radians(roll)};
}

/// A focal length that is longer by a share is one of as much more pixels.
void set_focal_length(const CameraOptions& options, const RigErrorOptions& errors, double deviate,
                      capture::CameraCalibration& camera) {
  std::vector<double>& p = camera.intrinsics.parameters;
  const double share = errors.focal_length_sd_mm > 0.0
                           ? errors.focal_length_sd_mm / options.focal_length_mm
                           : errors.focal_length_sd_px / p[0];
  const double factor = 1.0 + share * deviate;
  if (!(factor > 0.0))
    fail(ErrorKind::Config,
         "the focal length of {} px errs by {} px, which leaves none; give the rig's errors "
         "a smaller focal_length_sd",
         p[0], p[0] * (factor - 1.0));
  p[0] *= factor;
  p[1] *= factor;
}

capture::CameraCalibration true_camera(const RigOptions& rig, const CameraOptions& options,
                                       const capture::CameraCalibration& believed,
                                       const CameraDraws& draws) {
  const RigErrorOptions& errors = rig.errors;
  capture::CameraCalibration camera = believed;
  if (errors.has_focal_length())
    set_focal_length(options, errors, draws.normal(CameraDraws::kFocalLength), camera);
  geo::Rigid3d& pose = camera.rig_from_camera;
  if (errors.has_orientation()) {
    const Eigen::Matrix3d forward = geo::rig_from_forward_camera();
    const Eigen::Vector3d believed_deg =
        euler_deg_of(pose.rotation.toRotationMatrix() * forward.transpose());
    const Eigen::Matrix3d turn =
        rotation_of_euler_deg(
            believed_deg.x() + errors.azimuth_sd_deg * draws.normal(CameraDraws::kAzimuth),
            believed_deg.y() + errors.pitch_sd_deg * draws.normal(CameraDraws::kPitch),
            believed_deg.z() + errors.roll_sd_deg * draws.normal(CameraDraws::kRoll))
            .toRotationMatrix();
    pose.rotation = Eigen::Quaterniond(Eigen::Matrix3d(turn * forward)).normalized();
  }
  if (errors.has_offset()) {
    Eigen::Vector3d error_file_mm;
    for (int axis = 0; axis < 3; ++axis)
      error_file_mm[axis] = errors.offset_sd_mm[static_cast<std::size_t>(axis)] *
                            draws.normal(static_cast<CameraDraws::Draw>(
                                CameraDraws::kOffset + static_cast<std::uint64_t>(axis)));
    pose.translation += rig.rig_from_file() * (error_file_mm * 1e-3);
  }
  geo::make_camera(camera.intrinsics);  // refuses what the model cannot hold
  return camera;
}

}  // namespace

TrueRigs draw_true_rigs(const std::vector<RigOptions>& rigs,
                        const std::vector<capture::CameraCalibration>& believed, std::int64_t seed,
                        const std::string& sequence) {
  const bool has_clocks = std::any_of(rigs.begin(), rigs.end(),
                                      [](const RigOptions& rig) { return rig.errors.has_clock(); });
  TrueRigs drawn;
  for (const RigOptions& rig : rigs) {
    for (const CameraOptions& options : rig.placed_cameras()) {
      const capture::CameraCalibration& camera = believed.at(drawn.cameras.size());
      const CameraDraws draws(seed, sequence, camera);
      core::with_context([&] { drawn.cameras.push_back(true_camera(rig, options, camera, draws)); },
                         fmt::format("drawing the errors of camera {}/{} in sequence {}",
                                     camera.rig, camera.name, sequence));
      if (has_clocks)
        drawn.clocks.push_back(
            {.offset_s = rig.errors.clock_offset_sd_s * draws.normal(CameraDraws::kClockOffset),
             .drift = 1e-6 * rig.errors.clock_drift_sd_ppm * draws.normal(CameraDraws::kClockDrift),
             .jitter_sd_s = rig.errors.clock_jitter_sd_s});
    }
  }
  return drawn;
}

}  // namespace terracast::rigs
