#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/ledger.h"
#include "tiler/gdal_support.h"
#include "tiler/geodesy_cells.h"
#include "tiler/layer.h"
#include "tiler/no_data.h"
#include "tiler/raster_grid.h"
#include "world/imagery_info.h"

namespace terracast::tiler {

/// How the samples of a colour raster become albedo.
struct ColorOptions {
  std::vector<std::int64_t>
      bands;  ///< red, green, blue, or one grey; counted from 1; empty: by their colours
  std::string nodata = "declared";  ///< what NoData::from_text() reads
  double black = 0.0;               ///< sample that is shown as 0 …
  double white = 0.0;  ///< … and as 1; equal: 0 and 255 of bytes, of others by percentile
  double percentile =
      2.0;  ///< of the samples are darker than black, and as many lighter than white
  std::string transfer = "auto";  ///< from samples to light: srgb, linear; auto: srgb of bytes
  double gain = 0.0;              ///< on the light; 0: as plausible_gain() says
  double saturation = 1.0;        ///< 0: grey
};

/// What makes a mean albedo plausible for land: 1 from 0.08 to 0.22; else what brings it to the nearer
/// of these, from 0.2 to 5.
double plausible_gain(double mean_albedo);

/// A colour raster over the world's square, read tile by tile through few windows.
///
/// A pixel of a tile takes the colour at its centre's place on the ground (Catmull-Rom between samples, in linear
/// light; bilinear among those that are there beside missing ones). Where the nearest sample is missing
/// there is nothing.
///
/// memory    of a call: the window under a tile
/// threads   safe; each thread that reads has the file open for itself
class ColorRaster {
 public:
  /// throws   Io: no such file; Input: as RasterGrid; bands that are not there or hold no numbers
  ColorRaster(const core::Path& file, const ColorOptions& options, const LayerInputs& inputs);

  /// Whether any of it lies in the square.
  bool touches_square() const { return !box_.isEmpty(); }
  const RasterGrid& grid() const { return *grid_; }
  const std::string& name() const { return name_; }  ///< the file's, without folder
  double spacing_m() const { return spacing_m_; }
  /// Pixels of this level are about as large as its samples: by 0.55 to 1.1 of their spacing.
  int level() const { return level_; }
  double gain() const { return gain_; }
  const std::string& content_hash() const { return hash_; }
  /// What the file says beside its samples.
  const core::Ledger& ledger() const { return ledger_; }

  /// Fills the pixels of a tile that hold nothing yet (alpha 0).
  /// z_world   of the ground at (kNodes + 1)^2 places that span the tile, row by row from the south
  /// returns   whether it filled any
  bool fill(const world::ImageryTileId& id, std::span<const double> z_world,
            core::Image8& image) const;
  static constexpr int kNodes = 64;

 private:
  struct Window {
    SampleWindow at;
    std::vector<Eigen::Array4f>
        samples;  ///< linear light, and 1 where there is a sample, else all 0
  };
  class Lease;
  GdalDatasetPtr open() const;
  void choose_bands(GDALDataset& dataset);
  void choose_range(GDALDataset& dataset);
  void choose_gain();
  void set_codes();
  Window read(GDALDataset& dataset, const SampleWindow& at, int width, int height) const;
  float light_of(float sample) const;
  Eigen::Array3f shown(const Eigen::Array3f& light) const;

  core::Path file_;
  ColorOptions options_;
  std::string name_;
  double half_size_m_;
  std::unique_ptr<RasterGrid> grid_;
  std::unique_ptr<GeodesyCells> cells_;
  Eigen::AlignedBox2d box_;  ///< of the square, in samples
  double spacing_m_ = 0.0;
  int level_ = 0;
  std::vector<int> bands_;  ///< three, or one
  int alpha_band_ = 0;
  bool uses_mask_ = false;
  NoData no_data_;
  bool is_bytes_ = false;
  bool is_srgb_ = false;
  std::vector<std::array<std::uint8_t, 4>> palette_;
  std::array<float, 256> light_of_byte_ = {};
  double gain_ = 1.0;
  std::string hash_;
  core::Ledger ledger_;
  std::string said_;  ///< by GDAL at opening, of what it could not do; it does not say so again
  mutable std::mutex mutex_;
  mutable std::vector<GdalDatasetPtr> idle_;
};

}  // namespace terracast::tiler
