#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "geo/geodesy.h"
#include "tiler/crs_operation.h"
#include "tiler/gdal_support.h"
#include "world/raster_info.h"

namespace terracast::tiler {

/// A window of a raster's samples.
struct SampleWindow {
  int first_column = 0;
  int first_row = 0;
  int width = 0;
  int height = 0;
  bool is_empty() const { return width <= 0 || height <= 0; }
  std::int64_t num_samples() const { return std::int64_t{width} * height; }
};

/// A part of a window that lies together in the file.
struct WindowPart {
  SampleWindow in_file;
  int first_column = 0;  ///< of the buffer that the window is read into
  int width = 0;         ///< of the part, in the buffer's columns
};

/// How far apart samples stand on the ground.
struct SampleSize {
  double spacing_m = 0.0;  ///< in the direction where samples are densest
  double area_m2 = 0.0;
  Eigen::Vector2d sides_m = Eigen::Vector2d::Zero();  ///< along a row and along a column
};

/// Where the samples of a raster stand. They are the centres of its pixels: sample (i, j) at pixel
/// (i + 0.5, j + 0.5) of GDAL's geotransform, whatever AREA_OR_POINT says (GDAL has shifted such files
/// already).
///
/// A raster in longitude and latitude that goes round the Earth has no edge at its seam, wherever that is (180 degrees, 0,
/// …) and however its pixels are registered: of columns that come twice the first counts, and where the world lies
/// beyond a quarter of the way round from the middle, columns are counted from the middle. So the columns of samples
/// are not always those of the file: parts_of() says which these are.
///
/// threads   safe
class RasterGrid {
 public:
  /// written  the file, for messages
  /// near     longitudes are counted so that they run on without a jump round this place
  /// throws   Input: no samples, no georeference, no CRS, or none that PROJ leads to
  RasterGrid(GDALDataset& dataset, const std::string& written, const geo::Geodetic& near,
             const GdalErrors& errors);

  const std::string& written() const { return written_; }
  const std::string& crs_name() const { return crs_.name; }
  const HorizontalCrs& crs() const { return crs_; }
  /// The PROJ pipeline from WGS84 longitude and latitude to the CRS; empty where nothing is to do.
  const std::string& pipeline() const { return pipeline_; }
  /// Says so when only a ballpark transformation leads to the CRS; empty otherwise.
  const std::string& warning() const { return warning_; }
  /// Of all columns, of a raster that goes round the Earth once round.
  int width() const { return width_; }
  int height() const { return height_; }
  bool goes_round() const { return goes_round_; }
  /// The column of the file that a column of samples is; one that goes round counts on beyond its ends.
  int column_in_file(int column) const;
  /// In order; one part where the columns lie together in the file.
  /// window   of samples: within the raster, or beyond its first and last columns where it goes round
  /// width    of the buffer that it is read into, columns; fewer than the window's when it is read coarser
  std::vector<WindowPart> parts_of(const SampleWindow& window, int width) const;
  std::vector<WindowPart> parts_of(const SampleWindow& window) const {
    return parts_of(window, window.width);
  }

  /// Sample coordinates of places, and places (height 0) of sample coordinates.
  /// throws   Input: a place that the projection cannot hold
  void samples_from_geodetic(std::span<const geo::Geodetic> places,
                             std::span<Eigen::Vector2d> samples) const;
  void geodetic_from_samples(std::span<const Eigen::Vector2d> samples,
                             std::span<geo::Geodetic> places) const;

  /// Where sample (0, 0) of `other` stands among this one's samples, when it has the same CRS and
  /// its samples fall on this one's.
  std::optional<Eigen::Vector2i> offset_of(const RasterGrid& other) const;

  /// At the world's origin.
  /// half_size_m   of the world's square
  SampleSize size_of_samples(const geo::WorldFrame& frame, double half_size_m) const;

  /// Sample coordinates of the world's square, at whatever height its ground lies.
  Eigen::AlignedBox2d box_of_square(const geo::WorldFrame& frame, double half_size_m) const;

  /// Where its pixels lie, for the world's store; columns are those of samples.
  /// name   the file's, without folder
  world::RasterInfo info(const std::string& name) const;

  /// All that determines where samples stand, for hashes.
  std::string description() const;

 private:
  void read_geotransform(GDALDataset& dataset);
  void find_pipeline(const geo::Geodetic& near, const GdalErrors& errors);
  void place_samples(double near_lon_deg);
  void join_the_seam(double near_lon_deg);

  std::string written_;
  double near_lon_deg_;
  int width_;
  int height_;
  bool goes_round_ = false;
  int first_in_file_ = 0;  ///< the file's column of samples' column 0
  HorizontalCrs crs_;
  std::string pipeline_;
  std::string warning_;
  std::array<double, 6> geotransform_ = {};
  Eigen::Affine2d crs_from_sample_;
  Eigen::Affine2d sample_from_crs_;
  std::unique_ptr<SharedTransformation> crs_from_geodetic_;
  std::unique_ptr<SharedTransformation> geodetic_from_crs_;
};

/// Reads a window of a band, or of a mask of one.
/// samples   of the window, row by row; as many as it has
/// returns   false: GDAL could not
bool read_window(GDALRasterBand& band, const RasterGrid& grid, const SampleWindow& window,
                 std::span<double> samples);
bool read_window(GDALRasterBand& band, const RasterGrid& grid, const SampleWindow& window,
                 std::span<std::uint8_t> samples);

}  // namespace terracast::tiler
