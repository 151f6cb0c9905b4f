#pragma once

#include <cstdint>
#include <span>

#include "capture/labels.h"

/// Bounds on the error of labels, by running error analysis (Higham, Accuracy and Stability of
/// Numerical Algorithms, 2002, section 3.3): each operation in double adds half a step of its
/// result, u = 2^-53, to what its operands err by. The truth is what exact arithmetic makes of the
/// same doubles: intrinsics, camera poses (a quaternion stands for the rotation v -> q v q^-1, whatever
/// its length), heights of the tiles.
///
/// accuracy   never below the error, and the largest of a frame less than 100 times the frame's largest
///            error: LabelBounds tests, against 113-bit arithmetic
/// threads    safe
namespace terracast::capture {

struct CameraFrame;

/// What a label may err by.
struct LabelError {
  double arithmetic = 0.0;  ///< in doubles, from pixel to label
  /// The capture keeps ranges as float32, and labels are kept as float32 again.
  double rounding = 0.0;
  bool operator==(const LabelError&) const = default;
};

/// The tile that a ray meets. Its centre is within a metre of the middle between the ground's lowest and highest
/// heights.
struct TileScale {
  double spacing_m = 0.0;  ///< between samples
  double lowest_z_world = 0.0;
  double highest_z_world = 0.0;  ///< of all that stands on it, too
};

/// Errors of one view's ranges and depths.
class DepthBounds {
 public:
  explicit DepthBounds(const CameraView& view);

  /// By how much a traced range may differ from the exact crossing of the pixel's ray and the
  /// triangle's plane, m, before it is rounded to float32; +inf where the ray is so nearly in the plane
  /// that floats do not tell.
  /// range_m        as traced or as kept, not sky
  /// normal_world   of the triangle, unit, upward; float32 will do
  double range_error_m(const Eigen::Vector2d& pixel, double range_m,
                       const Eigen::Vector3d& normal_world, const TileScale& tile) const;

  /// The same of a triangle of an object.
  /// crossing_error   what the t of the crossing may differ by for the pixel's ray as it was traced
  ///                  (world/crossing_error.h)
  double object_range_error_m(const Eigen::Vector2d& pixel, double range_m,
                              const Eigen::Vector3d& normal_world, double crossing_error) const;

  /// Of depth_from_range of a kept range, m.
  /// range_m         as kept, not sky
  /// range_error_m   of the traced range
  LabelError depth_error_m(const Eigen::Vector2d& pixel, double range_m,
                           double range_error_m) const;

 private:
  /// A pixel's ray in the world, of depth 1.
  struct Aim {
    double length;
    Eigen::Vector3d direction;
    Eigen::Vector3d error;  ///< of each component
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    Eigen::Vector3d origin_error = Eigen::Vector3d::Zero();  ///< likewise

    /// Of the range to t.
    double range_error_m(double t, double t_error) const;
  };
  Aim aim_at(const Eigen::Vector2d& pixel) const;
  void set_origin(const Eigen::Vector2d& pixel, Aim& aim) const;

  const geo::CameraModel& model_;
  Eigen::Vector3d origin_world_;
  Eigen::Matrix3d rotation_;
  Eigen::Matrix3d rotation_error_;  ///< of each entry
};

/// Errors of flow() from one view to another.
class FlowBounds {
 public:
  FlowBounds(const CameraView& from, const CameraView& to);

  /// Of the vector, px.
  /// range_m         as kept; +inf: sky
  /// range_error_m   of the traced range
  /// returns         nothing where the point does not come to lie in the image
  std::optional<LabelError> flow_error_px(const Eigen::Vector2d& pixel, double range_m,
                                          double range_error_m) const;
  /// The same of a point of something that moves, of global shutters.
  /// returns   nothing besides where it is not there at the frame of `to`
  std::optional<LabelError> flow_error_px(const Eigen::Vector2d& pixel, double range_m,
                                          double range_error_m, const BodyMotion& motion) const;

 private:
  /// A point, or a direction, in the camera of `to`.
  struct Carried {
    Eigen::Vector3d along;  ///< of what was the ray, unit
    Eigen::Vector3d point;
    double error;  ///< of the point by the arithmetic, beside that of the ray
  };
  Carried carry(const Eigen::Vector2d& pixel, double range_m) const;
  Carried carry(const Eigen::Vector2d& pixel, double range_m, const BodyMotion& motion) const;
  std::optional<LabelError> error_px(const Eigen::Vector2d& pixel, double range_m,
                                     double range_error_m, const Carried& carried) const;

  CameraView from_;
  CameraView to_;
  geo::Rigid3d to_from_from_;
  double turn_error_ = 0.0;         ///< of a unit vector that is turned, in u
  double translation_error_ = 0.0;  ///< in u m
};

/// What the labels of an image err by: the largest over its pixels.
struct LabelBounds {
  std::optional<LabelError> depth_m;  ///< nothing where no ground is seen
  std::optional<LabelError>
      flow_next_px;  ///< to the next frame, of points that come to lie in its image
  std::optional<LabelError> flow_previous_px;  ///< the same to the previous frame
  /// Pixels that are left out: those with the edge bit, and those whose ray grazes its triangle so that no
  /// bound can be told.
  std::int64_t num_left_out = 0;
  bool operator==(const LabelBounds&) const = default;
};

/// Bounds of all labels that follow from a camera's facts. Parallel inside.
/// view, next, previous   the camera at this frame and at those beside it, where there are such
/// motions_next, _previous   of what moves, from this frame to those beside it
/// crossing_errors        of each pixel that shows an object, row by row: what the t of its crossing may differ by
/// tiles                  by the tile index of primitive ids
LabelBounds bounds_of_labels(const CameraView& view, const std::optional<CameraView>& next,
                             const std::optional<CameraView>& previous, const CameraFrame& facts,
                             std::span<const double> crossing_errors,
                             std::span<const TileScale> tiles, const BodyMotions& motions_next = {},
                             const BodyMotions& motions_previous = {});

/// The most that rounding a value to float32 changes it.
double float_rounding(double value);

}  // namespace terracast::capture
