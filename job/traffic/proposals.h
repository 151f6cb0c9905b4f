#pragma once

#include <span>
#include <vector>

#include "job/traffic/goer.h"
#include "job/traffic/routes.h"
#include "job/traffic/traffic.h"
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

/// All that may come within reach of a sequence's cameras, and those whom these may meet before.
std::vector<Proposal> propose(std::span<const TrafficOptions> options,
                              std::span<const geo::BodyState> frames, double duration_s,
                              const WayGraph& graph);

/// Ways last longer than what is asked of them, so that nothing ends at the last image.
double lasts_s(double duration_s);
/// may_be_long   a bus or a truck, as the road has them
Body draw_body(const Proposal& proposal, bool may_be_long);
Walker draw_walker(const Proposal& proposal, const Body& body);

}  // namespace terracast::job
