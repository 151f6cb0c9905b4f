#pragma once

#include <cstdint>
#include <vector>

#include "job/traffic/lane_path.h"
#include "job/traffic/track_sides.h"
#include "job/traffic/way_graph.h"

namespace terracast::job {

/// Where someone starts: so far along an arm.
struct Start {
  Arm arm;
  double along_m = 0.0;
  std::uint64_t key = 0;  ///< draws what they choose
  double lasts_s = 0.0;   ///< they are on their way at least so long
};

/// A way on, of arms that follow each other.
struct Route {
  std::vector<Leg> legs;     ///< none: all ways from there end too early, or it was given up
  bool is_given_up = false;  ///< after 400 tries, and 40 for each second
};

/// Of vehicles: a lane of the arm, and what they do at junctions by a draw, mostly straight on; never back, into
/// tunnels or where motor traffic may not go. On several lanes one turns from the one at that side.
/// lane       of the arm, as lane_right_m() counts
/// speed      times what is allowed
Route drive_route(const WayGraph& graph, const Start& start, int lane, double speed, bool on_left);

/// How one walks.
struct Walker {
  double speed_mps = 1.34;
  double aside = 0.0;  ///< -1 … 1, from the middle of where one walks to the right end of it
  int side = 0;  ///< 0: on paths; 1, -1: on the sidewalk to the right, to the left of the road
};
/// Of walkers on paths: any turn by a draw. On sidewalks: round the block, so that no road is crossed.
Route walk_route(const WayGraph& graph, const Start& start, const Walker& walker);

/// Of trains: rather straight on than over a switch, and rather past sidings than into them; on the wrong one of two tracks
/// where there is no other way alone; never back, into tunnels, round sharp bends or to a railway of another kind.
/// lane       the track of the arm, as lane_right_m() counts
/// on_left    trains keep to the left of two tracks
/// most_mps   of the train
Route rail_route(const WayGraph& graph, const TrackSides& sides, const Start& start, int lane,
                 double speed, bool on_left, double most_mps);

bool is_road(world::WayKind kind);
bool is_path(world::WayKind kind);

}  // namespace terracast::job
