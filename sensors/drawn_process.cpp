#include "sensors/drawn_process.h"

#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "sensors/deviates.h"

namespace terracast::sensors {

namespace {

/// The number of the whole interval's end, which is no tick's.
constexpr std::int64_t kEnd = -1;

}  // namespace

double DrawnProcess::deviate(std::int64_t tick) const {
  return normal_deviate(
      open_unit(core::random_bits(seed_, stream_, static_cast<std::uint64_t>(tick))));
}

DrawnProcess DrawnProcess::walk(double step, std::uint64_t seed, std::uint64_t stream) {
  DrawnProcess process(seed, stream);
  for (int depth = 0; depth < kDepth; ++depth) {
    const double half = std::ldexp(1.0, kDepth - depth - 1);
    // Between ends that are known the middle scatters by a quarter of what the whole interval gains.
    process.halvings_[static_cast<std::size_t>(depth)] = {0.5, step * std::sqrt(0.5 * half)};
  }
  const double whole = step * std::sqrt(std::ldexp(1.0, kDepth));
  process.intervals_[0] = {0, 0.0, whole * process.deviate(kEnd)};
  return process;
}

DrawnProcess DrawnProcess::markov(double deviation, double ticks, std::uint64_t seed,
                                  std::uint64_t stream) {
  DrawnProcess process(seed, stream);
  for (int depth = 0; depth < kDepth; ++depth) {
    const double half = std::ldexp(1.0, kDepth - depth - 1);
    const double kept = std::exp(-half / ticks);
    // 1 - kept^2, exactly for short intervals too.
    const double lost = -std::expm1(-2.0 * half / ticks);
    process.halvings_[static_cast<std::size_t>(depth)] = {
        kept / (1.0 + kept * kept), deviation * std::sqrt(lost / (1.0 + kept * kept))};
  }
  const double whole = std::ldexp(1.0, kDepth) / ticks;
  const double first = deviation * process.deviate(0);
  process.intervals_[0] = {0, first,
                           std::exp(-whole) * first + deviation *
                                                          std::sqrt(-std::expm1(-2.0 * whole)) *
                                                          process.deviate(kEnd)};
  return process;
}

double DrawnProcess::at(std::int64_t tick) {
  TERRACAST_CHECK(tick >= 0 && tick < (std::int64_t{1} << kDepth), "tick {}", tick);
  const auto length = [](int depth) { return std::int64_t{1} << (kDepth - depth); };
  const auto interval = [&](int depth) -> Interval& {
    return intervals_[static_cast<std::size_t>(depth)];
  };
  while (tick < interval(known_depth_).first ||
         tick >= interval(known_depth_).first + length(known_depth_))
    --known_depth_;
  for (; known_depth_ < kDepth; ++known_depth_) {
    const Interval& whole = interval(known_depth_);
    const Halving& halving = halvings_[static_cast<std::size_t>(known_depth_)];
    const std::int64_t middle = whole.first + length(known_depth_ + 1);
    const double at_middle =
        halving.weight * (whole.at_first + whole.at_end) + halving.deviation * deviate(middle);
    interval(known_depth_ + 1) = tick < middle ? Interval{whole.first, whole.at_first, at_middle}
                                               : Interval{middle, at_middle, whole.at_end};
  }
  return interval(kDepth).at_first;
}

}  // namespace terracast::sensors
