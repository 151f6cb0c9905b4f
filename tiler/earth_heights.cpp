#include "tiler/earth_heights.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

#include "core/error.h"
#include "tiler/no_data.h"

namespace terracast::tiler {

using core::ErrorKind;
using core::fail;

namespace {

/// The number that a height is stored as; a whole one is so to the bit, whatever factors lie between.
double stored(const RasterSource& raster, double height_m) {
  const double raw = raster.raw_of(height_m);
  return std::abs(raw - std::round(raw)) < 1e-6 ? std::round(raw) : raw;
}

}  // namespace

void refuse_undeclared_fills(const RasterSource& raster, const Grid<double>& heights_m,
                             const std::string& nodata, std::string_view key) {
  constexpr double kFill = -9999.0;
  constexpr double kTrench_m = -9000.0;  // where heights of -9999 m are, others lie about them
  const double fill_m = raster.metres_of(kFill);
  std::int64_t num_fills = 0;
  std::int64_t num_in_trenches = 0;
  for (const double height_m : heights_m.values) {
    if (height_m == fill_m || height_m == kFill)
      ++num_fills;
    else if (height_m < kTrench_m)
      ++num_in_trenches;
  }
  if (num_fills == 0) return;
  const NoData stated = NoData::of(nodata);
  // Heights in feet, decimetres or centimetres may be -9999 of them; who says so is believed.
  constexpr double kDeepest_m = -11500.0;
  const bool is_possible = fill_m > kTrench_m && fill_m > kDeepest_m && fill_m != kFill;
  if (is_possible && !stated.takes_masks()) return;
  const bool may_be_heights = num_in_trenches >= num_fills;
  if (may_be_heights && !stated.takes_masks()) return;
  fail(ErrorKind::Input,
       "{}: {} samples are exactly {:g}, which {}, and nothing declares it here; state {} = "
       "\"{}\"{}",
       raster.path(), num_fills, kFill, customary_fill(kFill)->where, key, stated.text_with(kFill),
       may_be_heights || is_possible ? ", or \"none\" if they are heights" : "");
}

void refuse_ground_beyond_earth(const RasterSource& raster, const ElevationOptions& entry,
                                const SampleWindow& window, const Grid<double>& heights_m) {
  const bool has_floors = entry.sea == "below" || entry.sea == "none";
  const double lowest_m = (has_floors ? kDeepestFloor_m : kLowestShore_m) - kEarthMargin_m;
  const double highest_m = kHighestPeak_m + kEarthMargin_m;
  for (int j = 0; j < window.height; ++j)
    for (int i = 0; i < window.width; ++i) {
      const double height_m = heights_m(i, j);
      if (!(height_m < lowest_m || height_m > highest_m)) continue;
      fail(ErrorKind::Input,
           "{}: the height of pixel ({}, {}) is {:.6g} m, and {} is between {:g} and {:g} m; if it "
           "marks voids, state "
           "nodata = \"{}\"; if the unit is another, unit = \"ft\"{}",
           raster.path(), raster.grid().column_in_file(window.first_column + i),
           window.first_row + j, height_m,
           has_floors ? "all ground on Earth, the sea's floor too," : "all land on Earth",
           has_floors ? kDeepestFloor_m : kLowestShore_m, kHighestPeak_m,
           NoData::of(entry.nodata).text_with(stored(raster, height_m)),
           has_floors ? ""
                      : "; if it is the floor of a sea, sea = \"below\" (above a geoid); of a "
                        "drained one, or under ice, sea = \"none\"");
    }
}

}  // namespace terracast::tiler
