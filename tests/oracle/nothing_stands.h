#pragma once

#include <Eigen/Core>

namespace terracast::test {

/// For worlds in which no instance stands that would ask.
inline Eigen::Matrix3d nothing_stands(const Eigen::Vector3d&) {
  return Eigen::Matrix3d::Identity();
}

}  // namespace terracast::test
