#pragma once

#include "tiler/objects/things.h"

namespace terracast::tiler {

/// The hull of a ship or boat; z = 0 is its water line.
struct Hull {
  double length_m;
  double beam_m;
  double draught_m;
  double deck_z_m;          ///< amidships
  double bow_rise_m = 0.0;  ///< by which the deck is higher at the bow
  double bow_m = 0.0;       ///< length over which the bow narrows
  double stern_m = 0.0;     ///< and the stern
  double transom = 0.7;     ///< breadth of the stern's end, of the beam
  double rake_m = 0.0;      ///< by which the stem leans forward above the water
  double bottom = 0.85;     ///< breadth of the flat bottom, of the beam; 0: a keel
};
void add_hull(ThingMesh& mesh, const Hull& hull, int detail, FinishNumber topsides,
              FinishNumber underwater, FinishNumber deck);

}  // namespace terracast::tiler
