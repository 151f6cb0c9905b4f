#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "scene/ground/ground.h"
#include "tiler/vegetation/groves.h"
#include "world/field_pattern.h"

// What vegetation plants along borders against what the ground shows of them: each is asked for itself.
namespace terracast::scene {
namespace {

using Eigen::Vector2d;

constexpr double kStep_m = 0.25;

/// Red of the ground's colour along a line to the east, on level meadows.
std::vector<double> painted(const Ground& ground, const Vector2d& first, int num_places) {
  std::vector<double> red;
  GroundPlaces places;
  world::SurfaceSample surface;
  surface.spacing_m = 1.0;
  surface.cover = world::Cover::Grass;
  surface.moisture = 0.4;
  for (int k = 0; k < num_places; k += core::kLanes) {
    for (int i = 0; i < core::kLanes; ++i)
      places.set(i, {first.x() + kStep_m * (k + i), first.y(), 300.0}, Eigen::Vector3d::UnitZ(),
                 surface, 0.5);
    GroundPacket packet;
    ground.set(places, packet);
    GroundLook look;
    ground.look(packet, look);
    for (int i = 0; i < core::kLanes; ++i) red.push_back(static_cast<double>(look.albedo[0][i]));
  }
  return red;
}

/// Where a line steps from one colour to another: parted there, both sides are the most even. Index of the first
/// place of the second side; below 0: the colours hardly differ.
int step_of(const std::vector<double>& red) {
  const int count = static_cast<int>(red.size());
  std::vector<double> sum{0.0};
  for (const double value : red) sum.push_back(sum.back() + value);
  const auto mean = [&](int from, int to) {
    return (sum[static_cast<std::size_t>(to)] - sum[static_cast<std::size_t>(from)]) / (to - from);
  };
  int best = 1;
  double most = 0.0;
  for (int k = 1; k < count; ++k) {
    // The sum of squares about the two means falls by this against that about one.
    const double apart = mean(0, k) - mean(k, count);
    const double gain = apart * apart * k * (count - k) / count;
    if (gain > most) best = k;
    most = std::max(most, gain);
  }
  return std::abs(mean(0, best) - mean(best, count)) > 0.025 ? best : -1;
}

/// How far rows' middles are from the border that the ground shows, of rows that lines to the east cross on meadows; in
/// rising order.
/// law   by which rows are planted
std::vector<double> offsets_m(const tiler::Groves& groves, const Ground& ground, world::Cover law) {
  constexpr int kReach = 56;  // 14 m to either side
  std::vector<double> offsets_m;
  for (int line = 0; line < 120; ++line) {
    const double y = -2400.0 + 43.7 * line;
    int first = 0;
    int length = 0;
    int last_end = -1000;
    for (int k = 0; k < 10000; ++k) {
      const tiler::Grove row = groves.along_fields({-1250.0 + kStep_m * k, y}, law);
      if (row.bushes > 0.0 || row.trees > 0.0) {
        if (length++ == 0) first = k;
        continue;
      }
      if (length == 0) continue;
      // Crossed at right angles or nearly, with no other row beside: 4.4 m of the pattern.
      const bool is_crossed = length >= 14 && length <= 26 && first - last_end > kReach;
      last_end = k;
      const int middle = first + length / 2;
      length = 0;
      if (!is_crossed) continue;
      const std::vector<double> red =
          painted(ground, {-1250.0 + kStep_m * (middle - kReach), y}, 2 * kReach);
      const int step = step_of(red);
      if (step >= 0) offsets_m.push_back(kStep_m * std::abs(step - kReach));
    }
  }
  std::sort(offsets_m.begin(), offsets_m.end());
  return offsets_m;
}

TEST(MeadowRows, StandOnTheBordersThatTheGroundShows) {
  const world::FieldPattern fields(5, false);
  const tiler::Groves groves(5, fields);
  Climate climate;
  climate.fields = fields;
  climate.has_trees = true;
  const Ground ground(climate);
  const auto of_hundred = [](const std::vector<double>& sorted, std::size_t share) {
    return sorted[sorted.size() * share / 100];
  };
  const std::vector<double> rows = offsets_m(groves, ground, world::Cover::Grass);
  // Rows by straight borders, as they stood until 2026-11: what the measure gives where they miss.
  const std::vector<double> straight = offsets_m(groves, ground, world::Cover::Crops);
  ASSERT_GT(rows.size(), 300U);
  ASSERT_GT(straight.size(), 300U);
  std::printf(
      "%zu rows: half within %.2f m, 75 of 100 within %.2f m; straight ones %.2f m, %.2f m\n",
      rows.size(), of_hundred(rows, 50), of_hundred(rows, 75), of_hundred(straight, 50),
      of_hundred(straight, 75));
  // Nobody mows 1.5 m to either side of a border: the step in colour is at the brighter side of that. Where another
  // border ends near a line, or colours are nearly equal, another step may be told.
  EXPECT_LE(of_hundred(rows, 50), 1.75);
  EXPECT_LT(of_hundred(rows, 75), 2.6);
  EXPECT_GT(of_hundred(straight, 50), 4.0);
}

}  // namespace
}  // namespace terracast::scene
