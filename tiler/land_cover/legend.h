#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "world/tile.h"

namespace terracast::tiler {

/// What a code of a land cover raster stands for.
enum class LandClass : std::uint8_t {
  Unknown = 0,  ///< nothing is said of the ground
  Forest,
  Shrubs,
  Grass,
  Crops,
  BuiltUp,
  Bare,
  Snow,
  Wetland,
  Lake,        ///< standing water, or water that is not told from it
  OtherWater,  ///< rivers, estuaries, the sea
};

/// What covers the ground there; nothing for Unknown and for the water, which only its form decides.
std::optional<world::Cover> cover_of(LandClass land_class);

/// Codes of land cover rasters by what they stand for.
struct Legend {
  std::string name;
  std::map<int, LandClass> classes;
};

/// worldcover, corine, nlcd, nlcd_8, none.
std::vector<std::string> legend_names();

/// A legend, with the classes of a config put into it.
/// name      one of legend_names()
/// classes   as "10 = forest": codes that it lacks, or that are to mean something else
/// throws    Config: a text that is no such pair, a class that is none (naming the nearest), a code
///           that is given twice or is not within 0 to 65535, a legend without a code
Legend make_legend(const std::string& name, const std::vector<std::string>& classes);

}  // namespace terracast::tiler
