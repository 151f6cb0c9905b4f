#include "tiler/vegetation/species.h"

#include "core/error.h"
#include "core/hash.h"

// Every species, in alphabetical order: X(name) is tiler/vegetation/species/name.cpp, which defines
// `SpeciesInfo name_species()`.
#define TERRACAST_SPECIES(X) \
  X(birch)                   \
  X(boulder)                 \
  X(bush)                    \
  X(corn)                    \
  X(dead_tree)               \
  X(grass)                   \
  X(mountain_pine)           \
  X(oak)                     \
  X(palm)                    \
  X(pine)                    \
  X(poplar)                  \
  X(reed)                    \
  X(seagrass)                \
  X(spruce)                  \
  X(vine)                    \
  X(wheat)

namespace terracast::tiler {

#define TERRACAST_DECLARE(name) SpeciesInfo name##_species();
TERRACAST_SPECIES(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const SpeciesInfo> all_species() {
#define TERRACAST_ENTRY(name) name##_species(),
  static const std::vector<SpeciesInfo> table = {TERRACAST_SPECIES(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

std::size_t species_row(std::string_view name) {
  const std::span<const SpeciesInfo> table = all_species();
  for (std::size_t row = 0; row < table.size(); ++row)
    if (table[row].name == name) return row;
  core::fail(core::ErrorKind::Internal, "no species \"{}\"", name);
}

Plant grow_variety(const SpeciesInfo& species, int variety) {
  const std::uint64_t seed =
      core::content_hash64(std::as_bytes(std::span(species.name.data(), species.name.size())));
  return species.grow(core::stream_of(seed, static_cast<std::uint64_t>(variety)));
}

}  // namespace terracast::tiler
