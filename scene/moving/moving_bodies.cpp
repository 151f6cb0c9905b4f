#include "scene/moving/moving_bodies.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>
#include <span>

#include "core/error.h"
#include "core/hash.h"
#include "core/instance_id.h"

namespace terracast::scene {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Within this time the ground under a thing is taken for as it is: for its rates of climb and of turning.
constexpr double kSettle_s = 0.05;
/// Where things stand, as shares of their length and width.
constexpr double kAxles = 0.6;
constexpr double kTracks = 0.8;

/// A deck is looked for so far above and below the height that a motion has.
constexpr double kDeckReach_m = 1.5;

double surface_z(const Vector3d& place, const world::RayQuery& query) {
  const std::optional<double> z = query.surface_z_world(place.x(), place.y());
  if (!z)
    fail(ErrorKind::Input, "the world has no ground at x {:.1f} m, y {:.1f} m", place.x(),
         place.y());
  return *z;
}

/// Of the bridge that carries a place, or else of the ground.
/// place   its height is about that of the deck
double way_z(const Vector3d& place, const world::RayQuery& query) {
  const double ground_z = surface_z(place, query);
  double from_z = place.z() + kDeckReach_m;
  const double to_z = std::max(place.z() - kDeckReach_m, ground_z);
  // What else hangs over the deck is passed.
  constexpr int kMostPassed = 16;
  for (int passed = 0; passed < kMostPassed && from_z > to_z; ++passed) {
    const world::WorldRay down{.origin_world = {place.x(), place.y(), from_z},
                               .direction_world = -Vector3d::UnitZ(),
                               .t_max = from_z - to_z};
    world::SurfaceHit hit;
    world::SurfaceSample surface;
    query.intersect({&down, 1}, {&hit, 1}, world::Coherence::Incoherent, {&surface, 1});
    if (hit.is_sky() || hit.is_ground()) break;
    const double z = from_z - hit.t;
    const core::SemanticClass what = surface.finish.semantic_class;
    if (what == core::SemanticClass::Bridge || what == core::SemanticClass::RoadMarking)
      return std::max(z, ground_z);
    constexpr double kOn_m = 1e-3;
    from_z = z - kOn_m;
  }
  return ground_z;
}

/// throws Input: on the ground there is water, or on the water ground
void check_ride(const Vector3d& place, Ride ride, const world::RayQuery& query) {
  constexpr double kAround_m = 0.05;
  const world::WorldRay down{.origin_world = place + Vector3d(0.0, 0.0, kAround_m),
                             .direction_world = -Vector3d::UnitZ(),
                             .t_max = 2.0 * kAround_m};
  world::SurfaceHit hit;
  world::SurfaceSample surface;
  query.intersect({&down, 1}, {&hit, 1}, world::Coherence::Incoherent, {&surface, 1});
  if (!hit.is_ground() || hit.is_sky()) return;  // something stands there
  const bool is_water = world::is_water(surface.cover);
  if (is_water != (ride == Ride::Water))
    fail(ErrorKind::Input,
         "it rides the {}, and at x {:.1f} m, y {:.1f} m of the world there is {}; lead it round "
         "there, or "
         "set ride",
         ride == Ride::Water ? "water" : "ground", place.x(), place.y(),
         is_water ? "water" : "ground");
}

/// Of the rails that carry a wheel: on a bridge they lie on its deck, and are looked for a little to both sides.
/// across   unit
double rail_z(const Vector3d& place, const Vector3d& across, const world::RayQuery& query) {
  double z = way_z(place, query);
  if (z == surface_z(place, query)) return z;
  constexpr double kProbe_m = 0.03;
  constexpr int kProbes = 3;
  for (int k = -kProbes; k <= kProbes; ++k)
    if (k != 0) z = std::max(z, way_z(place + k * kProbe_m * across, query));
  return z;
}

/// Axes of something whose z is up and whose x is as near as can be to `forward`.
Eigen::Quaterniond upright(const Vector3d& up, const Vector3d& forward) {
  const Vector3d left = up.cross(forward).normalized();
  Eigen::Matrix3d axes;
  axes << left.cross(up), left, up;
  return Eigen::Quaterniond(axes).normalized();
}

geo::Rigid3d settled_pose(const geo::Rigid3d& wanted, Ride ride, double length_m, double width_m,
                          const world::RayQuery& query, const geo::WorldFrame& frame) {
  const Vector3d up = frame.up_world(wanted.translation);
  const Eigen::Quaterniond level = upright(up, wanted.rotation * Vector3d::UnitX());
  Vector3d place = wanted.translation;
  if (ride == Ride::Water) {
    place.z() = surface_z(place, query);
    return {level, place};
  }
  const bool is_upright = length_m == 0.0 && width_m == 0.0;
  const auto foot = [&](double x_m, double y_m) -> Vector3d {
    Vector3d at = wanted.translation + level * Vector3d(x_m, y_m, 0.0);
    at.z() = ride == Ride::Rails ? rail_z(at, level * Vector3d::UnitY(), query)
             : ride == Ride::Way ? way_z(at, query)
                                 : surface_z(at, query);
    return at;
  };
  if (is_upright) return {level, foot(0.0, 0.0)};
  const bool is_on_rails = ride == Ride::Rails;
  const double x_m = 0.5 * (is_on_rails ? 1.0 : kAxles) * length_m;
  const double y_m = 0.5 * (is_on_rails ? 1.0 : kTracks) * width_m;
  const Vector3d front_left = foot(x_m, y_m), front_right = foot(x_m, -y_m);
  const Vector3d rear_left = foot(-x_m, y_m), rear_right = foot(-x_m, -y_m);
  // The plane that is as near as can be to four corners has these two slopes and goes through their middle.
  const Vector3d forward = front_left + front_right - rear_left - rear_right;
  const Vector3d left = front_left + rear_left - front_right - rear_right;
  place.z() = 0.25 * (front_left.z() + front_right.z() + rear_left.z() + rear_right.z());
  return {upright(forward.cross(left).normalized(), forward.normalized()), place};
}

/// People do, on slopes too.
bool stands_upright(const MovingThing& thing) {
  return thing.semantic_id == static_cast<std::uint32_t>(core::SemanticClass::Person);
}

geo::Box3d box_of(const world::Shape& shape) {
  geo::Box3d box;
  for (const Eigen::Vector3i& vertex : shape.vertices_steps)
    box.extend(vertex.cast<double>() * world::kHeightStep_m);
  return box;
}

template <class Value>
void append_bytes(std::string& text, const std::vector<Value>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::string hash_of(const world::Shape& shape) {
  std::string bytes;
  append_bytes(bytes, shape.vertices_steps);
  append_bytes(bytes, shape.uv);
  for (const world::Shape::Triangle& triangle : shape.triangles)
    bytes += fmt::format("{} {} {} {} ", triangle.corners[0], triangle.corners[1],
                         triangle.corners[2], triangle.finish);
  for (const world::Finish& finish : shape.finishes)
    bytes += fmt::format("{} {} {} {} {} {} ", static_cast<int>(finish.material),
                         static_cast<int>(finish.semantic_class), finish.color_srgb[0],
                         finish.color_srgb[1], finish.color_srgb[2], finish.pattern);
  return core::content_hash(bytes);
}

std::uint32_t num_triangles(const MovingShape& shape) {
  return static_cast<std::uint32_t>(shape.shown->shape.triangles.size());
}

/// Of swings, how even they are: between its ends the angle is asin(k sin(phase)) / asin(k) times the swing.
/// 1 would be a zigzag.
constexpr double kEvenness = 0.97;

/// How far a thing goes forward after its frame's time, by Gauss' rule of three points.
double way_forward_m(const geo::BodyState& thing, double offset_s) {
  constexpr double kPoint = 0.7745966692414834, kWeights[] = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};
  const double points[] = {-kPoint, 0.0, kPoint};
  double sum_mps = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double t = 0.5 * offset_s * (1.0 + points[i]);
    const Vector3d forward = thing.pose_after(t).rotation * Vector3d::UnitX();
    sum_mps += kWeights[i] * forward.dot(thing.velocity_after(t));
  }
  return 0.5 * offset_s * sum_mps;
}

}  // namespace

std::vector<BodyInfo> list_bodies(std::span<const MovingThing> things) {
  std::vector<BodyInfo> bodies;
  std::uint32_t id = core::kFirstMovingId;
  for (const MovingThing& thing : things) {
    std::uint32_t first_triangle = 0;
    const auto add = [&](std::string name, const MovingShape& shape) {
      bodies.push_back({.name = std::move(name),
                        .thing = shape.thing,
                        .instance_id = id,
                        .first_triangle = first_triangle,
                        .semantic_id = thing.semantic_id,
                        .box_m = box_of(shape.shown->shape)});
      first_triangle += num_triangles(shape);
    };
    add(thing.name, thing.shape);
    for (const TurningPart& part : thing.parts)
      add(fmt::format("{}-{}", thing.name, part.name), part.shape);
    ++id;
  }
  return bodies;
}

geo::BodyState settle(const geo::BodyState& wanted, Ride ride, double length_m, double width_m,
                      const world::RayQuery& query, const geo::WorldFrame& frame) {
  if (ride == Ride::Free) return wanted;
  const auto pose_at = [&](double offset_s) {
    return settled_pose(wanted.pose_after(offset_s), ride, length_m, width_m, query, frame);
  };
  const geo::Rigid3d before = pose_at(-kSettle_s), after = pose_at(kSettle_s);
  geo::BodyState state = wanted;
  state.world_from_body = pose_at(0.0);
  if (ride == Ride::Ground || ride == Ride::Water)
    check_ride(state.world_from_body.translation, ride, query);
  state.velocity_world_mps.z() =
      (after.translation.z() - before.translation.z()) / (2.0 * kSettle_s);
  state.acceleration_world_mps2.z() = 0.0;
  state.angular_velocity_body_radps =
      geo::rotation_vector_of(before.rotation.conjugate() * after.rotation) / (2.0 * kSettle_s);
  return state;
}

PartTurn turn_of_part(const TurningPart& part, double time_s, double gone_m, double forward_mps) {
  const double phase_rad = part.phase_rad + part.rate_radps * time_s + part.per_metre_rad * gone_m;
  const double phase_radps = part.rate_radps + part.per_metre_rad * forward_mps;
  if (part.swing_rad <= 0.0) return {phase_rad, phase_radps};
  const double sine = kEvenness * std::sin(phase_rad);
  const double scale = part.swing_rad / std::asin(kEvenness);
  return {scale * std::asin(sine),
          scale * kEvenness * std::cos(phase_rad) / std::sqrt(1.0 - sine * sine) * phase_radps};
}

geo::BodyState state_of_part(const geo::BodyState& thing, const TurningPart& part, double gone_m) {
  const geo::Rigid3d& world_from_thing = thing.world_from_body;
  const Vector3d forward = world_from_thing.rotation * Vector3d::UnitX();
  const PartTurn turn =
      turn_of_part(part, thing.time_s, gone_m, forward.dot(thing.velocity_world_mps));
  const bool swings = part.swing_rad > 0.0;
  const double rate_radps = turn.rate_radps;
  const geo::Rigid3d thing_from_part{
      Eigen::Quaterniond(
          Eigen::AngleAxisd(std::remainder(turn.angle_rad, 2.0 * std::numbers::pi), part.axis)),
      part.origin_m};
  // Of the origin of the part, which goes round with the thing.
  const Vector3d turning_world = world_from_thing.rotation * thing.angular_velocity_body_radps;
  const Vector3d arm_world = world_from_thing.rotation * part.origin_m;
  const Vector3d swing_world = turning_world.cross(arm_world);
  // A thing has no spin, so that its angular acceleration is twice the first of its terms of turning.
  const Vector3d twist_world = world_from_thing.rotation * (2.0 * thing.terms.turning_body[0]);
  geo::BodyState state = thing;
  state.world_from_body = world_from_thing * thing_from_part;
  state.velocity_world_mps += swing_world;
  state.acceleration_world_mps2 += turning_world.cross(swing_world) + twist_world.cross(arm_world);
  state.angular_velocity_body_radps =
      thing_from_part.rotation.conjugate() * thing.angular_velocity_body_radps +
      rate_radps * part.axis;
  if (thing.terms.are_any()) {
    state.terms = geo::fit_terms(
        state,
        [&](double offset_s) {
          const double way_m = way_forward_m(thing, offset_s);
          const double turned_rad =
              swings ? turn_of_part(part, thing.time_s + offset_s, gone_m + way_m, 0.0).angle_rad -
                           turn.angle_rad
                     : part.rate_radps * offset_s + part.per_metre_rad * way_m;
          return thing.pose_after(offset_s) * thing_from_part *
                 geo::Rigid3d{.rotation = geo::rotation_of(turned_rad * part.axis),
                              .translation = Vector3d::Zero()};
        },
        thing.terms.reach_s,
        swings ? Vector3d(Vector3d::Zero()) : Vector3d(rate_radps * part.axis));
    state.terms.error_m += thing.terms.error_m + part.origin_m.norm() * thing.terms.error_rad;
    state.terms.error_rad += thing.terms.error_rad;
  }
  return state;
}

MovingBodies::MovingBodies(std::span<const MovingThing> things, const world::RayQuery& query,
                           const geo::WorldFrame& frame) {
  const std::vector<BodyInfo> infos = list_bodies(things);
  auto info = infos.begin();
  for (const MovingThing& thing : things) {
    const Vector2d size_m = stands_upright(thing)       ? Vector2d(Vector2d::Zero())
                            : thing.ride == Ride::Rails ? thing.footing_m
                                                        : Vector2d(info->box_m.sizes().head<2>());
    Body body{.info = *info++, .shown = thing.shape.shown, .variety = thing.variety, .states = {}};
    std::vector<Body> parts;
    for (const TurningPart& part : thing.parts)
      parts.push_back(
          {.info = *info++, .shown = part.shape.shown, .variety = thing.variety, .states = {}});
    for (std::size_t i = 0; i < thing.states.size(); ++i) {
      const auto settled = [&]() -> std::optional<geo::BodyState> {
        if (!thing.states[i]) return std::nullopt;
        return core::with_context(
            [&] {
              return settle(*thing.states[i], thing.ride, size_m.x(), size_m.y(), query, frame);
            },
            fmt::format("laying out what moves, {} at frame {}", thing.name, i));
      };
      body.states.push_back(settled());
      for (std::size_t k = 0; k < parts.size(); ++k) {
        std::optional<geo::BodyState>& state = parts[k].states.emplace_back();
        if (body.states.back())
          state = state_of_part(*body.states.back(), thing.parts[k], thing.gone_m[i]);
      }
    }
    bodies_.push_back(std::move(body));
    std::move(parts.begin(), parts.end(), std::back_inserter(bodies_));
  }
}

MovingBodies::MovingBodies(std::span<const MovingThing> things,
                           std::span<const std::vector<std::optional<geo::BodyState>>> frames) {
  const std::vector<BodyInfo> infos = list_bodies(things);
  const auto add = [&](const MovingShape& shape, std::uint8_t variety) {
    const std::size_t at = bodies_.size();
    Body body{.info = infos[at], .shown = shape.shown, .variety = variety, .states = {}};
    for (const auto& states : frames) body.states.push_back(states.at(at));
    bodies_.push_back(std::move(body));
  };
  for (const MovingThing& thing : things) {
    add(thing.shape, thing.variety);
    for (const TurningPart& part : thing.parts) add(part.shape, thing.variety);
  }
}

std::vector<std::optional<geo::BodyState>> MovingBodies::states(int frame) const {
  std::vector<std::optional<geo::BodyState>> states;
  for (const Body& body : bodies_) states.push_back(body.states[static_cast<std::size_t>(frame)]);
  return states;
}

world::MovingScene MovingBodies::scene(int frame, double reach_s) const {
  std::vector<world::MovingBody> there;
  for (const Body& body : bodies_) {
    const std::optional<geo::BodyState>& state = body.states[static_cast<std::size_t>(frame)];
    if (!state) continue;
    there.push_back({.shown = body.shown.get(),
                     .provenance = {.instance_id = body.info.instance_id, .layer = 0, .feature = 0},
                     .first_triangle = body.info.first_triangle,
                     .variety = body.variety,
                     .state = *state});
  }
  if (there.empty()) return {};
  return {std::move(there), reach_s};
}

std::string MovingBodies::text_of(int frame) const {
  std::string text;
  for (const Body& body : bodies_) {
    const std::optional<geo::BodyState>& state = body.states[static_cast<std::size_t>(frame)];
    text += fmt::format("{}", body.info.name);
    if (state) {
      text += fmt::format(" {:.17g}", state->world_from_body.rotation.w());
      const auto add = [&](const Vector3d& vector) {
        text += fmt::format(" {:.17g} {:.17g} {:.17g}", vector.x(), vector.y(), vector.z());
      };
      for (const Vector3d& vector :
           {Vector3d(state->world_from_body.translation),
            Vector3d(state->world_from_body.rotation.vec()), state->velocity_world_mps,
            state->acceleration_world_mps2, state->angular_velocity_body_radps})
        add(vector);
      if (const geo::MotionTerms& terms = state->terms; terms.are_any()) {
        text += fmt::format(" terms {:.17g}", terms.reach_s);
        for (const Vector3d& term : terms.position_world) add(term);
        for (const Vector3d& term : terms.turning_body) add(term);
        add(terms.spin_body_radps);
      }
    }
    text += '\n';
  }
  return text;
}

std::string text_of_shapes(std::span<const MovingThing> things) {
  std::string text;
  for (const MovingThing& thing : things) {
    text += fmt::format("moves {} {} {} {} {}{}\n", thing.name, thing.shape.thing,
                        thing.semantic_id, thing.variety, hash_of(thing.shape.shown->shape),
                        stands_upright(thing) ? " upright" : "");
    for (const TurningPart& part : thing.parts)
      text += fmt::format("part {} {} {} {}\n", part.name, hash_of(part.shape.shown->shape),
                          part.rate_radps, part.per_metre_rad);
  }
  return text;
}

}  // namespace terracast::scene
