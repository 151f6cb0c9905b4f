#pragma once

#include <Eigen/Core>
#include <optional>

#include "capture/moving.h"
#include "core/image.h"
#include "geo/camera_model.h"
#include "geo/rigid3.h"
#include "geo/shutter.h"

/// Labels derived in double from facts (range, visibility), poses and camera models. Nothing here
/// traces a ray.
namespace terracast::capture {

struct CameraCalibration;
struct CameraFrame;

/// A camera at a place.
struct CameraView {
  const geo::CameraModel& model;
  geo::Rigid3d world_from_camera;
  /// How it moves while its lines are exposed one after the other; nothing: all are at once.
  std::optional<geo::CameraMotion> motion = {};

  /// When the line through an image point is in the middle of its exposure, counted from the frame's time.
  double offset_of_line_s(const Eigen::Vector2d& pixel) const;
  /// Where it is when the line through an image point is in the middle of its exposure.
  geo::Rigid3d pose_of_line(const Eigen::Vector2d& pixel) const;
};

/// A camera of a sequence at a frame.
CameraView view_of(const geo::CameraModel& model, const CameraCalibration& camera,
                   const geo::BodyState& state);

/// Centre of a pixel.
inline Eigen::Vector2d pixel_center(int x, int y) { return {x + 0.5, y + 0.5}; }

/// Depth along the optical axis of a point at a range along the ray through `pixel`, m; +inf stays
/// +inf. Behind the camera, which wide models see, it is negative. Range and depth count from where the
/// ray starts; rays that start at many places do so at a depth of 0.
double depth_from_range(const geo::CameraModel& model, const Eigen::Vector2d& pixel,
                        double range_m);

/// The same point in the camera's frame; of a rolling shutter in that of the pixel's line.
Eigen::Vector3d point_camera(const geo::CameraModel& model, const Eigen::Vector2d& pixel,
                             double range_m);

/// The point at a range along the ray through `pixel`.
Eigen::Vector3d point_world(const CameraView& view, const Eigen::Vector2d& pixel, double range_m);

/// The pose of one view in another's camera frame, at the times of their frames.
geo::Rigid3d to_from(const CameraView& to, const CameraView& from);

/// Where a world point stands in a view's image; nothing when it is behind the camera. Of a rolling shutter
/// where it stands when its line is exposed (geo::find_seen).
std::optional<Eigen::Vector2d> project(const CameraView& view, const Eigen::Vector3d& point_world);

/// The same of a point of something that moves.
/// body         at the view's frame; it goes on as BodyState::pose_after has it
/// point_body   in its frame
std::optional<Eigen::Vector2d> project(const CameraView& view, const geo::BodyState& body,
                                       const Eigen::Vector3d& point_body);

/// Motion of the image point from view `from` to view `to`, px: of the hit point, or for sky (range
/// +inf) of the direction at infinity. Nothing when it comes to lie behind the camera, and nothing for sky
/// where the rays of `to` start at many places: what is infinitely far has no one image there.
std::optional<Eigen::Vector2d> flow(const CameraView& from, const CameraView& to,
                                    const Eigen::Vector2d& pixel, double range_m);

/// The same of a point of something that moves. Nothing besides where it is not there at the frame of `to`.
std::optional<Eigen::Vector2d> flow(const CameraView& from, const CameraView& to,
                                    const BodyMotion& motion, const Eigen::Vector2d& pixel,
                                    double range_m);

/// Planar depth of a whole image, float32 rounded from double; sky +inf, NaN where no ray comes in.
core::ImageF depth_image(const geo::CameraModel& model, const core::ImageF& range_m);

/// Flow of a whole image: 2 channels, float32 rounded from double; NaN where there is none.
core::ImageF flow_image(const CameraView& from, const CameraView& to, const core::ImageF& range_m);

/// The same of an image that shows what moves between the two frames.
core::ImageF flow_image(const CameraView& from, const CameraView& to, const BodyMotions& motions,
                        const CameraFrame& facts);

/// Disparity of a rectified pair, px: focal length (px) times baseline (m) over depth; sky 0.
core::ImageF disparity_image(const geo::CameraModel& left, double baseline_m,
                             const core::ImageF& range_m);

}  // namespace terracast::capture
