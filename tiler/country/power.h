#pragma once

#include <vector>

#include "tiler/country/lots.h"

namespace terracast::tiler::country {

/// When roads are there, buildings not yet: a power station near the city, lines from it to the towns on
/// towers that stand clear of all else, wind turbines on ridges.
void build_power(const PlanGround& ground, const std::vector<Settlement>& settlements,
                 Builder& builder);

}  // namespace terracast::tiler::country
