#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "capture/frame.h"
#include "capture/frame_reader.h"
#include "geo/geodesy.h"
#include "tests/support/tiny_capture.h"

namespace terracast::batch {

/// A plane in the world, and pinhole cameras over it: what they see has closed form.
struct PlaneCapture {
  geo::Geodetic origin{.lat_deg = 45.0, .lon_deg = 7.0, .height_m = 0.0};
  Eigen::Vector3d ground_normal = Eigen::Vector3d(0.03, -0.02, 1.0).normalized();  ///< through 0
  int width_px = 64;
  int height_px = 48;
  double focal_length_px = 40.0;
  std::vector<geo::Rigid3d> world_from_camera;  ///< of the frames
  /// Ground that is of the class outside.
  std::function<bool(const Eigen::Vector3d& point_world)> is_outside = [](const Eigen::Vector3d&) {
    return false;
  };

  /// Range along a ray to the plane; +inf where it is not met.
  double range_m(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) const;

  /// The ground at a latitude and longitude.
  Eigen::Vector3d ground_world(double lat_deg, double lon_deg) const;

  /// Where ground stands in a frame's image, counted from pixel centres: 0 is the centre of the first.
  /// returns   whether it is in front of the camera
  bool project(int frame, const Eigen::Vector3d& point_world, Eigen::Vector2d& centres) const;

  /// What the ray through a pixel's centre meets.
  struct Shown {
    Eigen::Vector3d direction_world = Eigen::Vector3d::Zero();
    double range_m = 0.0;
    bool is_ground = false;  ///< neither sky nor outside
  };
  Shown shown(int frame, int x, int y) const;

  capture::SequenceReader write(const std::filesystem::path& folder) const;
};

/// A camera at a place that looks `down_deg` below the horizontal, towards a heading east of north.
geo::Rigid3d looking(const Eigen::Vector3d& eye, double heading_deg, double down_deg);

}  // namespace terracast::batch
