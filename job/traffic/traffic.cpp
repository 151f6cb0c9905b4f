#include "job/traffic/traffic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <unordered_set>

#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/semantic_class.h"
#include "job/moving.h"
#include "job/traffic/drive.h"
#include "job/traffic/goer.h"
#include "job/traffic/proposals.h"
#include "tiler/objects/things.h"

namespace terracast::job {
namespace {

using core::ErrorKind;
using core::fail;

/// Points of paths.
constexpr double kVehiclePoints_m = 2.0;
constexpr double kWalkerPoints_m = 1.0;
/// Of the length of what is long, that times the curvature of its way is no more.
constexpr double kMostBend = 0.7;

/// Why somebody is not made.
enum class Unmade { WayEnds, GivenUp, LeavesWorld, TooLong };

/// Why who was proposed is not there.
struct Tally {
  std::int64_t num_proposed = 0;
  std::array<std::int64_t, 4> num_unmade = {};  ///< by Unmade
  std::int64_t num_blocked = 0;
  std::int64_t num_giving_way = 0;
  std::int64_t num_beyond = 0;  ///< of `most`
};

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

struct Made {
  std::unique_ptr<Goer> goer;  ///< nullptr: there is none
  Unmade why_not = Unmade::WayEnds;
};

Made made_on(const Proposal& proposal, const TrafficSite& site, double duration_s,
             const Route& route, const Body& body, const TurnRadii& radii, double spacing_m,
             const DriveStyle& style) {
  if (route.legs.empty())
    return {.goer = nullptr, .why_not = route.is_given_up ? Unmade::GivenUp : Unmade::WayEnds};
  double start_m = proposal.start.along_m;
  std::vector<PathPoint> path = cut_out(lane_path(site.ways, route.legs, radii, spacing_m),
                                        spacing_m, lasts_s(duration_s), start_m);
  if (path.size() < 4) return {.goer = nullptr, .why_not = Unmade::WayEnds};
  auto goer = std::make_unique<Goer>(proposal.start.key, *proposal.options, body,
                                     PathCurve(std::move(path)), style, start_m);
  if (goer->lasts_s() < lasts_s(duration_s)) return {.goer = nullptr, .why_not = Unmade::WayEnds};
  if (!goer->is_inside(site.half_size_m, duration_s))
    return {.goer = nullptr, .why_not = Unmade::LeavesWorld};
  return {.goer = std::move(goer)};
}

Made make_driver(const Proposal& proposal, const TrafficSite& site, double duration_s) {
  const TrafficOptions& options = *proposal.options;
  const Body body = draw_body(proposal, proposal.may_be_long);
  if (body.thing == nullptr) return {.goer = nullptr, .why_not = Unmade::TooLong};
  TurnRadii radii;
  if (options.drives_on_left) std::swap(radii.left_m, radii.right_m);
  Made made = made_on(
      proposal, site, duration_s,
      drive_route(site.ways, proposal.start, proposal.lane, options.speed, options.drives_on_left),
      body, radii, kVehiclePoints_m, {});
  if (!made.goer || body.thing->size_m.x() <= kLong_m ||
      made.goer->sharpest_per_m(duration_s) * body.thing->size_m.x() <= kMostBend)
    return made;
  const Body shorter = draw_body(proposal, false);
  if (shorter.thing == nullptr) return {.goer = nullptr, .why_not = Unmade::TooLong};
  made.goer->take(shorter);
  return made;
}

Made make_walker(const Proposal& proposal, const TrafficSite& site, double duration_s) {
  const Body body = draw_body(proposal, false);
  return made_on(proposal, site, duration_s,
                 walk_route(site.ways, proposal.start, draw_walker(proposal, body)), body,
                 {.right_m = 0.7, .left_m = 0.7}, kWalkerPoints_m,
                 {.lateral_mps2 = 2.0, .accelerate_mps2 = 0.8, .brake_mps2 = 0.8});
}

std::vector<std::unique_ptr<Goer>> make_goers(const std::vector<Proposal>& proposals,
                                              const TrafficSite& site, double duration_s,
                                              Tally& tally) {
  std::vector<Made> all(proposals.size());
  core::parallel_for(static_cast<std::int64_t>(proposals.size()), [&](std::int64_t i) {
    const Proposal& proposal = proposals[static_cast<std::size_t>(i)];
    all[static_cast<std::size_t>(i)] = proposal.options->is_of_people()
                                           ? make_walker(proposal, site, duration_s)
                                           : make_driver(proposal, site, duration_s);
  });
  tally.num_proposed = static_cast<std::int64_t>(all.size());
  std::vector<std::unique_ptr<Goer>> made;
  for (Made& one : all) {
    if (one.goer)
      made.push_back(std::move(one.goer));
    else
      ++tally.num_unmade[static_cast<std::size_t>(one.why_not)];
  }
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

std::string name_of(const Goer& goer) {
  const TrafficOptions& options = goer.options();
  const std::string_view own = options.is_of_people() ? "walker" : "vehicle";
  return fmt::format("{}-{:016x}", options.name.empty() ? own : options.name, goer.key());
}

void tell(std::size_t num, const Tally& tally, const core::Log& log) {
  const auto unmade = [&](Unmade why) { return tally.num_unmade[static_cast<std::size_t>(why)]; };
  const std::string left_out = fmt::format(
      "of {} proposed on ways around, {} have no way that lasts through the sequence ({} more: "
      "none was found soon), {} would leave the world, {} are too long for their lanes or bends, "
      "{} would meet what stands or moves there, {} each other, {} are beyond `most`",
      tally.num_proposed, unmade(Unmade::WayEnds), unmade(Unmade::GivenUp),
      unmade(Unmade::LeavesWorld), unmade(Unmade::TooLong), tally.num_blocked, tally.num_giving_way,
      tally.num_beyond);
  if (num == 0)
    log.warn("traffic: nothing is within reach of the cameras: {}", left_out);
  else
    log.info("traffic: {} within reach of the cameras; {}", num, left_out);
}

bool goes_as(const tiler::ThingInfo& thing, bool is_of_people) {
  using core::SemanticClass;
  constexpr double kLongest_m = 25.0;
  if (thing.stance != tiler::Stance::Stands || thing.size_m.x() > kLongest_m) return false;
  if (is_of_people) return thing.semantic_class == SemanticClass::Person;
  constexpr SemanticClass kOfRoads[] = {SemanticClass::Car, SemanticClass::Van,
                                        SemanticClass::Truck, SemanticClass::Bus};
  return std::find(std::begin(kOfRoads), std::end(kOfRoads), thing.semantic_class) !=
         std::end(kOfRoads);
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
            "Of which built-in things it is made, evenly: cars, vans, trucks and buses, or people; "
            "what is longer than 7 m goes on wide lanes only. Empty: of what is common there.");
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
    if (!goes_as(info, is_of_people()))
      fail(ErrorKind::Config,
           "things of traffic of kind {}: {} is none of these: it takes {} (`terracast list "
           "things`)",
           kind, thing,
           is_of_people() ? "things of class person"
                          : "things of classes car, van, truck and bus, at most 25 m long");
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

std::vector<scene::MovingThing> lay_out_traffic(std::span<const TrafficOptions> options,
                                                std::span<const geo::BodyState> frames,
                                                double duration_s, const TrafficSite& site,
                                                const core::Log& log) {
  Tally tally;
  const std::vector<Proposal> proposals = propose(options, frames, duration_s, site.ways);
  std::vector<std::unique_ptr<Goer>> goers = make_goers(proposals, site, duration_s, tally);
  drop_encounters(goers, site, duration_s, tally);
  keep_near(goers, options, frames, tally);
  MovingThings shapes;
  std::vector<scene::MovingThing> things;
  for (const auto& goer : goers) {
    const Body& body = goer->body();
    scene::MovingThing thing = shapes.of(name_of(*goer), *body.thing, body.variant);
    thing.ride = scene::Ride::Way;
    for (const geo::BodyState& frame : frames) {
      thing.states.push_back(goer->state(frame.time_s));
      thing.states.back()->terms.reach_s = site.reach_s;
      thing.gone_m.push_back(goer->gone_m(frame.time_s));
    }
    things.push_back(std::move(thing));
  }
  tell(things.size(), tally, log);
  return things;
}

}  // namespace terracast::job
