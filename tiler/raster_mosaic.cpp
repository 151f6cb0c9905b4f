#include "tiler/raster_mosaic.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <span>

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "geo/units.h"
#include "tiler/collar.h"
#include "tiler/void_filling.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

/// Samples kept beyond the square, for the interpolation's stencil and the lean of up against z.
constexpr int kMargin = 4;
constexpr std::int64_t kMostSamples = 200'000'000;
/// A region without heights at the edge of the coverage is a void while it is smaller than this;
/// larger, it is missing coverage.
constexpr double kLargestEdgeVoid_km2 = 4.0;
/// Land sinks into the sea of outside = "sea" over this distance.
constexpr double kShore_m = 2000.0;
/// So many samples from the sea, heights of 0 and below are sea, too.
constexpr int kSunkenShore = 3;
/// The floor of a sea whose depth nobody measured: 1 in 50, down to the edge of a shelf.
constexpr double kShelfSlope = 0.02;
constexpr double kShelfDepth_m = 100.0;
constexpr std::uint8_t kNoSource = 255;

struct OpenRaster {
  std::unique_ptr<RasterSource> source;
  geo::VerticalDatum datum;
  const ElevationOptions* entry;
};

class MosaicMaker {
 public:
  MosaicMaker(const ElevationInputs& inputs, const MosaicPart& part)
      : inputs_(inputs), part_(part), half_size_m_(inputs.options.size_m / 2.0) {
    mosaic_.datum = inputs.datum;
  }

  RasterMosaic make();

 private:
  void open_rasters();
  Eigen::AlignedBox2d box_of_square(const RasterSource& raster) const;
  Eigen::AlignedBox2d box_of_rasters() const;
  void choose_grid();
  [[noreturn]] void fail_without_heights() const;
  struct SampleSize {
    double spacing_m;  ///< in the direction where samples are densest
    double area_m2;
    Eigen::Vector2d sides_m;  ///< along a row and along a column
  };
  SampleSize size_of_samples(const RasterSource& raster) const;  ///< at the world's origin
  void add(std::size_t index);
  void add_aligned(std::size_t index, const Eigen::Vector2i& offset);
  void add_resampled(std::size_t index);
  Grid<double> read_heights(std::size_t index, const SampleWindow& window);
  geo::VerticalDatum sea_datum() const;
  double in_our_datum_m(double height_m, const geo::VerticalDatum& datum,
                        const geo::Geodetic& place) const;
  std::vector<geo::Geodetic> places_of_row(int row) const;
  bool is_in_square(const geo::Geodetic& place) const;
  void sort_gaps();
  struct Missing {
    double area_m2 = 0.0;
    Eigen::AlignedBox2d box_deg;  ///< latitude, longitude
  };
  Missing find_missing() const;
  void refuse_missing();
  void fill_gaps();
  Grid<std::uint8_t> large_regions(const Grid<std::uint8_t>& is_member) const;
  void take_sea_from_gaps();
  void find_sea();
  void take_sunken_shore();
  void lay_floor();
  std::uint8_t source_row(const std::string& kind, const std::string& name);

  const ElevationInputs& inputs_;
  const MosaicPart& part_;
  const double half_size_m_;
  std::vector<OpenRaster> rasters_;
  RasterMosaic mosaic_;
  Grid<std::uint8_t> covered_by_;  ///< the first raster whose extent holds the sample
  Grid<std::uint8_t> is_void_;
  Grid<std::uint8_t> is_missing_;
  SampleSize sample_{};  ///< of the mosaic
};

void MosaicMaker::open_rasters() {
  const geo::Geodetic& origin = inputs_.frame.origin();
  for (const ElevationOptions& entry : part_.entries) {
    const geo::VerticalDatum datum = datum_of(entry);
    for (const core::Path& file : entry.files) {
      rasters_.push_back({RasterSource::open(file, entry, origin), datum, &entry});
      if (!rasters_.back().source->warning().empty())
        inputs_.context.log.warn("{}", rasters_.back().source->warning());
    }
  }
}

Eigen::AlignedBox2d MosaicMaker::box_of_square(const RasterSource& raster) const {
  // A lattice of places on the square, at the lowest and the highest heights that there are.
  constexpr int kProbes = 32;
  std::vector<geo::Geodetic> places;
  for (int j = 0; j <= kProbes; ++j)
    for (int i = 0; i <= kProbes; ++i)
      for (const double height_m : {-500.0, 9000.0}) {
        const double x = (2.0 * i / kProbes - 1.0) * half_size_m_;
        const double y = (2.0 * j / kProbes - 1.0) * half_size_m_;
        const double drop_m = (x * x + y * y) / (2.0 * geo::kWgs84SemiMajorAxis_m);
        places.push_back(inputs_.frame.geodetic_from_world({x, y, height_m - drop_m}));
      }
  std::vector<Eigen::Vector2d> samples(places.size());
  raster.samples_from_geodetic(places, samples);
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& sample : samples) box.extend(sample);
  return box;
}

/// Of all rasters, in samples of the first.
Eigen::AlignedBox2d MosaicMaker::box_of_rasters() const {
  constexpr int kProbes = 16;  // along a side: sides are bent in another projection
  Eigen::AlignedBox2d box;
  for (const OpenRaster& raster : rasters_) {
    std::vector<Eigen::Vector2d> rim;
    for (int k = 0; k <= kProbes; ++k) {
      const double t = static_cast<double>(k) / kProbes;
      const double u = t * raster.source->width() - 0.5;
      const double v = t * raster.source->height() - 0.5;
      rim.insert(rim.end(), {{u, -0.5},
                             {u, raster.source->height() - 0.5},
                             {-0.5, v},
                             {raster.source->width() - 0.5, v}});
    }
    std::vector<geo::Geodetic> places(rim.size());
    raster.source->geodetic_from_samples(rim, places);
    rasters_.front().source->samples_from_geodetic(places, rim);
    for (const Eigen::Vector2d& sample : rim) box.extend(sample);
  }
  return box;
}

void MosaicMaker::fail_without_heights() const {
  fail(ErrorKind::Input,
       "{}{}: no height within the world's square of {} m about latitude {}, longitude {}; move "
       "the origin, or give rasters that cover it",
       rasters_.front().source->path(), rasters_.size() > 1 ? " and the other rasters" : "",
       inputs_.options.size_m, inputs_.options.origin_lat_deg, inputs_.options.origin_lon_deg);
}

void MosaicMaker::choose_grid() {
  Eigen::AlignedBox2d box = box_of_square(*rasters_.front().source);
  if (part_.is_patch) box = box.intersection(box_of_rasters());
  if (box.isEmpty()) fail_without_heights();
  const Eigen::Vector2d low = box.min().array().floor() - kMargin;
  const Eigen::Vector2d size = box.max().array().ceil() - low.array() + kMargin + 1.0;
  if (!(size.x() * size.y() <= static_cast<double>(kMostSamples)) || size.maxCoeff() > 1e9 ||
      low.cwiseAbs().maxCoeff() > 1e9)
    fail(ErrorKind::Input,
         "{}: the world's square of {} m takes {:.3g} of its samples, and {} fit into memory; put "
         "a coarser raster first (its grid is the mosaic's), or make the square smaller",
         rasters_.front().source->path(), inputs_.options.size_m, size.x() * size.y(),
         kMostSamples);
  mosaic_.first_sample = low.cast<int>();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  mosaic_.heights_m = Grid<double>(static_cast<int>(size.x()), static_cast<int>(size.y()), nan);
  mosaic_.source = Grid<std::uint8_t>(mosaic_.heights_m.width, mosaic_.heights_m.height, kNoSource);
  covered_by_ = mosaic_.source;
}

MosaicMaker::SampleSize MosaicMaker::size_of_samples(const RasterSource& raster) const {
  std::array<geo::Geodetic, 3> places;
  const double reach_m = std::min(100.0, half_size_m_);
  for (std::size_t k = 0; k < 3; ++k)
    places[k] =
        inputs_.frame.geodetic_from_world({k == 1 ? reach_m : 0.0, k == 2 ? reach_m : 0.0, 0.0});
  std::array<Eigen::Vector2d, 3> samples;
  raster.samples_from_geodetic(places, samples);
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

std::vector<geo::Geodetic> MosaicMaker::places_of_row(int row) const {
  const int width = mosaic_.heights_m.width;
  std::vector<Eigen::Vector2d> samples(static_cast<std::size_t>(width));
  for (int i = 0; i < width; ++i)
    samples[static_cast<std::size_t>(i)] =
        (mosaic_.first_sample + Eigen::Vector2i(i, row)).cast<double>();
  std::vector<geo::Geodetic> places(samples.size());
  rasters_.front().source->geodetic_from_samples(samples, places);
  return places;
}

double MosaicMaker::in_our_datum_m(double height_m, const geo::VerticalDatum& datum,
                                   const geo::Geodetic& place) const {
  if (datum == mosaic_.datum) return height_m;
  const auto undulation_m = [&](const geo::VerticalDatum& of) {
    return of.is_ellipsoid() ? 0.0 : of.geoid->undulation_m(place.lat_deg, place.lon_deg);
  };
  return height_m + undulation_m(datum) - undulation_m(mosaic_.datum);
}

/// What sea levels count from where no source says: EGM96.
geo::VerticalDatum MosaicMaker::sea_datum() const {
  return mosaic_.datum.is_ellipsoid() ? geo::VerticalDatum{"egm96", inputs_.geoid} : mosaic_.datum;
}

/// Holes of -9999 that the file does not declare would be pits of 10 km.
void refuse_undeclared_voids(const RasterSource& raster, const Grid<double>& heights_m) {
  constexpr double kUsualMark = -9999.0;
  std::int64_t num_marked = 0;
  for (const double height_m : heights_m.values)
    for (const double metres : {1.0, geo::metres_from_feet(1.0), 1200.0 / 3937.0})
      if (height_m == kUsualMark * metres) {
        ++num_marked;
        break;
      }
  if (num_marked > 0)
    fail(ErrorKind::Input,
         "{}: {} samples are exactly -9999, which marks voids in many files, and this one does not "
         "declare it; state nodata = \"-9999\", or \"none\" if they are heights",
         raster.path(), num_marked);
}

/// The window's heights, without an undeclared collar.
Grid<double> MosaicMaker::read_heights(std::size_t index, const SampleWindow& window) {
  const RasterSource& raster = *rasters_[index].source;
  Grid<double> heights_m = raster.read(window);
  if (rasters_[index].entry->nodata == "declared") {
    if (const auto collar = remove_collar(heights_m, raster.corner_heights_m()))
      inputs_.context.log.warn(
          "{}: {} samples of exactly {:g} m round its data ({:.3g} km2) are taken for a collar "
          "without heights; state nodata = \"VALUE\" as the file stores it, or \"none\" if they "
          "are heights",
          raster.path(), collar->num_samples, collar->height_m,
          static_cast<double>(collar->num_samples) * size_of_samples(raster).area_m2 * 1e-6);
  }
  for (const double height_m : heights_m.values)
    if (std::isnan(height_m)) ++mosaic_.sources[index].num_voids;
  if (rasters_[index].entry->nodata == "declared") refuse_undeclared_voids(raster, heights_m);
  return heights_m;
}

void MosaicMaker::add(std::size_t index) {
  const RasterSource& raster = *rasters_[index].source;
  world::SourceInfo info;
  info.name = std::filesystem::path(raster.path()).filename().string();
  info.kind = "raster";
  info.horizontal_crs = raster.crs_name();
  info.vertical_datum = rasters_[index].datum.name;
  info.pipeline = raster.pipeline();
  info.spacing_m = size_of_samples(raster).spacing_m;
  info.licence = rasters_[index].entry->licence;
  info.content_hash = raster.content_hash();
  mosaic_.sources.push_back(std::move(info));
  core::with_context(
      [&] {
        if (const auto offset = rasters_.front().source->offset_of(raster))
          add_aligned(index, *offset);
        else
          add_resampled(index);
      },
      fmt::format("reading heights from {}", raster.path()));
}

void MosaicMaker::add_aligned(std::size_t index, const Eigen::Vector2i& offset) {
  const RasterSource& raster = *rasters_[index].source;
  // Column 0 of the mosaic is this column of the raster.
  const Eigen::Vector2i first = mosaic_.first_sample - offset;
  SampleWindow window;
  window.first_column = std::clamp(first.x(), 0, raster.width());
  window.first_row = std::clamp(first.y(), 0, raster.height());
  window.width =
      std::clamp(first.x() + mosaic_.heights_m.width, 0, raster.width()) - window.first_column;
  window.height =
      std::clamp(first.y() + mosaic_.heights_m.height, 0, raster.height()) - window.first_row;
  if (window.is_empty()) return;
  const Grid<double> heights_m = read_heights(index, window);
  const bool changes_datum = !(rasters_[index].datum == mosaic_.datum);
  const auto row_of_source = static_cast<std::uint8_t>(index);
  for (int j = 0; j < window.height; ++j) {
    const int row = window.first_row - first.y() + j;
    std::vector<geo::Geodetic> places;
    if (changes_datum) places = places_of_row(row);
    for (int i = 0; i < window.width; ++i) {
      const int column = window.first_column - first.x() + i;
      const double height_m = heights_m(i, j);
      const std::size_t at = mosaic_.heights_m.index(column, row);
      if (covered_by_.values[at] == kNoSource) covered_by_.values[at] = row_of_source;
      if (std::isnan(height_m) || mosaic_.source.values[at] != kNoSource) continue;
      mosaic_.heights_m.values[at] = changes_datum
                                         ? in_our_datum_m(height_m, rasters_[index].datum,
                                                          places[static_cast<std::size_t>(column)])
                                         : height_m;
      mosaic_.source.values[at] = row_of_source;
    }
  }
}

/// Bicubic where all sixteen samples have heights; else bilinear of those of the four that have;
/// nothing where the nearest sample has none.
double resampled_m(const Grid<double>& heights_m, const Eigen::Vector2d& at) {
  const int i0 = static_cast<int>(std::floor(at.x()));
  const int j0 = static_cast<int>(std::floor(at.y()));
  if (i0 >= 1 && j0 >= 1 && i0 + 2 < heights_m.width && j0 + 2 < heights_m.height) {
    const double smooth_m = bicubic(heights_m, at);
    if (!std::isnan(smooth_m)) return smooth_m;
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const int nearest_i = std::clamp(static_cast<int>(std::lround(at.x())), 0, heights_m.width - 1);
  const int nearest_j = std::clamp(static_cast<int>(std::lround(at.y())), 0, heights_m.height - 1);
  if (std::isnan(heights_m(nearest_i, nearest_j))) return nan;
  double sum = 0.0;
  double sum_of_weights = 0.0;
  for (int dj = 0; dj < 2; ++dj)
    for (int di = 0; di < 2; ++di) {
      if (!heights_m.contains(i0 + di, j0 + dj)) continue;
      const double height_m = heights_m(i0 + di, j0 + dj);
      if (std::isnan(height_m)) continue;
      const double weight =
          (1.0 - std::abs(at.x() - (i0 + di))) * (1.0 - std::abs(at.y() - (j0 + dj)));
      sum += weight * height_m;
      sum_of_weights += weight;
    }
  return sum_of_weights > 0.0 ? sum / sum_of_weights : nan;
}

void MosaicMaker::add_resampled(std::size_t index) {
  const RasterSource& raster = *rasters_[index].source;
  const Eigen::AlignedBox2d box = box_of_square(raster);
  const Eigen::Array2d last = Eigen::Array2d(raster.width(), raster.height()) - 1.0;
  // The mosaic reaches some of its samples beyond the square; these may be more of the other's, or
  // fewer.
  const Eigen::Array2d margin = 8.0 + 0.05 * box.sizes().array();
  const Eigen::Array2d low = (box.min().array().floor() - margin).max(0.0).min(last + 1.0);
  const Eigen::Array2d high = (box.max().array().ceil() + margin).min(last).max(-1.0);
  SampleWindow window;
  window.first_column = static_cast<int>(low.x());
  window.first_row = static_cast<int>(low.y());
  window.width = static_cast<int>(high.x() - low.x()) + 1;
  window.height = static_cast<int>(high.y() - low.y()) + 1;
  if (window.is_empty()) return;
  if (window.num_samples() > kMostSamples)
    fail(ErrorKind::Input, "{}: the world's square takes {} of its samples, and {} fit into memory",
         raster.path(), window.num_samples(), kMostSamples);
  const Grid<double> heights_m = read_heights(index, window);

  const auto row_of_source = static_cast<std::uint8_t>(index);
  core::parallel_for(mosaic_.heights_m.height, [&](std::int64_t row_index) {
    const int row = static_cast<int>(row_index);
    const std::vector<geo::Geodetic> places = places_of_row(row);
    std::vector<Eigen::Vector2d> samples(places.size());
    raster.samples_from_geodetic(places, samples);
    for (int i = 0; i < mosaic_.heights_m.width; ++i) {
      const Eigen::Vector2d& sample = samples[static_cast<std::size_t>(i)];
      if (sample.minCoeff() < -0.5 || sample.x() > raster.width() - 0.5 ||
          sample.y() > raster.height() - 0.5)
        continue;
      const Eigen::Vector2d at = sample - low.matrix();
      if (at.minCoeff() < -0.5 || at.x() > window.width - 0.5 || at.y() > window.height - 0.5)
        continue;
      const std::size_t k = mosaic_.heights_m.index(i, row);
      if (covered_by_.values[k] == kNoSource) covered_by_.values[k] = row_of_source;
      if (mosaic_.source.values[k] != kNoSource) continue;
      const double height_m = resampled_m(heights_m, at);
      if (std::isnan(height_m)) continue;
      mosaic_.heights_m.values[k] =
          in_our_datum_m(height_m, rasters_[index].datum, places[static_cast<std::size_t>(i)]);
      mosaic_.source.values[k] = row_of_source;
    }
  });
}

bool MosaicMaker::is_in_square(const geo::Geodetic& place) const {
  const Eigen::Vector3d at = inputs_.frame.world_from_geodetic(place);
  return std::abs(at.x()) <= half_size_m_ && std::abs(at.y()) <= half_size_m_ && at.z() > -1e6;
}

/// Parts samples without a height into voids and missing coverage.
void MosaicMaker::sort_gaps() {
  is_void_ = Grid<std::uint8_t>(mosaic_.heights_m.width, mosaic_.heights_m.height, 0);
  is_missing_ = is_void_;
  bool has_height = false;
  for (std::size_t k = 0; k < is_void_.values.size(); ++k) {
    if (mosaic_.source.values[k] != kNoSource)
      has_height = true;
    else if (covered_by_.values[k] == kNoSource)
      is_missing_.values[k] = 1;
    else
      is_void_.values[k] = 1;
  }
  if (!has_height) fail_without_heights();

  // The collar of a raster that was turned is no void: nothing beyond it could tell how it goes on.
  const Regions regions = find_regions(is_void_);
  std::vector<std::uint8_t> is_at_edge;
  for (const auto& region : regions.regions) is_at_edge.push_back(region.touches_border ? 1 : 0);
  for (int j = 0; j < is_void_.height; ++j)
    for (int i = 0; i < is_void_.width; ++i) {
      if (regions.label(i, j) == 0) continue;
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di)
          if (is_missing_.contains(i + di, j + dj) && is_missing_(i + di, j + dj) != 0)
            is_at_edge[static_cast<std::size_t>(regions.label(i, j) - 1)] = 1;
    }
  double largest_km2 = 0.0;
  std::vector<std::uint8_t> is_filled(regions.regions.size(), 0);
  for (std::size_t k = 0; k < is_void_.values.size(); ++k) {
    if (is_void_.values[k] == 0) continue;
    const auto region = static_cast<std::size_t>(regions.label.values[k] - 1);
    const double area_km2 =
        static_cast<double>(regions.regions[region].num_samples) * sample_.area_m2 * 1e-6;
    if (is_at_edge[region] != 0 && area_km2 > kLargestEdgeVoid_km2) {
      is_void_.values[k] = 0;
      is_missing_.values[k] = 1;
      continue;
    }
    largest_km2 = std::max(largest_km2, area_km2);
    is_filled[region] = 1;
    ++mosaic_.sources[covered_by_.values[k]].num_voids_filled;
  }
  std::int64_t num_filled = 0;
  for (const world::SourceInfo& source : mosaic_.sources) num_filled += source.num_voids_filled;
  if (num_filled == 0) return;
  inputs_.context.log.info(
      "{} voids of {} samples are filled from their surroundings ({:.2f} %), the largest {:.3g} "
      "km2",
      std::count(is_filled.begin(), is_filled.end(), 1), num_filled,
      100.0 * static_cast<double>(num_filled) / static_cast<double>(is_void_.values.size()),
      largest_km2);
  if (largest_km2 > kLargestEdgeVoid_km2)
    inputs_.context.log.warn(
        "the largest void has {:.3g} km2: its ground is smooth and not measured; a second raster "
        "could fill it",
        largest_km2);
}

/// What no raster covers within the square: by the samples in it, or, where the samples are so wide
/// that none is in its uncovered part, by places of it and the samples nearest to them.
MosaicMaker::Missing MosaicMaker::find_missing() const {
  Missing missing;
  for (int j = 0; j < is_missing_.height; ++j) {
    std::vector<geo::Geodetic> places;
    for (int i = 0; i < is_missing_.width; ++i) {
      if (is_missing_(i, j) == 0) continue;
      if (places.empty()) places = places_of_row(j);
      const geo::Geodetic& place = places[static_cast<std::size_t>(i)];
      if (!is_in_square(place)) continue;
      missing.area_m2 += sample_.area_m2;
      missing.box_deg.extend(Eigen::Vector2d(place.lat_deg, place.lon_deg));
    }
  }
  if (missing.area_m2 > 0.0) return missing;

  constexpr int kProbes = 32;
  const double step_m = 2.0 * half_size_m_ / kProbes;
  std::vector<geo::Geodetic> places;
  for (int j = 0; j < kProbes; ++j)
    for (int i = 0; i < kProbes; ++i)
      places.push_back(inputs_.frame.geodetic_from_world(
          {(i + 0.5) * step_m - half_size_m_, (j + 0.5) * step_m - half_size_m_, 0.0}));
  std::vector<Eigen::Vector2d> samples(places.size());
  rasters_.front().source->samples_from_geodetic(places, samples);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Eigen::Vector2i at =
        samples[k].array().round().matrix().cast<int>() - mosaic_.first_sample;
    if ((at.array() < 0).any() || at.x() >= is_missing_.width || at.y() >= is_missing_.height ||
        is_missing_(at.x(), at.y()) == 0)
      continue;
    missing.area_m2 += step_m * step_m;
    missing.box_deg.extend(Eigen::Vector2d(places[k].lat_deg, places[k].lon_deg));
  }
  return missing;
}

/// Refuses, or reports, what no raster covers within the square.
void MosaicMaker::refuse_missing() {
  if (part_.is_patch) return;
  const Missing missing = find_missing();
  if (missing.area_m2 == 0.0) return;
  const Eigen::AlignedBox2d& area_deg = missing.box_deg;
  const double area_km2 = missing.area_m2 * 1e-6;
  const std::string where = fmt::format(
      "{:.4g} km2 of the world's square, between latitude {:.4f} and {:.4f}, longitude {:.4f} and "
      "{:.4f}",
      area_km2, area_deg.min().x(), area_deg.max().x(), area_deg.min().y(), area_deg.max().y());
  if (inputs_.options.outside == "error")
    fail(ErrorKind::Input,
         "no raster covers {}; add one that does, make the square smaller, or say what lies there: "
         "outside = \"sea\" or \"extend\"",
         where);
  inputs_.context.log.warn("no raster covers {}: outside = \"{}\" fills it", where,
                           inputs_.options.outside);
}

std::uint8_t MosaicMaker::source_row(const std::string& kind, const std::string& name) {
  for (std::size_t i = 0; i < mosaic_.sources.size(); ++i)
    if (mosaic_.sources[i].kind == kind) return static_cast<std::uint8_t>(i);
  world::SourceInfo source;
  source.name = name;
  source.kind = kind;
  source.vertical_datum = mosaic_.datum.name;
  source.spacing_m = sample_.spacing_m;
  mosaic_.sources.push_back(std::move(source));
  return static_cast<std::uint8_t>(mosaic_.sources.size() - 1);
}

void MosaicMaker::fill_gaps() {
  Grid<std::uint8_t> is_unknown = is_void_;
  bool has_void = false;
  bool has_missing = false;
  for (std::size_t k = 0; k < is_unknown.values.size(); ++k) {
    has_void = has_void || is_void_.values[k] != 0;
    has_missing = has_missing || is_missing_.values[k] != 0;
    if (is_missing_.values[k] != 0) is_unknown.values[k] = 1;
  }
  if (!has_void && !has_missing) return;
  for (std::size_t k = 0; k < is_unknown.values.size(); ++k)
    if (is_unknown.values[k] != 0) mosaic_.heights_m.values[k] = 0.0;
  fill_from_surroundings(mosaic_.heights_m, is_unknown);
  if (has_void) {
    const std::uint8_t row = source_row("void", "filled void");
    for (std::size_t k = 0; k < is_void_.values.size(); ++k)
      if (is_void_.values[k] != 0) mosaic_.source.values[k] = row;
  }
  if (!has_missing) return;
  if (part_.is_patch) {
    mosaic_.is_missing = is_missing_;
    for (std::size_t k = 0; k < is_missing_.values.size(); ++k)
      if (is_missing_.values[k] != 0) mosaic_.source.values[k] = 0;
    return;
  }
  const bool is_sea_wanted = inputs_.options.outside == "sea";
  const std::uint8_t extended = source_row("extend", "extended");
  const std::uint8_t sea = is_sea_wanted ? source_row("sea", "sea") : extended;
  const Grid<float> distance = distance_to_others(is_missing_);
  for (int j = 0; j < is_missing_.height; ++j) {
    std::vector<geo::Geodetic> places;
    for (int i = 0; i < is_missing_.width; ++i) {
      if (is_missing_(i, j) == 0) continue;
      const std::size_t k = is_missing_.index(i, j);
      mosaic_.source.values[k] = extended;
      if (!is_sea_wanted) continue;
      if (places.empty()) places = places_of_row(j);
      const double sea_m = in_our_datum_m(0.0, sea_datum(), places[static_cast<std::size_t>(i)]);
      const double t =
          std::min(static_cast<double>(distance(i, j)) * sample_.spacing_m / kShore_m, 1.0);
      double& height_m = mosaic_.heights_m.values[k];
      height_m += t * t * (3.0 - 2.0 * t) * (sea_m - height_m);
      if (t < 1.0) continue;
      height_m = sea_m;
      mosaic_.is_sea.values[k] = 1;
      mosaic_.source.values[k] = sea;
    }
  }
}

/// Members of regions as large as the sources want a sea to be.
Grid<std::uint8_t> MosaicMaker::large_regions(const Grid<std::uint8_t>& is_member) const {
  const Regions regions = find_regions(is_member);
  Grid<std::uint8_t> is_large(is_member.width, is_member.height, 0);
  for (std::size_t k = 0; k < is_member.values.size(); ++k) {
    if (is_member.values[k] == 0) continue;
    const auto region = static_cast<std::size_t>(regions.label.values[k] - 1);
    const double area_m2 =
        static_cast<double>(regions.regions[region].num_samples) * sample_.area_m2;
    const std::uint8_t source = mosaic_.source.values[k];
    const std::uint8_t raster = source < rasters_.size() ? source : covered_by_.values[k];
    is_large.values[k] = area_m2 * 1e-6 >= rasters_[raster].entry->sea_min_km2 ? 1 : 0;
  }
  return is_large;
}

/// Large regions without a height, of rasters that hold the sea so, are sea: no void, no gap.
void MosaicMaker::take_sea_from_gaps() {
  Grid<std::uint8_t> is_gap(mosaic_.heights_m.width, mosaic_.heights_m.height, 0);
  bool has_gap = false;
  for (std::size_t k = 0; k < is_gap.values.size(); ++k) {
    const std::uint8_t by = covered_by_.values[k];
    if (mosaic_.source.values[k] != kNoSource || by == kNoSource ||
        rasters_[by].entry->sea != "nodata")
      continue;
    is_gap.values[k] = 1;
    has_gap = true;
  }
  if (!has_gap) return;
  const Grid<std::uint8_t> is_sea = large_regions(is_gap);
  const std::uint8_t row_of_sea = source_row("sea", "sea");
  for (int j = 0; j < is_sea.height; ++j) {
    std::vector<geo::Geodetic> places;
    for (int i = 0; i < is_sea.width; ++i) {
      if (is_sea(i, j) == 0) continue;
      if (places.empty()) places = places_of_row(j);
      mosaic_.heights_m(i, j) =
          in_our_datum_m(0.0, sea_datum(), places[static_cast<std::size_t>(i)]);
      mosaic_.source(i, j) = row_of_sea;
      mosaic_.is_sea(i, j) = 1;
    }
  }
}

/// Above a geoid, large regions of exact zeros are sea, or all that lies at 0 and below, as each
/// source says.
void MosaicMaker::find_sea() {
  for (const OpenRaster& raster : rasters_) {
    const std::string& sea = raster.entry->sea;
    if (raster.datum == mosaic_.datum || raster.datum.is_ellipsoid() ||
        (sea != "auto" && sea != "below"))
      continue;
    const std::string what = fmt::format(
        "{}: sea = \"{}\" finds none, for these heights above {} are joined to others above {}",
        raster.source->path(), sea, raster.datum.name, mosaic_.datum.name);
    if (sea == "below")
      fail(ErrorKind::Config, "{}; make it the first raster, or an inset of its own", what);
    inputs_.context.log.warn(
        "{}; make it the first raster where it has sea, or state sea = \"none\"", what);
  }
  if (!mosaic_.datum.is_ellipsoid()) {
    Grid<std::uint8_t> is_low(mosaic_.heights_m.width, mosaic_.heights_m.height, 0);
    for (std::size_t k = 0; k < is_low.values.size(); ++k) {
      if (mosaic_.source.values[k] >= rasters_.size()) continue;
      const std::string& sea = rasters_[mosaic_.source.values[k]].entry->sea;
      const double height_m = mosaic_.heights_m.values[k];
      is_low.values[k] =
          (sea == "auto" && height_m == 0.0) || (sea == "below" && height_m <= 0.0) ? 1 : 0;
    }
    const Grid<std::uint8_t> is_sea = large_regions(is_low);
    for (std::size_t k = 0; k < is_sea.values.size(); ++k)
      if (is_sea.values[k] != 0) mosaic_.is_sea.values[k] = 1;
    take_sunken_shore();
  }
  for (const std::uint8_t sea : mosaic_.is_sea.values)
    mosaic_.has_sea = mosaic_.has_sea || sea != 0;
  if (mosaic_.has_sea) lay_floor();
}

/// A shore of negative heights beside a sea of zeros is noise of the measurement: sea.
void MosaicMaker::take_sunken_shore() {
  std::int64_t num_taken = 0;
  for (int round = 0; round < kSunkenShore; ++round) {
    const Grid<std::uint8_t> was_sea = mosaic_.is_sea;
    for (int j = 0; j < was_sea.height; ++j)
      for (int i = 0; i < was_sea.width; ++i) {
        double& height_m = mosaic_.heights_m(i, j);
        if (was_sea(i, j) != 0 || height_m > 0.0 || mosaic_.source(i, j) >= rasters_.size() ||
            rasters_[mosaic_.source(i, j)].entry->sea != "auto")
          continue;
        bool is_beside = false;
        for (int dj = -1; dj <= 1; ++dj)
          for (int di = -1; di <= 1; ++di)
            is_beside = is_beside || was_sea.clamped(i + di, j + dj) != 0;
        if (!is_beside) continue;
        height_m = 0.0;
        mosaic_.is_sea(i, j) = 1;
        ++num_taken;
      }
  }
  if (num_taken > 0)
    inputs_.context.log.info("{} samples at 0 and below beside the sea are taken for sea",
                             num_taken);
}

/// Where no source holds the sea's floor it is a shelf, the deeper the farther from the shore.
void MosaicMaker::lay_floor() {
  const Grid<float> distance = distance_to_others(mosaic_.is_sea);
  mosaic_.floor_depth_m = Grid<float>(distance.width, distance.height, 0.0F);
  for (std::size_t k = 0; k < distance.values.size(); ++k) {
    const bool is_measured = !mosaic_.datum.is_ellipsoid() && mosaic_.heights_m.values[k] < 0.0;
    if (mosaic_.is_sea.values[k] == 0 || is_measured) continue;
    const double from_shore_m = static_cast<double>(distance.values[k]) * sample_.spacing_m;
    mosaic_.floor_depth_m.values[k] =
        static_cast<float>(std::min(from_shore_m * kShelfSlope, kShelfDepth_m));
  }
}

RasterMosaic MosaicMaker::make() {
  open_rasters();
  choose_grid();
  sample_ = size_of_samples(*rasters_.front().source);
  for (std::size_t index = 0; index < rasters_.size(); ++index) add(index);
  mosaic_.is_sea = Grid<std::uint8_t>(mosaic_.heights_m.width, mosaic_.heights_m.height, 0);
  take_sea_from_gaps();
  sort_gaps();
  refuse_missing();
  fill_gaps();
  find_sea();
  mosaic_.input_hash =
      core::content_hash(core::content_hash(std::as_bytes(std::span(mosaic_.heights_m.values))) +
                         core::content_hash(std::as_bytes(std::span(mosaic_.source.values))) +
                         core::content_hash(std::as_bytes(std::span(mosaic_.is_sea.values))) +
                         fmt::format(" {} {} {}", rasters_.front().source->pipeline(),
                                     mosaic_.datum.name, sample_.spacing_m));
  for (const world::SourceInfo& source : mosaic_.sources)
    mosaic_.input_hash = core::content_hash(
        fmt::format("{} {} {} {} {} {}", mosaic_.input_hash, source.name, source.content_hash,
                    source.licence, source.num_voids, source.num_voids_filled));
  mosaic_.sample_size_m = sample_.sides_m;
  mosaic_.first = std::move(rasters_.front().source);
  return std::move(mosaic_);
}

}  // namespace

RasterMosaic make_mosaic(const ElevationInputs& inputs, const MosaicPart& part) {
  return MosaicMaker(inputs, part).make();
}

}  // namespace terracast::tiler
