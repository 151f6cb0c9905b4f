#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/context.h"
#include "tiler/surveyed_ground.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {

class WorldSurface;

/// A whole country made from a world's seed and its ground: what a survey of it would hold, as features
/// with OpenStreetMap's keys (https://wiki.openstreetmap.org/wiki/Map_features), from which the layers
/// build as they do from real ones. Numbers are osm_number()s, the same for the same seed and ground.
class Country {
 public:
  /// surface    the ground before any layer
  /// surveyed   where nothing but roads, waters and fields is made up, and through whose buildings nothing leads
  Country(const WorldSurface& surface, std::uint64_t seed, const core::Context& context,
          const SurveyedGround& surveyed = {});

  /// By number.
  std::span<const VectorFeature> features() const { return features_; }
  const std::string& content_hash() const { return content_hash_; }

 private:
  std::vector<VectorFeature> features_;
  std::string content_hash_;
};

}  // namespace terracast::tiler
