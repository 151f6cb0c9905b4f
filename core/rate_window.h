#pragma once

#include <cstdint>
#include <deque>
#include <optional>

namespace terracast::core {

/// The recent rate of work, from counts at times: over the last 30 s, or over the last 8 units
/// where those took longer, so that a slow part in the past does not spoil the estimate of what is
/// left.
class RateWindow {
 public:
  explicit RateWindow(double start_s) : samples_{{start_s, 0}} {}

  /// done   units so far, never less than before; time_s likewise
  void add(double time_s, std::int64_t done);

  /// Units a second; empty before the first unit is done.
  std::optional<double> rate() const;

  /// Seconds for `count` more units at this rate; empty as rate().
  std::optional<double> time_for(std::int64_t count) const;

 private:
  struct Sample {
    double time_s;
    std::int64_t done;
  };
  std::deque<Sample> samples_;
};

}  // namespace terracast::core
