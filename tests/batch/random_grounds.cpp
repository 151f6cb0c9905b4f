#include "tests/batch/random_grounds.h"

#include <GeographicLib/Geodesic.hpp>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/random.h"

namespace terracast::batch {
namespace {

double geodesic_m(double lat1_deg, double lon1_deg, double lat2_deg, double lon2_deg) {
  double distance_m = 0.0;
  GeographicLib::Geodesic::WGS84().Inverse(lat1_deg, lon1_deg, lat2_deg, lon2_deg, distance_m);
  return distance_m;
}

/// Between the nearest places of two cells, on WGS84: of all that their corners, and the corners of
/// each on the other's border, offer.
double distance_m(const GroundCell& a, const GroundCell& b) {
  const CellBounds of_a = bounds_of(a);
  const CellBounds of_b = bounds_of(b);
  // The other's longitudes, in the turn that is nearest.
  const double turn = 360.0 * std::round((of_a.west_deg - of_b.west_deg) / 360.0);
  const double west_b = of_b.west_deg + turn, east_b = of_b.east_deg + turn;
  const auto between = [](double value, double low, double high) {
    return std::clamp(value, low, high);
  };
  double least_m = std::numeric_limits<double>::infinity();
  for (const double lat_a : {of_a.south_deg, of_a.north_deg})
    for (const double lat_b : {of_b.south_deg, of_b.north_deg})
      for (const double lon_a :
           {of_a.west_deg, of_a.east_deg, between(west_b, of_a.west_deg, of_a.east_deg)})
        least_m =
            std::min(least_m, geodesic_m(lat_a, lon_a, lat_b, between(lon_a, west_b, east_b)));
  return least_m;
}

std::vector<GroundCell> cells_of(const GroundSeen& seen) {
  std::vector<GroundCell> cells;
  for (const CellRun& run : seen.runs)
    for (int k = 0; k < run.num_cells; ++k) cells.push_back({run.band, run.first_column + k});
  return cells;
}

}  // namespace

double distance_m(const GroundSeen& a, const GroundSeen& b) {
  double least_m = std::numeric_limits<double>::infinity();
  if (a.ground != b.ground) return least_m;
  for (const GroundCell& cell_a : cells_of(a))
    for (const GroundCell& cell_b : cells_of(b))
      least_m = std::min(least_m, cell_a == cell_b ? -1.0 : distance_m(cell_a, cell_b));
  return least_m;  // -1: they share a cell
}

std::vector<GroundSeen> random_grounds(std::uint64_t seed, const geo::Geodetic& middle, int num,
                                       double spread_m) {
  std::vector<GroundSeen> grounds;
  for (int i = 0; i < num; ++i) {
    GroundSeen seen;
    seen.within_m = 1000.0;
    if (core::random_bits(seed, 9, static_cast<std::uint64_t>(i)) % 5 == 0) seen.ground = "made";
    const auto draw = [&](std::uint64_t stream, std::uint64_t k) {
      return core::random_between(-0.5, 0.5, seed, core::stream_of(stream, k),
                                  static_cast<std::uint64_t>(i));
    };
    const double lat_deg = middle.lat_deg + draw(1, 0) * spread_m / 111000.0;
    const double lon_deg =
        middle.lon_deg +
        draw(2, 0) * spread_m / (111000.0 * std::cos(middle.lat_deg * std::numbers::pi / 180.0));
    for (std::uint64_t k = 0; k < 4; ++k) {
      const int band = band_at(std::clamp(lat_deg + draw(3, k) * 0.006, -90.0, 90.0));
      const int count = cells_in_band(band);
      const int first =
          (column_at(band, lon_deg) + static_cast<int>(10.0 * draw(4, k)) + count) % count;
      seen.runs.push_back(
          {band, first, std::min(count - first, 1 + static_cast<int>(3.0 + 5.0 * draw(5, k)))});
    }
    join_runs(seen.runs);
    grounds.push_back(seen);
  }
  return grounds;
}

}  // namespace terracast::batch
