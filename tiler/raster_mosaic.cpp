#include "tiler/raster_mosaic.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <span>

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "tiler/collar.h"
#include "tiler/earth_heights.h"
#include "tiler/mosaic_draft.h"
#include "tiler/mosaic_gaps.h"
#include "tiler/mosaic_sea.h"
#include "tiler/offset_grid.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

/// Samples kept beyond the square, for the interpolation's stencil and the lean of up against z.
constexpr int kMargin = 4;

void open_rasters(MosaicDraft& draft) {
  const geo::Geodetic& origin = draft.inputs.frame.origin();
  for (const ElevationOptions& entry : draft.part.entries) {
    const geo::VerticalDatum datum = datum_of(entry);
    for (const core::Path& file : entry.files) {
      draft.rasters.push_back({RasterSource::open(file, entry, origin), datum, &entry});
      if (!draft.rasters.back().source->grid().warning().empty())
        draft.inputs.context.log.warn("{}", draft.rasters.back().source->grid().warning());
    }
  }
}

/// Of all rasters, in samples of the first.
Eigen::AlignedBox2d box_of_rasters(const MosaicDraft& draft) {
  constexpr int kProbes = 16;  // along a side: sides are bent in another projection
  Eigen::AlignedBox2d box;
  for (const MosaicDraft::Raster& raster : draft.rasters) {
    std::vector<Eigen::Vector2d> rim;
    for (int k = 0; k <= kProbes; ++k) {
      const double t = static_cast<double>(k) / kProbes;
      const double u = t * raster.source->grid().width() - 0.5;
      const double v = t * raster.source->grid().height() - 0.5;
      rim.insert(rim.end(), {{u, -0.5},
                             {u, raster.source->grid().height() - 0.5},
                             {-0.5, v},
                             {raster.source->grid().width() - 0.5, v}});
    }
    std::vector<geo::Geodetic> places(rim.size());
    raster.source->grid().geodetic_from_samples(rim, places);
    draft.rasters.front().source->grid().samples_from_geodetic(places, rim);
    for (const Eigen::Vector2d& sample : rim) box.extend(sample);
  }
  return box;
}

void choose_grid(MosaicDraft& draft) {
  Eigen::AlignedBox2d box =
      draft.rasters.front().source->grid().box_of_square(draft.inputs.frame, draft.half_size_m);
  if (draft.part.is_patch) box = box.intersection(box_of_rasters(draft));
  if (box.isEmpty()) draft.fail_without_heights();
  const Eigen::Vector2d low = box.min().array().floor() - kMargin;
  const Eigen::Vector2d size = box.max().array().ceil() - low.array() + kMargin + 1.0;
  if (!(size.x() * size.y() <= static_cast<double>(RasterSource::kMostSamples)) ||
      size.maxCoeff() > 1e9 || low.cwiseAbs().maxCoeff() > 1e9)
    fail(ErrorKind::Input,
         "{}: the world's square of {} m takes {:.3g} of its samples, and {} fit into memory; put "
         "a coarser raster first (its grid is the mosaic's), or make the square smaller",
         draft.rasters.front().source->path(), draft.inputs.options.size_m, size.x() * size.y(),
         RasterSource::kMostSamples);
  draft.mosaic.first_sample = low.cast<int>();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  draft.mosaic.heights_m =
      Grid<double>(static_cast<int>(size.x()), static_cast<int>(size.y()), nan);
  draft.mosaic.source =
      Grid<std::uint8_t>(draft.mosaic.heights_m.width, draft.mosaic.heights_m.height, kNoSource);
  draft.covered_by = draft.mosaic.source;
  draft.is_low = Grid<std::uint8_t>(draft.mosaic.heights_m.width, draft.mosaic.heights_m.height, 0);
  draft.mosaic.is_sea = draft.is_low;
  draft.sample = draft.size_of_samples(draft.rasters.front().source->grid());
  draft.mosaic.sample_size_m = draft.sample.sides_m;
}

/// The window's heights, without an undeclared collar.
Grid<double> read_heights(MosaicDraft& draft, std::size_t index, const SampleWindow& window) {
  const RasterSource& raster = *draft.rasters[index].source;
  Grid<double> heights_m = raster.read(window);
  if (draft.rasters[index].entry->nodata == "declared") {
    if (const auto collar = remove_collar(heights_m, raster.corner_heights_m()))
      draft.inputs.context.log.warn(
          "{}: {} samples of exactly {:g} m round its data ({:.3g} km2) are taken for a collar "
          "without heights; state nodata = \"VALUE\" as the file stores it, or \"none\" if they "
          "are heights",
          raster.path(), collar->num_samples, collar->height_m,
          static_cast<double>(collar->num_samples) * draft.size_of_samples(raster.grid()).area_m2 *
              1e-6);
  }
  for (const double height_m : heights_m.values)
    if (std::isnan(height_m)) ++draft.mosaic.sources[index].num_voids;
  refuse_undeclared_fills(raster, heights_m, draft.rasters[index].entry->nodata);
  refuse_ground_beyond_earth(raster, *draft.rasters[index].entry, window, heights_m);
  return heights_m;
}

/// One sample of a raster, above its own datum.
void take(MosaicDraft& draft, std::size_t index, std::size_t at, double height_m, double shift_m) {
  draft.mosaic.heights_m.values[at] = height_m + shift_m;
  draft.mosaic.source.values[at] = static_cast<std::uint8_t>(index);
  draft.is_low.values[at] = is_low(height_m, draft.rasters[index]) ? 1 : 0;
}

void add_aligned(MosaicDraft& draft, std::size_t index, const Eigen::Vector2i& offset) {
  const RasterGrid& grid = draft.rasters[index].source->grid();
  // Column 0 of the mosaic is this column of the raster.
  const Eigen::Vector2i first = draft.mosaic.first_sample - offset;
  SampleWindow window;
  window.first_row = std::clamp(first.y(), 0, grid.height());
  window.first_column = first.x();
  window.width = draft.mosaic.heights_m.width;
  if (!grid.goes_round()) {
    window.first_column = std::clamp(first.x(), 0, grid.width());
    window.width = std::clamp(first.x() + window.width, 0, grid.width()) - window.first_column;
  }
  window.height =
      std::clamp(first.y() + draft.mosaic.heights_m.height, 0, grid.height()) - window.first_row;
  if (window.is_empty()) return;
  const Grid<double> heights_m = read_heights(draft, index, window);
  const geo::VerticalDatum& datum = draft.rasters[index].datum;
  const bool changes_datum = !(datum == draft.mosaic.datum);
  const auto row_of_source = static_cast<std::uint8_t>(index);
  for (int j = 0; j < window.height; ++j) {
    const int row = window.first_row - first.y() + j;
    std::vector<geo::Geodetic> places;
    if (changes_datum) places = draft.places_of_row(row);
    for (int i = 0; i < window.width; ++i) {
      const int column = window.first_column - first.x() + i;
      const double height_m = heights_m(i, j);
      const std::size_t at = draft.mosaic.heights_m.index(column, row);
      if (draft.covered_by.values[at] == kNoSource) draft.covered_by.values[at] = row_of_source;
      if (std::isnan(height_m) || draft.mosaic.source.values[at] != kNoSource) continue;
      const double shift_m =
          changes_datum ? draft.shift_m(datum, places[static_cast<std::size_t>(column)]) : 0.0;
      take(draft, index, at, height_m, shift_m);
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

void add_resampled(MosaicDraft& draft, std::size_t index) {
  const RasterGrid& grid = draft.rasters[index].source->grid();
  const Eigen::AlignedBox2d box = grid.box_of_square(draft.inputs.frame, draft.half_size_m);
  const Eigen::Array2d last = Eigen::Array2d(grid.width(), grid.height()) - 1.0;
  // The mosaic reaches some of its samples beyond the square; these may be more of the other's, or
  // fewer.
  const Eigen::Array2d margin = 8.0 + 0.05 * box.sizes().array();
  Eigen::Array2d low = box.min().array().floor() - margin;
  Eigen::Array2d high = box.max().array().ceil() + margin;
  const double low_x = low.x(), high_x = high.x();
  low = low.max(0.0).min(last + 1.0);
  high = high.min(last).max(-1.0);
  if (grid.goes_round()) {  // about its seam, which lies half-way round, samples are taken twice
    low.x() = std::max(low_x, -0.5 * grid.width());
    high.x() = std::min(high_x, 1.5 * grid.width());
    low.x() = std::floor(low.x());
    high.x() = std::ceil(high.x());
  }
  SampleWindow window;
  window.first_column = static_cast<int>(low.x());
  window.first_row = static_cast<int>(low.y());
  window.width = static_cast<int>(high.x() - low.x()) + 1;
  window.height = static_cast<int>(high.y() - low.y()) + 1;
  if (window.is_empty()) return;
  if (window.num_samples() > RasterSource::kMostSamples)
    fail(ErrorKind::Input, "{}: the world's square takes {} of its samples, and {} fit into memory",
         grid.written(), window.num_samples(), RasterSource::kMostSamples);
  const Grid<double> heights_m = read_heights(draft, index, window);

  const auto row_of_source = static_cast<std::uint8_t>(index);
  core::parallel_for(draft.mosaic.heights_m.height, [&](std::int64_t row_index) {
    const int row = static_cast<int>(row_index);
    const std::vector<geo::Geodetic> places = draft.places_of_row(row);
    std::vector<Eigen::Vector2d> samples(places.size());
    grid.samples_from_geodetic(places, samples);
    for (int i = 0; i < draft.mosaic.heights_m.width; ++i) {
      const Eigen::Vector2d& sample = samples[static_cast<std::size_t>(i)];
      if (sample.y() < -0.5 || sample.y() > grid.height() - 0.5) continue;
      if (!grid.goes_round() && (sample.x() < -0.5 || sample.x() > grid.width() - 0.5)) continue;
      const Eigen::Vector2d at = sample - low.matrix();
      if (at.minCoeff() < -0.5 || at.x() > window.width - 0.5 || at.y() > window.height - 0.5)
        continue;
      const std::size_t k = draft.mosaic.heights_m.index(i, row);
      if (draft.covered_by.values[k] == kNoSource) draft.covered_by.values[k] = row_of_source;
      if (draft.mosaic.source.values[k] != kNoSource) continue;
      const double height_m = resampled_m(heights_m, at);
      if (std::isnan(height_m)) continue;
      take(draft, index, k, height_m,
           draft.shift_m(draft.rasters[index].datum, places[static_cast<std::size_t>(i)]));
    }
  });
}

void add(MosaicDraft& draft, std::size_t index) {
  const RasterSource& raster = *draft.rasters[index].source;
  world::SourceInfo info;
  info.name = std::filesystem::path(raster.path()).filename().string();
  info.kind = "raster";
  info.horizontal_crs = raster.grid().crs_name();
  info.vertical_datum = draft.rasters[index].datum.name;
  info.pipeline = raster.grid().pipeline();
  info.spacing_m = draft.size_of_samples(raster.grid()).spacing_m;
  info.licence = draft.rasters[index].entry->licence;
  info.accuracy = draft.rasters[index].entry->accuracy;
  info.content_hash = raster.content_hash();
  info.ledger = raster.ledger();
  if (draft.rasters[index].entry->vertical_datum == "grid")
    info.ledger.merge(ledger_of_offset_grid(draft.rasters[index].entry->datum_grid));
  draft.mosaic.rasters.emplace_back(raster.grid().info(info.name));
  draft.mosaic.sources.push_back(std::move(info));
  core::with_context(
      [&] {
        if (const auto offset = draft.rasters.front().source->grid().offset_of(raster.grid()))
          add_aligned(draft, index, *offset);
        else
          add_resampled(draft, index);
      },
      fmt::format("reading heights from {}", raster.path()));
}

std::string hash_of(const MosaicDraft& draft) {
  const RasterMosaic& mosaic = draft.mosaic;
  std::string hash =
      core::content_hash(core::content_hash(std::as_bytes(std::span(mosaic.heights_m.values))) +
                         core::content_hash(std::as_bytes(std::span(mosaic.source.values))) +
                         core::content_hash(std::as_bytes(std::span(mosaic.is_sea.values))) +
                         fmt::format(" {} {} {}", draft.rasters.front().source->grid().pipeline(),
                                     mosaic.datum.name, draft.sample.spacing_m));
  for (const world::SourceInfo& source : mosaic.sources)
    hash = core::content_hash(fmt::format("{} {} {} {} {} {} {}", hash, source.name,
                                          source.content_hash, source.licence, source.accuracy,
                                          source.num_voids, source.num_voids_filled));
  return hash;
}

}  // namespace

RasterMosaic make_mosaic(const ElevationInputs& inputs, const MosaicPart& part) {
  MosaicDraft draft{.inputs = inputs, .part = part};
  draft.mosaic.datum = inputs.datum;
  open_rasters(draft);
  choose_grid(draft);
  for (std::size_t index = 0; index < draft.rasters.size(); ++index) add(draft, index);
  find_sea(draft);
  fill_gaps(draft);
  lay_floor(draft);
  draft.mosaic.input_hash = hash_of(draft);
  draft.mosaic.first = std::move(draft.rasters.front().source);
  return std::move(draft.mosaic);
}

}  // namespace terracast::tiler
