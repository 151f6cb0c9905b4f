#include "tiler/mosaic_sea.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "tiler/void_filling.h"

namespace terracast::tiler {
namespace {

/// So many samples from the sea, heights of 0 and below are sea, too.
constexpr int kSunkenShore = 3;
/// The floor of a sea whose depth nobody measured: 1 in 50, down to the edge of a shelf.
constexpr double kShelfSlope = 0.02;
constexpr double kShelfDepth_m = 100.0;

/// Members of regions as large as the sources want a sea to be.
Grid<std::uint8_t> large_regions(const MosaicDraft& draft, const Grid<std::uint8_t>& is_member) {
  const Regions regions = find_regions(is_member);
  Grid<std::uint8_t> is_large(is_member.width, is_member.height, 0);
  for (std::size_t k = 0; k < is_member.values.size(); ++k) {
    if (is_member.values[k] == 0) continue;
    const auto region = static_cast<std::size_t>(regions.label.values[k] - 1);
    const double area_m2 =
        static_cast<double>(regions.regions[region].num_samples) * draft.sample.area_m2;
    const std::uint8_t source = draft.mosaic.source.values[k];
    const std::uint8_t raster = source < draft.rasters.size() ? source : draft.covered_by.values[k];
    is_large.values[k] = area_m2 * 1e-6 >= draft.rasters[raster].entry->sea_min_km2 ? 1 : 0;
  }
  return is_large;
}

/// Brings the sea of all rasters to one level, whatever geoids they stand on. Above a geoid heights
/// stay those of the floor, so that the shore is the contour of 0; above the ellipsoid they are the
/// surface's, and floors stand apart.
void level_sea(MosaicDraft& draft, const Grid<std::uint8_t>& is_sea) {
  const bool is_above_ellipsoid = draft.mosaic.datum.is_ellipsoid();
  for (int j = 0; j < is_sea.height; ++j) {
    std::vector<geo::Geodetic> places;
    for (int i = 0; i < is_sea.width; ++i) {
      if (is_sea(i, j) == 0) continue;
      const MosaicDraft::Raster& raster = draft.rasters[draft.mosaic.source(i, j)];
      if (raster.datum == draft.mosaic.datum) continue;
      if (places.empty()) places = draft.places_of_row(j);
      const geo::Geodetic& place = places[static_cast<std::size_t>(i)];
      double& height_m = draft.mosaic.heights_m(i, j);
      const double floor_m =
          raster.entry->sea == "auto" ? 0.0 : height_m - draft.shift_m(raster.datum, place);
      height_m = is_above_ellipsoid ? draft.shift_m({"egm96", draft.inputs.geoid}, place) : floor_m;
      if (is_above_ellipsoid) draft.mosaic.floor_depth_m(i, j) = static_cast<float>(-floor_m);
    }
  }
}

/// A shore of negative heights beside a sea of zeros is noise of the measurement: sea.
void take_sunken_shore(MosaicDraft& draft) {
  std::int64_t num_taken = 0;
  for (int round = 0; round < kSunkenShore; ++round) {
    const Grid<std::uint8_t> was_sea = draft.mosaic.is_sea;
    for (int j = 0; j < was_sea.height; ++j)
      for (int i = 0; i < was_sea.width; ++i) {
        double& height_m = draft.mosaic.heights_m(i, j);
        if (was_sea(i, j) != 0 || height_m > 0.0 ||
            draft.mosaic.source(i, j) >= draft.rasters.size() ||
            draft.rasters[draft.mosaic.source(i, j)].entry->sea != "auto")
          continue;
        bool is_beside = false;
        for (int dj = -1; dj <= 1; ++dj)
          for (int di = -1; di <= 1; ++di)
            is_beside = is_beside || was_sea.clamped(i + di, j + dj) != 0;
        if (!is_beside) continue;
        height_m = 0.0;
        draft.mosaic.is_sea(i, j) = 1;
        ++num_taken;
      }
  }
  if (num_taken > 0)
    draft.inputs.context.log.info("{} samples at 0 and below beside the sea are taken for sea",
                                  num_taken);
}

/// Takes large regions without a height, of rasters that hold the sea so, for sea.
void take_sea_from_gaps(MosaicDraft& draft) {
  Grid<std::uint8_t> is_gap(draft.mosaic.heights_m.width, draft.mosaic.heights_m.height, 0);
  bool has_gap = false;
  for (std::size_t k = 0; k < is_gap.values.size(); ++k) {
    const std::uint8_t by = draft.covered_by.values[k];
    if (draft.mosaic.source.values[k] != kNoSource || by == kNoSource ||
        draft.rasters[by].entry->sea != "nodata")
      continue;
    is_gap.values[k] = 1;
    has_gap = true;
  }
  if (!has_gap) return;
  const Grid<std::uint8_t> is_sea = large_regions(draft, is_gap);
  const std::uint8_t row_of_sea = draft.source_row("sea", "sea");
  for (int j = 0; j < is_sea.height; ++j) {
    std::vector<double> levels_m;
    for (int i = 0; i < is_sea.width; ++i) {
      if (is_sea(i, j) == 0) continue;
      if (levels_m.empty()) levels_m = sea_levels_of_row_m(draft, j);
      draft.mosaic.heights_m(i, j) = levels_m[static_cast<std::size_t>(i)];
      draft.mosaic.source(i, j) = row_of_sea;
      draft.mosaic.is_sea(i, j) = 1;
    }
  }
}

}  // namespace

bool is_low(double height_m, const MosaicDraft::Raster& raster) {
  if (raster.datum.is_ellipsoid()) return false;
  const std::string& sea = raster.entry->sea;
  return (sea == "auto" && height_m == 0.0) || (sea == "below" && height_m <= 0.0);
}

std::vector<double> sea_levels_of_row_m(const MosaicDraft& draft, int row) {
  std::vector<double> levels_m(static_cast<std::size_t>(draft.mosaic.heights_m.width), 0.0);
  if (!draft.mosaic.datum.is_ellipsoid()) return levels_m;
  const std::vector<geo::Geodetic> places = draft.places_of_row(row);
  for (std::size_t i = 0; i < levels_m.size(); ++i)
    levels_m[i] = draft.shift_m({"egm96", draft.inputs.geoid}, places[i]);
  return levels_m;
}

void find_sea(MosaicDraft& draft) {
  RasterMosaic& mosaic = draft.mosaic;
  take_sea_from_gaps(draft);
  const Grid<std::uint8_t> is_low_sea = large_regions(draft, draft.is_low);
  for (std::size_t k = 0; k < is_low_sea.values.size(); ++k) {
    if (is_low_sea.values[k] != 0) mosaic.is_sea.values[k] = 1;
    mosaic.has_sea = mosaic.has_sea || mosaic.is_sea.values[k] != 0;
  }
  if (!mosaic.has_sea) return;
  mosaic.floor_depth_m = Grid<float>(is_low_sea.width, is_low_sea.height, 0.0F);
  level_sea(draft, is_low_sea);
  if (!mosaic.datum.is_ellipsoid()) take_sunken_shore(draft);
}

double shelf_depth_m(float from_land_m, const Eigen::Vector2d& sample_size_m) {
  // The shore lies between the samples.
  const double from_shore_m = static_cast<double>(from_land_m) - 0.5 * sample_size_m.minCoeff();
  return std::min(from_shore_m * kShelfSlope, kShelfDepth_m);
}

void lay_floor(MosaicDraft& draft) {
  RasterMosaic& mosaic = draft.mosaic;
  mosaic.has_sea = std::find(mosaic.is_sea.values.begin(), mosaic.is_sea.values.end(), 1) !=
                   mosaic.is_sea.values.end();
  if (!mosaic.has_sea) return;
  if (mosaic.floor_depth_m.values.empty())
    mosaic.floor_depth_m = Grid<float>(mosaic.is_sea.width, mosaic.is_sea.height, 0.0F);
  mosaic.is_shelf = Grid<std::uint8_t>(mosaic.is_sea.width, mosaic.is_sea.height, 0);
  const Grid<float> from_land_m = distance_to_others(mosaic.is_sea, mosaic.sample_size_m);
  for (std::size_t k = 0; k < from_land_m.values.size(); ++k) {
    const bool is_measured = mosaic.floor_depth_m.values[k] > 0.0F ||
                             (!mosaic.datum.is_ellipsoid() && mosaic.heights_m.values[k] < 0.0);
    if (mosaic.is_sea.values[k] == 0 || is_measured) continue;
    mosaic.is_shelf.values[k] = 1;
    const double depth_m = shelf_depth_m(from_land_m.values[k], mosaic.sample_size_m);
    if (mosaic.datum.is_ellipsoid())
      mosaic.floor_depth_m.values[k] = static_cast<float>(depth_m);
    else
      mosaic.heights_m.values[k] = -depth_m;
  }
}

}  // namespace terracast::tiler
