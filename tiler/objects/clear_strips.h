#pragma once

#include <span>
#include <vector>

#include "tiler/objects/footprints.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {

/// Land of airfields on which nothing grows high: strips beside runways and taxiways, and the rest of what an
/// aerodrome's border encloses.
/// throws    Input: more runways than any land has
/// threads   const use is safe
class ClearStrips {
 public:
  explicit ClearStrips(std::span<const VectorFeature> features);
  /// Whether any of a disc lies in one.
  bool holds(const Eigen::Vector2d& place, double radius_m) const;

 private:
  struct Aerodrome {
    std::vector<PointsWorld> rings;
    Eigen::Vector2d lowest;
    Eigen::Vector2d highest;
  };
  void add_strips(const PointsWorld& line, const FeatureTags& tags);

  FootprintIndex strips_;
  std::size_t num_pieces_ = 0;
  std::vector<Aerodrome> aerodromes_;
};

}  // namespace terracast::tiler
