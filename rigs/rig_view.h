#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "geo/camera_model.h"
#include "rigs/rig.h"

namespace terracast::rigs {

/// Angles between the rays of the image's left and right edge, and of its upper and lower edge, through its middle
/// or, where the principal point is in the image, through that. Where an edge has no ray, of the outermost pixel
/// that has one.
struct FieldOfView {
  double horizontal_deg = 0.0;
  double vertical_deg = 0.0;
};
FieldOfView field_of_view(const geo::CameraModel& camera);

/// How long the lines are on which the rays of the image's columns and rows start, m; 0 where these start at one
/// place.
struct Swath {
  double width_m = 0.0;
  double height_m = 0.0;
};
Swath swath_of(const geo::CameraModel& camera);

/// "36.870 x 28.072 deg, horizontally and vertically", or what there is of a swath.
std::string view_text(const geo::CameraModel& camera);

/// What the cameras of a rig see, of what is far beyond the distances between them.
class RigView {
 public:
  /// throws   as rigs::build_cameras
  explicit RigView(const rigs::RigOptions& rig);

  const std::string& name() const { return name_; }
  const std::vector<capture::CameraCalibration>& cameras() const { return cameras_; }
  const geo::CameraModel& model(std::size_t camera) const { return *models_[camera]; }

  /// The cameras that see a direction, a bit each. Those whose rays start at many places see no share of what is
  /// far beyond them.
  std::uint32_t find_seeing(const Eigen::Vector3d& direction_rig) const;

  /// Share of the camera's view, by solid angle, that another one sees too; 0 where the camera sees nothing.
  /// accuracy   0.005, from kSamples directions; RigView.OverlapsAreThoseOfTheImages
  double overlap(std::size_t of_camera, std::size_t with_camera) const;
  /// Share of all directions that so many cameras see.
  double share_seen_by(int num_cameras) const;

  static constexpr int kSamples = 100000;

 private:
  std::string name_;
  std::vector<capture::CameraCalibration> cameras_;
  std::vector<std::unique_ptr<geo::CameraModel>> models_;
  std::vector<std::vector<int>>
      seen_together_;         ///< directions that two cameras see, by their indices
  std::vector<int> seen_by_;  ///< directions by the number of cameras that see them
};

/// K, T, and the fields of view of each camera, key by key.
std::string rig_text(const RigView& rig);

}  // namespace terracast::rigs
