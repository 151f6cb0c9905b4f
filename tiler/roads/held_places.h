#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "tiler/roads/road_bed.h"

namespace terracast::tiler {

/// What is painted and not shaped: where nothing may stand.
class HeldPlaces {
 public:
  void add_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double half_m) {
    const auto number = static_cast<std::uint32_t>(lines_.size());
    lines_.push_back({a, b, half_m});
    put(a.cwiseMin(b).array() - half_m, a.cwiseMax(b).array() + half_m, number << 1);
  }
  void add_area(const std::vector<PointsWorld>& rings) {
    const auto number = static_cast<std::uint32_t>(areas_.size());
    areas_.push_back(rings);
    Eigen::Vector2d low = rings.front().front();
    Eigen::Vector2d high = low;
    for (const Eigen::Vector2d& at : rings.front()) {
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    put(low, high, number << 1 | 1U);
  }
  bool holds(const Eigen::Vector2d& at, double radius_m) const {
    for (std::int32_t j = cell(at.y() - radius_m); j <= cell(at.y() + radius_m); ++j)
      for (std::int32_t i = cell(at.x() - radius_m); i <= cell(at.x() + radius_m); ++i) {
        const auto found = cells_.find(key(i, j));
        if (found == cells_.end()) continue;
        for (const std::uint32_t entry : found->second) {
          if ((entry & 1U) != 0) {
            const RingSide side = side_of_rings(areas_[entry >> 1], at);
            if (side.is_inside || side.distance_m < radius_m) return true;
            continue;
          }
          const Segment& line = lines_[entry >> 1];
          const Eigen::Vector2d step = line.b - line.a;
          const double t =
              std::clamp((at - line.a).dot(step) / std::max(step.squaredNorm(), 1e-9), 0.0, 1.0);
          if ((line.a + t * step - at).norm() < line.half_m + radius_m) return true;
        }
      }
    return false;
  }

 private:
  struct Segment {
    Eigen::Vector2d a;
    Eigen::Vector2d b;
    double half_m;
  };
  static std::int32_t cell(double at) { return static_cast<std::int32_t>(std::floor(at / 16.0)); }
  static std::uint64_t key(std::int32_t i, std::int32_t j) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32 |
           static_cast<std::uint32_t>(j);
  }
  void put(const Eigen::Vector2d& low, const Eigen::Vector2d& high, std::uint32_t entry) {
    for (std::int32_t j = cell(low.y()); j <= cell(high.y()); ++j)
      for (std::int32_t i = cell(low.x()); i <= cell(high.x()); ++i)
        cells_[key(i, j)].push_back(entry);
  }

  std::vector<Segment> lines_;
  std::vector<std::vector<PointsWorld>> areas_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace terracast::tiler
