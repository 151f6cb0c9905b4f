#pragma once

#include <optional>

#include "capture/label_bounds.h"

/// Errors of labels of rolling shutters, whose lines each have a pose of their own (capture/label_bounds.h has those
/// of one pose). The truth is what exact arithmetic makes of the frame's pose, velocity, acceleration, angular
/// velocity and terms of its motion, of the camera's mount, and of the shutter. What the terms differ from the
/// trajectory by is stated with them.
/// threads   safe
namespace terracast::capture {

/// What the pose of a line may err by.
struct PoseError {
  double position_m = 0.0;
  double angle_rad = 0.0;
};
PoseError line_pose_error(const geo::CameraMotion& motion, double offset_s);

/// Errors at an image point of a view that has a motion.
class LineBounds {
 public:
  /// Of a view that outlives it.
  LineBounds(const CameraView& view, const Eigen::Vector2d& pixel);

  /// For ranges and depths by the line's pose, taken as it is.
  const DepthBounds& depth() const { return depth_; }
  /// What the line's pose adds to a range, m; +inf where the ray lies in the surface.
  /// normal_world   of the surface, unit
  /// motion         of the body whose surface it is; null: it stands still
  double range_error_m(double range_m, const Eigen::Vector3d& normal_world,
                       const BodyMotion* motion = nullptr) const;

  /// As FlowBounds::flow_error_px, to a view that has a motion: of the line that sees the point, and of when it does.
  /// range_error_m   what range_error_m adds is counted
  std::optional<LabelError> flow_error_px(const CameraView& to, double range_m,
                                          double range_error_m,
                                          const BodyMotion* motion = nullptr) const;

 private:
  Eigen::Vector2d pixel_;
  double offset_s_;  ///< of the line's time from the frame's
  CameraView line_;  ///< at the line's time, without motion
  PoseError pose_error_;
  DepthBounds depth_;
};

}  // namespace terracast::capture
