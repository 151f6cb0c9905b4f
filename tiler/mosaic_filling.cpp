#include "tiler/mosaic_filling.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tiler/mosaic_sea.h"
#include "tiler/void_filling.h"

namespace terracast::tiler {
namespace {

/// Land of this height ends this far out in the sea of outside = "sea". The reach grows with the root of
/// the height: low ground ends near its border, and mountains of 2000 m fall by 1 in 3.
constexpr double kReach_m = 3000.0;
constexpr double kHeightOfReach_m = 500.0;

/// Starts of least_squared_distance() that make it negative within reach of the land.
Grid<double> reach_of_land(const MosaicDraft& draft) {
  const RasterMosaic& mosaic = draft.mosaic;
  Grid<double> start_m2(mosaic.heights_m.width, mosaic.heights_m.height, kNoStart_m2);
  for (int j = 0; j < start_m2.height; ++j) {
    const std::vector<double> sea_m = sea_levels_of_row_m(draft, j);
    for (int i = 0; i < start_m2.width; ++i) {
      if (mosaic.source(i, j) == kNoSource || mosaic.is_sea(i, j) != 0) continue;
      const double above_sea_m =
          std::max(mosaic.heights_m(i, j) - sea_m[static_cast<std::size_t>(i)], 0.0);
      start_m2(i, j) = -kReach_m * kReach_m * above_sea_m / kHeightOfReach_m;
    }
  }
  return start_m2;
}

/// The squared distance from each sample to the nearest known one of the sea, or of the land.
Grid<double> squared_distance_to(const MosaicDraft& draft, bool to_sea) {
  const RasterMosaic& mosaic = draft.mosaic;
  Grid<double> start_m2(mosaic.heights_m.width, mosaic.heights_m.height, kNoStart_m2);
  for (std::size_t k = 0; k < start_m2.values.size(); ++k)
    if (mosaic.source.values[k] != kNoSource && (mosaic.is_sea.values[k] != 0) == to_sea)
      start_m2.values[k] = 0.0;
  return least_squared_distance(std::move(start_m2), mosaic.sample_size_m);
}

/// Whether the first known sample in a direction is sea; not where the grid ends before there is one.
Grid<std::uint8_t> sea_ahead(const RasterMosaic& mosaic, int di, int dj) {
  Grid<std::uint8_t> is_sea(mosaic.source.width, mosaic.source.height, 0);
  for (int row = 0; row < is_sea.height; ++row)
    for (int column = 0; column < is_sea.width; ++column) {
      const int i = di > 0 ? is_sea.width - 1 - column : column;
      const int j = dj > 0 ? is_sea.height - 1 - row : row;
      if (!is_sea.contains(i + di, j + dj)) continue;
      const bool is_known = mosaic.source(i + di, j + dj) != kNoSource;
      is_sea(i, j) = is_known ? mosaic.is_sea(i + di, j + dj) : is_sea(i + di, j + dj);
    }
  return is_sea;
}

/// Whether a sample lies between sea and sea, on a line in one of eight directions.
Grid<std::uint8_t> between_sea_and_sea(const RasterMosaic& mosaic) {
  Grid<std::uint8_t> is_between(mosaic.source.width, mosaic.source.height, 0);
  for (const auto& [di, dj] :
       {std::pair{1, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 1}, {-1, 2}, {-1, 1}, {-2, 1}}) {
    const Grid<std::uint8_t> ahead = sea_ahead(mosaic, di, dj);
    const Grid<std::uint8_t> behind = sea_ahead(mosaic, -di, -dj);
    for (std::size_t k = 0; k < is_between.values.size(); ++k)
      if (ahead.values[k] != 0 && behind.values[k] != 0) is_between.values[k] = 1;
  }
  return is_between;
}

Grid<std::uint8_t> find_sea_in_gaps(const MosaicDraft& draft, const Gaps& gaps) {
  const Grid<double> to_sea_m2 = squared_distance_to(draft, true);
  const Grid<double> to_land_m2 = squared_distance_to(draft, false);
  const Grid<std::uint8_t> is_between = between_sea_and_sea(draft.mosaic);
  Grid<std::uint8_t> is_sea(gaps.is_void.width, gaps.is_void.height, 0);
  for (std::size_t k = 0; k < is_sea.values.size(); ++k) {
    const bool is_gap = gaps.is_void.values[k] != 0 || gaps.is_missing.values[k] != 0;
    const bool is_nearer = to_sea_m2.values[k] <= to_land_m2.values[k];
    is_sea.values[k] = is_gap && (is_nearer || is_between.values[k] != 0) ? 1 : 0;
  }
  if (draft.part.is_patch || draft.inputs.options.outside != "sea") return is_sea;
  const Grid<double> beyond_reach_m2 =
      least_squared_distance(reach_of_land(draft), draft.mosaic.sample_size_m);
  for (std::size_t k = 0; k < is_sea.values.size(); ++k)
    if (gaps.is_missing.values[k] != 0 && beyond_reach_m2.values[k] >= 0.0) is_sea.values[k] = 1;
  return is_sea;
}

/// Lays filled sea at its level, and filled land as a membrane between the land around and the coasts.
void fill_surface(MosaicDraft& draft, const Gaps& gaps, const Grid<std::uint8_t>& is_filled_sea) {
  RasterMosaic& mosaic = draft.mosaic;
  Grid<double> surface_m = mosaic.heights_m;
  Grid<std::uint8_t> is_unknown(surface_m.width, surface_m.height, 0);
  for (int j = 0; j < surface_m.height; ++j) {
    const std::vector<double> sea_m = sea_levels_of_row_m(draft, j);
    for (int i = 0; i < surface_m.width; ++i) {
      if (is_filled_sea(i, j) != 0 || mosaic.is_sea(i, j) != 0) {
        surface_m(i, j) = sea_m[static_cast<std::size_t>(i)];
      } else if (gaps.is_void(i, j) != 0 || gaps.is_missing(i, j) != 0) {
        surface_m(i, j) = 0.0;
        is_unknown(i, j) = 1;
      }
    }
  }
  fill_from_surroundings(surface_m, is_unknown);
  for (std::size_t k = 0; k < is_unknown.values.size(); ++k) {
    if (is_unknown.values[k] != 0 || is_filled_sea.values[k] != 0)
      mosaic.heights_m.values[k] = surface_m.values[k];
    if (is_filled_sea.values[k] != 0) mosaic.is_sea.values[k] = 1;
  }
}

/// Lets measured floors go on under filled sea, up to its coasts.
void fill_floors(MosaicDraft& draft, const Grid<std::uint8_t>& is_filled_sea) {
  RasterMosaic& mosaic = draft.mosaic;
  if (!mosaic.has_sea) return;
  const bool stands_apart = mosaic.datum.is_ellipsoid();
  Grid<double> depth_m(mosaic.heights_m.width, mosaic.heights_m.height, 0.0);
  for (std::size_t k = 0; k < depth_m.values.size(); ++k)
    if (mosaic.is_sea.values[k] != 0 && is_filled_sea.values[k] == 0)
      depth_m.values[k] = stands_apart ? static_cast<double>(mosaic.floor_depth_m.values[k])
                                       : -mosaic.heights_m.values[k];
  if (std::none_of(depth_m.values.begin(), depth_m.values.end(), [](double d) { return d > 0.0; }))
    return;
  fill_from_surroundings(depth_m, is_filled_sea);
  for (std::size_t k = 0; k < depth_m.values.size(); ++k) {
    if (is_filled_sea.values[k] == 0) continue;
    if (stands_apart)
      mosaic.floor_depth_m.values[k] = static_cast<float>(depth_m.values[k]);
    else
      mosaic.heights_m.values[k] = -depth_m.values[k];
  }
}

}  // namespace

void fill_heights(MosaicDraft& draft, const Gaps& gaps) {
  const Grid<std::uint8_t> is_filled_sea = find_sea_in_gaps(draft, gaps);
  fill_surface(draft, gaps, is_filled_sea);
  fill_floors(draft, is_filled_sea);
}

}  // namespace terracast::tiler
