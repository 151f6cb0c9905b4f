#pragma once

#include <vector>

#include "validate/check.h"
#include "validate/dataset.h"

namespace terracast::validate {

/// The stamps of sensors beside cameras against what sensors.json says of their clocks: clocks_stamps (order, and how far
/// each is off), clocks_offset, clocks_drift and clocks_jitter.
/// returns   nothing where no sensor has a clock of its own
std::vector<CheckResult> compare_sensor_clocks(const Dataset& dataset, const Sequence& sequence);

/// How stamps are off a clock, s.
struct StampErrors {
  double mean_s = 0.0;       ///< at the middle of their times
  double middle_s = 0.0;     ///< of their times
  double slope = 0.0;        ///< s/s
  double spread_s2 = 0.0;    ///< sum of the squared times about their middle
  double variance_s2 = 0.0;  ///< about that line; 0 of fewer than three
  std::size_t count = 0;
};
/// errors_s   of the stamps at these times
StampErrors stamp_errors_of(const std::vector<double>& times_s,
                            const std::vector<double>& errors_s);

/// What doubles of a time and its stamp are rounded to, s.
double stamp_rounding_s(double time_s, double stamp_s);

}  // namespace terracast::validate
