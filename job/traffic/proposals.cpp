#include "job/traffic/proposals.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "job/traffic/track_sides.h"

namespace terracast::job {
namespace {

using Eigen::Vector2d;
using world::kHeightStep_m;
using world::WayKind;
using world::WayPart;

/// Between two vehicles of a lane, beside kLeastGap_s.
constexpr double kLeastGap_m = 7.0;
constexpr double kLeastWalkerGap_m = 1.5;
/// Nobody starts nearer to the begin of a part, where curves from other parts end.
constexpr double kStart_m = 4.0;
/// Lanes for what is long are wider.
constexpr double kWideLane_m = 2.7;
constexpr double kLonger_s = kLeastGap_s + 0.5;
/// Of all trains, so that all that others keep away from are looked at.
constexpr double kMostHeadway_s = 120.0;
constexpr double kLongestTrain_m = 400.0;
/// Who is farther from another, and not behind it, does not meet it.
constexpr double kMeet_m = 30.0;

// Mean and deviation of the speeds of walkers: Weidmann, Transporttechnik der Fussgänger (1993).
constexpr double kWalk_mps = 1.34;
constexpr double kWalkDeviation_mps = 0.26;
constexpr double kChildShare = 0.85;
/// People keep to the right of where they walk, as they meet others.
constexpr double kLeastAside = 0.3;
constexpr tiler::Chance kPeople[] = {{"person", 0.88}, {"child", 0.12}};
/// People on a kilometre, of a path or of one sidewalk.
struct Walkers {
  WayKind kind;
  double per_km;
};
constexpr Walkers kWalkers[] = {
    {WayKind::Primary, 12.0},     {WayKind::Secondary, 12.0},  {WayKind::Tertiary, 10.0},
    {WayKind::Unclassified, 4.0}, {WayKind::Residential, 6.0}, {WayKind::LivingStreet, 8.0},
    {WayKind::Track, 0.4},        {WayKind::Pedestrian, 25.0}, {WayKind::Footway, 6.0},
    {WayKind::Cycleway, 1.0},     {WayKind::Path, 1.0},        {WayKind::Bridleway, 0.2},
    {WayKind::Steps, 3.0}};

std::uint64_t key_of(const WayPart& part) {
  std::uint64_t key = part.feature;
  for (const Eigen::Vector3i& end : {part.points_steps.front(), part.points_steps.back()})
    for (const int value : {end.x(), end.y()})
      key = core::stream_of(key, static_cast<std::uint32_t>(value));
  return key;
}

/// Where the cameras are, on the map.
class Neighbourhood {
 public:
  Neighbourhood(std::span<const geo::BodyState> frames) {
    constexpr double kApart_m = 5.0;
    for (const geo::BodyState& frame : frames) {
      const Vector2d at = frame.world_from_body.translation.head<2>();
      if (places_.empty() || (at - places_.back()).norm() > kApart_m) places_.push_back(at);
    }
  }
  bool is_near(const WayPart& part, double reach_m) const {
    Vector2d low = part.at_world(0), high = low;
    for (std::size_t i = 1; i < part.points_steps.size(); ++i) {
      low = low.cwiseMin(part.at_world(i));
      high = high.cwiseMax(part.at_world(i));
    }
    return std::any_of(places_.begin(), places_.end(), [&](const Vector2d& at) {
      return (at - at.cwiseMax(low).cwiseMin(high)).norm() <= reach_m;
    });
  }

 private:
  std::vector<Vector2d> places_;
};

/// Places along a lane, by shifted exponential gaps (Cowan 1975): no gap is shorter than the least. The first is what is
/// left of a gap in which one begins anywhere, so that everywhere as many are to be expected.
template <class Visit>
void visit_starts(double length_m, double mean_m, double least_m, std::uint64_t seed,
                  std::uint64_t stream, const Visit& visit) {
  const auto beyond_m = [&](std::uint64_t index) {
    return -(mean_m - least_m) * std::log1p(-core::random_unit(seed, stream, index));
  };
  const double share = core::random_unit(seed, stream, 0);
  double at_m = mean_m * share;
  if (at_m >= least_m) at_m = least_m + beyond_m(1);
  for (std::uint64_t i = 1; at_m < length_m; ++i) {
    visit(at_m, core::random_bits(seed, stream, 2 * i));
    at_m += least_m + beyond_m(2 * i + 1);
  }
}

/// A tenth more than the least: so full a lane can be.
double mean_gap_m(double per_km, double least_m) {
  return std::max(1000.0 / std::max(per_km, 1e-6), 1.1 * least_m);
}

void propose_vehicles(const TrafficOptions& options, const WayGraph& graph, std::uint32_t p,
                      double duration_s, std::vector<Proposal>& proposals) {
  const WayPart& part = graph.parts()[p];
  const auto roads = tiler::road_traffic();
  const auto road = std::find_if(roads.begin(), roads.end(), [&](const tiler::RoadTraffic& one) {
    return one.kind == part.kind;
  });
  if (road == roads.end() || part.is_tunnel) return;
  const double width_m =
      (part.lanes_left_steps - part.lanes_right_steps) * kHeightStep_m / part.num_lanes;
  const double least_m = kLeastGap_m + kLeastGap_s * options.speed * speed_limit_kmph(part) / 3.6;
  for (const bool is_forward : {true, false})
    for (int lane = 0; lane < num_lanes(part, is_forward); ++lane)
      visit_starts(graph.length_m(p), mean_gap_m(options.amount * road->per_lane_km, least_m),
                   least_m, static_cast<std::uint64_t>(options.seed),
                   core::stream_of(key_of(part), static_cast<std::uint64_t>(2 * lane + is_forward)),
                   [&](double at_m, std::uint64_t key) {
                     if (at_m < kStart_m) return;
                     proposals.push_back({.options = &options,
                                          .start = {.arm = {p, is_forward},
                                                    .along_m = at_m,
                                                    .key = key,
                                                    .lasts_s = lasts_s(duration_s)},
                                          .lane = lane,
                                          .may_be_long = lane == 0 && width_m >= kWideLane_m,
                                          .road = &*road});
                   });
}

/// On a sidewalk nobody starts where it is cut by another road's carriageway.
double first_start_m(const WayGraph& graph, const Arm& arm) {
  double first_m = kStart_m;
  if (!is_road(graph.part(arm).kind)) return first_m;
  for (const Arm& other : graph.after({arm.part, !arm.is_forward}))
    if (other.part != arm.part)
      first_m = std::max(first_m, 2.0 + kHeightStep_m * (graph.part(other).half_width_steps +
                                                         graph.part(other).sidewalk_steps));
  return first_m;
}

void propose_walkers(const TrafficOptions& options, const WayGraph& graph, std::uint32_t p,
                     double duration_s, std::vector<Proposal>& proposals) {
  const WayPart& part = graph.parts()[p];
  const auto walkers = std::find_if(std::begin(kWalkers), std::end(kWalkers),
                                    [&](const Walkers& one) { return one.kind == part.kind; });
  if (walkers == std::end(kWalkers) || part.is_tunnel) return;
  if (is_road(part.kind) && part.sidewalk_steps == 0) return;
  // Half of them each way; on sidewalks on both sides.
  const double mean_m = mean_gap_m(0.5 * options.amount * walkers->per_km, kLeastWalkerGap_m);
  for (const bool is_forward : {true, false})
    for (const int side : is_road(part.kind) ? std::vector{1, -1} : std::vector{0})
      visit_starts(graph.length_m(p), mean_m, kLeastWalkerGap_m,
                   static_cast<std::uint64_t>(options.seed),
                   core::stream_of(key_of(part),
                                   static_cast<std::uint64_t>(0x100 + 2 * (side + 1) + is_forward)),
                   [&](double at_m, std::uint64_t key) {
                     if (at_m < first_start_m(graph, {p, is_forward})) return;
                     proposals.push_back({.options = &options,
                                          .start = {.arm = {p, is_forward},
                                                    .along_m = at_m,
                                                    .key = key,
                                                    .lasts_s = lasts_s(duration_s)},
                                          .lane = side});
                   });
}

/// like       all but its start and its track
/// length_m   that trains have at most
void propose_on_track(const TrainProposal& like, double length_m, const WayGraph& graph,
                      const TrackSides& sides, std::uint32_t p, double duration_s,
                      std::vector<TrainProposal>& proposals) {
  const TrafficOptions& options = *like.options;
  const WayPart& part = graph.parts()[p];
  if (part.is_tunnel || part.is_siding) return;
  const double least_m =
      length_m + like.rail->headway_s * options.speed * speed_limit_kmph(part) / 3.6;
  // Of a track that trains go both ways on, half of them each way.
  const bool is_shared = part.num_lanes == 1 && sides.goes({p, true}) && sides.goes({p, false});
  const double per_km = (is_shared ? 0.5 : 1.0) * options.amount * like.rail->per_track_km;
  for (const bool is_forward : {true, false}) {
    if (!sides.goes({p, is_forward})) continue;
    for (int lane = 0; lane < num_lanes(part, is_forward); ++lane)
      visit_starts(
          graph.length_m(p), mean_gap_m(per_km, least_m), least_m,
          static_cast<std::uint64_t>(options.seed),
          core::stream_of(key_of(part), static_cast<std::uint64_t>(0x200 + 2 * lane + is_forward)),
          [&](double at_m, std::uint64_t key) {
            if (at_m < kStart_m) return;
            TrainProposal proposal = like;
            proposal.start = {.arm = {p, is_forward},
                              .along_m = at_m,
                              .key = key,
                              .lasts_s = lasts_s(duration_s)};
            proposal.lane = lane;
            proposals.push_back(proposal);
          });
  }
}

}  // namespace

double lasts_s(double duration_s) { return duration_s + kLonger_s; }

Body draw_body(const Proposal& proposal, bool may_be_long) {
  const TrafficOptions& options = *proposal.options;
  const std::uint64_t draw = core::random_bits(proposal.start.key, 1, 0);
  if (!options.things.empty()) {
    std::vector<std::string> fit;
    for (const std::string& thing : options.things)
      if (may_be_long || tiler::find_thing(thing)->size_m.x() <= kLong_m) fit.push_back(thing);
    if (fit.empty()) return {};
    std::vector<tiler::Chance> chances;
    for (const std::string& thing : fit)
      chances.push_back({thing, 1.0 / static_cast<double>(fit.size())});
    const tiler::DrawnThing drawn = tiler::draw_thing(chances, draw);
    return {drawn.thing, drawn.variant};
  }
  if (options.is_of_people()) {
    const tiler::DrawnThing drawn = tiler::draw_thing(kPeople, draw);
    return {drawn.thing, drawn.variant};
  }
  const bool is_heavy =
      may_be_long && core::random_unit(proposal.start.key, 1, 1) < proposal.road->trucks;
  const tiler::DrawnThing drawn =
      tiler::draw_thing(tiler::vehicles_on(*proposal.road, is_heavy), draw);
  return {drawn.thing, drawn.variant};
}

Walker draw_walker(const Proposal& proposal, const Body& body) {
  const std::uint64_t key = proposal.start.key;
  double deviation = -1.5;  // the sum of three of [0, 1) has a deviation of a half
  for (std::uint64_t i = 0; i < 3; ++i) deviation += core::random_unit(key, 2, i);
  Walker walker{
      .speed_mps = proposal.options->speed * (kWalk_mps + 2.0 * kWalkDeviation_mps * deviation),
      .aside = core::random_between(kLeastAside, 1.0, key, 2, 3),
      .side = proposal.lane};
  if (body.thing->name == "child") walker.speed_mps *= kChildShare;
  return walker;
}

Reach reach_of_traffic(std::span<const TrafficOptions> options, double duration_s,
                       const WayGraph& graph) {
  double fastest_kmph = 0.0, fastest_rail_kmph = 0.0;
  for (const WayPart& part : graph.parts())
    if (num_lanes(part, true) + num_lanes(part, false) > 0) {
      double& fastest = world::is_railway(part.kind) ? fastest_rail_kmph : fastest_kmph;
      fastest = std::max(fastest, speed_limit_kmph(part));
    }
  double seen_m = 0.0, drive_mps = 0.0, walk_mps = 0.0, rail_mps = 0.0;
  for (const TrafficOptions& one : options) {
    seen_m = std::max(seen_m, one.reach_m);
    if (one.is_of_people())
      walk_mps = std::max(walk_mps, one.speed * (kWalk_mps + 3.0 * kWalkDeviation_mps));
    else if (one.is_of_trains())
      rail_mps = std::max(rail_mps, one.speed * fastest_rail_kmph / 3.6);
    else
      drive_mps = std::max(drive_mps, one.speed * fastest_kmph / 3.6);
  }
  const double fastest_mps = std::max({drive_mps, walk_mps, rail_mps});
  // Where somebody who is seen may have been, and what is in the way there.
  const double meets_m =
      seen_m + fastest_mps * lasts_s(duration_s) + fastest_mps * kLeastGap_s + kMeet_m;
  return {
      .of_vehicles_m = meets_m + drive_mps * lasts_s(duration_s),
      .of_people_m = meets_m + walk_mps * lasts_s(duration_s),
      // A train that is seen, one that it meets, and one that decides whether that one is there: each to its end.
      .of_trains_m =
          meets_m + rail_mps * (lasts_s(duration_s) + kMostHeadway_s) + 3.0 * kLongestTrain_m,
      .of_all_m = meets_m + fastest_mps * lasts_s(duration_s) + kMeet_m +
                  (rail_mps > 0.0 ? 2.0 * kLongestTrain_m : 0.0)};
}

std::vector<Proposal> propose(std::span<const TrafficOptions> options,
                              std::span<const geo::BodyState> frames, double duration_s,
                              const WayGraph& graph) {
  const Reach reach = reach_of_traffic(options, duration_s, graph);
  const Neighbourhood neighbourhood(frames);
  std::vector<Proposal> proposals;
  for (const TrafficOptions& one : options)
    for (std::uint32_t p = 0; p < graph.parts().size() && !one.is_of_trains(); ++p) {
      const double reach_m = one.is_of_people() ? reach.of_people_m : reach.of_vehicles_m;
      if (!neighbourhood.is_near(graph.parts()[p], reach_m)) continue;
      if (one.is_of_people())
        propose_walkers(one, graph, p, duration_s, proposals);
      else
        propose_vehicles(one, graph, p, duration_s, proposals);
    }
  return proposals;
}

std::vector<TrainProposal> propose_trains(std::span<const TrafficOptions> options,
                                          std::span<const geo::BodyState> frames, double duration_s,
                                          const WayGraph& graph) {
  const double reach_m = reach_of_traffic(options, duration_s, graph).of_trains_m;
  const Neighbourhood neighbourhood(frames);
  std::vector<TrainProposal> proposals;
  for (const TrafficOptions& one : options) {
    if (!one.is_of_trains()) continue;
    const TrackSides sides(graph, one.drives_on_left);
    for (const RailKind& rail : rail_kinds()) {
      const std::vector<TrainRow> rows = rows_on(rail.kind, one.things);
      if (rows.empty()) continue;
      for (std::uint32_t p = 0; p < graph.parts().size(); ++p)
        if (graph.parts()[p].kind == rail.kind && neighbourhood.is_near(graph.parts()[p], reach_m))
          propose_on_track({.options = &one, .start = {}, .rail = &rail}, longest_m(rows), graph,
                           sides, p, duration_s, proposals);
    }
  }
  return proposals;
}

}  // namespace terracast::job
