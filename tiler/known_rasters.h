#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "world/raster_info.h"

namespace terracast::tiler {

/// Of fields and surfaces whose sources may be rasters: where the pixels of these lie.
class KnownRasters {
 public:
  virtual ~KnownRasters() = default;
  /// A row for each of sources(); none where it is no raster.
  virtual std::vector<std::optional<world::RasterInfo>> rasters() const = 0;
};

/// A row for each of the sources() of a field or surface, which may know of rasters.
template <class Sourced>
std::vector<std::optional<world::RasterInfo>> rasters_of(const Sourced& sourced) {
  std::vector<std::optional<world::RasterInfo>> rasters;
  if (const auto* known = dynamic_cast<const KnownRasters*>(&sourced)) rasters = known->rasters();
  rasters.resize(sourced.sources().size());
  return rasters;
}

/// Of layers of land cover that read rasters: where their pixels lie and what they say.
class KnownCovers {
 public:
  virtual ~KnownCovers() = default;
  /// In order of priority, without what they say.
  virtual std::vector<world::CoverRasterInfo> cover_rasters() const = 0;
  /// A row of what one of them says; as world::CoverRows.
  virtual void tell_row(std::size_t raster, int row, std::span<std::uint8_t> covers) const = 0;
};

}  // namespace terracast::tiler
