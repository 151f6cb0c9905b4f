#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tiler/vector_source.h"
#include "tiler/water/water_profile.h"

namespace terracast::tiler {

/// A line of water and what it is made of.
struct WaterLineInfo {
  Waterline line;
  bool is_dry = false;  ///< but for some weeks of the year
};

/// A polygon of water.
struct WaterPolygon {
  std::uint64_t number = 0;
  bool is_river = false;
  std::vector<PointsWorld> rings_world;
  double area_m2 = 0.0;
  double mean_width_m = 0.0;  ///< as that of a band with such an area and shore
};

/// What a layer of water takes from features with OpenStreetMap's keys: waterway = river, stream, canal, …;
/// natural = water, waterway = riverbank, landuse = reservoir, ….
struct WaterFeatures {
  std::vector<WaterLineInfo> lines;
  std::vector<WaterPolygon> polygons;
  std::vector<std::pair<std::string, std::int64_t>> counts;
};

/// Whether any water is said to be there.
bool is_water_feature(const FeatureTags& tags);

/// Takes what lies in or near the square; what is no shape (fewer than three places, no area, a width that
/// none can have) is left out and counted; areas that cross themselves are taken apart.
/// half_size_m   of the world's square
WaterFeatures water_of(const std::vector<VectorFeature>& features, double half_size_m);

}  // namespace terracast::tiler
