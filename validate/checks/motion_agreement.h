#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "validate/check.h"
#include "validate/geometry.h"

/// What is said of a body's motion at the frames, against the differences between its poses there.
namespace terracast::validate {

/// A body at a frame, in one frame for all.
struct StatedMotion {
  Pose local_from_body;
  Eigen::Vector3d velocity_mps;
  Eigen::Vector3d acceleration_mps2;
  Eigen::Vector3d turn_body_radps;
};

/// What motions say over a step, held against what they differ by.
struct MotionQuantity {
  /// What is left of the differences when the mean is taken off.
  Eigen::Vector3d (*residual)(const StatedMotion& from, const StatedMotion& to, double step_s);
  /// What the mean would be off by if all change happened at one end of the step.
  Eigen::Vector3d (*variation)(const StatedMotion& from, const StatedMotion& to, double step_s);
};
extern const MotionQuantity kVelocity;
extern const MotionQuantity kAcceleration;
extern const MotionQuantity kTurnRate;

struct MotionDescription {
  const char* name;
  double bound;
  const char* unit;
  const char* summary;
  const char* reason;
  const char* detects;
};

/// Median of what is left over all steps, in a unit.
/// motions   one a frame
/// returns   unseen where frames are too few, or too far apart to tell
CheckResult motion_result(const std::vector<std::optional<StatedMotion>>& motions, double step_s,
                          const MotionQuantity& quantity, double unit,
                          const MotionDescription& description);

/// Median speed; at least 1 m/s, for where hardly anything moves.
double typical_speed_mps(const std::vector<std::optional<StatedMotion>>& motions);

}  // namespace terracast::validate
