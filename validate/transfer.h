#pragma once

#include <Eigen/Core>
#include <optional>

#include "validate/frames.h"

namespace terracast::validate {

/// Pose of a view's camera when the line through an image point is exposed.
Pose pose_of_line(const View& view, const Eigen::Vector2d& pixel);

/// What one image shows, in another: each line of a rolling shutter from the place where its camera is when it is
/// exposed. Threads: safe.
class Transfer {
 public:
  /// Of two views that outlive it.
  Transfer(const View& a, const View& b);

  struct Place {
    Eigen::Vector3d point_a =
        Eigen::Vector3d::Zero();  ///< in the camera's frame when the line of `a` is exposed
    Eigen::Vector3d point_b =
        Eigen::Vector3d::Zero();  ///< in the other's, when that of `b` is that sees it
    Eigen::Vector2d pixel =
        Eigen::Vector2d::Zero();  ///< in `b`; anything where it does not see the point
    Eigen::Vector2d pixel_a = Eigen::Vector2d::Zero();
    /// As the two images measure them; not above 0 where `b` does not see the point.
    double distance_a_m = 0.0;
    double distance_b_m = 0.0;
    double offset_a_s = 0.0;  ///< of these two times from those of the frames
    double offset_b_s = 0.0;
  };
  /// A point at a distance, m, as the image of `a` measures it.
  /// returns  nothing where no line of a rolling `b` sees it; else a point that `b` may not see
  std::optional<Place> point(const Eigen::Vector2d& pixel_a, double distance_m) const {
    return place(pixel_a, distance_m, false);
  }
  /// The same of a point of a body that moves.
  /// body     from 1; it is there at the frame of `a`
  /// returns  nothing besides where it is not there at the frame of `b`
  std::optional<Place> point_of_body(int body, const Eigen::Vector2d& pixel_a,
                                     double distance_m) const;
  /// The same of a direction: point_a and point_b have no length.
  std::optional<Place> direction(const Eigen::Vector2d& pixel_a) const {
    return place(pixel_a, 1.0, true);
  }
  /// Whether `b` sees a point, or a direction, at a pixel as well: a rolling shutter that turns fast sees one at several
  /// times, of which point() is one.
  /// pixel_b        whose line tells the time
  /// tolerance_px   how far from it the point may stand then
  bool is_seen_at(const Eigen::Vector2d& pixel_b, const Eigen::Vector2d& pixel_a, double distance_m,
                  bool is_direction, double tolerance_px) const;
  /// A place of the local frame as `b` sees it.
  static std::optional<Place> of_local_point(const View& b, const Eigen::Vector3d& point_local);

  /// Rotation of the camera's axes at one of the times of a place.
  Eigen::Matrix3d local_from_a(const Place& place) const;
  Eigen::Matrix3d local_from_b(const Place& place) const;
  /// What becomes of a small change of point_b: it is seen by another line, at another time, when the camera is
  /// elsewhere. The identity where all lines are at once.
  Eigen::Matrix3d through_time(const Place& place) const;

 private:
  std::optional<Place> place(const Eigen::Vector2d& pixel_a, double distance_m,
                             bool is_direction) const;
  /// What a place is in `a`.
  void start(const Eigen::Vector2d& pixel_a, double distance_m, Place& place) const;
  /// A view's frame from its camera's so much later.
  Pose b_from_a_at(const Eigen::Vector2d& pixel_a, double& offset_s) const;

  const View& a_;
  const View& b_;
  Pose b_from_a_;  ///< at the times of the frames
};

}  // namespace terracast::validate
