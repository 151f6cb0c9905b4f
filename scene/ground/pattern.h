#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/random.h"

/// Patterns of lines and cells, filtered: what share of a window of a given width, about a place, they
/// take. All in closed form; the shares of a window wider than the period are the pattern's own.
namespace terracast::scene {

/// Length of [0, s] that bars take, each the first bar_m of a period_m.
inline double bars_up_to(double s, double bar_m, double period_m) {
  const double periods = std::floor(s / period_m);
  return periods * bar_m + std::min(s - periods * period_m, bar_m);
}

/// Share of [at - width / 2, at + width / 2] that bars take, each from a multiple of period_m on.
/// width_m   0: 1 on a bar, 0 beside
inline double share_of_bars(double at, double width_m, double bar_m, double period_m) {
  if (width_m <= 0.0) return at - std::floor(at / period_m) * period_m < bar_m ? 1.0 : 0.0;
  return (bars_up_to(at + 0.5 * width_m, bar_m, period_m) -
          bars_up_to(at - 0.5 * width_m, bar_m, period_m)) /
         width_m;
}

/// Share of [at - width / 2, at + width / 2] within [low, high].
inline double share_within(double at, double width_m, double low, double high) {
  if (width_m <= 0.0) return at >= low && at <= high ? 1.0 : 0.0;
  return std::max(0.0, std::min(at + 0.5 * width_m, high) - std::max(at - 0.5 * width_m, low)) /
         width_m;
}

/// Share that lines at the multiples of two periods take of a square: joints between slabs or stones.
inline double share_of_joints(double x, double y, double width_m, double joint_m, double period_x_m,
                              double period_y_m) {
  const double across = share_of_bars(x + 0.5 * joint_m, width_m, joint_m, period_x_m);
  const double along = share_of_bars(y + 0.5 * joint_m, width_m, joint_m, period_y_m);
  return across + along - across * along;
}

/// A number of [0, 1) of a cell.
inline float cell_tint(std::uint64_t seed, double column, double row) {
  return static_cast<float>(
             core::random_bits(seed, static_cast<std::uint64_t>(static_cast<std::int64_t>(column)),
                               static_cast<std::uint64_t>(static_cast<std::int64_t>(row))) >>
             40) *
         0x1.0p-24f;
}

}  // namespace terracast::scene
