#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "tiler/out_of_sight.h"
#include "tiler/roads/pads.h"
#include "tiler/roads/road_network.h"
#include "tiler/roads/road_paint.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {

struct RoadsOptions {
  std::string sidewalks = "streets";
  bool has_paths = true;
  bool has_bridges = true;
};

/// What a source's features are for the layer of roads.
struct RoadFeatures {
  std::vector<Way> ways;   ///< shaped, or bridges
  std::vector<Way> paths;  ///< only painted
  std::vector<Way> piers;
  std::vector<PaintedArea> areas;
  std::vector<std::vector<PointsWorld>> airfields;  ///< whose ground is kept as grass
  std::vector<FootCrossing> crossings;
  HiddenCounts hidden;
  std::int64_t num_not_built = 0;  ///< lines and areas of no kind that is built
  std::int64_t num_repaired = 0;
  std::int64_t num_bad_areas = 0;
};

/// Whether a feature's tags are of roads, railways, airfields or places.
bool is_of_roads(const FeatureTags& tags);

/// half_size_m   of the world's square
RoadFeatures sort_features(const std::vector<VectorFeature>& features, const RoadsOptions& options,
                           double half_size_m);

/// Streets between houses get sidewalks where many ways end.
void add_sidewalks(std::vector<Way>& ways);

}  // namespace terracast::tiler
