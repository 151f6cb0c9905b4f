#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>

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
  /// As the CRS's vertical part names it; empty where it has none.
  const std::string& vertical_unit() const { return crs_.vertical_unit; }
  /// The PROJ pipeline from WGS84 longitude and latitude to the CRS; empty where nothing is to do.
  const std::string& pipeline() const { return pipeline_; }
  /// Says so when only a ballpark transformation leads to the CRS; empty otherwise.
  const std::string& warning() const { return warning_; }
  int width() const { return width_; }
  int height() const { return height_; }

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

  /// Where its pixels lie, for the world's store.
  /// name   the file's, without folder
  world::RasterInfo info(const std::string& name) const;

  /// All that determines where samples stand, for hashes.
  std::string description() const;

 private:
  void read_geotransform(GDALDataset& dataset);
  void find_pipeline(const geo::Geodetic& near, const GdalErrors& errors);
  void place_samples(double near_lon_deg);

  std::string written_;
  double near_lon_deg_;
  int width_;
  int height_;
  HorizontalCrs crs_;
  std::string pipeline_;
  std::string warning_;
  std::array<double, 6> geotransform_ = {};
  Eigen::Affine2d crs_from_sample_;
  Eigen::Affine2d sample_from_crs_;
  std::unique_ptr<SharedTransformation> crs_from_geodetic_;
  std::unique_ptr<SharedTransformation> geodetic_from_crs_;
};

}  // namespace terracast::tiler
