#pragma once

#include <limits>
#include <vector>

#include "batch/dataset/ground_cells.h"

namespace terracast::batch {

/// A place on the map. Its longitude counts on from that of its neighbours, past 180 degrees where
/// need be.
struct MapPlace {
  double lat_deg = 0.0;
  double lon_deg = 0.0;
};

/// The cells that the hull of some places meets, lines being straight in latitude and longitude. The
/// hull's border is among the lines between all pairs of the places.
class GroundHull {
 public:
  /// Forgets what was added, for a hull that lies between these latitudes.
  void start(double lowest_lat_deg, double highest_lat_deg);
  void add_line(MapPlace a, MapPlace b);
  void append_to(std::vector<CellRun>& runs) const;

 private:
  /// How far west and east the hull reaches in a band.
  struct Row {
    double west_deg = std::numeric_limits<double>::infinity();
    double east_deg = -std::numeric_limits<double>::infinity();
    void extend(double lon_deg);
  };
  Row& row(int band) { return rows_[static_cast<std::size_t>(band - first_band_)]; }

  int first_band_ = 0;
  std::vector<Row> rows_;
};

}  // namespace terracast::batch
