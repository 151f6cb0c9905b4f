#include "tiler/vegetation/blue_noise.h"

#include <array>
#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "core/random.h"
#include "world/tile_id.h"

namespace terracast::tiler {
namespace {

/// After so many rounds of so many darts the set is nearly full.
constexpr int kNumRounds = 8;
constexpr int kNumDarts = 4;
/// A place matters to cells so far away.
constexpr int kReach = 2;
/// An offer is weighed against those within its reach, and each of them depends on places within its own.
constexpr int kRoundReach = 2 * kReach;

/// What has become of a cell.
enum class State : std::uint8_t {
  Empty,
  Offering,  ///< a place in this round
  Filled,
  GivenUp,  ///< all darts of a round fell too near to others: little room is left
};

/// Of a place in its cell, in steps of kHeightStep_m.
struct Offset {
  std::uint16_t x = 0;
  std::uint16_t y = 0;
};

/// Cells whose places can be nearer than the least distance: not those at the corners of the square of
/// five by five, whose are farther by a hair. Nearest first.
constexpr std::array<std::array<int, 2>, 20> kNeighbours = {
    {{-1, 0}, {1, 0}, {0, -1},  {0, 1},  {-1, -1}, {1, -1}, {-1, 1},  {1, 1},  {-2, 0}, {2, 0},
     {0, -2}, {0, 2}, {-2, -1}, {-2, 1}, {2, -1},  {2, 1},  {-1, -2}, {1, -2}, {-1, 2}, {1, 2}}};

}  // namespace

BlueNoise::BlueNoise(std::uint64_t seed, std::uint64_t stream, double cell_m)
    : seed_(seed), stream_(stream), cell_m_(cell_m) {
  const double steps = cell_m / world::kHeightStep_m;
  TERRACAST_CHECK(steps >= 1.0 && steps < 65536.0 && steps == std::floor(steps), "cells of {} m",
                  cell_m);
}

std::vector<BlueNoise::Place> BlueNoise::places_in(const Eigen::Vector2d& lowest_world,
                                                   const Eigen::Vector2d& highest_world) const {
  const auto cell_of = [&](double at) { return static_cast<int>(std::floor(at / cell_m_)); };
  const int first_x = cell_of(lowest_world.x());
  const int first_y = cell_of(lowest_world.y());
  const int num_x = cell_of(highest_world.x()) - first_x + 1;
  const int num_y = cell_of(highest_world.y()) - first_y + 1;
  if (num_x <= 0 || num_y <= 0) return {};

  // With a rim that no cell reaches beyond.
  constexpr int kRim = kRoundReach * kNumRounds;
  const int width = num_x + 2 * kRim;
  const int height = num_y + 2 * kRim;
  const auto num_cells = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<State> states(num_cells, State::Empty);
  std::vector<Offset> offsets(num_cells);
  std::vector<std::uint32_t> offers(num_cells, 0);  // higher wins
  const auto row_of = [&](int i, int j) {
    return static_cast<std::ptrdiff_t>(j) * width + static_cast<std::ptrdiff_t>(i);
  };
  std::array<std::ptrdiff_t, kNeighbours.size()> neighbour_rows;
  for (std::size_t k = 0; k < kNeighbours.size(); ++k)
    neighbour_rows[k] = row_of(kNeighbours[k][0], kNeighbours[k][1]);
  const auto cell_steps = static_cast<std::int32_t>(cell_m_ / world::kHeightStep_m);
  const double least_steps = least_distance_m() / world::kHeightStep_m;
  const auto least2 = static_cast<std::int64_t>(std::ceil(least_steps * least_steps));
  // Whether a place of cell `row` is too near to that of a cell beside it of which `counts` holds.
  const auto is_near = [&](std::ptrdiff_t row, const Offset& at, const auto& counts) {
    for (std::size_t k = 0; k < kNeighbours.size(); ++k) {
      const auto other = static_cast<std::size_t>(row + neighbour_rows[k]);
      if (!counts(other)) continue;
      const auto& [di, dj] = kNeighbours[k];
      const std::int64_t dx = std::int64_t{di} * cell_steps + offsets[other].x - at.x;
      const std::int64_t dy = std::int64_t{dj} * cell_steps + offsets[other].y - at.y;
      if (dx * dx + dy * dy < least2) return true;
    }
    return false;
  };
  // As core::random_bits draws, what all cells share done once.
  std::array<std::uint64_t, kNumRounds * kNumDarts> streams;
  for (std::size_t dart = 0; dart < streams.size(); ++dart)
    streams[dart] = core::mix_bits(core::mix_bits(seed_) ^ core::stream_of(stream_, dart));
  std::vector<std::size_t> taken;
  for (int round = 0; round < kNumRounds; ++round) {
    // Later rounds ask for this one's cells so far out.
    const int out = kRoundReach * (kNumRounds - 1 - round);
    const int offered = out + kReach;
    for (int j = kRim - offered; j < kRim + num_y + offered; ++j)
      for (int i = kRim - offered; i < kRim + num_x + offered; ++i) {
        const std::ptrdiff_t row = row_of(i, j);
        const auto own = static_cast<std::size_t>(row);
        if (states[own] == State::Filled || states[own] == State::GivenUp) continue;
        states[own] = State::GivenUp;
        const std::uint64_t number =
            static_cast<std::uint64_t>(static_cast<std::uint32_t>(first_y + j - kRim)) << 32U |
            static_cast<std::uint32_t>(first_x + i - kRim);
        for (std::size_t dart = 0; dart < kNumDarts; ++dart) {
          const std::uint64_t bits =
              core::mix_bits(streams[static_cast<std::size_t>(round) * kNumDarts + dart] ^ number);
          const auto within_cell = [&](std::uint64_t part) {
            return static_cast<std::uint16_t>(
                (part & 0xffffffffU) * static_cast<std::uint64_t>(cell_steps) >> 32U);
          };
          const Offset at{within_cell(bits), within_cell(bits >> 32U)};
          // In the first round none is filled.
          if (round > 0 &&
              is_near(row, at, [&](std::size_t k) { return states[k] == State::Filled; }))
            continue;
          offsets[own] = at;
          offers[own] = static_cast<std::uint32_t>(core::mix_bits(bits));
          states[own] = State::Offering;
          break;
        }
      }
    taken.clear();
    for (int j = kRim - out; j < kRim + num_y + out; ++j)
      for (int i = kRim - out; i < kRim + num_x + out; ++i) {
        const std::ptrdiff_t row = row_of(i, j);
        const auto own = static_cast<std::size_t>(row);
        if (states[own] != State::Offering) continue;
        // Of equal offers neither is taken.
        const auto is_higher = [&](std::size_t k) {
          return states[k] == State::Offering && offers[k] >= offers[own];
        };
        if (!is_near(row, offsets[own], is_higher)) taken.push_back(own);
      }
    for (const std::size_t own : taken) states[own] = State::Filled;
  }

  std::vector<Place> places;
  for (int j = 0; j < num_y; ++j)
    for (int i = 0; i < num_x; ++i) {
      const auto own = static_cast<std::size_t>(row_of(i + kRim, j + kRim));
      if (states[own] != State::Filled) continue;
      const Eigen::Vector2d at((first_x + i) * cell_m_ + offsets[own].x * world::kHeightStep_m,
                               (first_y + j) * cell_m_ + offsets[own].y * world::kHeightStep_m);
      if ((at.array() >= lowest_world.array()).all() && (at.array() < highest_world.array()).all())
        places.push_back({first_x + i, first_y + j, at});
    }
  return places;
}

}  // namespace terracast::tiler
