#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "job/traffic/routes.h"
#include "job/traffic/way_graph.h"

namespace terracast::job {

/// Where a train is at time 0, and where it goes.
struct TrainCourse {
  std::uint64_t key = 0;
  std::vector<Leg> legs;  ///< from that on which its end is
  double end_m = 0.0;     ///< of its end, along the first of them
  double length_m = 0.0;
  double room_m = 0.0;  ///< from its head to the end of a train before it, at least
};

/// Finds trains that are too near before others on their track, or face them there: of each two the one of the higher key.
/// Who stays does not depend on who is left out for others.
/// returns   for each course 1: it gives way
std::vector<std::uint8_t> find_too_near(const WayGraph& graph,
                                        std::span<const TrainCourse> courses);

}  // namespace terracast::job
