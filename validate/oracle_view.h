#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "validate/frames.h"
#include "validate/oracle/exact_world.h"
#include "validate/oracle/geometry_rules.h"
#include "validate/transfer.h"

/// The images of a dataset in the frame of its world, and how well the dataset's decimals place them
/// there.
namespace terracast::validate {

/// The world's frame from a sequence's: both are tangent to WGS84 at their origins.
/// accuracy   1e-8 m within 100 km, by the validator's own geodesy
Pose world_from_local(const oracle::WorldFolder& world, const Sequence& sequence);

/// East, north and up at places of a world, by the validator's own geodesy.
oracle::WorldFromEnu world_from_enu_of(const oracle::WorldFolder& world);

/// How far a camera may stand, and be turned, from where the renderer had it: by the format's
/// decimals and the arithmetic of both ways between the frames.
struct PoseRounding {
  double position_m = 0.0;
  double angle_rad = 0.0;  ///< of its rays, errors of intrinsics included
};
/// distance_m   from the camera's place in the first frame
PoseRounding pose_rounding(const std::string& format, double distance_m);

/// An image in the world.
struct OracleView {
  View view;
  Pose world_from_camera;  ///< at the frame's time
  PoseRounding rounding;

  const Intrinsics& intrinsics() const { return view.camera->intrinsics; }
  /// When the line through an image point is exposed.
  Pose world_from_line(const Eigen::Vector2d& pixel) const;

  /// Whether it can be computed with: a camera on Earth, a rotation to a thousandth, rays of sane
  /// length.
  bool is_usable() const;

  /// In lengths of the ray of distance 1, to its second point: so far that rounding that point turns the
  /// ray by 1e-16 rad.
  static constexpr double kThrough_m = 0x1.0p20;
  /// The ray through an image point; t times kThrough_m is the distance that images hold.
  oracle::ExactRay ray(const Eigen::Vector2d& pixel) const;
  static double depth_m(const oracle::ExactHit& hit) { return hit.t * kThrough_m; }

  /// Whether a ray comes in through an image point.
  bool has_ray(const Eigen::Vector2d& pixel) const {
    return intrinsics().ray_from_pixel(pixel).allFinite();
  }

  /// Where a point stands in the image, and from where it is seen there.
  struct Sighting {
    Eigen::Vector2d pixel;
    Eigen::Vector3d eye_world;
  };
  /// Nothing when the camera does not see the point, or no line of a rolling shutter meets it.
  std::optional<Sighting> sighting(const Eigen::Vector3d& point_world) const;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_world) const {
    const std::optional<Sighting> seen = sighting(point_world);
    if (!seen) return std::nullopt;
    return seen->pixel;
  }

  /// |sine| of the angle between the ray through a pixel and the triangle that it hits.
  double sine_of_graze(const Eigen::Vector2d& pixel, const oracle::ExactHit& hit) const;

  /// The most that a right depth can differ from the exact one at a hit: float32 twice (the range that
  /// the renderer recorded, and the depth), and the rounding of the pose carried to the triangle's
  /// plane. With n the normal and d the ray of depth 1, a pose off by p and a turn give
  /// (p + depth |d| turn) / |n d|.
  double depth_error_m(const Eigen::Vector2d& pixel, const oracle::ExactHit& hit) const;
};

/// Half of the step between float32 values at a value.
double half_float_step(double value);

/// For the rule of levels: where an image resolves most, at a corner.
double finest_pixels_per_radian(const Intrinsics& camera);

}  // namespace terracast::validate
