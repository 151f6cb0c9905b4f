#pragma once

#include <Eigen/Core>

/// The frames of terracast. All are right-handed; lengths are metres, double.
///
/// | frame    | axes                             | origin                                         |
/// | -------- | -------------------------------- | ---------------------------------------------- |
/// | ecef     | WGS84 Earth-centred, Earth-fixed | Earth's centre                                 |
/// | world    | x east, y north, z up at origin  | a geodetic point kept in the world's manifest  |
/// | enu(p)   | east, north, up of the place p   | p; up: the ellipsoid's normal, not world z     |
/// | tile     | as world                         | the tile's centre, subtracted in double        |
/// | body     | x forward, y left, z up          | the vehicle's reference point                  |
/// | rig      | x forward, y left, z up          | the rig's reference point, by body_from_rig    |
/// | camera   | x right, y down, z forward       | centre of projection                           |
/// | pixel    | x right, y down                  | top-left pixel's corner; centre (0.5, 0.5)     |
///
/// The world is a true Cartesian frame: the Earth curves away below it, 98 m at the corner of a
/// 50 km square.
namespace terracast::geo {

/// A rig axis system in which a file may state offsets and rotations: x right, y down, z forward.
/// The rows say where rig's x, y, z point in it.
inline Eigen::Matrix3d rig_from_rdf() {
  return (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
}
/// Axes of a camera that looks along the rig's x axis, in the rig.
inline Eigen::Matrix3d rig_from_forward_camera() { return rig_from_rdf(); }

}  // namespace terracast::geo
