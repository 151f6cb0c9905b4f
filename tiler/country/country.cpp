#include "tiler/country/country.h"

#include <fmt/format.h>

#include "core/hash.h"
#include "tiler/country/country_plan.h"
#include "tiler/surface.h"

namespace terracast::tiler {

Country::Country(const WorldSurface& surface, std::uint64_t seed, const core::Context& context,
                 const SurveyedGround& surveyed)
    : features_(country::make_country(surface, seed, surveyed, context)) {
  content_hash_ = core::content_hash(
      fmt::format("country {} {} {}{}", country::kVersion, surface.input_hash(), seed,
                  surveyed.content_hash.empty() ? "" : " " + surveyed.content_hash));
}

}  // namespace terracast::tiler
