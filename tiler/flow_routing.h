#pragma once

#include <cstdint>
#include <vector>

#include "tiler/grid.h"

namespace terracast::tiler {

/// Where water runs on a grid of heights.
struct FlowRouting {
  std::vector<std::int32_t> order;     ///< cells, each after the cell it drains to
  std::vector<std::int32_t> receiver;  ///< the cell it drains to; itself at an outlet
  Grid<float> filled_m;                ///< heights with every hollow filled to its spill
  std::vector<float> area;             ///< cells that drain through a cell, itself included
};

/// Fills hollows by priority flood (Barnes, Lehman, Mulla 2014) from the outlets, and routes each
/// cell to its steepest lower neighbour of eight (O'Callaghan, Mark 1984) on the filled surface.
/// is_outlet   cells where water leaves; at least one
/// cost        about 0.3 us a cell; the same result on every machine
FlowRouting route_flow(const Grid<float>& heights_m, const std::vector<std::uint8_t>& is_outlet);

}  // namespace terracast::tiler
