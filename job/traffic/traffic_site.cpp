#include "job/traffic/traffic_site.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_set>

#include "capture/moving_json.h"
#include "core/error.h"
#include "core/semantic_class.h"
#include "job/moving.h"
#include "job/traffic/proposals.h"
#include "job/traffic/ships.h"
#include "job/traffic/traffic.h"
#include "job/traffic/water_map.h"
#include "sensors/moving_record.h"
#include "world/instance_frame.h"

namespace terracast::job {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;

/// Of what carries cameras and is not shown: a car's.
constexpr double kBodyLength_m = 4.8;
constexpr double kBodyWidth_m = 2.0;
/// Whatever is higher above the ground is not in the way.
constexpr double kLow_m = 6.0;
constexpr double kLampFoot_m = 0.25;

bool is_vehicle(core::SemanticClass what) {
  return core::semantic_classes()[static_cast<std::size_t>(what)].parent == "vehicle";
}

/// The states in which something is low enough to be in the way.
Obstacle obstacle_of(const Job& job, std::span<const std::optional<geo::BodyState>> states,
                     bool is_on_ground, double length_m, double width_m) {
  Obstacle obstacle{.states = {}, .length_m = length_m, .width_m = width_m};
  for (const std::optional<geo::BodyState>& state : states) {
    obstacle.states.push_back(state);
    if (!state || is_on_ground) continue;
    const geo::Geodetic place =
        job.ground->frame().geodetic_from_world(state->world_from_body.translation);
    const auto ground_m = job.ground->measured_height_m(place.lat_deg, place.lon_deg);
    if (!ground_m || place.height_m - *ground_m > kLow_m) obstacle.states.back() = std::nullopt;
  }
  return obstacle;
}

/// Of the same bodies the same for all sequences: places so far apart in time, from the beginning to the end.
std::vector<geo::BodyState> looks(double duration_s) {
  const auto num = static_cast<std::size_t>(std::ceil(duration_s / kLook_s)) + 1;
  std::vector<geo::BodyState> states(num);
  for (std::size_t i = 0; i < num; ++i)
    states[i].time_s = std::min(static_cast<double>(i) * kLook_s, duration_s);
  return states;
}

/// What else moves.
struct OthersThere {
  std::vector<Obstacle> on_land;
  std::vector<Obstacle> on_water;  ///< and low above it
};

/// Things of [[moving]] and all bodies that are shown in any sequence, by their own courses; and the body of this
/// sequence, if it is shown in none.
OthersThere obstacles_of(const Job& job, const geo::TrajectoryOptions& own,
                         const render::SequencePlan& plan, double duration_s) {
  const tiler::WorldSurface& ground = *job.ground;
  const geo::TrajectoryContext context{.frame = ground.frame(),
                                       .ground_height_m =
                                           [&ground](double lat_deg, double lon_deg) {
                                             return ground.measured_height_m(lat_deg, lon_deg);
                                           },
                                       .geoid = geo::Geoid::egm96(),
                                       .log = nullptr,
                                       .half_size_m = 0.5 * job.config.world.size_m};
  const std::vector<double> half_sizes = half_sizes_m(job);
  OthersThere others;
  geo::TrajectoryOptions nobody;
  nobody.name.clear();  // no trajectory's
  for (const scene::MovingThing& thing :
       lay_out_moving(job.config.moving, {job.config.trajectories, half_sizes}, nobody,
                      looks(duration_s), context)) {
    const Eigen::Vector3d& size_m = thing_called(thing.shape.thing).size_m;
    const bool floats = thing.ride == scene::Ride::Water;
    const bool is_on_ground = floats || thing.ride == scene::Ride::Ground;
    const Obstacle obstacle = obstacle_of(job, thing.states, is_on_ground, size_m.x(), size_m.y());
    others.on_water.push_back(obstacle);
    if (!floats) others.on_land.push_back(obstacle);
  }
  if (!own.shown_as.empty()) return others;
  const std::vector<std::optional<geo::BodyState>> states(plan.states.begin(), plan.states.end());
  others.on_land.push_back(obstacle_of(job, states, false, kBodyLength_m, kBodyWidth_m));
  others.on_water.push_back(others.on_land.back());
  return others;
}

/// What each prototype takes up, about its place, that is a vehicle, or a lamp, of which the foot alone: who goes by
/// one needs no room along it, which points across the road.
std::vector<std::optional<Footprint>> taken_by(const world::WorldManifest& manifest) {
  std::vector<std::optional<Footprint>> taken;
  for (const world::PrototypeInfo& prototype : manifest.prototypes) {
    const tiler::ThingInfo* thing =
        tiler::find_thing(prototype.name.substr(0, prototype.name.find(' ')));
    taken.emplace_back();
    if (thing == nullptr) continue;
    if (is_vehicle(thing->semantic_class))
      taken.back() = Footprint{.length_m = thing->size_m.x(), .width_m = thing->size_m.y()};
    if (thing->semantic_class == core::SemanticClass::StreetLamp)
      taken.back() =
          Footprint{.length_m = kLampFoot_m, .width_m = kLampFoot_m, .room_along_m = kRoomAside_m};
  }
  return taken;
}

bool is_near(const world::TileId& id, std::span<const geo::BodyState> frames, double reach_m) {
  const Vector2d low = id.corner_world();
  const Vector2d high = low.array() + id.side_m();
  return std::any_of(frames.begin(), frames.end(), [&](const geo::BodyState& frame) {
    const Vector2d at = frame.world_from_body.translation.head<2>();
    return (at - at.cwiseMax(low).cwiseMin(high)).norm() <= reach_m;
  });
}

std::vector<Footprint> what_stands(const world::TileStore& store,
                                   std::span<const geo::BodyState> frames, double reach_m) {
  const auto taken = taken_by(store.manifest());
  const geo::WorldFrame frame(store.manifest().origin);
  std::vector<Footprint> standing;
  if (std::none_of(taken.begin(), taken.end(), [](const auto& one) { return one.has_value(); }))
    return standing;
  std::unordered_set<std::uint32_t> known;
  for (const world::TileInfo& info : store.manifest().tiles) {
    if (info.objects_bytes == 0 || store.find(info.id.child(0)) != nullptr ||
        !is_near(info.id, frames, reach_m))
      continue;
    for (const world::Instance& instance : store.load(info.id).objects.instances) {
      if (instance.prototype >= taken.size() || !taken[instance.prototype] ||
          !known.insert(instance.provenance.instance_id).second)
        continue;
      const world::InstanceFrame stands = world::instance_frame(instance, frame);
      Footprint footprint = *taken[instance.prototype];
      footprint.at_world = stands.place_world.head<2>();
      footprint.forward =
          (stands.world_from_prototype * Eigen::Vector3d::UnitX()).head<2>().normalized();
      footprint.length_m *= stands.scale;
      footprint.width_m *= stands.scale;
      footprint.deck_z_world = stands.place_world.z();
      standing.push_back(footprint);
    }
  }
  return standing;
}

/// Places of all that stands in a world's water within reach of frames: things, and corners of what is built.
std::vector<Vector2d> what_stands_in_water(const world::TileStore& store, WaterMap& water,
                                           std::span<const geo::BodyState> frames, double reach_m) {
  std::vector<Vector2d> standing;
  const auto add = [&](const Vector2d& at_world) {
    if (water.at(at_world).is_water) standing.push_back(at_world);
  };
  // Piers are long between their corners; so far apart a place beside them is 0.3 m farther than their edge at most.
  constexpr double kApart_m = 20.0;
  const auto add_edge = [&](const Vector2d& from, const Vector2d& to) {
    const int num = 1 + static_cast<int>((to - from).norm() / kApart_m);
    for (int i = 0; i < num; ++i) add(from + (to - from) * i / num);
  };
  for (const world::TileInfo& info : store.manifest().tiles) {
    if (info.objects_bytes == 0 || store.find(info.id.child(0)) != nullptr ||
        !is_near(info.id, frames, reach_m))
      continue;
    const world::TileObjects objects = store.load(info.id).objects;
    for (const world::Instance& instance : objects.instances)
      add(instance.place_steps.head<2>().cast<double>() * world::kHeightStep_m);
    for (const world::Solid& solid : objects.solids) {
      const world::Shape& shape = solid.levels.front().shape;
      const auto corner = [&](std::uint32_t vertex) -> Vector2d {
        return (solid.origin_steps + shape.vertices_steps[vertex]).head<2>().cast<double>() *
               world::kHeightStep_m;
      };
      for (const auto& triangle : shape.triangles)
        for (std::size_t k = 0; k < 3; ++k)
          add_edge(corner(triangle.corners[k]), corner(triangle.corners[(k + 1) % 3]));
    }
  }
  return standing;
}

/// Of the sequence and of those that are seen in it: what they see is the same.
double duration_s_of(const Job& job, const render::SequencePlan& plan) {
  double longest_s = plan.states.back().time_s;
  for (std::size_t i = 0; i < job.sequences.size(); ++i)
    if (!job.config.trajectories[i].shown_as.empty())
      longest_s = std::max(longest_s, job.sequences[i].states.back().time_s);
  return longest_s;
}

}  // namespace

void add_traffic(const Job& job, const world::TileStore& store, const core::Log& log,
                 render::SequencePlan& plan) {
  if (job.config.traffic.empty() || plan.states.empty()) return;
  std::vector<TrafficOptions> on_land, ships;
  for (const TrafficOptions& one : job.config.traffic)
    (one.is_of_ships() ? ships : on_land).push_back(one);
  const auto own = std::find_if(job.config.trajectories.begin(), job.config.trajectories.end(),
                                [&](const auto& options) { return options.name == plan.name; });
  TERRACAST_CHECK(own != job.config.trajectories.end(), "no trajectory {}", plan.name);
  const double duration_s = duration_s_of(job, plan);
  OthersThere others = obstacles_of(job, *own, plan, duration_s);
  const double half_size_m = 0.5 * store.manifest().size_m;
  const double reach_s = reach_of_bodies_s(plan);
  const auto add = [&](std::vector<scene::MovingThing> things) {
    std::move(things.begin(), things.end(), std::back_inserter(plan.moving));
  };
  if (!on_land.empty()) {
    world::WayNetwork network = store.load_ways();
    if (network.parts.empty())
      fail(ErrorKind::Input,
           "{}: the config asks for traffic, and this world has no ways: give it a layer of kind "
           "\"roads\", or leave out [[traffic]]",
           store.folder().string());
    const WayGraph ways(std::move(network));
    const double reach_m = reach_of_traffic(on_land, duration_s, ways).of_all_m;
    const TrafficSite site{.ways = ways,
                           .half_size_m = half_size_m,
                           .obstacles = std::move(others.on_land),
                           .standing = what_stands(store, plan.states, reach_m),
                           .reach_s = reach_s};
    add(lay_out_traffic(on_land, plan.states, duration_s, site, log));
  }
  if (!ships.empty()) {
    WaterMap water(store);
    const double reach_m = reach_of_ships_m(ships, duration_s);
    const WaterSite site{.water = [&water](const Vector2d& at_world) { return water.at(at_world); },
                         .standing = what_stands_in_water(store, water, plan.states, reach_m),
                         .half_size_m = half_size_m,
                         .obstacles = std::move(others.on_water),
                         .reach_s = reach_s};
    add(lay_out_ships(ships, plan.states, duration_s, site, log));
  }
  capture::check_moving(sensors::describe_moving(plan.moving), ErrorKind::Config,
                        "sequence " + plan.name);
}

}  // namespace terracast::job
