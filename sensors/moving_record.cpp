#include "sensors/moving_record.h"

#include <optional>

namespace terracast::sensors {

std::vector<capture::MovingBody> describe_moving(std::span<const scene::MovingThing> things) {
  std::vector<capture::MovingBody> bodies;
  for (const scene::BodyInfo& info : scene::list_bodies(things))
    bodies.push_back({.name = info.name,
                      .thing = info.thing,
                      .instance_id = info.instance_id,
                      .first_triangle = info.first_triangle,
                      .semantic_id = info.semantic_id,
                      .box_m = info.box_m});
  return bodies;
}

scene::MovingBodies captured_bodies(std::span<const scene::MovingThing> things,
                                    std::span<const capture::FrameRecord> frames) {
  std::vector<std::vector<std::optional<geo::BodyState>>> states;
  for (const capture::FrameRecord& frame : frames) states.push_back(frame.moving);
  return {things, states};
}

}  // namespace terracast::sensors
