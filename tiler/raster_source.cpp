#include "tiler/raster_source.h"

#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
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
      : GdalRaster(file, options,
                   {.name = "height",
                    .lowest = kLowestHeight_m,
                    .highest = kHighestHeight_m,
                    .advice = {}},
                   true, near) {}
  GdalRaster(const core::Path& file, const RasterQuantity& quantity, const geo::Geodetic& near)
      : GdalRaster(file, {}, quantity, false, near) {}

  const std::string& path() const override { return written_; }
  const RasterGrid& grid() const override { return *grid_; }
  Grid<double> read(const SampleWindow& window) const override;
  std::array<double, 4> corner_heights_m() const override;
  std::string content_hash() const override;

 private:
  GdalRaster(const core::Path& file, const ElevationOptions& options, RasterQuantity quantity,
             bool holds_heights, const geo::Geodetic& near)
      : file_(file),
        written_(file.written),
        encoding_(options.encoding),
        quantity_(std::move(quantity)),
        holds_heights_(holds_heights) {
    const GdalErrors errors;
    dataset_ = open_gdal_raster(file, errors);
    check_band();
    grid_ = std::make_unique<RasterGrid>(*dataset_, written_, near, errors);
    if (holds_heights_) metres_per_unit_ = unit_of(options);
    read_nodata(options);
  }

  bool is_colour() const { return encoding_ != "heights"; }
  void check_band();
  void check_colour_bands();
  void read_samples(int band, const SampleWindow& window, std::vector<double>& samples,
                    const GdalErrors& errors) const;
  std::vector<std::uint8_t> read_mask(const SampleWindow& window, const GdalErrors& errors) const;
  void decode_colours(const SampleWindow& window, std::vector<double>& red,
                      const GdalErrors& errors) const;
  [[noreturn]] void fail_unread(const GdalErrors& errors) const;
  double unit_of(const ElevationOptions& options) const;
  void read_nodata(const ElevationOptions& options);
  bool is_nodata(double raw) const;
  double value_of(double raw, int column, int row) const;
  [[noreturn]] void fail_undeclared_nan(int column, int row) const;
  [[noreturn]] void fail_out_of_range(double value, double raw, int column, int row) const;

  GDALRasterBand* band() const { return dataset_->GetRasterBand(1); }

  core::Path file_;
  std::string written_;
  std::string encoding_;
  RasterQuantity quantity_;
  bool holds_heights_;
  GdalDatasetPtr dataset_;
  std::unique_ptr<RasterGrid> grid_;
  double metres_per_unit_ = 1.0;
  double scale_ = 1.0;
  double offset_ = 0.0;
  std::optional<double> nodata_;
  int alpha_band_ = 0;  ///< 0: none
  bool uses_mask_ = false;
};

void GdalRaster::check_band() {
  if (is_colour()) return check_colour_bands();
  const int count = dataset_->GetRasterCount();
  const bool has_alpha =
      count == 2 && dataset_->GetRasterBand(2)->GetColorInterpretation() == GCI_AlphaBand;
  if (has_alpha) alpha_band_ = 2;
  if (count != 1 && !has_alpha)
    fail(ErrorKind::Input,
         "{}: has {} bands, and a raster of one {} a pixel has one; take it out with "
         "gdal_translate -b N{}",
         written_, count, quantity_.name,
         holds_heights_ ? ", or state the encoding of terrain tiles" : "");
  const GDALDataType type = band()->GetRasterDataType();
  if (GDALDataTypeIsComplex(type) != FALSE)
    fail(ErrorKind::Input,
         "{}: its samples are complex numbers ({}), and a pixel's {} is a real one", written_,
         GDALGetDataTypeName(type), quantity_.name);
  int has_value = FALSE;
  const double scale = band()->GetScale(&has_value);
  if (has_value != FALSE) scale_ = scale;
  const double offset = band()->GetOffset(&has_value);
  if (has_value != FALSE) offset_ = offset;
  if (!std::isfinite(scale_) || scale_ == 0.0 || !std::isfinite(offset_))
    fail(ErrorKind::Input, "{}: declares scale {} and offset {}, which give no {}", written_,
         scale_, offset_, quantity_.name);
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

double GdalRaster::unit_of(const ElevationOptions& options) const {
  if (is_colour()) return 1.0;
  if (options.unit == "m") return 1.0;
  if (options.unit == "ft") return geo::metres_from_feet(1.0);
  if (options.unit == "us_ft") return kMetresPerUsFoot;
  std::string word = band()->GetUnitType() == nullptr ? "" : band()->GetUnitType();
  if (word.empty()) word = grid_->vertical_unit();
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
    corners[k] = read({.first_column = (k & 1) != 0 ? grid_->width() - 1 : 0,
                       .first_row = (k & 2) != 0 ? grid_->height() - 1 : 0,
                       .width = 1,
                       .height = 1})
                     .values.front();
  return corners;
}

void GdalRaster::fail_undeclared_nan(int column, int row) const {
  fail(
      ErrorKind::Input,
      "{}: the {} of pixel ({}, {}) is NaN, and NaN is not its declared no-data value; if it marks "
      "{}",
      written_, quantity_.name, column, row,
      holds_heights_
          ? "voids, state nodata = \"nan\""
          : "places without a value, declare it: gdal_edit.py -a_nodata nan " + written_);
}

void GdalRaster::fail_out_of_range(double value, double raw, int column, int row) const {
  if (holds_heights_)
    fail(ErrorKind::Input,
         "{}: the height of pixel ({}, {}) is {:.6g} m, outside {} to {} m; if it marks voids, "
         "state nodata = \"{:.17g}\"; if it is in feet, unit = \"ft\"",
         written_, column, row, value, kLowestHeight_m, kHighestHeight_m, raw);
  fail(ErrorKind::Input,
       "{}: the {} of pixel ({}, {}) is {:.6g}, outside {:g} to {:g}; {}; if it marks places "
       "without a value, declare it: gdal_edit.py -a_nodata {:.17g} {}",
       written_, quantity_.name, column, row, value, quantity_.lowest, quantity_.highest,
       quantity_.advice, raw, written_);
}

double GdalRaster::value_of(double raw, int column, int row) const {
  const double value = (raw * scale_ + offset_) * metres_per_unit_;
  if (std::isnan(value)) fail_undeclared_nan(column, row);
  if (!(value >= quantity_.lowest && value <= quantity_.highest))
    fail_out_of_range(value, raw, column, row);
  return value;
}

Grid<double> GdalRaster::read(const SampleWindow& window) const {
  TERRACAST_CHECK(window.first_column >= 0 && window.first_row >= 0 &&
                      window.first_column + window.width <= grid_->width() &&
                      window.first_row + window.height <= grid_->height(),
                  "window outside {}", written_);
  const GdalErrors errors;
  Grid<double> values(window.width, window.height);
  if (window.is_empty()) return values;
  read_samples(1, window, values.values, errors);
  if (is_colour()) decode_colours(window, values.values, errors);
  const std::vector<std::uint8_t> mask = read_mask(window, errors);
  for (int j = 0; j < window.height; ++j)
    for (int i = 0; i < window.width; ++i) {
      double& value = values(i, j);
      const bool is_empty_colour = is_colour() && std::isnan(value);
      if ((uses_mask_ && mask[values.index(i, j)] == 0) || is_nodata(value) || is_empty_colour) {
        value = std::numeric_limits<double>::quiet_NaN();
        continue;
      }
      value = value_of(value, window.first_column + i, window.first_row + j);
    }
  return values;
}

std::string GdalRaster::content_hash() const {
  // A georeference may stand in a file beside the raster's, and so may all that the band declares.
  std::string content =
      fmt::format("{} {} {} {} {} {}", grid_->description(), metres_per_unit_, scale_, offset_,
                  uses_mask_, nodata_ ? fmt::to_string(*nodata_) : "none");
  if (is_colour()) content += encoding_;
  return core::content_hash(content + content_hash_of(*dataset_, file_));
}

}  // namespace

std::unique_ptr<RasterSource> RasterSource::open(const core::Path& file,
                                                 const ElevationOptions& options,
                                                 const geo::Geodetic& near) {
  return std::make_unique<GdalRaster>(file, options, near);
}

std::unique_ptr<RasterSource> RasterSource::open_quantity(const core::Path& file,
                                                          const RasterQuantity& quantity,
                                                          const geo::Geodetic& near) {
  return std::make_unique<GdalRaster>(file, quantity, near);
}

}  // namespace terracast::tiler
