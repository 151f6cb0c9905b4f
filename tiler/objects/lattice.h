#pragma once

#include "tiler/objects/things.h"

namespace terracast::tiler {

/// A square tower of bars: legs through the corners of level squares, diagonals between them.
struct LatticeLevel {
  double z_m;
  double half_m;  ///< of the square's side
};
/// leg_m, brace_m   widths of bars; coarse levels have fewer and thicker ones
void add_lattice(ThingMesh& mesh, const std::vector<LatticeLevel>& levels, double leg_m,
                 double brace_m, int detail,
                 const std::function<FinishNumber(std::size_t)>& finish);

}  // namespace terracast::tiler
