#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/schema.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// A corner of an area that a config names.
struct Corner {
  double lat_deg = std::numeric_limits<double>::quiet_NaN();
  double lon_deg = std::numeric_limits<double>::quiet_NaN();
  double east_m = std::numeric_limits<double>::quiet_NaN();
  double north_m = std::numeric_limits<double>::quiet_NaN();

  void describe(core::SchemaVisitor& visit);
  /// throws Config: neither or both of the two pairs, or half of one
  void validate() const;
};

/// A simple polygon in the world's x and y.
class Area {
 public:
  /// corners   three or more, in order
  /// throws    Config: fewer corners, sides that cross, no extent
  explicit Area(std::vector<Eigen::Vector2d> corners);

  bool contains(const Eigen::Vector2d& point) const;
  /// Least and largest coordinate along a unit vector.
  std::pair<double, double> extent(const Eigen::Vector2d& along) const;
  /// The same of the part whose coordinate along the unit vector `across` is between two bounds;
  /// nothing where there is none.
  std::optional<std::pair<double, double>> extent_of_strip(const Eigen::Vector2d& along,
                                                           const Eigen::Vector2d& across,
                                                           double lowest, double highest) const;
  const std::vector<Eigen::Vector2d>& corners() const { return corners_; }

 private:
  std::vector<Eigen::Vector2d> corners_;
};

/// A corner's place in the world's x and y. `what` names it.
/// throws Input: no ground there
Eigen::Vector2d resolve_corner(const Corner& corner, const TrajectoryContext& context,
                               const std::string& what);

/// The area between corners on the ground.
/// throws Input: no ground there
Area resolve_area(const std::vector<Corner>& corners, const TrajectoryContext& context);

/// Ground as a height of flattened coordinates: what lies below or above (x, y).
/// near_w_m   a height near the answer; 1 km of difference shifts the place by some metres
/// throws     Input: the world has no ground there
double ground_w_m(const Eigen::Vector2d& place, double near_w_m, const TrajectoryContext& context);

}  // namespace terracast::geo
