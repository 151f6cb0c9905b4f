#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "job/traffic/drive.h"
#include "job/traffic/goer.h"
#include "world/way_network.h"

namespace terracast::job {

/// How trains go on a kind of railway.
struct RailKind {
  world::WayKind kind = world::WayKind::Rail;
  double per_track_km = 0.0;  ///< trains at one time, by day
  double headway_s = 0.0;     ///< from the end of a train to the head of the next on its track
  DriveStyle style = {};
};
/// Those that have trains.
std::span<const RailKind> rail_kinds();

/// What a train is made of: cars of one kind, led or not.
struct TrainRow {
  world::WayKind kind = world::WayKind::Rail;
  std::string_view lead;  ///< a thing; empty: there is none
  std::string_view car;
  int fewest_cars = 1;
  int most_cars = 1;
  double share = 1.0;  ///< of the trains of its kind of railway
  double most_kmph = 0.0;
};

/// Rows that may go on a kind of railway.
/// things   of which they are made alone; empty: of all
std::vector<TrainRow> rows_on(world::WayKind kind, std::span<const std::string> things);

/// A train as it is drawn.
struct DrawnTrain {
  std::vector<Body> cars;  ///< from the head to the end
  double most_mps = 0.0;
  double length_m() const;
};
/// rows   one or more
DrawnTrain draw_train(std::span<const TrainRow> rows, std::uint64_t key);
double longest_m(std::span<const TrainRow> rows);

}  // namespace terracast::job
