#pragma once

#include <Eigen/Core>
#include <cmath>

#include "geo/camera_model.h"

namespace terracast::scene {

/// How wide a colour sample is across its ray.
struct SampleWidth {
  double angle_rad = 0.0;  ///< what it grows by a metre, where all rays start at one place
  /// Where they start at many: along columns and rows how wide it starts, and what it grows by a metre.
  Eigen::Vector2d start_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d growth = Eigen::Vector2d::Zero();

  bool is_central() const { return start_m.x() == 0.0 && start_m.y() == 0.0; }
  /// The side of a square of the sample's area, so far from where its ray starts.
  double at(double distance_m) const {
    if (is_central()) return distance_m * angle_rad;
    return std::sqrt((start_m.x() + distance_m * growth.x()) *
                     (start_m.y() + distance_m * growth.y()));
  }
};

/// Of a sample that stands for a share of a pixel's side, at an image point.
SampleWidth sample_width(const geo::CameraModel& model, const Eigen::Vector2d& here, double share);

}  // namespace terracast::scene
