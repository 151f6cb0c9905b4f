#include "tiler/raster_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace terracast::tiler {

using core::ErrorKind;
using core::fail;

RasterGrid::RasterGrid(GDALDataset& dataset, const std::string& written, const geo::Geodetic& near,
                       const GdalErrors& errors)
    : written_(written),
      near_lon_deg_(near.lon_deg),
      width_(dataset.GetRasterXSize()),
      height_(dataset.GetRasterYSize()) {
  if (width_ <= 0 || height_ <= 0)
    fail(ErrorKind::Input, "{}: has no samples ({} x {})", written_, width_, height_);
  read_geotransform(dataset);
  crs_ = horizontal_crs(dataset.GetSpatialRef(), written_,
                        {.setter = "gdal_edit.py -a_srs", .changer = "gdalwarp"}, errors);
  find_pipeline(near, errors);
  place_samples(near.lon_deg);
}

void RasterGrid::read_geotransform(GDALDataset& dataset) {
  std::array<double, 6>& gt = geotransform_;
  if (dataset.GetGeoTransform(gt.data()) != CE_None)
    fail(ErrorKind::Input,
         "{}: has no georeference{}; add one with gdal_translate -a_ullr, or gdalwarp", written_,
         dataset.GetGCPCount() > 0 ? " but ground control points" : "");
  Eigen::Matrix2d linear;
  linear << gt[1], gt[2], gt[4], gt[5];
  const double determinant = linear.determinant();
  if (!linear.allFinite() || !std::isfinite(gt[0]) || !std::isfinite(gt[3]) ||
      !(std::abs(determinant) > 0.0))
    fail(ErrorKind::Input, "{}: its geotransform ({}, {}, {}, {}, {}, {}) cannot be inverted",
         written_, gt[0], gt[1], gt[2], gt[3], gt[4], gt[5]);
}

void RasterGrid::find_pipeline(const geo::Geodetic& near, const GdalErrors& errors) {
  const CrsOperation operation = best_operation(crs_.wkt, near);
  if (operation.pipeline.empty())
    fail(ErrorKind::Input, "{}: PROJ knows no transformation from WGS84 to {}; warp it to WGS84",
         written_, crs_.name);
  if (operation.is_ballpark)
    warning_ = fmt::format(
        "{}: only a ballpark transformation leads from WGS84 to {} (its datum is taken for WGS84)",
        written_, crs_.name);
  if (operation.pipeline == "+proj=noop") return;
  pipeline_ = operation.pipeline;
  crs_from_geodetic_ = std::make_unique<SharedTransformation>(pipeline_, false);
  geodetic_from_crs_ = std::make_unique<SharedTransformation>(pipeline_, true);
  if (!crs_from_geodetic_->is_good() || !geodetic_from_crs_->is_good())
    fail(ErrorKind::Input, "{}: the transformation {} cannot be used ({})", written_, pipeline_,
         errors.text());
}

void RasterGrid::place_samples(double near_lon_deg) {
  const std::array<double, 6>& gt = geotransform_;
  Eigen::Matrix2d linear;
  linear << gt[1], gt[2], gt[4], gt[5];
  // Sample (0, 0) is the centre of the first pixel.
  crs_from_sample_.linear() = linear;
  crs_from_sample_.translation() =
      Eigen::Vector2d(gt[0], gt[3]) + linear * Eigen::Vector2d(0.5, 0.5);
  if (crs_.is_geographic) join_the_seam(near_lon_deg);
  if (crs_.is_geographic && !goes_round_) {
    const Eigen::Vector2d middle =
        crs_from_sample_ * Eigen::Vector2d(0.5 * width(), 0.5 * height());
    crs_from_sample_.translation().x() -= 360.0 * std::round((middle.x() - near_lon_deg) / 360.0);
  }
  sample_from_crs_ = crs_from_sample_.inverse();
}

/// Within a pixel, a raster in longitude and latitude is as wide as the Earth: its steps are printed with few digits.
void RasterGrid::join_the_seam(double near_lon_deg) {
  std::array<double, 6>& gt = geotransform_;
  if (gt[2] != 0.0 || gt[4] != 0.0) return;
  const double columns = 360.0 / std::abs(gt[1]);
  constexpr double kFewest =
      4.0;  // of fewer the middle half, where columns are the file's, holds none
  if (!(columns >= kFewest) || std::round(columns) > width_) return;
  goes_round_ = true;
  width_ = static_cast<int>(std::lround(columns));
  // The file's column of the place, and how many turns lie between them.
  const double column = (near_lon_deg - crs_from_sample_.translation().x()) / gt[1];
  const double turns = std::floor((column + 0.5) / columns);
  const double within = column - turns * columns;
  double first = 0.0;
  if (within < 0.25 * columns) first = -std::floor(0.5 * columns);
  if (within >= 0.75 * columns) first = std::floor(0.5 * columns);
  first_in_file_ = column_in_file(static_cast<int>(first));
  gt[0] += first * gt[1];
  crs_from_sample_.translation().x() += first * gt[1] + (gt[1] < 0.0 ? -360.0 : 360.0) * turns;
}

int RasterGrid::column_in_file(int column) const {
  if (!goes_round_) return column;
  const std::int64_t at = (std::int64_t{column} + first_in_file_) % width_;
  return static_cast<int>(at < 0 ? at + width_ : at);
}

std::vector<WindowPart> RasterGrid::parts_of(const SampleWindow& window, int width) const {
  std::vector<WindowPart> parts;
  const auto buffer_column = [&](std::int64_t column) {
    return static_cast<int>((column * width + window.width / 2) / window.width);
  };
  for (int done = 0; done < window.width;) {
    WindowPart part{.in_file = window};
    part.in_file.first_column = column_in_file(window.first_column + done);
    part.in_file.width = goes_round_
                             ? std::min(window.width - done, width_ - part.in_file.first_column)
                             : window.width;
    part.first_column = buffer_column(done);
    done += part.in_file.width;
    part.width = buffer_column(done) - part.first_column;
    if (part.width > 0) parts.push_back(part);
  }
  return parts;
}

void RasterGrid::samples_from_geodetic(std::span<const geo::Geodetic> places,
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
           written_, crs_.name, places[0].lat_deg, places[0].lon_deg, errors.text());
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (crs_.is_geographic) x[i] -= 360.0 * std::round((x[i] - near_lon_deg_) / 360.0);
    samples[i] = sample_from_crs_ * Eigen::Vector2d(x[i], y[i]);
  }
}

void RasterGrid::geodetic_from_samples(std::span<const Eigen::Vector2d> samples,
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
           written_, crs_.name, errors.text());
  }
  for (std::size_t i = 0; i < samples.size(); ++i)
    places[i] = {.lat_deg = std::clamp(y[i], -90.0, 90.0), .lon_deg = x[i], .height_m = 0.0};
}

std::optional<Eigen::Vector2i> RasterGrid::offset_of(const RasterGrid& other) const {
  if (other.pipeline_ != pipeline_ || other.crs_.is_geographic != crs_.is_geographic)
    return std::nullopt;
  // Over the whole of the other raster, samples may stray by this part of the spacing: files print
  // their steps with few digits, and 1e-3 of a sample is 3 cm of 30 m.
  constexpr double kStray = 1e-3;
  const Eigen::Affine2d sample_from_other = sample_from_crs_ * other.crs_from_sample_;
  const Eigen::Vector2d first = sample_from_other * Eigen::Vector2d::Zero();
  const Eigen::Vector2d whole = first.array().round();
  if (whole.cwiseAbs().maxCoeff() > 1e9) return std::nullopt;
  for (const Eigen::Vector2d& corner :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(other.width(), 0),
        Eigen::Vector2d(0, other.height()), Eigen::Vector2d(other.width(), other.height())})
    if ((sample_from_other * corner - whole - corner).cwiseAbs().maxCoeff() > kStray)
      return std::nullopt;
  return whole.cast<int>();
}

SampleSize RasterGrid::size_of_samples(const geo::WorldFrame& frame, double half_size_m) const {
  std::array<geo::Geodetic, 3> places;
  const double reach_m = std::min(100.0, half_size_m);
  for (std::size_t k = 0; k < 3; ++k)
    places[k] = frame.geodetic_from_world({k == 1 ? reach_m : 0.0, k == 2 ? reach_m : 0.0, 0.0});
  std::array<Eigen::Vector2d, 3> samples;
  samples_from_geodetic(places, samples);
  Eigen::Matrix2d sample_from_m;
  sample_from_m << (samples[1] - samples[0]) / reach_m, (samples[2] - samples[0]) / reach_m;
  // The eigenvalues of J^T J are the squares of samples a metre in the densest and the widest
  // direction.
  const Eigen::Matrix2d square = sample_from_m.transpose() * sample_from_m;
  const double half_trace = 0.5 * square.trace();
  const double densest =
      half_trace + std::sqrt(std::max(half_trace * half_trace - square.determinant(), 0.0));
  return {.spacing_m = 1.0 / std::sqrt(densest),
          .area_m2 = 1.0 / std::abs(sample_from_m.determinant()),
          .sides_m = sample_from_m.inverse().colwise().norm().transpose()};
}

Eigen::AlignedBox2d RasterGrid::box_of_square(const geo::WorldFrame& frame,
                                              double half_size_m) const {
  // A lattice of places on the square, at the lowest and the highest heights that there are.
  constexpr int kProbes = 32;
  std::vector<geo::Geodetic> places;
  for (int j = 0; j <= kProbes; ++j)
    for (int i = 0; i <= kProbes; ++i)
      for (const double height_m : {-500.0, 9000.0}) {
        const double x = (2.0 * i / kProbes - 1.0) * half_size_m;
        const double y = (2.0 * j / kProbes - 1.0) * half_size_m;
        const double drop_m = (x * x + y * y) / (2.0 * geo::kWgs84SemiMajorAxis_m);
        places.push_back(frame.geodetic_from_world({x, y, height_m - drop_m}));
      }
  std::vector<Eigen::Vector2d> samples(places.size());
  samples_from_geodetic(places, samples);
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& sample : samples) box.extend(sample);
  return box;
}

world::RasterInfo RasterGrid::info(const std::string& name) const {
  return {.name = name,
          .horizontal_crs = crs_.name,
          .pipeline = pipeline_,
          .is_geographic = crs_.is_geographic,
          .geotransform = geotransform_,
          .width_px = width_,
          .height_px = height_};
}

std::string RasterGrid::description() const {
  return fmt::format("{} {} {} {}", crs_.wkt, width_, height_, fmt::join(geotransform_, " "));
}

namespace {

template <class Sample>
bool read_parts(GDALRasterBand& band, const RasterGrid& grid, const SampleWindow& window,
                std::span<Sample> samples, GDALDataType type) {
  constexpr auto kSample_bytes = static_cast<GSpacing>(sizeof(Sample));
  TERRACAST_CHECK(std::ssize(samples) == window.num_samples(), "a buffer of another size");
  for (const WindowPart& part : grid.parts_of(window)) {
    const SampleWindow& at = part.in_file;
    if (band.RasterIO(GF_Read, at.first_column, at.first_row, at.width, at.height,
                      &samples[static_cast<std::size_t>(part.first_column)], part.width, at.height,
                      type, kSample_bytes, kSample_bytes * window.width, nullptr) != CE_None)
      return false;
  }
  return true;
}

}  // namespace

bool read_window(GDALRasterBand& band, const RasterGrid& grid, const SampleWindow& window,
                 std::span<double> samples) {
  return read_parts(band, grid, window, samples, GDT_Float64);
}
bool read_window(GDALRasterBand& band, const RasterGrid& grid, const SampleWindow& window,
                 std::span<std::uint8_t> samples) {
  return read_parts(band, grid, window, samples, GDT_Byte);
}

}  // namespace terracast::tiler
