#pragma once

#include <cstddef>
#include <vector>

#include "geo/fixes/placing.h"

namespace terracast::geo {

/// What is wrong in recordings, and when a fix counts as such.
struct CleaningOptions {
  double max_gap_s = 30.0;
  double max_speed_mps = 350.0;
  double hold_s = 0.0;   ///< 0: three times the median time between two places that differ
  double slack_m = 0.0;  ///< distance that noise alone may put between two fixes
};

struct CleaningCounts {
  std::size_t num_without_time = 0;
  std::size_t num_repeated = 0;      ///< the place of the fix before, held until the next one came
  std::size_t num_of_same_time = 0;  ///< another place at the time of a fix that is kept
  std::size_t num_out_of_order = 0;  ///< times that do not grow
  std::size_t num_impossible = 0;    ///< too far from the others for max_speed_mps
  std::size_t num_in_short_parts = 0;
};

/// A stretch of a recording without a gap.
struct FixPart {
  std::vector<PlacedFix> positions;     ///< times increase
  std::vector<PlacedFix> orientations;  ///< those that hold an attitude; times increase
};

/// Fewer fixes are no part.
inline constexpr std::size_t kFewestFixes = 3;

/// More fixes in a row are never taken for wrong.
inline constexpr std::size_t kLongestWrongRun = 2000;

/// Drops repeated and impossible fixes (where a recorder is faster than its receiver, a place that is repeated with
/// another height is repeated too), then cuts where the fixes are more than max_gap_s apart. The
/// fewest fixes are dropped so that times grow and no leg is longer than max_speed_mps allows. A run of
/// more than kLongestWrongRun wrong fixes is not bridged: the longer side of it is kept.
/// fixes   in the file's order
std::vector<FixPart> clean_fixes(const std::vector<PlacedFix>& fixes,
                                 const CleaningOptions& options, CleaningCounts& counts);

/// Gives each part the timed attitudes of the time between its first and last fix, instead of those of its fixes.
/// attitudes   in the order of their times
void take_attitudes(const std::vector<PlacedFix>& attitudes, std::vector<FixPart>& parts);

}  // namespace terracast::geo
