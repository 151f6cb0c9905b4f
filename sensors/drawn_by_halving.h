#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "core/error.h"

namespace terracast::sensors {

/// Values at the ticks 0, 1, 2, … of a stream, each drawn as the middle of an interval whose ends were drawn before it,
/// so that a tick's value is the same whichever others are asked.
///
/// cost      41 draws for a tick alone, two in the mean where ticks are asked in order
/// threads   one at a time
template <class Value>
class DrawnByHalving {
 public:
  static constexpr int kDepth = 40;
  /// The number of the whole interval's end, which is no tick's.
  static constexpr std::int64_t kEnd = -1;

  /// Half of an interval that was halved so often, in ticks.
  static double half_ticks(int depth) { return std::ldexp(1.0, kDepth - depth - 1); }

  /// Values at tick 0 and at the whole interval's end.
  DrawnByHalving(Value at_first, Value at_end) { intervals_[0] = {0, at_first, at_end}; }

  /// tick      0 to 2^40
  /// drawn     the value at a middle: drawn(depth, value at the interval's first tick, at its end, middle tick)
  template <class Draw>
  Value at(std::int64_t tick, const Draw& drawn) {
    TERRACAST_CHECK(tick >= 0 && tick < (std::int64_t{1} << kDepth), "tick {}", tick);
    while (tick < interval(known_depth_).first ||
           tick >= interval(known_depth_).first + length(known_depth_))
      --known_depth_;
    for (; known_depth_ < kDepth; ++known_depth_) {
      const Interval& whole = interval(known_depth_);
      const std::int64_t middle = whole.first + length(known_depth_ + 1);
      const Value at_middle = drawn(known_depth_, whole.at_first, whole.at_end, middle);
      interval(known_depth_ + 1) = tick < middle ? Interval{whole.first, whole.at_first, at_middle}
                                                 : Interval{middle, at_middle, whole.at_end};
    }
    return interval(kDepth).at_first;
  }

 private:
  struct Interval {
    std::int64_t first = 0;
    Value at_first{}, at_end{};
  };
  static std::int64_t length(int depth) { return std::int64_t{1} << (kDepth - depth); }
  Interval& interval(int depth) { return intervals_[static_cast<std::size_t>(depth)]; }

  std::array<Interval, kDepth + 1> intervals_{};  ///< around the tick that was asked last
  int known_depth_ = 0;
};

}  // namespace terracast::sensors
