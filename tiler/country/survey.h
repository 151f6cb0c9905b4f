#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tiler/country/plan_geometry.h"

namespace terracast::tiler::country {

using Tags = std::vector<std::pair<std::string, std::string>>;

/// What features are of; numbers of each count for themselves.
enum class Theme : std::uint8_t {
  Water = 1,
  Road,
  Rail,
  Aerodrome,
  Building,
  LandUse,
  Power,
  Harbour,
  Place,
  Leisure,
};

/// Gathers the features of a country. Places are put on the plan's lattice.
class Survey {
 public:
  void add_point(Theme theme, const Point& at, Tags tags);
  void add_line(Theme theme, const PointsWorld& line, Tags tags);
  /// Of a ring, or of one with holes.
  void add_area(Theme theme, std::vector<PointsWorld> rings, Tags tags);
  void add_area(Theme theme, const PointsWorld& ring, Tags tags) {
    add_area(theme, std::vector<PointsWorld>{ring}, std::move(tags));
  }
  std::size_t size() const { return features_.size(); }

  /// By number.
  std::vector<VectorFeature> take();

 private:
  void add(Theme theme, OsmKind osm_kind, FeatureKind kind, std::vector<PointsWorld> part,
           Tags tags);
  std::vector<VectorFeature> features_;
  std::uint64_t counts_[16] = {};
};

/// Metres with at most two decimals.
std::string text_of(double value);

}  // namespace terracast::tiler::country
