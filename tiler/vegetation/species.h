#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "tiler/vegetation/plant.h"
#include "tiler/vegetation/plant_mesh.h"
#include "world/shape.h"

namespace terracast::tiler {

/// A species of plants, or of what lies among them.
struct SpeciesInfo {
  std::string_view name;
  std::string_view summary;
  int num_varieties;  ///< individuals that differ in shape
  std::vector<PlantLevel> levels;
  /// A pure function of the seed.
  Plant (*grow)(std::uint64_t seed);
};

/// The table of species.
std::span<const SpeciesInfo> all_species();

/// Rows of all_species() by name.
/// throws   Internal: there is none
std::size_t species_row(std::string_view name);

/// One individual of a species: a pure function of both.
/// variety   0 … num_varieties - 1
Plant grow_variety(const SpeciesInfo& species, int variety);

/// Levels of trees: a tile of level L shows a metre as 2^(1 - L) pixels, so that a tree's sprays of
/// leaves are about a pixel on the coarsest tiles of each. Many worlds' finest tiles are of level 0, and cameras are
/// nearer to these than that: their trees have more.
inline const std::vector<PlantLevel> kTreeLevels = {
    {-1, 6000}, {0, 3600}, {1, 300}, {3, 60}, {5, 20}};

/// Of bushes up to three metres high.
inline const std::vector<PlantLevel> kBushLevels = {{-2, 2400}, {-1, 700}, {0, 200}, {2, 30}};

}  // namespace terracast::tiler
