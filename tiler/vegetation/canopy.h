#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>

#include "core/ledger.h"
#include "core/schema.h"
#include "geo/geodesy.h"
#include "tiler/surface.h"

namespace terracast::tiler {

/// A raster of canopy heights above the ground: where trees stand, and how tall they are.
///
/// threads   safe
class Canopy {
 public:
  /// Reads what lies in the world's square.
  /// nodata   "declared" by the file, "none", or a number
  /// throws   Io, Input: as RasterSource; heights that no canopy has; a raster beside the world
  static std::unique_ptr<Canopy> open(const core::Path& file, const std::string& nodata,
                                      const WorldSurface& surface, double size_m);
  virtual ~Canopy() = default;

  /// Height above the ground, by bilinear interpolation; nothing where the raster knows none.
  virtual std::optional<double> height_m(const Eigen::Vector2d& place_world) const = 0;

  virtual const std::string& content_hash() const = 0;
  /// What the file says beside its samples.
  virtual const core::Ledger& ledger() const = 0;
  virtual std::int64_t num_samples() const = 0;  ///< in the square
  virtual std::int64_t num_voids() const = 0;    ///< of these, without a height
  virtual std::int64_t num_wooded() const = 0;   ///< of these, as high as trees
};

/// What is lower is no tree.
inline constexpr double kLowestTree_m = 2.5;

}  // namespace terracast::tiler
