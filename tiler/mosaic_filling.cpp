#include "tiler/mosaic_filling.h"

#include <Eigen/Geometry>
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

bool holds_any(const Grid<std::uint8_t>& is_member) {
  return std::any_of(is_member.values.begin(), is_member.values.end(),
                     [](std::uint8_t member) { return member != 0; });
}

/// Starts of least_squared_distance() that make it negative within reach of the land.
Grid<double> reach_of_land(const MosaicDraft& draft) {
  const RasterMosaic& mosaic = draft.mosaic;
  Grid<double> start_m2(mosaic.heights_m.width, mosaic.heights_m.height, kNoStart_m2);
  for (int j = 0; j < start_m2.height; ++j) {
    std::vector<double> sea_m;
    for (int i = 0; i < start_m2.width; ++i) {
      if (mosaic.source(i, j) == kNoSource || mosaic.is_sea(i, j) != 0) continue;
      if (sea_m.empty()) sea_m = sea_levels_of_row_m(draft, j);
      const double above_sea_m =
          std::max(mosaic.heights_m(i, j) - sea_m[static_cast<std::size_t>(i)], 0.0);
      start_m2(i, j) = -kReach_m * kReach_m * above_sea_m / kHeightOfReach_m;
    }
  }
  return start_m2;
}

/// What is known about the gaps: the mosaic's part that holds them and two samples round them. All samples
/// beyond it are known, so that the nearest known sample of a gap's sample lies in it, and the first one
/// in each direction that between_sea_and_sea() looks in.
struct Surroundings {
  int first_column = 0;
  int first_row = 0;
  Grid<std::uint8_t> is_known;
  Grid<std::uint8_t> is_sea;
};

Surroundings surroundings_of_gaps(const RasterMosaic& mosaic) {
  constexpr int kMargin = 2;
  Eigen::AlignedBox2i box;
  for (int j = 0; j < mosaic.source.height; ++j)
    for (int i = 0; i < mosaic.source.width; ++i)
      if (mosaic.source(i, j) == kNoSource) box.extend(Eigen::Vector2i(i, j));
  if (box.isEmpty()) return {};
  const Eigen::Array2i size(mosaic.source.width, mosaic.source.height);
  const Eigen::Array2i first = (box.min().array() - kMargin).max(0);
  const Eigen::Array2i end = (box.max().array() + 1 + kMargin).min(size);
  Surroundings around{
      .first_column = first.x(), .first_row = first.y(), .is_known = {}, .is_sea = {}};
  around.is_known = Grid<std::uint8_t>(end.x() - first.x(), end.y() - first.y(), 0);
  around.is_sea = around.is_known;
  for (int j = 0; j < around.is_known.height; ++j)
    for (int i = 0; i < around.is_known.width; ++i) {
      around.is_known(i, j) = mosaic.source(first.x() + i, first.y() + j) != kNoSource ? 1 : 0;
      around.is_sea(i, j) = mosaic.is_sea(first.x() + i, first.y() + j);
    }
  return around;
}

/// The squared distance from each sample to the nearest known one of the sea, or of the land.
Grid<double> squared_distance_to(const Surroundings& around, const Eigen::Vector2d& sample_size_m,
                                 bool to_sea) {
  Grid<double> start_m2(around.is_known.width, around.is_known.height, kNoStart_m2);
  for (std::size_t k = 0; k < start_m2.values.size(); ++k)
    if (around.is_known.values[k] != 0 && (around.is_sea.values[k] != 0) == to_sea)
      start_m2.values[k] = 0.0;
  return least_squared_distance(std::move(start_m2), sample_size_m);
}

/// Whether the nearest known sample is one of the sea.
Grid<std::uint8_t> nearer_to_sea(const Surroundings& around, const Eigen::Vector2d& sample_size_m) {
  // Samples as far from both are sea, whatever the rounding.
  constexpr double kRounding = 1e-9;
  const Grid<double> to_sea_m2 = squared_distance_to(around, sample_size_m, true);
  const Grid<double> to_land_m2 = squared_distance_to(around, sample_size_m, false);
  Grid<std::uint8_t> is_nearer(to_sea_m2.width, to_sea_m2.height, 0);
  for (std::size_t k = 0; k < is_nearer.values.size(); ++k)
    is_nearer.values[k] = to_sea_m2.values[k] <= to_land_m2.values[k] * (1.0 + kRounding) ? 1 : 0;
  return is_nearer;
}

/// Whether the first known sample in a direction is sea; not where the grid ends before there is one.
Grid<std::uint8_t> sea_ahead(const Surroundings& around, int di, int dj) {
  Grid<std::uint8_t> is_sea(around.is_known.width, around.is_known.height, 0);
  for (int row = 0; row < is_sea.height; ++row)
    for (int column = 0; column < is_sea.width; ++column) {
      const int i = di > 0 ? is_sea.width - 1 - column : column;
      const int j = dj > 0 ? is_sea.height - 1 - row : row;
      if (!is_sea.contains(i + di, j + dj)) continue;
      const bool is_known = around.is_known(i + di, j + dj) != 0;
      is_sea(i, j) = is_known ? around.is_sea(i + di, j + dj) : is_sea(i + di, j + dj);
    }
  return is_sea;
}

/// Whether a sample lies between sea and sea, on a line in one of eight directions.
Grid<std::uint8_t> between_sea_and_sea(const Surroundings& around) {
  Grid<std::uint8_t> is_between(around.is_known.width, around.is_known.height, 0);
  for (const auto& [di, dj] :
       {std::pair{1, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 1}, {-1, 2}, {-1, 1}, {-2, 1}}) {
    const Grid<std::uint8_t> ahead = sea_ahead(around, di, dj);
    const Grid<std::uint8_t> behind = sea_ahead(around, -di, -dj);
    for (std::size_t k = 0; k < is_between.values.size(); ++k)
      if (ahead.values[k] != 0 && behind.values[k] != 0) is_between.values[k] = 1;
  }
  return is_between;
}

/// Lets the sea that is known go on into gaps.
void continue_sea(const RasterMosaic& mosaic, Grid<std::uint8_t>& is_sea) {
  const Surroundings around = surroundings_of_gaps(mosaic);
  const Grid<std::uint8_t> is_nearer = nearer_to_sea(around, mosaic.sample_size_m);
  const Grid<std::uint8_t> is_between = between_sea_and_sea(around);
  for (int j = 0; j < is_nearer.height; ++j)
    for (int i = 0; i < is_nearer.width; ++i)
      if (around.is_known(i, j) == 0 && (is_nearer(i, j) != 0 || is_between(i, j) != 0))
        is_sea(around.first_column + i, around.first_row + j) = 1;
}

Grid<std::uint8_t> find_sea_in_gaps(const MosaicDraft& draft, const Gaps& gaps) {
  const RasterMosaic& mosaic = draft.mosaic;
  Grid<std::uint8_t> is_sea(gaps.is_void.width, gaps.is_void.height, 0);
  if (mosaic.has_sea) continue_sea(mosaic, is_sea);
  if (draft.part.is_patch || draft.inputs.options.outside != "sea" || !holds_any(gaps.is_missing))
    return is_sea;
  const Grid<double> beyond_reach_m2 =
      least_squared_distance(reach_of_land(draft), mosaic.sample_size_m);
  for (std::size_t k = 0; k < is_sea.values.size(); ++k)
    if (gaps.is_missing.values[k] != 0 && beyond_reach_m2.values[k] >= 0.0) is_sea.values[k] = 1;
  return is_sea;
}

/// Lays filled sea at its level, and filled land as a membrane between the land around and the coasts.
void fill_surface(MosaicDraft& draft, const Gaps& gaps, const Grid<std::uint8_t>& is_filled_sea) {
  RasterMosaic& mosaic = draft.mosaic;
  // Heights of known sea may be those of its floor, and stay.
  Grid<double> levelled_m;
  if (mosaic.has_sea) levelled_m = mosaic.heights_m;
  Grid<double>& surface_m = mosaic.has_sea ? levelled_m : mosaic.heights_m;
  Grid<std::uint8_t> is_unknown(surface_m.width, surface_m.height, 0);
  for (int j = 0; j < surface_m.height; ++j) {
    std::vector<double> sea_m;
    for (int i = 0; i < surface_m.width; ++i) {
      if (is_filled_sea(i, j) != 0 || mosaic.is_sea(i, j) != 0) {
        if (sea_m.empty()) sea_m = sea_levels_of_row_m(draft, j);
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

/// The regions of filled sea beside sea with a measured floor.
Grid<std::uint8_t> beside_measured_floor(const Grid<std::uint8_t>& is_filled_sea,
                                         const Grid<double>& depth_m) {
  const Regions regions = find_regions(is_filled_sea);
  std::vector<std::uint8_t> is_beside(regions.regions.size(), 0);
  const auto region_of = [&](std::int32_t label) { return static_cast<std::size_t>(label - 1); };
  for (int j = 0; j < depth_m.height; ++j)
    for (int i = 0; i < depth_m.width; ++i) {
      if (regions.label(i, j) == 0) continue;
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di)
          if (depth_m.contains(i + di, j + dj) && depth_m(i + di, j + dj) > 0.0)
            is_beside[region_of(regions.label(i, j))] = 1;
    }
  Grid<std::uint8_t> is_member(depth_m.width, depth_m.height, 0);
  for (std::size_t k = 0; k < is_member.values.size(); ++k)
    if (regions.label.values[k] != 0)
      is_member.values[k] = is_beside[region_of(regions.label.values[k])];
  return is_member;
}

/// Lets measured floors go on under filled sea, up to its coasts. A sea whose floor nobody measured has
/// that of lay_floor(), so that the filled floor passes into it without a ledge; filled sea beside no
/// measured floor is left to lay_floor(), too.
void fill_floors(MosaicDraft& draft, const Grid<std::uint8_t>& is_filled_sea) {
  RasterMosaic& mosaic = draft.mosaic;
  if (!mosaic.has_sea || !holds_any(is_filled_sea)) return;
  const bool stands_apart = mosaic.datum.is_ellipsoid();
  Grid<double> depth_m(mosaic.heights_m.width, mosaic.heights_m.height, 0.0);
  const auto is_known_sea = [&](std::size_t k) {
    return mosaic.is_sea.values[k] != 0 && is_filled_sea.values[k] == 0;
  };
  bool has_unmeasured = false;
  for (std::size_t k = 0; k < depth_m.values.size(); ++k) {
    if (!is_known_sea(k)) continue;
    depth_m.values[k] = stands_apart ? static_cast<double>(mosaic.floor_depth_m.values[k])
                                     : -mosaic.heights_m.values[k];
    has_unmeasured = has_unmeasured || !(depth_m.values[k] > 0.0);
  }
  const Grid<std::uint8_t> goes_on = beside_measured_floor(is_filled_sea, depth_m);
  if (!holds_any(goes_on)) return;
  if (has_unmeasured) {
    const Grid<float> from_land_m = distance_to_others(mosaic.is_sea, mosaic.sample_size_m);
    for (std::size_t k = 0; k < depth_m.values.size(); ++k)
      if (is_known_sea(k) && !(depth_m.values[k] > 0.0))
        depth_m.values[k] = shelf_depth_m(from_land_m.values[k], mosaic.sample_size_m);
  }
  fill_from_surroundings(depth_m, goes_on);
  for (std::size_t k = 0; k < depth_m.values.size(); ++k) {
    if (goes_on.values[k] == 0) continue;
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
