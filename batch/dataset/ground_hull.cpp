#include "batch/dataset/ground_hull.h"

#include <algorithm>
#include <utility>

namespace terracast::batch {

void GroundHull::Row::extend(double lon_deg) {
  west_deg = std::min(west_deg, lon_deg);
  east_deg = std::max(east_deg, lon_deg);
}

void GroundHull::start(double lowest_lat_deg, double highest_lat_deg) {
  first_band_ = band_at(lowest_lat_deg);
  rows_.assign(static_cast<std::size_t>(band_at(highest_lat_deg) - first_band_) + 1, Row{});
}

void GroundHull::add_line(MapPlace a, MapPlace b) {
  if (a.lat_deg > b.lat_deg) std::swap(a, b);
  const double rise_deg = b.lat_deg - a.lat_deg;
  const auto lon_at = [&](double lat_deg) {
    const double share =
        rise_deg > 0.0 ? std::clamp((lat_deg - a.lat_deg) / rise_deg, 0.0, 1.0) : 0.0;
    return a.lon_deg + share * (b.lon_deg - a.lon_deg);
  };
  const int first = band_at(a.lat_deg);
  const int last = band_at(b.lat_deg);
  for (int band = first; band <= last; ++band) {
    const CellBounds bounds = bounds_of({band, 0});
    row(band).extend(band == first ? a.lon_deg : lon_at(bounds.south_deg));
    row(band).extend(band == last ? b.lon_deg : lon_at(bounds.north_deg));
  }
}

void GroundHull::append_to(std::vector<CellRun>& runs) const {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    if (row.west_deg > row.east_deg) continue;
    const int band = first_band_ + static_cast<int>(i);
    const int count = cells_in_band(band);
    const int west = column_at(band, row.west_deg);
    const int east = column_at(band, row.east_deg);
    if ((row.east_deg - row.west_deg) * count >= 360.0 * (count - 1)) {
      runs.push_back({band, 0, count});
    } else if (west <= east) {
      runs.push_back({band, west, east - west + 1});
    } else {  // across the 180 degree meridian
      runs.push_back({band, west, count - west});
      runs.push_back({band, 0, east + 1});
    }
  }
}

}  // namespace terracast::batch
