#include "job/traffic/traffic.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <unordered_set>

#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "job/moving.h"
#include "job/traffic/drive.h"
#include "job/traffic/routes.h"
#include "tiler/objects/things.h"
#include "tiler/objects/vehicle_mix.h"

namespace terracast::job {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;
using Eigen::Vector3d;
using world::kHeightStep_m;
using world::WayKind;
using world::WayPart;

/// Between two vehicles of a lane: so long at least after the one before, and so much room while they stand.
constexpr double kLeastGap_s = 1.5;
constexpr double kLeastGap_m = 7.0;
constexpr double kLeastWalkerGap_m = 1.5;
/// Nobody starts nearer to the begin of a part, where curves from other parts end.
constexpr double kStart_m = 4.0;
constexpr double kVehiclePoints_m = 2.0;
constexpr double kWalkerPoints_m = 1.0;
/// Ways last longer than what is asked of them, so that nothing ends at the last image.
constexpr double kLonger_s = 1.0;
/// Of the length of what is long, that times the curvature of its way is no more; lanes for it are wider.
constexpr double kMostBend = 0.7;
constexpr double kLong_m = 7.0;
constexpr double kWideLane_m = 2.7;
/// Whoever comes so near to the world's border is left out.
constexpr double kBorder_m = 12.0;
/// Where no deck is: what rides its way looks for none so low.
constexpr double kNoDeck_m = -1e5;

// Mean and deviation of the speeds of walkers: Weidmann, Transporttechnik der Fussgänger (1993).
constexpr double kWalk_mps = 1.34;
constexpr double kWalkDeviation_mps = 0.26;
constexpr double kChildShare = 0.85;
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

/// Of what one is on the way with.
struct Body {
  const tiler::ThingInfo* thing = nullptr;
  int variant = 0;
};

class Goer final : public Traveller {
 public:
  Goer(std::uint64_t key, const TrafficOptions& options, const Body& body, PathCurve curve,
       const DriveStyle& style, double start_m)
      : key_(key),
        options_(&options),
        body_(body),
        curve_(std::move(curve)),
        drive_(curve_, style),
        start_m_(start_m),
        start_s_(drive_.time_s(start_m)) {}

  std::uint64_t key() const override { return key_; }
  const TrafficOptions& options() const { return *options_; }
  const Body& body() const { return body_; }
  void take(const Body& body) { body_ = body; }
  double lasts_s() const { return drive_.duration_s() - start_s_; }
  double gone_m(double time_s) const { return drive_.at(start_s_ + time_s).at_m - start_m_; }

  Footprint at(double time_s) const override {
    const PathCurve::Place place = curve_.at(drive_.at(start_s_ + time_s).at_m);
    return {.at_world = place.at_world,
            .forward = place.tangent,
            .length_m = body_.thing->size_m.x(),
            .width_m = body_.thing->size_m.y(),
            .deck_z_world = place.deck_z_world};
  }

  geo::BodyState state(double time_s) const {
    const Drive::Progress progress = drive_.at(start_s_ + time_s);
    const PathCurve::Place place = curve_.at(progress.at_m);
    const Vector3d forward(place.tangent.x(), place.tangent.y(), 0.0);
    const Vector3d left(-forward.y(), forward.x(), 0.0);
    geo::BodyState state;
    state.time_s = time_s;
    state.world_from_body.translation << place.at_world,
        std::isfinite(place.deck_z_world) ? place.deck_z_world : kNoDeck_m;
    state.world_from_body.rotation =
        Eigen::AngleAxisd(std::atan2(forward.y(), forward.x()), Vector3d::UnitZ());
    state.velocity_world_mps = progress.speed_mps * forward;
    state.acceleration_world_mps2 =
        progress.acceleration_mps2 * forward +
        progress.speed_mps * progress.speed_mps * place.curvature_per_m * left;
    state.angular_velocity_body_radps.z() = progress.speed_mps * place.curvature_per_m;
    return state;
  }

  /// Of the curve, where it is gone along until a time.
  double sharpest_per_m(double until_s) const {
    double sharpest = 0.0;
    const double end_m = drive_.at(start_s_ + until_s).at_m;
    for (double at_m = start_m_; at_m <= end_m; at_m += 0.5)
      sharpest = std::max(sharpest, std::abs(curve_.at(at_m).curvature_per_m));
    return sharpest;
  }
  bool is_inside(double half_size_m, double until_s) const {
    const double end_m = drive_.at(start_s_ + until_s).at_m;
    for (double at_m = start_m_;; at_m = std::min(at_m + 5.0, end_m)) {
      if (curve_.at(at_m).at_world.cwiseAbs().maxCoeff() > half_size_m - kBorder_m) return false;
      if (at_m >= end_m) return true;
    }
  }

 private:
  std::uint64_t key_;
  const TrafficOptions* options_;
  Body body_;
  PathCurve curve_;
  Drive drive_;
  double start_m_;
  double start_s_;
};

/// Someone who may be made, by where they start.
struct Proposal {
  const TrafficOptions* options = nullptr;
  Start start;
  int lane = 0;  ///< of vehicles; of walkers their side
  bool may_be_long = false;
  const tiler::RoadTraffic* road = nullptr;
};

/// Why who was proposed is not there.
struct Tally {
  std::int64_t num_proposed = 0;
  std::int64_t num_ending = 0;  ///< their ways end
  std::int64_t num_blocked = 0;
  std::int64_t num_giving_way = 0;
  std::int64_t num_beyond = 0;  ///< of `most`
};

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

/// Places along a lane, by shifted exponential gaps (Cowan 1975): no gap is shorter than the least.
template <class Visit>
void visit_starts(double length_m, double mean_m, double least_m, std::uint64_t seed,
                  std::uint64_t stream, const Visit& visit) {
  double at_m = mean_m * core::random_unit(seed, stream, 0);
  for (std::uint64_t i = 1; at_m < length_m; ++i) {
    visit(at_m, core::random_bits(seed, stream, 2 * i));
    at_m += least_m - (mean_m - least_m) * std::log1p(-core::random_unit(seed, stream, 2 * i + 1));
  }
}

/// A tenth more than the least: so full a lane can be.
double mean_gap_m(double per_km, double least_m) {
  return std::max(1000.0 / std::max(per_km, 1e-6), 1.1 * least_m);
}

double lasts_s(double duration_s) { return duration_s + kLonger_s; }

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

/// What is needed of a path: from some way before the start, whose bends are still felt, for as long as it takes at least.
/// Parts of one lane are cut at the same places.
/// start_m   along the path; afterwards along its curve
std::vector<PathPoint> cut_out(const std::vector<PathPoint>& path, double spacing_m, double lasts_s,
                               double& start_m) {
  constexpr double kBefore_m = 64.0;
  constexpr double kBeyond_m = 64.0;
  const double from_m = kBefore_m * std::max(std::floor(start_m / kBefore_m) - 1.0, 0.0);
  const auto first = static_cast<std::size_t>(std::lround(from_m / spacing_m));
  auto end = std::min(path.size(), static_cast<std::size_t>((start_m + kBeyond_m) / spacing_m));
  for (double left_s = lasts_s; left_s > 0.0 && end < path.size(); ++end)
    left_s -= spacing_m / path[end].limit_mps;
  start_m -= from_m + spacing_m;  // a curve begins at its second point
  if (first >= end) return {};
  return {path.begin() + static_cast<std::ptrdiff_t>(first),
          path.begin() + static_cast<std::ptrdiff_t>(end)};
}

Body draw_body(const Proposal& proposal, bool may_be_long) {
  const TrafficOptions& options = *proposal.options;
  const std::uint64_t draw = core::random_bits(proposal.start.key, 1, 0);
  if (!options.things.empty()) {
    std::vector<tiler::Chance> chances;
    for (const std::string& thing : options.things)
      chances.push_back({thing, 1.0 / static_cast<double>(options.things.size())});
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

/// nullptr: the way ends too early.
std::unique_ptr<Goer> make_driver(const Proposal& proposal, const TrafficSite& site,
                                  double duration_s) {
  const TrafficOptions& options = *proposal.options;
  const auto legs =
      drive_route(site.ways, proposal.start, proposal.lane, options.speed, options.drives_on_left);
  if (!legs) return nullptr;
  TurnRadii radii;
  if (options.drives_on_left) std::swap(radii.left_m, radii.right_m);
  double start_m = proposal.start.along_m;
  std::vector<PathPoint> path = cut_out(lane_path(site.ways, *legs, radii, kVehiclePoints_m),
                                        kVehiclePoints_m, lasts_s(duration_s), start_m);
  if (path.size() < 4) return nullptr;
  auto goer =
      std::make_unique<Goer>(proposal.start.key, options, draw_body(proposal, proposal.may_be_long),
                             PathCurve(std::move(path)), DriveStyle{}, start_m);
  if (goer->lasts_s() < lasts_s(duration_s) || !goer->is_inside(site.half_size_m, duration_s))
    return nullptr;
  const double length_m = goer->body().thing->size_m.x();
  if (length_m > kLong_m && goer->sharpest_per_m(duration_s) * length_m > kMostBend) {
    if (!options.things.empty()) return nullptr;
    goer->take(draw_body(proposal, false));
  }
  return goer;
}

std::unique_ptr<Goer> make_walker(const Proposal& proposal, const TrafficSite& site,
                                  double duration_s) {
  const TrafficOptions& options = *proposal.options;
  const std::uint64_t key = proposal.start.key;
  const Body body = draw_body(proposal, false);
  double deviation = -1.5;  // the sum of three of [0, 1) has a deviation of a half
  for (std::uint64_t i = 0; i < 3; ++i) deviation += core::random_unit(key, 2, i);
  Walker walker{.speed_mps = options.speed * (kWalk_mps + 2.0 * kWalkDeviation_mps * deviation),
                .aside = core::random_between(-1.0, 1.0, key, 2, 3),
                .side = proposal.lane};
  if (body.thing->name == "child") walker.speed_mps *= kChildShare;
  const auto legs = walk_route(site.ways, proposal.start, walker);
  if (!legs) return nullptr;
  double start_m = proposal.start.along_m;
  std::vector<PathPoint> path =
      cut_out(lane_path(site.ways, *legs, {.right_m = 0.7, .left_m = 0.7}, kWalkerPoints_m),
              kWalkerPoints_m, lasts_s(duration_s), start_m);
  if (path.size() < 4) return nullptr;
  auto goer = std::make_unique<Goer>(
      key, options, body, PathCurve(std::move(path)),
      DriveStyle{.lateral_mps2 = 2.0, .accelerate_mps2 = 0.8, .brake_mps2 = 0.8}, start_m);
  if (goer->lasts_s() < lasts_s(duration_s) || !goer->is_inside(site.half_size_m, duration_s))
    return nullptr;
  return goer;
}

std::vector<Proposal> propose(std::span<const TrafficOptions> options,
                              std::span<const geo::BodyState> frames, double duration_s,
                              const WayGraph& graph) {
  double fastest_kmph = 0.0;
  for (const WayPart& part : graph.parts())
    if (num_lanes(part, true) + num_lanes(part, false) > 0)
      fastest_kmph = std::max(fastest_kmph, speed_limit_kmph(part));
  const Neighbourhood neighbourhood(frames);
  std::vector<Proposal> proposals;
  for (const TrafficOptions& one : options) {
    // Who comes within reach, and who those may meet before.
    const double fastest_mps =
        one.speed *
        (one.is_of_people() ? kWalk_mps + 3.0 * kWalkDeviation_mps : fastest_kmph / 3.6);
    const double reach_m = one.reach_m + 2.0 * fastest_mps * lasts_s(duration_s);
    for (std::uint32_t p = 0; p < graph.parts().size(); ++p) {
      if (!neighbourhood.is_near(graph.parts()[p], reach_m)) continue;
      if (one.is_of_people())
        propose_walkers(one, graph, p, duration_s, proposals);
      else
        propose_vehicles(one, graph, p, duration_s, proposals);
    }
  }
  return proposals;
}

std::vector<std::unique_ptr<Goer>> make_goers(const std::vector<Proposal>& proposals,
                                              const TrafficSite& site, double duration_s,
                                              Tally& tally) {
  std::vector<std::unique_ptr<Goer>> made(proposals.size());
  core::parallel_for(static_cast<std::int64_t>(proposals.size()), [&](std::int64_t i) {
    const Proposal& proposal = proposals[static_cast<std::size_t>(i)];
    made[static_cast<std::size_t>(i)] = proposal.options->is_of_people()
                                            ? make_walker(proposal, site, duration_s)
                                            : make_driver(proposal, site, duration_s);
  });
  tally.num_proposed = static_cast<std::int64_t>(made.size());
  std::erase(made, nullptr);
  tally.num_ending = tally.num_proposed - static_cast<std::int64_t>(made.size());
  std::sort(made.begin(), made.end(),
            [](const auto& a, const auto& b) { return a->key() < b->key(); });
  // Two ways on the same points draw the same.
  made.erase(std::unique(made.begin(), made.end(),
                         [](const auto& a, const auto& b) { return a->key() == b->key(); }),
             made.end());
  return made;
}

void drop_encounters(std::vector<std::unique_ptr<Goer>>& goers, const TrafficSite& site,
                     double duration_s, Tally& tally) {
  std::vector<const Traveller*> travellers;
  for (const auto& goer : goers) travellers.push_back(goer.get());
  const Encounters encounters =
      find_encounters(travellers, site.obstacles, site.standing, duration_s);
  for (std::size_t i = 0; i < goers.size(); ++i) {
    tally.num_blocked += encounters.is_blocked[i];
    tally.num_giving_way += encounters.gives_way[i];
    if (encounters.is_blocked[i] != 0 || encounters.gives_way[i] != 0) goers[i] = nullptr;
  }
  std::erase(goers, nullptr);
}

/// Of each entry's, those that come within reach of the cameras, the nearest of these.
void keep_near(std::vector<std::unique_ptr<Goer>>& goers, std::span<const TrafficOptions> options,
               std::span<const geo::BodyState> frames, Tally& tally) {
  std::map<const TrafficOptions*, std::vector<std::pair<double, std::uint64_t>>> near;
  for (const auto& goer : goers) {
    double nearest_m = 1e300;
    for (const geo::BodyState& frame : frames)
      nearest_m = std::min(
          nearest_m,
          (goer->at(frame.time_s).at_world - frame.world_from_body.translation.head<2>()).norm());
    if (nearest_m <= goer->options().reach_m)
      near[&goer->options()].emplace_back(nearest_m, goer->key());
  }
  std::unordered_set<std::uint64_t> kept;
  for (const TrafficOptions& one : options) {
    auto& all = near[&one];
    std::sort(all.begin(), all.end());
    const auto most = std::min(all.size(), static_cast<std::size_t>(one.most));
    tally.num_beyond += static_cast<std::int64_t>(all.size() - most);
    for (std::size_t i = 0; i < most; ++i) kept.insert(all[i].second);
  }
  std::erase_if(goers, [&](const auto& goer) { return !kept.contains(goer->key()); });
}

/// Things of one kind and colour share their shapes.
class Shapes {
 public:
  render::MovingThing of(const std::string& name, const Body& body) {
    const auto [found, is_new] = known_.try_emplace({body.thing, body.variant});
    if (is_new) found->second = moving_thing(name, *body.thing, body.variant);
    render::MovingThing thing = found->second;
    thing.name = name;
    thing.ride = render::Ride::Way;
    return thing;
  }

 private:
  std::map<std::pair<const tiler::ThingInfo*, int>, render::MovingThing> known_;
};

std::string name_of(const Goer& goer) {
  const TrafficOptions& options = goer.options();
  const std::string_view own = options.is_of_people() ? "walker" : "vehicle";
  return fmt::format("{}-{:016x}", options.name.empty() ? own : options.name, goer.key());
}

void tell(std::size_t num, const Tally& tally, const core::Log& log) {
  const std::string left_out = fmt::format(
      "of {} proposed on ways around, {} have no way that lasts through the sequence, {} would "
      "meet "
      "what stands or moves there, {} each other, {} are beyond `most`",
      tally.num_proposed, tally.num_ending, tally.num_blocked, tally.num_giving_way,
      tally.num_beyond);
  if (num == 0)
    log.warn("traffic: nothing is within reach of the cameras: {}", left_out);
  else
    log.info("traffic: {} within reach of the cameras; {}", num, left_out);
}

}  // namespace

void TrafficOptions::describe(core::SchemaVisitor& visit) {
  visit.key("kind", kind,
            "vehicles: on roads. people: on paths and sidewalks. Both keep to the world's own.",
            core::one_of({"people", "vehicles"}));
  visit.key("name", name, "With what the names of its bodies begin; empty: vehicle, walker.");
  visit.key("seed", seed, "Another seed is other traffic. Entries of one kind need different ones.",
            core::between(0.0, 9e15));
  visit.key("amount", amount,
            "How much there is, of what each class of ways has by day (vehicles: 10 on a lane's km "
            "of a motorway, 1.2 of a residential street; people: 12 on a km of a main street's "
            "sidewalk).",
            core::between(0.01, 20.0));
  visit.key("speed", speed, "Times the speed that is allowed, of people that at which they walk.",
            core::between(0.1, 2.0));
  visit.key("things", things,
            "Of which built-in things it is made, evenly; empty: of what is common there.");
  visit.key("drives_on_left", drives_on_left, "Vehicles keep to the left.");
  visit.key("reach_m", reach_m,
            "Who comes so near to a camera's place, on the map, is there through the whole "
            "sequence.",
            core::between(10.0, 5000.0));
  visit.key("most", most, "No more in a sequence: those that come nearest.",
            core::between(1.0, 5000.0));
}

void TrafficOptions::validate() const {
  constexpr std::size_t kLongestName = 40;
  if (!name.empty() && (!capture::is_safe_name(name) || name.size() > kLongestName))
    fail(ErrorKind::Config, "name = \"{}\" of traffic: it takes 1 to {} letters, digits, _ or -",
         name, kLongestName);
  for (const std::string& thing : things) {
    const tiler::ThingInfo& info = thing_called(thing);
    constexpr double kLongest_m = 25.0;
    if (info.stance != tiler::Stance::Stands || info.size_m.x() > kLongest_m)
      fail(
          ErrorKind::Config,
          "things of traffic: {} does not go on roads or paths: it takes what stands on the ground "
          "and is at most {} m long",
          thing, kLongest_m);
  }
}

void check_traffic(std::span<const TrafficOptions> traffic) {
  std::set<std::pair<std::string, std::int64_t>> known;
  for (const TrafficOptions& one : traffic)
    if (!known.emplace(one.kind, one.seed).second)
      fail(ErrorKind::Config,
           "two [[traffic]] of kind {} have seed = {}, and would draw the same; give each its own",
           one.kind, one.seed);
}

std::vector<render::MovingThing> lay_out_traffic(std::span<const TrafficOptions> options,
                                                 std::span<const geo::BodyState> frames,
                                                 double duration_s, const TrafficSite& site,
                                                 const core::Log& log) {
  Tally tally;
  const std::vector<Proposal> proposals = propose(options, frames, duration_s, site.ways);
  std::vector<std::unique_ptr<Goer>> goers = make_goers(proposals, site, duration_s, tally);
  drop_encounters(goers, site, duration_s, tally);
  keep_near(goers, options, frames, tally);
  Shapes shapes;
  std::vector<render::MovingThing> things;
  for (const auto& goer : goers) {
    render::MovingThing thing = shapes.of(name_of(*goer), goer->body());
    for (const geo::BodyState& frame : frames) {
      thing.states.push_back(goer->state(frame.time_s));
      thing.gone_m.push_back(goer->gone_m(frame.time_s));
    }
    things.push_back(std::move(thing));
  }
  tell(things.size(), tally, log);
  return things;
}

}  // namespace terracast::job
