#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace terracast::tiler {

/// Twice the area of the triangle of a, b and c, in steps squared, positive where it goes
/// anticlockwise: exact for coordinates that differ by less than 2^30.
inline std::int64_t turn(const Eigen::Vector2i& a, const Eigen::Vector2i& b,
                         const Eigen::Vector2i& c) {
  const Eigen::Matrix<std::int64_t, 2, 1> u = (b - a).cast<std::int64_t>();
  const Eigen::Matrix<std::int64_t, 2, 1> v = (c - a).cast<std::int64_t>();
  return u.x() * v.y() - u.y() * v.x();
}

}  // namespace terracast::tiler
