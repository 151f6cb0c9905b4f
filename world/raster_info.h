#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"

namespace terracast::world {

class TileStore;

/// Where the pixels of a raster lie that a world was made from.
struct RasterInfo {
  std::string name;            ///< file name without folder
  std::string horizontal_crs;  ///< as GDAL names it
  /// The PROJ pipeline from WGS84 longitude and latitude (deg) to the CRS; empty for identity.
  std::string pipeline;
  bool is_geographic = false;  ///< coordinates of the CRS are longitude and latitude, deg
  /// GDAL's: of the CRS's coordinates at column i, row j (corners of pixels are whole numbers)
  /// x = [0] + i [1] + j [2], y = [3] + i [4] + j [5].
  std::array<double, 6> geotransform = {};
  int width_px = 0;
  int height_px = 0;
  bool operator==(const RasterInfo&) const = default;
};

/// A world takes no more pixels of a raster of land cover: a gigabyte, 10 m over 327 km.
inline constexpr std::int64_t kMaxCoverPixels = std::int64_t{1} << 30;

/// A raster of land cover, and what it says.
struct CoverRasterInfo {
  RasterInfo raster;
  /// A place has the class of the pixel at most this far from it along rows and columns, in pixels: borders
  /// between classes are bent.
  double border_px = 0.0;
  // The part that the world took: none, or up to kMaxCoverPixels.
  int first_column = 0;
  int first_row = 0;
  int num_columns = 0;
  int num_rows = 0;
  /// A Cover a pixel of that part, kSilent where the raster says nothing; empty until read_covers().
  core::Image8 covers;
  static constexpr std::uint8_t kSilent = 255;
};

/// The rasters of a world, by the rows of its manifest.
struct WorldRasters {
  std::vector<std::optional<RasterInfo>> sources;  ///< of WorldManifest::sources; none: no raster
  std::vector<std::vector<CoverRasterInfo>> land_cover;  ///< of WorldManifest::layers
  /// Of WorldManifest::imagery, in the order of ImageryInfo::sources.
  std::vector<std::vector<RasterInfo>> imagery;
};

/// Tells a row of what WorldRasters::land_cover[layer][raster] says.
/// row      of the part that the world took, from 0
/// covers   num_columns of them, all to be written
using CoverRows = std::function<void(std::size_t layer, std::size_t raster, int row,
                                     std::span<std::uint8_t> covers)>;

/// Writes `rasters.json` and `land_cover/<layer>_<raster>.png` of a store, each atomically.
/// input_hash   WorldManifest::input_hash
/// rasters      whose `covers` are not looked at
/// memory       as core::encode_png_rows() has it, beside what cover_rows needs
void write_rasters(const std::filesystem::path& store, const std::string& input_hash,
                   const WorldRasters& rasters, const CoverRows& cover_rows);

/// Reads them without what land cover says, and checks them; nothing of a store that older versions made, which
/// keeps none.
/// throws   Input: damaged, or of another world; Io
std::optional<WorldRasters> read_rasters(const TileStore& store);

/// Reads what a raster of land cover says into its `covers`.
/// layer    of WorldRasters::land_cover
/// raster   of that layer's
/// throws   as read_rasters()
void read_covers(const TileStore& store, std::size_t layer, std::size_t raster,
                 WorldRasters& rasters);

}  // namespace terracast::world
