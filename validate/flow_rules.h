#pragma once

#include "validate/geometry.h"

/// What flow of a format that marks where a camera does not see a point must be (docs/formats/terracast.md).
namespace terracast::validate {

/// Nearer to a border than this float32 flow may fall on either side.
inline constexpr double kFlowBorder_px = 0.005;

/// Whether a camera sees a point so surely that roundings of float32 decide nothing: it sees as well what is a part in
/// 10^5 of the distance beside it, on every side.
inline bool sees_surely(const Intrinsics& camera, const Eigen::Vector3d& point) {
  constexpr double kBeside = 1e-5;
  const double step = kBeside * point.norm();
  const auto is_seen = [&](const Eigen::Vector3d& at) { return camera.distance_m(at) > 0.0; };
  if (!is_seen(point)) return false;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0})
      if (!is_seen(point + sign * step * Eigen::Vector3d::Unit(axis))) return false;
  return true;
}

/// Whether a place is none of an image that joins at its ends: a turn, or a part of one, beyond its seam.
inline bool is_beyond_seam(const Intrinsics& camera, const Eigen::Vector2d& pixel) {
  const double turn_px = camera.plane ? camera.plane->turn() * camera.fx_px : 0.0;
  return turn_px > 0.0 && std::abs(pixel.x() - camera.cx_px) > 0.5 * turn_px + kFlowBorder_px;
}

}  // namespace terracast::validate
