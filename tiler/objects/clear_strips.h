#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "tiler/objects/footprints.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {

/// Land of airfields on which nothing but grass grows: strips beside runways and taxiways, and the rest of what an
/// aerodrome's border encloses.
/// throws    Input: more runways or aerodromes than any land has
/// threads   const use is safe
class ClearStrips {
 public:
  explicit ClearStrips(std::span<const VectorFeature> features);
  /// Whether any of a disc lies in one.
  bool holds(const Eigen::Vector2d& place, double radius_m) const;

 private:
  /// Of the aerodromes' plane.
  struct Cell {
    bool is_inside = false;                 ///< all of it is in one aerodrome
    std::vector<std::uint32_t> aerodromes;  ///< whose border may run through it
    std::size_t num_corners = 0;            ///< of all these
  };
  void add_aerodrome(const std::vector<PointsWorld>& rings);
  void add_strips(const PointsWorld& line, const FeatureTags& tags);

  FootprintIndex strips_;
  std::size_t num_pieces_ = 0;
  std::vector<std::vector<PointsWorld>> aerodromes_;
  std::unordered_map<std::uint64_t, Cell> cells_;
  std::size_t num_compared_ = 0;  ///< corners with cells
};

}  // namespace terracast::tiler
