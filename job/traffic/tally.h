#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace terracast::job {

/// Why somebody is not made.
enum class Unmade { WayEnds, GivenUp, LeavesWorld, TooLong };

/// Why who was proposed is not there.
struct Tally {
  std::int64_t num_proposed = 0;
  std::array<std::int64_t, 4> num_unmade = {};  ///< by Unmade
  std::int64_t num_blocked = 0;
  std::int64_t num_giving_way = 0;
  std::int64_t num_beyond = 0;  ///< of `most`

  void add(Unmade why) { ++num_unmade[static_cast<std::size_t>(why)]; }
  std::int64_t of(Unmade why) const { return num_unmade[static_cast<std::size_t>(why)]; }
};

}  // namespace terracast::job
