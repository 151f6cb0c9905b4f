#include "capture/moving_json.h"

#include <cmath>
#include <set>

#include "capture/channel.h"
#include "capture/sequence_files.h"
#include "core/instance_id.h"
#include "core/semantic_class.h"

namespace terracast::capture {

using core::ErrorKind;
using core::fail;
using core::Json;

Json json_from_moving(const std::vector<MovingBody>& moving) {
  Json list = Json::array();
  for (const MovingBody& body : moving)
    list.push(Json::object()
                  .set("name", body.name)
                  .set("thing", body.thing)
                  .set("instance_id", static_cast<std::int64_t>(body.instance_id))
                  .set("first_triangle", static_cast<std::int64_t>(body.first_triangle))
                  .set("semantic_id", static_cast<std::int64_t>(body.semantic_id))
                  .set("lowest_m", json_from_vector(body.box_m.min()))
                  .set("highest_m", json_from_vector(body.box_m.max())));
  return list;
}

std::vector<MovingBody> moving_from_json(const Json& json, const Source& source) {
  if (!json.is_array() || json.size() > core::kMostMovingThings)
    fail(ErrorKind::Input, "{}: moving must be a list of at most {}", source.file,
         core::kMostMovingThings);
  std::vector<MovingBody> moving;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const Json& body = json.at(i);
    moving.push_back({.name = body.at("name").string(),
                      .thing = body.at("thing").string(),
                      .instance_id = static_cast<std::uint32_t>(
                          source.count(body.at("instance_id"), 0xffffffffLL, "instance_id")),
                      .first_triangle = static_cast<std::uint32_t>(source.count(
                          body.at("first_triangle"), kMaxObjectPrimitives, "first_triangle")),
                      .semantic_id = static_cast<std::uint32_t>(source.count(
                          body.at("semantic_id"), core::kNumSemanticClasses - 1, "semantic_id")),
                      .box_m = {source.vector(body.at("lowest_m"), "lowest_m"),
                                source.vector(body.at("highest_m"), "highest_m")}});
  }
  return moving;
}

void check_moving(const std::vector<MovingBody>& moving, ErrorKind kind, const std::string& where) {
  if (moving.size() > core::kMostMovingThings)
    fail(kind, "{}: {} bodies move; a sequence holds {}", where, moving.size(),
         core::kMostMovingThings);
  std::set<std::string> names;
  std::size_t num_things = 0;
  for (std::size_t i = 0; i < moving.size(); ++i) {
    const MovingBody& body = moving[i];
    if (!is_safe_name(body.name) || !names.insert(body.name).second)
      fail(kind,
           "{}: the name \"{}\" of what moves is there twice, or not of 1 to 64 letters, digits, _ "
           "or -",
           where, body.name);
    const bool is_in_order = body.is_part()
                                 ? i > 0 && moving[i - 1].instance_id == body.instance_id &&
                                       moving[i - 1].first_triangle < body.first_triangle
                                 : body.instance_id == core::kFirstMovingId + num_things;
    if (!is_in_order)
      fail(kind, "{}: the instance id of {}, {}, or its first triangle, {}, is out of order", where,
           body.name, body.instance_id, body.first_triangle);
    num_things += body.is_part() ? 0 : 1;
    if (!body.box_m.min().allFinite() || !body.box_m.max().allFinite() || body.box_m.isEmpty())
      fail(kind, "{}: the box of {} is none", where, body.name);
  }
}

Json json_from_states(const MovingStates& states) {
  Json list = Json::array();
  for (const std::optional<geo::BodyState>& state : states) {
    if (!state) {
      list.push(Json());
      continue;
    }
    Json entry = Json::object();
    entry.set("world_from_thing", json_from_rigid(state->world_from_body))
        .set("velocity_world_mps", json_from_vector(state->velocity_world_mps))
        .set("acceleration_world_mps2", json_from_vector(state->acceleration_world_mps2))
        .set("angular_velocity_thing_radps", json_from_vector(state->angular_velocity_body_radps));
    if (state->terms.are_any()) entry.set("motion_terms", json_from_terms(state->terms));
    list.push(std::move(entry));
  }
  return list;
}

MovingStates states_from_json(const Json& json, double time_s, const Source& source) {
  if (!json.is_array()) fail(ErrorKind::Input, "{}: moving must be a list", source.file);
  MovingStates states;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const Json& state = json.at(i);
    if (state.is_null()) {
      states.push_back(std::nullopt);
      continue;
    }
    states.push_back(geo::BodyState{
        .time_s = time_s,
        .world_from_body = source.rigid(state.at("world_from_thing"), "world_from_thing"),
        .velocity_world_mps = source.vector(state.at("velocity_world_mps"), "velocity_world_mps"),
        .acceleration_world_mps2 =
            source.vector(state.at("acceleration_world_mps2"), "acceleration_world_mps2"),
        .angular_velocity_body_radps =
            source.vector(state.at("angular_velocity_thing_radps"), "angular_velocity_thing_radps"),
        .terms = state.has("motion_terms") ? terms_from_json(state.at("motion_terms"), source)
                                           : geo::MotionTerms{}});
  }
  return states;
}

void check_states(const MovingStates& states, const std::vector<MovingBody>& bodies, ErrorKind kind,
                  const std::string& where) {
  if (states.size() != bodies.size())
    fail(kind, "{}: the states of {} bodies that move, but the sequence has {}", where,
         states.size(), bodies.size());
  for (std::size_t i = 1; i < states.size(); ++i)
    if (bodies[i].is_part() && states[i].has_value() != states[i - 1].has_value())
      fail(kind, "{}: {} is there without its thing, or the thing without it", where,
           bodies[i].name);
  for (const std::optional<geo::BodyState>& state : states)
    if (state &&
        (!state->world_from_body.translation.allFinite() ||
         !state->velocity_world_mps.allFinite() || !state->acceleration_world_mps2.allFinite() ||
         !state->angular_velocity_body_radps.allFinite() || !are_sound(state->terms) ||
         !(std::abs(state->world_from_body.rotation.norm() - 1.0) <= kUnitTolerance)))
      fail(
          kind,
          "{}: the state of something that moves is not finite, or its rotation not of unit length",
          where);
}

}  // namespace terracast::capture
