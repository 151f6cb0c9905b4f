#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <vector>

#include "core/json.h"

/// A grid of the whole Earth with cells of about 100 m, which worlds with different origins share.
///
/// WGS84 latitude is cut into kGroundBands bands of 0.0009 degrees (99.5 to 100.5 m), numbered from
/// the South Pole on: band b holds -90 + 0.0009 b <= lat_deg < -90 + 0.0009 (b + 1), the last one the
/// North Pole too. Each band is cut into cells of equal width along its parallel, numbered eastward
/// from -180 degrees, so that no cell lies across that meridian. Their number is the whole number
/// that is nearest to 400 750 cos(latitude of the band's middle), at least 1: from the equator to 89
/// degrees they are 100.0 to 100.4 m wide.
namespace terracast::batch {

inline constexpr int kGroundBands = 200000;
/// No two places of a cell are farther apart.
inline constexpr double kGroundCellReach_m = 145.0;

/// Cells of a band.
int cells_in_band(int band);
/// lat_deg   in [-90, 90]
int band_at(double lat_deg);
/// lon_deg   any turn of it
int column_at(int band, double lon_deg);

struct GroundCell {
  std::int32_t band = 0;
  std::int32_t column = 0;
  auto operator<=>(const GroundCell&) const = default;
};

GroundCell ground_cell_at(double lat_deg, double lon_deg);

struct CellBounds {
  double south_deg = 0.0;
  double north_deg = 0.0;
  double west_deg = 0.0;  ///< in [-180, 180)
  double east_deg = 0.0;
};
CellBounds bounds_of(const GroundCell& cell);

/// Neighbouring cells of one band; none goes on across the 180 degree meridian.
struct CellRun {
  std::int32_t band = 0;
  std::int32_t first_column = 0;
  std::int32_t num_cells = 0;
  auto operator<=>(const CellRun&) const = default;
};

/// Brings runs of any order, which may overlap, into the one form that a set of cells has: sorted,
/// joined where they touch.
void join_runs(std::vector<CellRun>& runs);

/// Ground that somebody saw: a set of cells.
struct GroundSeen {
  /// Which ground the cells are of: "earth", or the input hash of a world that a seed made. Cells of
  /// different grounds have nothing to do with each other.
  std::string ground = "earth";
  double within_m = 0.0;      ///< of a camera; +inf: any distance
  std::vector<CellRun> runs;  ///< as join_runs() leaves them

  std::int64_t num_cells() const;
  bool holds(const GroundCell& cell) const;
  bool operator==(const GroundSeen&) const = default;
};

/// {"ground", "within_m" (null: any distance), "cells", "bands": [[band, first, count, first, count, …], …]}
core::Json json_from_ground(const GroundSeen& seen);
/// throws   Input: a member is missing, or holds what no such set can; `file` names it
GroundSeen ground_from_json(const core::Json& json, const std::string& file);

}  // namespace terracast::batch
