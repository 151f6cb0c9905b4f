#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace terracast::validate {

/// Distance of each query to the nearest of some points, m, by CGAL's k-d tree in double.
/// points   one at least; finite; may repeat
/// queries  finite
/// cost     n log n, whatever repeats; 100 bytes a point
/// threads  queries run in parallel; the distances do not depend on their number
std::vector<double> nearest_distances_m(std::span<const Eigen::Vector3d> points,
                                        std::span<const Eigen::Vector3d> queries);

}  // namespace terracast::validate
