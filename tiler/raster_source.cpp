#include "tiler/raster_source.h"

#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "tiler/earth_heights.h"
#include "tiler/gdal_support.h"
#include "tiler/no_data.h"
#include "tiler/raster_claims.h"
#include "tiler/raster_ledger.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

constexpr double kLowestHeight_m = kDeepestFloor_m - kEarthMargin_m;
constexpr double kHighestHeight_m = kHighestPeak_m + kEarthMargin_m;

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
  double metres_of(double raw) const override {
    return (raw * scale_ + offset_) * metres_per_unit_;
  }
  double raw_of(double value) const override {
    return (value / metres_per_unit_ - offset_) / scale_;
  }
  core::Ledger ledger() const override { return ledger_; }

 private:
  GdalRaster(const core::Path& file, const ElevationOptions& options, RasterQuantity quantity,
             bool holds_heights, const geo::Geodetic& near)
      : file_(file),
        written_(file.written),
        encoding_(options.encoding),
        quantity_(std::move(quantity)),
        holds_heights_(holds_heights),
        no_data_(NoData::of(options.nodata)) {
    const GdalErrors errors;
    dataset_ = open_gdal_raster(file, errors);
    check_band();
    grid_ = std::make_unique<RasterGrid>(*dataset_, written_, near, errors);
    if (holds_heights_) take_claims(options);
    find_no_data();
    take_ledger(options);
    if (errors.has_failure()) said_ = errors.text();
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
  void take_claims(const ElevationOptions& options);
  void find_no_data();
  void take_ledger(const ElevationOptions& options);
  double value_of(double raw, int column, int row) const;
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
  NoData no_data_;
  core::Ledger ledger_;
  std::string said_;    ///< by GDAL at opening, of what it could not do; it does not say so again
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

void GdalRaster::take_claims(const ElevationOptions& options) {
  const HeightClaims claims = height_claims(*dataset_, *band(), grid_->crs());
  check_vertical_datum(claims, options, written_);
  if (!is_colour()) metres_per_unit_ = metres_per_unit(claims, options, written_);
}

void GdalRaster::find_no_data() {
  if (is_colour()) {
    uses_mask_ = alpha_band_ > 0 && no_data_.takes_masks();
    return;
  }
  no_data_.take_declared(*band());
  // GDAL takes alpha for a mask where samples are bytes, and not where they are floats.
  uses_mask_ = no_data_.takes_masks() &&
               (alpha_band_ > 0 || (band()->GetMaskFlags() & (GMF_ALL_VALID | GMF_NODATA)) == 0);
}

void GdalRaster::take_ledger(const ElevationOptions& options) {
  const bool counts = options.trust != "config" || options.unit == "declared";
  ledger_ = ledger_of(*dataset_, {.what = is_colour() ? "colours" : quantity_.name,
                                  .uses_unit = holds_heights_ && !is_colour() && counts,
                                  .uses_scale = !is_colour(),
                                  .uses_nodata = no_data_.takes_declared() && !is_colour(),
                                  .uses_mask = uses_mask_,
                                  .uses_colours = is_colour()});
}

void GdalRaster::fail_unread(const GdalErrors& errors) const {
  fail(ErrorKind::Input, "{}: its samples cannot be read; is it truncated? ({})", written_,
       errors.has_failure() || said_.empty() ? errors.text() : said_);
}

void GdalRaster::read_samples(int band, const SampleWindow& window, std::vector<double>& samples,
                              const GdalErrors& errors) const {
  samples.resize(static_cast<std::size_t>(window.num_samples()));
  if (!read_window(*dataset_->GetRasterBand(band), *grid_, window, samples)) fail_unread(errors);
}

/// Empty where the raster has no mask.
std::vector<std::uint8_t> GdalRaster::read_mask(const SampleWindow& window,
                                                const GdalErrors& errors) const {
  std::vector<std::uint8_t> mask;
  if (!uses_mask_) return mask;
  mask.resize(static_cast<std::size_t>(window.num_samples()));
  GDALRasterBand* mask_band =
      alpha_band_ > 0 ? dataset_->GetRasterBand(alpha_band_) : band()->GetMaskBand();
  if (!read_window(*mask_band, *grid_, window, mask)) fail_unread(errors);
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

void GdalRaster::fail_out_of_range(double value, double raw, int column, int row) const {
  const CustomaryFill* fill = is_colour() ? nullptr : customary_fill(raw);
  const std::string mark =
      fill == nullptr ? "" : fmt::format(" (it is stored as {:.9g}, which {})", raw, fill->where);
  if (holds_heights_)
    fail(ErrorKind::Input,
         "{}: the height of pixel ({}, {}) is {:.6g} m{}, outside {:g} to {:g} m, where all ground "
         "on Earth lies; if it "
         "marks voids, state nodata = \"{}\"; if it is in feet, unit = \"ft\"",
         written_, grid_->column_in_file(column), row, value, mark, kLowestHeight_m,
         kHighestHeight_m, no_data_.text_with(raw));
  fail(ErrorKind::Input,
       "{}: the {} of pixel ({}, {}) is {:.6g}{}, outside {:g} to {:g}; {}; if it marks places "
       "without a value, declare it: gdal_edit.py -a_nodata {:.17g} {}",
       written_, quantity_.name, grid_->column_in_file(column), row, value, mark, quantity_.lowest,
       quantity_.highest, quantity_.advice, raw, written_);
}

double GdalRaster::value_of(double raw, int column, int row) const {
  const double value = metres_of(raw);
  if (!(value >= quantity_.lowest && value <= quantity_.highest))
    fail_out_of_range(value, raw, column, row);
  return value;
}

Grid<double> GdalRaster::read(const SampleWindow& window) const {
  TERRACAST_CHECK(
      window.first_row >= 0 && window.first_row + window.height <= grid_->height() &&
          (grid_->goes_round() ||
           (window.first_column >= 0 && window.first_column + window.width <= grid_->width())),
      "window outside {}", written_);
  const GdalErrors errors;
  Grid<double> values(window.width, window.height);
  if (window.is_empty()) return values;
  read_samples(1, window, values.values, errors);
  if (is_colour()) decode_colours(window, values.values, errors);
  const std::vector<std::uint8_t> mask = read_mask(window, errors);
  const GDALDataType type = is_colour() ? GDT_Float64 : band()->GetRasterDataType();
  for (int j = 0; j < window.height; ++j)
    for (int i = 0; i < window.width; ++i) {
      double& value = values(i, j);
      if ((uses_mask_ && mask[values.index(i, j)] == 0) || no_data_.holds(value, type)) {
        value = std::numeric_limits<double>::quiet_NaN();
        continue;
      }
      value = value_of(value, window.first_column + i, window.first_row + j);
    }
  return values;
}

std::string GdalRaster::content_hash() const {
  // A georeference may stand in a file beside the raster's, and so may all that the band declares.
  std::string content = fmt::format("{} {} {} {} {} {}", grid_->description(), metres_per_unit_,
                                    scale_, offset_, uses_mask_, no_data_.text());
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
