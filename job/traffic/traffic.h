#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/log.h"
#include "core/schema.h"
#include "geo/trajectory.h"
#include "job/traffic/encounters.h"
#include "job/traffic/way_graph.h"
#include "scene/moving/moving_bodies.h"

namespace terracast::job {

/// Config `[[traffic]]`: what goes along the world's own roads, paths and railways, and over its water, through every
/// sequence.
struct TrafficOptions {
  std::string kind = "vehicles";
  std::string name;  ///< "": the kind's
  std::int64_t seed = 1;
  double amount = 1.0;
  double speed = 1.0;
  std::vector<std::string> things;
  bool drives_on_left = false;
  double reach_m = 300.0;
  std::int64_t most = 100;

  bool is_of_people() const { return kind == "people"; }
  bool is_of_trains() const { return kind == "trains"; }
  bool is_of_ships() const { return kind == "ships"; }
  void describe(core::SchemaVisitor& visit);
  /// throws Config: no such thing, an amount of nothing, a name that is none
  void validate() const;
};

/// throws Config: two entries that would draw the same
void check_traffic(std::span<const TrafficOptions> traffic);

/// Where traffic is made.
struct TrafficSite {
  const WayGraph& ways;
  double half_size_m = 0.0;         ///< of the world's square
  std::vector<Obstacle> obstacles;  ///< what else moves on the ground
  std::vector<Footprint> standing;  ///< vehicles and lamps of the world
  double reach_s = 0.0;  ///< for so long before and after a frame's time things are looked at
};

/// Everything that goes along the world's ways within reach of a sequence's cameras, in no order but its own: the
/// same for the same ways, whatever their order.
///
/// Who is made is there from before the first frame until after `duration_s`, and keeps its place on the ways all
/// that time: nothing comes or goes in view. It does not depend on the cameras:
/// sequences of one duration and with the same obstacles see the same traffic at the same times, but that of each
/// entry the `most` nearest to a sequence's own cameras are kept, which may be others than in another one.
/// options      none of ships (lay_out_ships)
/// site         within reach_of_traffic() of the frames; what is farther counts for nobody
/// frames       the sequence's
/// duration_s   of the longest of the sequences that see each other
std::vector<scene::MovingThing> lay_out_traffic(std::span<const TrafficOptions> options,
                                                std::span<const geo::BodyState> frames,
                                                double duration_s, const TrafficSite& site,
                                                const core::Log& log);

}  // namespace terracast::job
