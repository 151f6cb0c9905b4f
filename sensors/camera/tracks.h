#pragma once

#include <cstdint>
#include <vector>

#include "capture/frame.h"
#include "core/log.h"
#include "core/schema.h"
#include "sensors/camera/views.h"
#include "world/ray_query.h"

namespace terracast::sensors {

/// Config `[tracks]`: points followed through a sequence.
struct TrackOptions {
  std::int64_t num_points = 4000;
  void describe(core::SchemaVisitor& visit);
};

/// Points of the ground that many images of a sequence see: hits of rays through random places of
/// images drawn evenly over all frames and cameras. Preferred are points that three images or more
/// see, from directions that differ enough to triangulate them; only where a sequence has too few
/// of those the rest is taken from the others.
/// determinism   a function of the views, the world, the number and the seed: every shard finds the
///               same
/// cost          some 20 rays a point
std::vector<capture::TrackPoint> choose_tracks(const world::RayQuery& query, const ViewTable& views,
                                               std::int64_t num_points, std::uint64_t seed,
                                               const core::Log& log);

}  // namespace terracast::sensors
