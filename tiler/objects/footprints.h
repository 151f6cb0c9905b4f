#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace terracast::tiler {

/// A rectangle on the ground.
struct GroundRectangle {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();  ///< unit
  double half_length_m = 0.0;
  double half_width_m = 0.0;

  /// 0 within.
  double distance_m(const Eigen::Vector2d& place) const;
  bool overlaps(const GroundRectangle& other) const;
  double reach_m() const;
};

/// Footprints by place. Threads: const use is safe.
class FootprintIndex {
 public:
  void add(const GroundRectangle& footprint);
  bool overlaps(const GroundRectangle& footprint) const;
  /// Whether any is nearer than a radius, or round the place.
  bool holds(const Eigen::Vector2d& place, double radius_m) const;

 private:
  template <class Visit>
  bool any_near(const Eigen::Vector2d& middle, double reach_m, const Visit& visit) const;

  std::vector<GroundRectangle> footprints_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace terracast::tiler
