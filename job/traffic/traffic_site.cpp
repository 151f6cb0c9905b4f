#include "job/traffic/traffic_site.h"

#include <algorithm>
#include <numbers>
#include <unordered_set>

#include "capture/moving_json.h"
#include "core/error.h"
#include "core/semantic_class.h"
#include "job/traffic/traffic.h"

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
const Eigen::Vector3d kLampFoot_m(0.25, 0.25, 1.0);
/// What stands is looked for where who comes within reach starts at the latest.
constexpr double kFast_mps = 36.0;

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

std::vector<Obstacle> obstacles_of(const Job& job, const geo::TrajectoryOptions& options,
                                   const render::SequencePlan& plan) {
  std::vector<Obstacle> obstacles;
  for (const render::MovingThing& thing : plan.moving) {
    if (thing.ride == render::Ride::Water) continue;
    const Eigen::Vector3d& size_m = thing_called(thing.shape.thing).size_m;
    obstacles.push_back(
        obstacle_of(job, thing.states, thing.ride == render::Ride::Ground, size_m.x(), size_m.y()));
  }
  const std::vector<std::optional<geo::BodyState>> own(plan.states.begin(), plan.states.end());
  Eigen::Vector3d size_m(kBodyLength_m, kBodyWidth_m, 0.0);
  if (!options.shown_as.empty()) size_m = thing_called(options.shown_as).size_m;
  obstacles.push_back(obstacle_of(job, own, false, size_m.x(), size_m.y()));
  return obstacles;
}

/// What each prototype takes up that is a vehicle, or a lamp, of which the foot alone.
std::vector<std::optional<Eigen::Vector3d>> taken_by(const world::WorldManifest& manifest) {
  std::vector<std::optional<Eigen::Vector3d>> sizes;
  for (const world::PrototypeInfo& prototype : manifest.prototypes) {
    const tiler::ThingInfo* thing =
        tiler::find_thing(prototype.name.substr(0, prototype.name.find(' ')));
    sizes.emplace_back();
    if (thing == nullptr) continue;
    if (is_vehicle(thing->semantic_class)) sizes.back() = thing->size_m;
    if (thing->semantic_class == core::SemanticClass::StreetLamp) sizes.back() = kLampFoot_m;
  }
  return sizes;
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
  const auto sizes = taken_by(store.manifest());
  std::vector<Footprint> standing;
  if (std::none_of(sizes.begin(), sizes.end(), [](const auto& size) { return size.has_value(); }))
    return standing;
  std::unordered_set<std::uint32_t> known;
  for (const world::TileInfo& info : store.manifest().tiles) {
    if (info.objects_bytes == 0 || store.find(info.id.child(0)) != nullptr ||
        !is_near(info.id, frames, reach_m))
      continue;
    for (const world::Instance& instance : store.load(info.id).objects.instances) {
      if (instance.prototype >= sizes.size() || !sizes[instance.prototype] ||
          !known.insert(instance.provenance.instance_id).second)
        continue;
      const double heading_rad = instance.heading * 2.0 * std::numbers::pi / 65536.0;
      const double scale = instance.scale / 4096.0;
      standing.push_back(
          {.at_world = instance.place_steps.head<2>().cast<double>() * world::kHeightStep_m,
           .forward = {std::cos(heading_rad), std::sin(heading_rad)},
           .length_m = scale * sizes[instance.prototype]->x(),
           .width_m = scale * sizes[instance.prototype]->y(),
           .deck_z_world = instance.place_steps.z() * world::kHeightStep_m});
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
  const std::vector<TrafficOptions>& traffic = job.config.traffic;
  if (traffic.empty() || plan.states.empty()) return;
  world::WayNetwork network = store.load_ways();
  if (network.parts.empty())
    fail(ErrorKind::Input,
         "{}: the config asks for traffic, and this world has no ways: give it a layer of kind "
         "\"roads\", or leave out [[traffic]]",
         store.folder().string());
  const auto own = std::find_if(job.config.trajectories.begin(), job.config.trajectories.end(),
                                [&](const auto& options) { return options.name == plan.name; });
  TERRACAST_CHECK(own != job.config.trajectories.end(), "no trajectory {}", plan.name);
  const double duration_s = duration_s_of(job, plan);
  double reach_m = 0.0;
  for (const TrafficOptions& one : traffic)
    reach_m = std::max(reach_m, one.reach_m + one.speed * kFast_mps * duration_s);
  const WayGraph ways(std::move(network));
  const TrafficSite site{.ways = ways,
                         .half_size_m = 0.5 * store.manifest().size_m,
                         .obstacles = obstacles_of(job, *own, plan),
                         .standing = what_stands(store, plan.states, reach_m)};
  std::vector<render::MovingThing> things =
      lay_out_traffic(traffic, plan.states, duration_s, site, log);
  std::move(things.begin(), things.end(), std::back_inserter(plan.moving));
  capture::check_moving(render::describe_moving(plan.moving), ErrorKind::Config,
                        "sequence " + plan.name);
}

}  // namespace terracast::job
