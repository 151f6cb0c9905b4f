#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/ledger.h"
#include "tiler/geodesy_cells.h"
#include "tiler/gradient_noise.h"
#include "tiler/grid.h"
#include "tiler/land_cover/legend.h"
#include "tiler/land_cover/water_bodies.h"
#include "tiler/layer.h"
#include "tiler/no_data.h"
#include "tiler/raster_grid.h"

namespace terracast::tiler {

struct CoverRasterOptions {
  /// what NoData::from_text() reads
  std::string nodata = "declared";
  double border_px = 0.9;    ///< how far borders stray, in sides of a pixel
  double lake_flat_m = 2.0;  ///< water whose ground is more uneven is not taken for a lake
};

/// What was found in the part of a raster that lies in the world's square.
struct CoverRasterCounts {
  std::int64_t num_samples = 0;
  std::int64_t num_nodata = 0;
  std::int64_t num_unknown = 0;  ///< whose code the legend calls unknown
  std::int64_t num_lakes = 0;
  std::int64_t num_lake_samples = 0;
  std::int64_t num_water_samples_left = 0;  ///< water that is not taken for a lake
};

/// A raster of land cover codes over the world's square.
///
/// Each place has the class of the nearest sample in the raster's own CRS, seen from a place a little
/// aside: noise bends the borders between classes, which would run along the pixels' sides. A place strays
/// by at most border_px of the samples' spacing.
///
/// Water is a lake where its ground is level: the heights of a body of water (samples that hang together
/// by their four neighbours) lie within lake_flat_m of each other, beside the tenth that is lowest and
/// the tenth that is highest, and a geoid that leans by up to 1e-4. Heights of lakes differ by that much
/// because elevation is rounded to metres, noisy, and blurred over the shore; the lake itself is level at
/// their median, or on their plane where that leans as a geoid does. Of other water the raster says nothing: rivers and streams run down their beds, and want a layer that knows how.
///
/// memory    a byte a sample of the square
/// threads   safe
class CoverRaster {
 public:
  /// Reads the part of the raster that lies in the square, strip by strip.
  /// throws   Io: no such file; Input: as RasterGrid; not one band of whole numbers; a code that the
  ///          legend lacks (names code and pixel); more samples of the square than world::kMaxCoverPixels
  CoverRaster(const core::Path& file, const Legend& legend, const CoverRasterOptions& options,
              const LayerInputs& inputs);

  /// Whether any of its samples lies in the square.
  bool touches_square() const { return !window_.is_empty(); }
  const RasterGrid& grid() const { return *grid_; }
  const CoverRasterCounts& counts() const { return counts_; }
  /// Where its pixels lie, for the world's store.
  /// name   the file's, without folder
  world::CoverRasterInfo info(const std::string& name) const;
  /// A row of what they say; as world::CoverRows.
  void tell_row(int row, std::span<std::uint8_t> covers) const;
  /// Of the file, the legend and all else that determines cover().
  const std::string& content_hash() const { return hash_; }
  /// What the file says beside its samples.
  const core::Ledger& ledger() const { return ledger_; }

  struct Found {
    world::Cover cover;
    std::optional<double> level_m;  ///< of a lake's surface, above the ellipsoid
  };
  /// z_world   of the ground at the place; 10 m more or less move the place by millimetres
  std::optional<Found> find(const Eigen::Vector2d& place_world, double z_world) const;

 private:
  void choose_window(const LayerInputs& inputs);
  void read(const Legend& legend, const GdalErrors& errors);
  void decode(const Legend& legend, const std::vector<double>& codes,
              const std::vector<std::uint8_t>& mask, const SampleWindow& strip);
  struct SampleHeight {
    Eigen::Vector2d sample;
    double height_m;  ///< above the ellipsoid
  };
  struct LakeRun {
    SampleRun run;
    Eigen::Vector3d
        level;  ///< height above the ellipsoid: at sample (0, 0), and what a column and a row add
  };
  void find_lakes(const LayerInputs& inputs);
  /// Of a body's ground, at up to a thousand of its samples.
  std::vector<SampleHeight> heights_of(const std::vector<SampleRun>& body,
                                       const LayerInputs& inputs) const;
  /// As LakeRun::level; nothing where the ground is too uneven for a lake.
  std::optional<Eigen::Vector3d> level_of(std::vector<SampleHeight> heights) const;
  double lake_level_m(const Eigen::Vector2i& sample) const;
  Eigen::Vector2d aside_m(const Eigen::Vector2d& place_world) const;

  CoverRasterOptions options_;
  double half_size_m_;
  GdalDatasetPtr dataset_;  ///< closed once it is read
  std::unique_ptr<RasterGrid> grid_;
  double spacing_m_ = 0.0;
  int num_bends_ = 1;  ///< octaves of the noise that bends borders
  NoData no_data_;
  SampleWindow window_;
  Grid<std::uint8_t> classes_;  ///< LandClass, of the window
  std::vector<LakeRun> lakes_;  ///< in the order of rows and columns
  std::unique_ptr<GeodesyCells> cells_;
  GradientNoise aside_x_, aside_y_;
  CoverRasterCounts counts_;
  std::string hash_;
  core::Ledger ledger_;
};

}  // namespace terracast::tiler
