#pragma once

#include "tiler/country/lots.h"

namespace terracast::tiler::country {

/// Parts a block of industry into plots of all sizes and builds on each: a logistics hall with docks, works of
/// several halls, workshops, or a yard of containers, tanks or cars. What is built on is paved.
void fill_industry(const Block& block, int palette, Builder& builder);

/// One such plot at the left of a street, where streets close no block.
/// street    a line
/// from_m    along it
/// half_m    half the street's width
/// returns   how far along the street it takes; 0: there is no room
double build_plot_at(const PointsWorld& street, double from_m, double half_m, int palette,
                     Builder& builder);

}  // namespace terracast::tiler::country
