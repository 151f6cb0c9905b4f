#include "tiler/raster_source.h"

#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "geo/units.h"
#include "tiler/crs_operation.h"
#include "tiler/gdal_support.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

constexpr double kLowestHeight_m = -12000.0;  // the deepest trench, with a margin
constexpr double kHighestHeight_m = 9000.0;
constexpr double kMetresPerUsFoot = 1200.0 / 3937.0;

/// Metres in a unit of height as files name them; nothing for words that are not known.
std::optional<double> metres_in(std::string unit) {
  for (char& c : unit) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const char* word : {"", "m", "metre", "metres", "meter", "meters"})
    if (unit == word) return 1.0;
  for (const char* word : {"ft", "foot", "feet", "international foot", "international feet"})
    if (unit == word) return geo::metres_from_feet(1.0);
  for (const char* word : {"us-ft", "us_ft", "ftus", "sft", "us survey foot", "us survey feet",
                           "foot_us", "survey foot", "us foot"})
    if (unit == word) return kMetresPerUsFoot;
  return std::nullopt;
}

class GdalRaster : public RasterSource {
 public:
  GdalRaster(const core::Path& file, const ElevationOptions& options, const geo::Geodetic& near)
      : path_(gdal_path(file)),
        written_(file.written),
        near_lon_deg_(near.lon_deg),
        encoding_(options.encoding) {
    const GdalErrors errors;
    dataset_ = open_gdal_raster(file, errors);
    check_band();
    read_georeference(near, errors);
    metres_per_unit_ = unit_of(options);
    read_nodata(options);
  }

  const std::string& path() const override { return written_; }
  const std::string& crs_name() const override { return crs_name_; }
  const std::string& pipeline() const override { return pipeline_; }
  const std::string& warning() const override { return warning_; }
  int width() const override { return dataset_->GetRasterXSize(); }
  int height() const override { return dataset_->GetRasterYSize(); }

  void samples_from_geodetic(std::span<const geo::Geodetic> places,
                             std::span<Eigen::Vector2d> samples) const override;
  void geodetic_from_samples(std::span<const Eigen::Vector2d> samples,
                             std::span<geo::Geodetic> places) const override;
  std::optional<Eigen::Vector2i> offset_of(const RasterSource& other) const override;
  Grid<double> read(const SampleWindow& window) const override;
  std::array<double, 4> corner_heights_m() const override;
  std::string content_hash() const override;

 private:
  bool is_colour() const { return encoding_ != "heights"; }
  void check_band();
  void check_colour_bands();
  void read_samples(int band, const SampleWindow& window, std::vector<double>& samples,
                    const GdalErrors& errors) const;
  std::vector<std::uint8_t> read_mask(const SampleWindow& window, const GdalErrors& errors) const;
  void decode_colours(const SampleWindow& window, std::vector<double>& red,
                      const GdalErrors& errors) const;
  [[noreturn]] void fail_unread(const GdalErrors& errors) const;
  void read_georeference(const geo::Geodetic& near, const GdalErrors& errors);
  double unit_of(const ElevationOptions& options) const;
  void read_nodata(const ElevationOptions& options);
  bool is_nodata(double raw) const;

  GDALRasterBand* band() const { return dataset_->GetRasterBand(1); }

  std::string path_;
  std::string written_;
  double near_lon_deg_;
  std::string encoding_;
  GdalDatasetPtr dataset_;
  std::string crs_name_;
  std::string crs_wkt_;
  std::string pipeline_;
  std::string warning_;
  bool is_geographic_ = false;
  std::string declared_vertical_unit_;
  std::array<double, 6> geotransform_ = {};
  Eigen::Affine2d crs_from_sample_;
  Eigen::Affine2d sample_from_crs_;
  std::unique_ptr<SharedTransformation> crs_from_geodetic_;
  std::unique_ptr<SharedTransformation> geodetic_from_crs_;
  double metres_per_unit_ = 1.0;
  double scale_ = 1.0;
  double offset_ = 0.0;
  std::optional<double> nodata_;
  int alpha_band_ = 0;  ///< 0: none
  bool uses_mask_ = false;
};

void GdalRaster::check_band() {
  if (width() <= 0 || height() <= 0)
    fail(ErrorKind::Input, "{}: has no samples ({} x {})", written_, width(), height());
  if (is_colour()) return check_colour_bands();
  const int count = dataset_->GetRasterCount();
  const bool has_alpha =
      count == 2 && dataset_->GetRasterBand(2)->GetColorInterpretation() == GCI_AlphaBand;
  if (has_alpha) alpha_band_ = 2;
  if (count != 1 && !has_alpha)
    fail(ErrorKind::Input,
         "{}: has {} bands, and a raster of heights has one; take it out with gdal_translate -b "
         "N, or state the encoding of terrain tiles",
         written_, count);
  const GDALDataType type = band()->GetRasterDataType();
  if (GDALDataTypeIsComplex(type) != FALSE)
    fail(ErrorKind::Input, "{}: its samples are complex numbers ({}), not heights", written_,
         GDALGetDataTypeName(type));
  int has_value = FALSE;
  const double scale = band()->GetScale(&has_value);
  if (has_value != FALSE) scale_ = scale;
  const double offset = band()->GetOffset(&has_value);
  if (has_value != FALSE) offset_ = offset;
  if (!std::isfinite(scale_) || scale_ == 0.0 || !std::isfinite(offset_))
    fail(ErrorKind::Input, "{}: declares scale {} and offset {}, which give no heights", written_,
         scale_, offset_);
}

void GdalRaster::check_colour_bands() {
  const int count = dataset_->GetRasterCount();
  if (count == 4) alpha_band_ = 4;
  bool is_byte = count == 3 || count == 4;
  for (int band = 1; is_byte && band <= 3; ++band)
    is_byte = dataset_->GetRasterBand(band)->GetRasterDataType() == GDT_Byte;
  if (!is_byte)
    fail(ErrorKind::Input,
         "{}: has {} bands (the first of {}), and encoding = \"{}\" reads red, green and blue of "
         "one byte each",
         written_, count, GDALGetDataTypeName(band()->GetRasterDataType()), encoding_);
}

void GdalRaster::read_georeference(const geo::Geodetic& near, const GdalErrors& errors) {
  std::array<double, 6>& gt = geotransform_;
  if (dataset_->GetGeoTransform(gt.data()) != CE_None)
    fail(ErrorKind::Input,
         "{}: has no georeference{}; add one with gdal_translate -a_ullr, or gdalwarp", written_,
         dataset_->GetGCPCount() > 0 ? " but ground control points" : "");
  Eigen::Matrix2d linear;
  linear << gt[1], gt[2], gt[4], gt[5];
  const double determinant = linear.determinant();
  if (!linear.allFinite() || !std::isfinite(gt[0]) || !std::isfinite(gt[3]) ||
      !(std::abs(determinant) > 0.0))
    fail(ErrorKind::Input, "{}: its geotransform ({}, {}, {}, {}, {}, {}) cannot be inverted",
         written_, gt[0], gt[1], gt[2], gt[3], gt[4], gt[5]);

  const HorizontalCrs crs =
      horizontal_crs(dataset_->GetSpatialRef(), written_,
                     {.setter = "gdal_edit.py -a_srs", .changer = "gdalwarp"});
  declared_vertical_unit_ = crs.vertical_unit;
  is_geographic_ = crs.is_geographic;
  crs_name_ = crs.name;
  crs_wkt_ = crs.wkt;

  const CrsOperation operation = best_operation(crs_wkt_, near);
  if (operation.pipeline.empty())
    fail(ErrorKind::Input, "{}: PROJ knows no transformation from WGS84 to {}; warp it to WGS84",
         written_, crs_name_);
  if (operation.is_ballpark)
    warning_ = fmt::format(
        "{}: only a ballpark transformation leads from WGS84 to {} (its datum is taken for WGS84)",
        written_, crs_name_);
  if (operation.pipeline != "+proj=noop") {
    pipeline_ = operation.pipeline;
    crs_from_geodetic_ = std::make_unique<SharedTransformation>(pipeline_, false);
    geodetic_from_crs_ = std::make_unique<SharedTransformation>(pipeline_, true);
    if (!crs_from_geodetic_->is_good() || !geodetic_from_crs_->is_good())
      fail(ErrorKind::Input, "{}: the transformation {} cannot be used ({})", written_, pipeline_,
           errors.text());
  }

  // Sample (0, 0) is the centre of the first pixel.
  crs_from_sample_.linear() = linear;
  crs_from_sample_.translation() =
      Eigen::Vector2d(gt[0], gt[3]) + linear * Eigen::Vector2d(0.5, 0.5);
  if (is_geographic_) {
    const Eigen::Vector2d middle =
        crs_from_sample_ * Eigen::Vector2d(0.5 * width(), 0.5 * height());
    crs_from_sample_.translation().x() -= 360.0 * std::round((middle.x() - near_lon_deg_) / 360.0);
  }
  sample_from_crs_ = crs_from_sample_.inverse();
}

double GdalRaster::unit_of(const ElevationOptions& options) const {
  if (is_colour()) return 1.0;
  if (options.unit == "m") return 1.0;
  if (options.unit == "ft") return geo::metres_from_feet(1.0);
  if (options.unit == "us_ft") return kMetresPerUsFoot;
  std::string word = band()->GetUnitType() == nullptr ? "" : band()->GetUnitType();
  if (word.empty()) word = declared_vertical_unit_;
  const auto metres = metres_in(word);
  if (!metres)
    fail(ErrorKind::Input,
         "{}: declares heights in \"{}\", which is no known unit of length; state unit = \"m\", "
         "\"ft\" or \"us_ft\"",
         written_, word);
  return *metres;
}

void GdalRaster::read_nodata(const ElevationOptions& options) {
  if (options.nodata == "none") return;
  if (is_colour()) {
    uses_mask_ = alpha_band_ > 0;
    return;
  }
  if (options.nodata == "declared") {
    int has_value = FALSE;
    const double value = band()->GetNoDataValue(&has_value);
    if (has_value != FALSE) nodata_ = value;
    const int flags = band()->GetMaskFlags();
    // GDAL takes alpha for a mask where samples are bytes, and not where they are floats.
    uses_mask_ = alpha_band_ > 0 || (flags & (GMF_ALL_VALID | GMF_NODATA)) == 0;
    return;
  }
  nodata_ = number_from_text(options.nodata);
}

bool GdalRaster::is_nodata(double raw) const {
  if (!nodata_) return false;
  if (std::isnan(*nodata_)) return std::isnan(raw);
  // A value such as -3.4028234663852886e+38 is declared with more digits than a float holds.
  return raw == *nodata_ || (band()->GetRasterDataType() == GDT_Float32 &&
                             static_cast<float>(raw) == static_cast<float>(*nodata_));
}

void GdalRaster::samples_from_geodetic(std::span<const geo::Geodetic> places,
                                       std::span<Eigen::Vector2d> samples) const {
  std::vector<double> x(places.size());
  std::vector<double> y(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    x[i] = places[i].lon_deg;
    y[i] = places[i].lat_deg;
  }
  if (crs_from_geodetic_) {
    const GdalErrors errors;
    if (!crs_from_geodetic_->transform(x, y))
      fail(ErrorKind::Input,
           "{}: its projection ({}) does not hold the places about latitude {:.4f}, longitude "
           "{:.4f} ({}); does the world's origin lie within the raster?",
           written_, crs_name_, places[0].lat_deg, places[0].lon_deg, errors.text());
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (is_geographic_) x[i] -= 360.0 * std::round((x[i] - near_lon_deg_) / 360.0);
    samples[i] = sample_from_crs_ * Eigen::Vector2d(x[i], y[i]);
  }
}

void GdalRaster::geodetic_from_samples(std::span<const Eigen::Vector2d> samples,
                                       std::span<geo::Geodetic> places) const {
  std::vector<double> x(samples.size());
  std::vector<double> y(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Vector2d at = crs_from_sample_ * samples[i];
    x[i] = at.x();
    y[i] = at.y();
  }
  if (geodetic_from_crs_) {
    const GdalErrors errors;
    if (!geodetic_from_crs_->transform(x, y))
      fail(ErrorKind::Input, "{}: its projection ({}) has no place for some of its samples ({})",
           written_, crs_name_, errors.text());
  }
  for (std::size_t i = 0; i < samples.size(); ++i)
    places[i] = {.lat_deg = std::clamp(y[i], -90.0, 90.0), .lon_deg = x[i], .height_m = 0.0};
}

std::optional<Eigen::Vector2i> GdalRaster::offset_of(const RasterSource& other_source) const {
  const auto* other = dynamic_cast<const GdalRaster*>(&other_source);
  if (other == nullptr || other->pipeline_ != pipeline_ || other->is_geographic_ != is_geographic_)
    return std::nullopt;
  // Over the whole of the other raster, samples may stray by this part of the spacing: files print
  // their steps with few digits, and 1e-3 of a sample is 3 cm of 30 m.
  constexpr double kStray = 1e-3;
  const Eigen::Affine2d sample_from_other = sample_from_crs_ * other->crs_from_sample_;
  const Eigen::Vector2d first = sample_from_other * Eigen::Vector2d::Zero();
  const Eigen::Vector2d whole = first.array().round();
  if (whole.cwiseAbs().maxCoeff() > 1e9) return std::nullopt;
  for (const Eigen::Vector2d& corner :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(other->width(), 0),
        Eigen::Vector2d(0, other->height()), Eigen::Vector2d(other->width(), other->height())})
    if ((sample_from_other * corner - whole - corner).cwiseAbs().maxCoeff() > kStray)
      return std::nullopt;
  return whole.cast<int>();
}

void GdalRaster::fail_unread(const GdalErrors& errors) const {
  fail(ErrorKind::Input, "{}: its samples cannot be read; is it truncated? ({})", written_,
       errors.text());
}

void GdalRaster::read_samples(int band, const SampleWindow& window, std::vector<double>& samples,
                              const GdalErrors& errors) const {
  samples.resize(static_cast<std::size_t>(window.num_samples()));
  if (dataset_->GetRasterBand(band)->RasterIO(
          GF_Read, window.first_column, window.first_row, window.width, window.height,
          samples.data(), window.width, window.height, GDT_Float64, 0, 0, nullptr) != CE_None)
    fail_unread(errors);
}

/// Empty where the raster has no mask.
std::vector<std::uint8_t> GdalRaster::read_mask(const SampleWindow& window,
                                                const GdalErrors& errors) const {
  std::vector<std::uint8_t> mask;
  if (!uses_mask_) return mask;
  mask.resize(static_cast<std::size_t>(window.num_samples()));
  GDALRasterBand* mask_band =
      alpha_band_ > 0 ? dataset_->GetRasterBand(alpha_band_) : band()->GetMaskBand();
  if (mask_band->RasterIO(GF_Read, window.first_column, window.first_row, window.width,
                          window.height, mask.data(), window.width, window.height, GDT_Byte, 0, 0,
                          nullptr) != CE_None)
    fail_unread(errors);
  return mask;
}

/// Heights of colours, in place of the reds. Black, which stands for 10 and 32 km below the sea, is
/// what tiles hold where there are no heights: NaN.
void GdalRaster::decode_colours(const SampleWindow& window, std::vector<double>& red,
                                const GdalErrors& errors) const {
  std::vector<double> green;
  std::vector<double> blue;
  read_samples(2, window, green, errors);
  read_samples(3, window, blue, errors);
  for (std::size_t k = 0; k < red.size(); ++k) {
    const double code = 65536.0 * red[k] + 256.0 * green[k] + blue[k];
    if (code == 0.0)
      red[k] = std::numeric_limits<double>::quiet_NaN();
    else if (encoding_ == "mapbox")
      red[k] = 0.1 * code - 10000.0;
    else
      red[k] = code / 256.0 - 32768.0;
  }
}

std::array<double, 4> GdalRaster::corner_heights_m() const {
  std::array<double, 4> corners = {};
  for (std::size_t k = 0; k < 4; ++k)
    corners[k] = read({.first_column = (k & 1) != 0 ? width() - 1 : 0,
                       .first_row = (k & 2) != 0 ? height() - 1 : 0,
                       .width = 1,
                       .height = 1})
                     .values.front();
  return corners;
}

Grid<double> GdalRaster::read(const SampleWindow& window) const {
  TERRACAST_CHECK(window.first_column >= 0 && window.first_row >= 0 &&
                      window.first_column + window.width <= width() &&
                      window.first_row + window.height <= height(),
                  "window outside {}", written_);
  const GdalErrors errors;
  Grid<double> heights_m(window.width, window.height);
  if (window.is_empty()) return heights_m;
  read_samples(1, window, heights_m.values, errors);
  if (is_colour()) decode_colours(window, heights_m.values, errors);
  const std::vector<std::uint8_t> mask = read_mask(window, errors);
  for (int j = 0; j < window.height; ++j)
    for (int i = 0; i < window.width; ++i) {
      double& value = heights_m(i, j);
      const bool is_empty_colour = is_colour() && std::isnan(value);
      if ((uses_mask_ && mask[heights_m.index(i, j)] == 0) || is_nodata(value) || is_empty_colour) {
        value = std::numeric_limits<double>::quiet_NaN();
        continue;
      }
      const double height_m = (value * scale_ + offset_) * metres_per_unit_;
      if (std::isnan(height_m))
        fail(ErrorKind::Input,
             "{}: the height of pixel ({}, {}) is NaN, and NaN is not its declared no-data value; "
             "if it marks voids, state nodata = \"nan\"",
             written_, window.first_column + i, window.first_row + j);
      if (!(height_m >= kLowestHeight_m && height_m <= kHighestHeight_m))
        fail(ErrorKind::Input,
             "{}: the height of pixel ({}, {}) is {:.6g} m, outside {} to {} m; if it marks voids, "
             "state nodata = \"{:.17g}\"; if it is in feet, unit = \"ft\"",
             written_, window.first_column + i, window.first_row + j, height_m, kLowestHeight_m,
             kHighestHeight_m, value);
      value = height_m;
    }
  return heights_m;
}

std::string GdalRaster::content_hash() const {
  // A georeference may stand in a file beside the raster's, and so may all that the band declares.
  std::string content = fmt::format(
      "{} {} {} {} {} {} {} {} {}", crs_wkt_, width(), height(), fmt::join(geotransform_, " "),
      metres_per_unit_, scale_, offset_, uses_mask_, nodata_ ? fmt::to_string(*nodata_) : "none");
  if (is_colour()) content += encoding_;
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path_, ignored))
    content += core::content_hash_of_file(path_);
  return core::content_hash(content);
}

}  // namespace

std::unique_ptr<RasterSource> RasterSource::open(const core::Path& file,
                                                 const ElevationOptions& options,
                                                 const geo::Geodetic& near) {
  return std::make_unique<GdalRaster>(file, options, near);
}

}  // namespace terracast::tiler
