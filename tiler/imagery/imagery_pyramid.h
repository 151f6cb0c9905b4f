#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/image.h"
#include "tiler/imagery/color_raster.h"
#include "world/imagery_info.h"

namespace terracast::tiler {

class WorldSurface;

/// Colour rasters of about one spacing as tiles of pictures and their coarser levels. The first raster
/// that knows a pixel is shown.
///
/// determinism   tiles are a function of place: the same bytes for any number of threads
/// memory        some MB a thread, and a quarter of a megabyte for each of at most 256 parts
class ImageryPyramid {
 public:
  /// surface   the ground without layers; must outlive the pyramid
  ImageryPyramid(int finest_level, double size_m, const WorldSurface& surface,
                 std::vector<std::shared_ptr<const ColorRaster>> rasters);

  int finest_level() const { return finest_level_; }
  int coarsest_level() const { return coarsest_level_; }
  const std::vector<std::shared_ptr<const ColorRaster>>& rasters() const { return rasters_; }

  /// Writes all tiles into a world's folder.
  /// row       of WorldManifest::imagery
  /// returns   what the manifest shall hold, but for the layer
  /// throws    Input: samples that cannot be read; Io
  world::ImageryInfo write(const std::filesystem::path& store, std::size_t row,
                           const core::Context& context) const;

  /// A tile of the finest level, transparent where nothing is known; empty without any pixel.
  /// sources   the rasters that show in it
  core::Image8 finest_tile(const world::ImageryTileId& id, std::vector<int>& sources) const;

 private:
  struct Part;
  struct Built;
  Built build(const world::ImageryTileId& id, Part& part) const;
  Built join(const world::ImageryTileId& id, const std::array<Built, 4>& children,
             Part& part) const;
  std::vector<world::ImageryTileId> tiles_of_square(int level) const;
  bool touches_square(const world::ImageryTileId& id) const;

  int finest_level_;
  int coarsest_level_;
  double half_size_m_;
  const WorldSurface& surface_;
  std::vector<std::shared_ptr<const ColorRaster>> rasters_;
};

}  // namespace terracast::tiler
