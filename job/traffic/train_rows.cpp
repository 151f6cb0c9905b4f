#include "job/traffic/train_rows.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "core/random.h"

namespace terracast::job {
namespace {

using world::WayKind;

// Trains an hour on a track over their speed, stops with it: 4 at 80 km/h, 6 at 40, 8 at 20, 1 at 40 and 10 at 35. Headways
// are those of dense timetables: 120 s from train to train by signals, 90 s of light railways and undergrounds, 30 s of
// trams, which are driven on sight. Across, rails carry what cant of 100 mm and as much that is missing make of it,
// 1.3 m/s^2; lines without cant less. Along, trains are gentler than cars: people stand in them.
constexpr DriveStyle kHeavy = {.lateral_mps2 = 1.3, .accelerate_mps2 = 0.4, .brake_mps2 = 0.5};
constexpr DriveStyle kLight = {.lateral_mps2 = 1.0, .accelerate_mps2 = 0.9, .brake_mps2 = 1.0};
constexpr std::array<RailKind, 5> kKinds = {{{WayKind::Rail, 0.05, 120.0, kHeavy},
                                             {WayKind::LightRail, 0.15, 90.0, kLight},
                                             {WayKind::Tram, 0.4, 30.0, kLight},
                                             {WayKind::NarrowGauge, 0.025, 120.0, kHeavy},
                                             {WayKind::Subway, 0.29, 90.0, kLight}}};

constexpr std::array<TrainRow, 7> kRows = {
    {{WayKind::Rail, "", "railcar", 1, 3, 0.5, 120.0},
     {WayKind::Rail, "locomotive", "passenger_coach", 5, 9, 0.3, 160.0},
     {WayKind::Rail, "locomotive", "container_wagon", 8, 18, 0.2, 100.0},
     {WayKind::LightRail, "", "metro_car", 2, 4, 1.0, 80.0},
     {WayKind::Tram, "", "tram", 1, 2, 1.0, 60.0},
     {WayKind::NarrowGauge, "", "railcar", 1, 2, 1.0, 80.0},
     {WayKind::Subway, "", "metro_car", 4, 6, 1.0, 80.0}}};

const tiler::ThingInfo& car_called(std::string_view name) {
  const tiler::ThingInfo* thing = tiler::find_thing(name);
  TERRACAST_CHECK(thing != nullptr && thing->pivots_m > 0.0, "{} is no car of trains", name);
  return *thing;
}

}  // namespace

std::span<const RailKind> rail_kinds() { return kKinds; }

std::vector<TrainRow> rows_on(WayKind kind, std::span<const std::string> things) {
  const auto is_meant = [&](std::string_view thing) {
    return thing.empty() || things.empty() ||
           std::find(things.begin(), things.end(), thing) != things.end();
  };
  std::vector<TrainRow> rows;
  for (const TrainRow& row : kRows)
    if (row.kind == kind && is_meant(row.lead) && is_meant(row.car)) rows.push_back(row);
  return rows;
}

double DrawnTrain::length_m() const {
  double length_m = 0.0;
  for (const Body& car : cars) length_m += car.thing->size_m.x();
  return length_m;
}

DrawnTrain draw_train(std::span<const TrainRow> rows, std::uint64_t key) {
  double all = 0.0;
  for (const TrainRow& row : rows) all += row.share;
  double left = all * core::random_unit(key, 0x10003, 0);
  const TrainRow* row = &rows.back();
  for (const TrainRow& one : rows) {
    if (left < one.share) {
      row = &one;
      break;
    }
    left -= one.share;
  }
  DrawnTrain train{.cars = {}, .most_mps = row->most_kmph / 3.6};
  const auto add = [&](std::string_view name, std::uint64_t draw) {
    const tiler::ThingInfo& thing = car_called(name);
    train.cars.push_back(
        {.thing = &thing,
         .variant = static_cast<int>(draw % static_cast<std::uint64_t>(thing.num_variants))});
  };
  if (!row->lead.empty()) add(row->lead, core::random_bits(key, 0x10003, 1));
  const auto more = static_cast<std::uint64_t>(row->most_cars - row->fewest_cars) + 1;
  const int num = row->fewest_cars + static_cast<int>(core::random_bits(key, 0x10003, 2) % more);
  // Wagons are as they come; coaches of a train are of one colour.
  const bool is_mixed = row->car == "container_wagon";
  for (int i = 0; i < num; ++i)
    add(row->car, core::random_bits(key, 0x10004, is_mixed ? static_cast<std::uint64_t>(i) : 0));
  return train;
}

double longest_m(std::span<const TrainRow> rows) {
  double longest = 0.0;
  for (const TrainRow& row : rows)
    longest = std::max(longest, (row.lead.empty() ? 0.0 : car_called(row.lead).size_m.x()) +
                                    row.most_cars * car_called(row.car).size_m.x());
  return longest;
}

}  // namespace terracast::job
