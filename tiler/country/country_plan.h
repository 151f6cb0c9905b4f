#pragma once

#include <vector>

#include "core/context.h"
#include "tiler/surveyed_ground.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {
class WorldSurface;
}

namespace terracast::tiler::country {

/// Raised when the same seed and ground give another country.
inline constexpr int kVersion = 6;

/// All features of a country, by number. Its stages in their order: ground, water, sites, airport, roads,
/// streets, buildings, and what lies between.
/// surveyed   what stands already
std::vector<VectorFeature> make_country(const WorldSurface& surface, std::uint64_t seed,
                                        const SurveyedGround& surveyed,
                                        const core::Context& context);

}  // namespace terracast::tiler::country
