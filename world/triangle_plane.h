#pragma once

#include "core/packet_code.h"

namespace terracast::world {

/// A ray above the plane of a cell's triangle: the clearance, z of the ray less z of the plane, is
/// a + b t. The one place of its arithmetic: a ray crosses a triangle at the same t to the last
/// bit, whoever asks.
struct TrianglePlane {
  double a = 0.0;
  double b = 0.0;
  double rise_x = 0.0;  ///< of the plane over a cell, m
  double rise_y = 0.0;
};

/// z_corner        the triangle's height at its right angle, above the ray's zero of heights, m
/// z_x, z_y        its heights a cell from there along x and along y
/// upward          +1 for the upper triangle, -1 for the lower one
/// from_corner_x   the ray's origin seen from the right angle, in cells
/// z_origin, dz    the ray's height at t = 0, and per t
/// qx, qy          the ray's cells per t
TERRACAST_PACKET_INLINE TrianglePlane triangle_plane(double z_corner, double z_x, double z_y,
                                                     double upward, double from_corner_x,
                                                     double from_corner_y, double z_origin,
                                                     double dz, double qx, double qy) {
  TrianglePlane plane;
  plane.rise_x = upward * (z_corner - z_x);
  plane.rise_y = upward * (z_corner - z_y);
  plane.a = z_origin - z_corner - plane.rise_x * from_corner_x - plane.rise_y * from_corner_y;
  plane.b = dz - plane.rise_x * qx - plane.rise_y * qy;
  return plane;
}

}  // namespace terracast::world
