#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>

#include "core/ledger.h"
#include "core/schema.h"
#include "tiler/buildings/footprint.h"
#include "tiler/surface.h"

namespace terracast::tiler {

/// Heights above the ground, of a raster of them or of a surface model and a ground model.
///
/// threads   safe
class HeightRaster {
 public:
  /// Reads what lies in the world's square.
  /// surface, terrain   heights of what is seen from above and of the bare ground, on one datum;
  ///                    terrain may be empty: then the first holds heights above the ground
  /// nodata    "declared" by the file, "none", or a number
  /// throws    Io, Input: as RasterSource; a raster beside the world
  static std::unique_ptr<HeightRaster> open(const core::Path& surface, const core::Path& terrain,
                                            const std::string& nodata, const WorldSurface& world,
                                            double size_m);
  virtual ~HeightRaster() = default;

  /// Above the ground, by bilinear interpolation; nothing where the raster knows none.
  virtual std::optional<double> height_m(const Eigen::Vector2d& place_world) const = 0;
  /// The median over a footprint, of places a metre or more from its edges where it has such;
  /// nothing where fewer than half of them are known.
  std::optional<double> median_m(const Footprint& footprint) const;

  virtual const std::string& content_hash() const = 0;
  /// What the files say beside their samples.
  virtual const core::Ledger& ledger() const = 0;
};

}  // namespace terracast::tiler
