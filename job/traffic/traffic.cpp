#include "job/traffic/traffic.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <set>

#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/semantic_class.h"
#include "job/moving.h"
#include "job/traffic/drive.h"
#include "job/traffic/goer.h"
#include "job/traffic/near.h"
#include "job/traffic/proposals.h"
#include "job/traffic/ship_kinds.h"
#include "job/traffic/tally.h"
#include "job/traffic/trains.h"
#include "tiler/objects/gait.h"
#include "tiler/objects/things.h"

namespace terracast::job {
namespace {

using core::ErrorKind;
using core::fail;

/// Points of paths.
constexpr double kVehiclePoints_m = 2.0;
constexpr double kWalkerPoints_m = 1.0;
/// From the middle of one rail's head to the other's.
constexpr double kRails_m = 1.507;
/// Of the length of what is long, that times the curvature of its way is no more.
constexpr double kMostBend = 0.7;

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
                                        spacing_m, lasts_s(duration_s), 0.0, start_m);
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
  tally.num_proposed += static_cast<std::int64_t>(all.size());
  std::vector<std::unique_ptr<Goer>> made;
  for (Made& one : all) {
    if (one.goer)
      made.push_back(std::move(one.goer));
    else
      tally.add(one.why_not);
  }
  std::sort(made.begin(), made.end(),
            [](const auto& a, const auto& b) { return a->key() < b->key(); });
  // Two ways on the same points draw the same.
  made.erase(std::unique(made.begin(), made.end(),
                         [](const auto& a, const auto& b) { return a->key() == b->key(); }),
             made.end());
  return made;
}

/// All that goes through a sequence.
struct Going {
  std::vector<std::unique_ptr<Goer>> goers;
  std::vector<std::unique_ptr<Train>> trains;
};

void drop_encounters(Going& going, const TrafficSite& site, double duration_s, Tally& tally) {
  std::vector<const Traveller*> travellers;
  for (const auto& goer : going.goers) travellers.push_back(goer.get());
  for (const auto& train : going.trains)
    for (const TrainCar& car : train->cars()) travellers.push_back(&car);
  const Encounters encounters =
      find_encounters(travellers, site.obstacles, site.standing, duration_s);
  // One that has several cars is out with any of them.
  std::size_t at = 0;
  const auto is_out = [&](std::size_t num_cars) {
    bool is_blocked = false, gives_way = false;
    for (const std::size_t end = at + num_cars; at < end; ++at) {
      is_blocked = is_blocked || encounters.is_blocked[at] != 0;
      gives_way = gives_way || encounters.gives_way[at] != 0;
    }
    tally.num_blocked += is_blocked ? 1 : 0;
    tally.num_giving_way += gives_way ? 1 : 0;
    return is_blocked || gives_way;
  };
  for (auto& goer : going.goers)
    if (is_out(1)) goer = nullptr;
  for (auto& train : going.trains)
    if (is_out(train->cars().size())) train = nullptr;
  std::erase(going.goers, nullptr);
  std::erase(going.trains, nullptr);
}

/// Gives someone on foot the steps of their pace, which begin anywhere.
void walk(const Goer& goer, scene::MovingThing& thing) {
  const double step_m = tiler::step_length_m(goer.body().thing->size_m.z(), goer.pace_mps());
  const double phase_rad = 2.0 * std::numbers::pi * core::random_unit(goer.key(), 0x10005, 0);
  for (scene::TurningPart& part : thing.parts) {
    // Legs and arms swing as far as the steps are long.
    part.swing_rad *= step_m * part.per_metre_rad / std::numbers::pi;
    part.per_metre_rad = std::numbers::pi / step_m;
    part.phase_rad += phase_rad;
  }
}

std::string name_of(const TrafficOptions& options, std::uint64_t key) {
  const std::string_view own = options.is_of_people()   ? "walker"
                               : options.is_of_trains() ? "train"
                                                        : "vehicle";
  return fmt::format("{}-{:016x}", options.name.empty() ? own : options.name, key);
}

/// frames   of the sequence
scene::MovingThing thing_of(const Goer& goer, std::span<const geo::BodyState> frames,
                            double reach_s, MovingThings& shapes) {
  const Body& body = goer.body();
  scene::MovingThing thing =
      shapes.of(name_of(goer.options(), goer.key()), *body.thing, body.variant);
  thing.ride = scene::Ride::Way;
  if (goer.options().is_of_people()) walk(goer, thing);
  for (const geo::BodyState& frame : frames) {
    thing.states.push_back(goer.state(frame.time_s));
    thing.states.back()->terms.reach_s = reach_s;
    thing.gone_m.push_back(goer.gone_m(frame.time_s));
  }
  return thing;
}

/// number   of the car, from 1 at its train's head
scene::MovingThing thing_of(const Train& train, const TrainCar& car, std::size_t number,
                            std::span<const geo::BodyState> frames, double reach_s,
                            MovingThings& shapes) {
  const Body& body = car.body();
  scene::MovingThing thing =
      shapes.of(fmt::format("{}-{}", name_of(train.options(), train.key()), number), *body.thing,
                body.variant);
  thing.ride = scene::Ride::Rails;
  thing.footing_m = {body.thing->pivots_m, kRails_m};
  for (const geo::BodyState& frame : frames) {
    thing.states.push_back(car.state(frame.time_s));
    thing.states.back()->terms.reach_s = reach_s;
    thing.gone_m.push_back(train.gone_m(frame.time_s));
  }
  return thing;
}

void tell(std::size_t num, const Tally& tally, const core::Log& log) {
  const std::string left_out = fmt::format(
      "of {} proposed on ways around, {} have no way that lasts through the sequence ({} more: "
      "none was found soon), {} would leave the world, {} are too long for their lanes or bends, "
      "{} would meet what stands or moves there, {} each other, {} are beyond `most`",
      tally.num_proposed, tally.of(Unmade::WayEnds), tally.of(Unmade::GivenUp),
      tally.of(Unmade::LeavesWorld), tally.of(Unmade::TooLong), tally.num_blocked,
      tally.num_giving_way, tally.num_beyond);
  if (num == 0)
    log.warn("traffic: nothing is within reach of the cameras: {}", left_out);
  else
    log.info("traffic: {} within reach of the cameras; {}", num, left_out);
}

bool goes_as(const tiler::ThingInfo& thing, const TrafficOptions& options) {
  using core::SemanticClass;
  constexpr double kLongest_m = 25.0;
  if (options.is_of_trains()) return thing.semantic_class == SemanticClass::Train;
  if (options.is_of_ships())
    return std::any_of(ship_kinds().begin(), ship_kinds().end(),
                       [&](const ShipKind& kind) { return kind.thing == thing.name; });
  if (thing.stance != tiler::Stance::Stands || thing.size_m.x() > kLongest_m) return false;
  if (options.is_of_people()) return thing.semantic_class == SemanticClass::Person;
  constexpr SemanticClass kOfRoads[] = {SemanticClass::Car, SemanticClass::Van,
                                        SemanticClass::Truck, SemanticClass::Bus};
  return std::find(std::begin(kOfRoads), std::end(kOfRoads), thing.semantic_class) !=
         std::end(kOfRoads);
}

/// Whether there is a kind of train of these things, or of any where there are none.
bool makes_trains(std::span<const std::string> things) {
  return std::any_of(rail_kinds().begin(), rail_kinds().end(),
                     [&](const RailKind& rail) { return !rows_on(rail.kind, things).empty(); });
}

}  // namespace

void TrafficOptions::describe(core::SchemaVisitor& visit) {
  visit.key("kind", kind,
            "vehicles: on roads. people: on paths and sidewalks. trains: on railways, trams among "
            "them. All keep to the world's own. ships: boats too, on open water, clear of shores.",
            core::one_of({"people", "ships", "trains", "vehicles"}));
  visit.key("name", name,
            "With what the names of its bodies begin; empty: vehicle, walker, train, ship.");
  visit.key("seed", seed, "Another seed is other traffic. Entries of one kind need different ones.",
            core::between(0.0, 9e15));
  visit.key(
      "amount", amount,
      "How much there is, of what each class of ways has by day (vehicles: 10 on a lane's km "
      "of a motorway, 1.2 of a residential street; people: 12 on a km of a main street's "
      "sidewalk; trains: 0.05 on a track's km of a railway, 0.4 of a tramway; ships: 0.5 on a "
      "square km of open water).",
      core::between(0.01, 20.0));
  visit.key("speed", speed,
            "Times the speed that is allowed, of people, boats and ships that at which they go.",
            core::between(0.1, 2.0));
  visit.key("things", things,
            "Of which built-in things it is made, evenly: cars, vans, trucks and buses, or people; "
            "what is longer than 7 m goes on wide lanes only. Of trains: only those whose cars are "
            "all among these; of ships: those, by their shares. Empty: of what is common there.");
  visit.key("drives_on_left", drives_on_left,
            "Vehicles keep to the left, and trains to the left of two tracks.");
  visit.key("reach_m", reach_m,
            "Who comes so near to a camera's place, on the map, is there through the whole "
            "sequence.",
            core::between(10.0, 5000.0));
  visit.key("most", most,
            "No more in a sequence, of trains with all their cars: those that come nearest.",
            core::between(1.0, 5000.0));
}

void TrafficOptions::validate() const {
  // Behind it come a key, and of trains numbers of cars.
  const std::size_t longest_name = is_of_trains() ? 36 : 40;
  if (!name.empty() && (!capture::is_safe_name(name) || name.size() > longest_name))
    fail(ErrorKind::Config, "name = \"{}\" of traffic: it takes 1 to {} letters, digits, _ or -",
         name, longest_name);
  for (const std::string& thing : things) {
    const tiler::ThingInfo& info = thing_called(thing);
    if (!goes_as(info, *this))
      fail(ErrorKind::Config,
           "things of traffic of kind {}: {} is none of these: it takes {} (`terracast list "
           "things`)",
           kind, thing,
           is_of_people()   ? "things of class person"
           : is_of_trains() ? "things of class train"
           : is_of_ships()  ? fmt::format("{}", fmt::join(ship_names(), ", "))
                            : "things of classes car, van, truck and bus, at most 25 m long");
  }
  if (is_of_trains() && !makes_trains(things))
    fail(ErrorKind::Config,
         "things of traffic of kind trains: of {} alone no train is made; locomotives go with "
         "passenger_coach or container_wagon, and these with a locomotive",
         fmt::join(things, ", "));
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
  Going going;
  going.goers =
      make_goers(propose(options, frames, duration_s, site.ways), site, duration_s, tally);
  going.trains =
      make_trains(propose_trains(options, frames, duration_s, site.ways), site, duration_s, tally);
  drop_encounters(going, site, duration_s, tally);
  keep_near(going.goers, options, frames, tally);
  keep_near(going.trains, options, frames, tally);
  MovingThings shapes;
  std::vector<scene::MovingThing> things;
  for (const auto& goer : going.goers)
    things.push_back(thing_of(*goer, frames, site.reach_s, shapes));
  for (const auto& train : going.trains) {
    std::size_t number = 0;
    for (const TrainCar& car : train->cars())
      things.push_back(thing_of(*train, car, ++number, frames, site.reach_s, shapes));
  }
  tell(going.goers.size() + going.trains.size(), tally, log);
  return things;
}

}  // namespace terracast::job
