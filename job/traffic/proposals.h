#pragma once

#include <span>
#include <vector>

#include "job/traffic/goer.h"
#include "job/traffic/routes.h"
#include "job/traffic/traffic.h"
#include "job/traffic/train_rows.h"
#include "job/traffic/way_graph.h"
#include "tiler/objects/vehicle_mix.h"

namespace terracast::job {

/// Someone who may be made, by where they start.
struct Proposal {
  const TrafficOptions* options = nullptr;
  Start start;
  int lane = 0;  ///< of vehicles; of walkers their side
  bool may_be_long = false;
  const tiler::RoadTraffic* road = nullptr;
};

/// A train that may be made, by where its end is.
struct TrainProposal {
  const TrafficOptions* options = nullptr;
  Start start;
  int lane = 0;  ///< the track
  const RailKind* rail = nullptr;
};

/// How far from the cameras one looks for whoever may be seen from them, may be in the way of these, or in the way of
/// those. All who go begin there, and all that is in their way is there.
struct Reach {
  double of_vehicles_m = 0.0;
  double of_people_m = 0.0;
  double of_trains_m = 0.0;
  double of_all_m = 0.0;
};
Reach reach_of_traffic(std::span<const TrafficOptions> options, double duration_s,
                       const WayGraph& graph);

/// All that may come within reach of a sequence's cameras, and those whom these may meet before. On each lane as many to
/// the km as is asked, whatever the lengths of its parts, but on the first 4 m of each.
std::vector<Proposal> propose(std::span<const TrafficOptions> options,
                              std::span<const geo::BodyState> frames, double duration_s,
                              const WayGraph& graph);

/// As propose(), of trains, on tracks that are no sidings.
std::vector<TrainProposal> propose_trains(std::span<const TrafficOptions> options,
                                          std::span<const geo::BodyState> frames, double duration_s,
                                          const WayGraph& graph);

/// What is longer takes wide lanes and gentle bends.
inline constexpr double kLong_m = 7.0;
/// Ways last longer than what is asked of them, so that nothing ends at the last image.
double lasts_s(double duration_s);
/// may_be_long   of an entry's own things one that is short is taken where there is one; a bus or a truck, as the road has them
Body draw_body(const Proposal& proposal, bool may_be_long);
Walker draw_walker(const Proposal& proposal, const Body& body);

}  // namespace terracast::job
