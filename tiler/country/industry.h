#pragma once

#include "tiler/country/lots.h"

namespace terracast::tiler::country {

/// Parts a block of industry into plots of all sizes and builds on each: a logistics hall with docks, works of
/// several halls, workshops, or a yard of containers, tanks or cars. What is built on is paved.
void fill_industry(const Block& block, int palette, Builder& builder);

}  // namespace terracast::tiler::country
