#pragma once

#include "validate/camera_plane.h"

namespace terracast::validate {

/// A model that is told by its rays: unit vectors at the nodes (i, j) of a grid, which are the places, joined by the
/// cubic of Keys (a = -1/2) component by component. Beyond the outer nodes they go on as straight lines do, for half
/// a step.
class RayTable final : public CameraPlane {
 public:
  /// parameters   columns, rows, then x, y, z of each node, row by row
  /// throws       Input: more or fewer numbers than that, a ray without length
  explicit RayTable(const std::vector<double>& parameters);

  std::optional<Eigen::Vector2d> place_from_point(const Eigen::Vector3d& point) const override;
  Eigen::Vector3d ray_from_place(const Eigen::Vector2d& place) const override;

 private:
  bool holds(const Eigen::Vector2d& place) const;
  Eigen::Vector3d node(int column, int row) const;
  /// Before it is brought to length 1.
  Eigen::Vector3d joined(const Eigen::Vector2d& place) const;
  /// The node whose ray is nearest to a direction.
  Eigen::Vector2d nearest(const Eigen::Vector3d& direction) const;

  int columns_, rows_;
  std::vector<Eigen::Vector3d> nodes_;
};

}  // namespace terracast::validate
