#pragma once

#include <Eigen/Core>
#include <vector>

#include "tiler/buildings/building.h"
#include "tiler/feature_tags.h"

namespace terracast::tiler {

/// A building before it is known whether another one has its place.
struct BuildingDraft {
  Building building;
  const FeatureTags* tags = nullptr;
  bool is_dropped = false;
  double share_earlier = 0.0;  ///< of it in buildings of earlier layers
  double area_m2 = 0.0;
  std::vector<Eigen::Vector2d> inside_world;  ///< places within it
};

/// Share of one that lies within another.
double share_in(const BuildingDraft& one, const BuildingDraft& other);

/// Whether `one` stays where they are the same.
bool goes_before(const BuildingDraft& one, const BuildingDraft& other);

/// Copies one after the other: the same footprint, and of parts the same tags; of each the one that
/// stays first.
bool comes_before_copies(const BuildingDraft& one, const BuildingDraft& other);
bool are_copies(const BuildingDraft& one, const BuildingDraft& other);

}  // namespace terracast::tiler
