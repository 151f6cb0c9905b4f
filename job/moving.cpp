#include "job/moving.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <set>

#include "capture/moving_json.h"
#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/registry.h"
#include "sensors/moving_record.h"
#include "tiler/objects/gait.h"

namespace terracast::job {
namespace {

using core::ErrorKind;
using core::fail;
using core::SemanticClass;
using Eigen::Vector3d;
using scene::MovingThing;
using scene::Ride;

constexpr double kMost_s = 1e6;

bool flies(const tiler::ThingInfo& thing) {
  return thing.semantic_class == SemanticClass::Aircraft ||
         thing.semantic_class == SemanticClass::Helicopter ||
         thing.semantic_class == SemanticClass::Drone;
}

/// Whether it is of a kind that moves: no building, pole or tank.
bool can_move(const tiler::ThingInfo& thing) {
  constexpr std::array kOnLandOrWater = {
      SemanticClass::Person, SemanticClass::Car,   SemanticClass::Van,  SemanticClass::Truck,
      SemanticClass::Bus,    SemanticClass::Train, SemanticClass::Boat, SemanticClass::Ship};
  return flies(thing) || std::find(kOnLandOrWater.begin(), kOnLandOrWater.end(),
                                   thing.semantic_class) != kOnLandOrWater.end();
}

/// throws   Config: as thing_called(), or it is none that moves; lists those that do
void check_moves(const std::string& name) {
  if (can_move(thing_called(name))) return;
  std::vector<std::string> movable;
  for (const tiler::ThingInfo& thing : tiler::all_things())
    if (can_move(thing)) movable.push_back(thing.name);
  fail(ErrorKind::Config, "a {} is not a thing that moves; those that do are {}", name,
       fmt::join(movable, ", "));
}

Ride ride_of(const std::string& ride, const tiler::ThingInfo& thing) {
  if (ride == "free") return Ride::Free;
  if (ride == "ground") return Ride::Ground;
  if (ride == "water") return Ride::Water;
  if (thing.stance == tiler::Stance::Floats) return Ride::Water;
  return flies(thing) ? Ride::Free : Ride::Ground;
}

/// Wheels turn where they roll: those of what flies stand still, unless it rides the ground.
void stop_wheels_in_the_air(const tiler::ThingInfo& info, MovingThing& thing) {
  if (!flies(info) || thing.ride != Ride::Free) return;
  for (scene::TurningPart& part : thing.parts) part.per_metre_rad = 0.0;
}

std::shared_ptr<const world::PrototypeLibrary::Shown> shown(world::Shape shape) {
  return std::make_shared<const world::PrototypeLibrary::Shown>(std::move(shape));
}

/// A motion as a sequence sees it.
class Course {
 public:
  Course(const geo::MotionOptions& options, double start_s, bool repeats,
         const geo::TrajectoryContext& context)
      : motion_(options.kind_options().build(context)), start_s_(start_s), repeats_(repeats) {}

  /// At a time of the sequence; nothing before the motion begins and after it ends.
  /// reach_s   for so long before and after that time the state goes on as the motion does; 0: with constants
  std::optional<geo::BodyState> at(double time_s, double reach_s = 0.0) const {
    // The very end counts although a sum of times rounds past it.
    constexpr double kTolerance_s = 1e-9;
    const double duration_s = motion_->duration_s();
    double at_s = start_s_ + time_s;
    if (at_s < -kTolerance_s) return std::nullopt;
    at_s = std::max(at_s, 0.0);
    if (repeats_) at_s -= duration_s * std::floor(at_s / duration_s);
    if (at_s > duration_s + kTolerance_s) return std::nullopt;
    at_s = std::clamp(at_s, 0.0, duration_s);
    const geo::MotionState moved = motion_->at(at_s);
    geo::BodyState state = moved;
    state.time_s = time_s;
    // scene::state_of_part reads the angular acceleration here. Without a reach no pose depends on it.
    state.terms.turning_body[0] = 0.5 * moved.angular_acceleration_body_radps2;
    if (reach_s > 0.0)
      state.terms = geo::fit_terms(
          state, [&](double offset_s) { return motion_->at(at_s + offset_s).world_from_body; },
          reach_s);
    return state;
  }

  /// How far it goes forward on the map between two times, by Simpson's rule; where it is not there it does not
  /// go.
  double length_m(double from_s, double to_s) const {
    constexpr int kParts = 16;
    const double step_s = (to_s - from_s) / kParts;
    double sum = 0.0;
    for (int i = 0; i <= kParts; ++i) {
      const std::optional<geo::BodyState> state = at(from_s + i * step_s);
      const double weight = i == 0 || i == kParts ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
      if (!state) continue;
      const Vector3d forward = state->world_from_body.rotation * Vector3d::UnitX();
      sum += weight * forward.head<2>().normalized().dot(state->velocity_world_mps.head<2>());
    }
    return sum * step_s / 3.0;
  }

 private:
  std::unique_ptr<geo::Trajectory> motion_;
  double start_s_;
  bool repeats_;
};

/// reach_s   for so long before and after a frame's time it is looked at
void set_motion(const Course& course, std::span<const geo::BodyState> frames, double reach_s,
                MovingThing& thing) {
  double gone_m = 0.0, before_s = 0.0;
  for (const geo::BodyState& frame : frames) {
    gone_m += course.length_m(before_s, frame.time_s);
    before_s = frame.time_s;
    thing.gone_m.push_back(gone_m);
    const bool is_free = thing.ride == Ride::Free;
    std::optional<geo::BodyState>& state =
        thing.states.emplace_back(course.at(frame.time_s, is_free ? reach_s : 0.0));
    // scene::settle extends things on ground or water by constant velocity and turning; wheels fit terms of their own.
    if (!state) continue;
    if (!is_free) state->terms = {};
    state->terms.reach_s = reach_s;
  }
}

/// Of a body, whose origin is in the thing's middle, its foot's.
void lower_to_foot(double height_m, MovingThing& thing) {
  const scene::TurningPart foot{
      .name = {}, .shape = {}, .origin_m = Vector3d(0.0, 0.0, -0.5 * height_m)};
  for (std::optional<geo::BodyState>& state : thing.states)
    if (state) state = scene::state_of_part(*state, foot, 0.0);
}

}  // namespace

const tiler::ThingInfo& thing_called(const std::string& name) {
  const tiler::ThingInfo* thing = tiler::find_thing(name);
  if (thing == nullptr)
    fail(ErrorKind::Config, "{}; `terracast list things` tells of them",
         core::unknown_name_message("thing", name, tiler::thing_names()));
  return *thing;
}

scene::MovingThing moving_thing(const std::string& name, const tiler::ThingInfo& info,
                                int variant) {
  tiler::MovableThing movable = tiler::movable_thing(info, variant);
  MovingThing thing{.name = name,
                    .shape = {.thing = info.name, .shown = shown(std::move(movable.shape))},
                    .semantic_id = static_cast<std::uint32_t>(info.semantic_class),
                    .variety = static_cast<std::uint8_t>(variant),
                    .parts = {},
                    .states = {},
                    .gone_m = {}};
  for (tiler::TurningShape& part : movable.turning)
    thing.parts.push_back({.name = part.turning.name,
                           .shape = {.thing = info.name, .shown = shown(std::move(part.shape))},
                           .origin_m = part.turning.origin_m,
                           .axis = part.turning.axis,
                           .rate_radps = part.turning.rate_radps,
                           .per_metre_rad = part.turning.per_metre_rad,
                           .swing_rad = part.turning.swing_rad,
                           .phase_rad = part.turning.phase_rad});
  return thing;
}

scene::MovingThing MovingThings::of(const std::string& name, const tiler::ThingInfo& info,
                                    int variant) {
  const auto [known, is_new] = known_.try_emplace({&info, variant});
  if (is_new) known->second = moving_thing(name, info, variant);
  MovingThing thing = known->second;
  thing.name = name;
  return thing;
}

void MovingOptions::describe(core::SchemaVisitor& visit) {
  visit.key("name", name, "Its name, its own among all that move.", core::required());
  visit.key("thing", thing, "What it is: a built-in thing that moves (`terracast list things`).",
            core::required());
  visit.key("variant", variant, "Which of the thing's colours, counted from 0.",
            core::between(0.0, 255.0));
  visit.key(
      "ride", ride,
      "What carries it: free (as its motion has it), ground (it stands on the ground, wherever "
      "its motion would have it be there), water (it floats); auto: as the thing does.",
      core::one_of({"auto", "free", "ground", "water"}));
  describe_kind(visit);
  visit.key(
      "start_s", start_s,
      "Time on its motion at a sequence's first frame; below 0 it comes later. Before its motion "
      "begins and after it ends it is not there.",
      core::between(-kMost_s, kMost_s));
  visit.key("repeat", repeat, "Its motion begins again when it ends.");
  describe_keys(visit);
}

void MovingOptions::validate() const {
  if (!capture::is_safe_name(name))
    fail(ErrorKind::Config, "name = \"{}\" of what moves: it takes 1 to 64 letters, digits, _ or -",
         name);
  check_moves(thing);
  const tiler::ThingInfo& info = thing_called(thing);
  if (variant >= info.num_variants)
    fail(ErrorKind::Config, "variant = {} of {}: {} has {} colours, counted from 0", variant, name,
         thing, info.num_variants);
  if (has_kind_options()) kind_options().validate();
}

void check_moving(std::span<const MovingOptions> moving,
                  std::span<const geo::TrajectoryOptions> trajectories) {
  std::set<std::string> names;
  const auto add = [&](const std::string& name) {
    if (!names.insert(name).second)
      fail(ErrorKind::Config, "two things that move are called \"{}\"; give each its own name",
           name);
  };
  for (const MovingOptions& options : moving) add(options.name);
  for (const geo::TrajectoryOptions& trajectory : trajectories) {
    if (trajectory.shown_as.empty()) continue;
    core::with_context([&] { check_moves(trajectory.shown_as); },
                       fmt::format("shown_as of trajectory {}", trajectory.name));
    add(trajectory.name);
  }
}

std::vector<MovingThing> lay_out_moving(std::span<const MovingOptions> moving, const Bodies& bodies,
                                        const geo::TrajectoryOptions& sequence,
                                        std::span<const geo::BodyState> frames,
                                        const geo::TrajectoryContext& context) {
  std::vector<MovingThing> things;
  MovingThings shapes;
  const auto add = [&](const geo::MotionOptions& options, double start_s, bool repeats,
                       const geo::TrajectoryContext& own, MovingThing thing) {
    core::with_context(
        [&] { set_motion(Course(options, start_s, repeats, own), frames, own.reach_s, thing); },
        fmt::format("laying out what moves, {}", thing.name));
    things.push_back(std::move(thing));
  };
  geo::TrajectoryContext of_things = context;
  of_things.log = nullptr;
  for (const MovingOptions& options : moving) {
    const tiler::ThingInfo& info = thing_called(options.thing);
    MovingThing thing = shapes.of(options.name, info, static_cast<int>(options.variant));
    thing.ride = ride_of(options.ride, info);
    stop_wheels_in_the_air(info, thing);
    of_things.is_on_surface = thing.ride != Ride::Free;
    add(options, options.start_s, options.repeat, of_things, std::move(thing));
  }
  geo::TrajectoryContext of_bodies = context;
  of_bodies.log = nullptr;  // their own sequences tell of them
  for (std::size_t i = 0; i < bodies.trajectories.size(); ++i) {
    const geo::TrajectoryOptions& other = bodies.trajectories[i];
    const bool is_of_one_flight =
        other.name == sequence.name ||
        (!other.split_from.empty() && other.split_from == sequence.split_from);
    if (other.shown_as.empty() || is_of_one_flight) continue;
    const tiler::ThingInfo& info = thing_called(other.shown_as);
    of_bodies.rate_hz = other.rate_hz;
    of_bodies.half_size_m = bodies.half_sizes_m[i];
    MovingThing thing = shapes.of(other.name, info, 0);
    stop_wheels_in_the_air(info, thing);
    add(other, other.start_s, false, of_bodies, std::move(thing));
    lower_to_foot(info.size_m.z(), things.back());
  }
  capture::check_moving(sensors::describe_moving(things), ErrorKind::Config,
                        "sequence " + sequence.name);
  return things;
}

std::vector<MovingThing> captured_things(const capture::SequenceInfo& info) {
  std::vector<MovingThing> things;
  MovingThings shapes;
  for (const capture::MovingBody& body : info.moving) {
    if (body.is_part()) continue;
    const tiler::ThingInfo* thing = tiler::find_thing(body.thing);
    if (thing == nullptr)
      fail(ErrorKind::Input,
           "sequence {} shows {}, a thing that this program does not know; render it again",
           info.name, body.thing);
    things.push_back(shapes.of(body.name, *thing, 0));  // variants differ in colour alone
    // How fast someone walked is not known here: boxes hold the longest steps.
    for (scene::TurningPart& part : things.back().parts)
      if (part.swing_rad > 0.0)
        part.swing_rad *=
            tiler::longest_step_m(thing->size_m.z()) * part.per_metre_rad / std::numbers::pi;
  }
  return things;
}

}  // namespace terracast::job
