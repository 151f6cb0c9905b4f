#include "capture/moving.h"

#include <algorithm>
#include <iterator>

#include "capture/channel.h"
#include "capture/frame.h"
#include "core/error.h"
#include "core/instance_id.h"

namespace terracast::capture {

bool MovingBody::operator==(const MovingBody& other) const {
  return name == other.name && thing == other.thing && instance_id == other.instance_id &&
         first_triangle == other.first_triangle && semantic_id == other.semantic_id &&
         box_m.min() == other.box_m.min() && box_m.max() == other.box_m.max();
}

const MovingBody* body_shown(const std::vector<MovingBody>& bodies, std::uint32_t instance_id,
                             std::uint32_t primitive_id) {
  if (!core::is_moving_id(instance_id) || primitive_id < kObjectPrimitives) return nullptr;
  const std::pair key(instance_id, primitive_id - kObjectPrimitives);
  // They stand in the order of ids and first triangles.
  const auto after = std::upper_bound(
      bodies.begin(), bodies.end(), key, [](const auto& wanted, const MovingBody& body) {
        return wanted < std::pair(body.instance_id, body.first_triangle);
      });
  if (after == bodies.begin() || std::prev(after)->instance_id != instance_id) return nullptr;
  return &*std::prev(after);
}

BodyMotions::BodyMotions(const std::vector<MovingBody>& bodies,
                         const std::vector<std::optional<geo::BodyState>>& from,
                         const std::vector<std::optional<geo::BodyState>>& to) {
  TERRACAST_CHECK(from.size() == bodies.size() && to.size() == bodies.size(),
                  "{} and {} states of {} bodies", from.size(), to.size(), bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (from[i])
      motions_.emplace(std::pair(bodies[i].instance_id, bodies[i].first_triangle),
                       BodyMotion{.from = *from[i], .to = to[i]});
}

BodyMotions::BodyMotions(const SequenceInfo& info, const FrameRecord& from, const FrameRecord& to)
    : BodyMotions(info.moving, from.moving, to.moving) {}

const BodyMotion* BodyMotions::find(std::uint32_t instance_id, std::uint32_t primitive_id) const {
  if (!core::is_moving_id(instance_id) || primitive_id < kObjectPrimitives) return nullptr;
  const auto after = motions_.upper_bound({instance_id, primitive_id - kObjectPrimitives});
  if (after == motions_.begin()) return nullptr;
  const auto found = std::prev(after);
  return found->first.first == instance_id ? &found->second : nullptr;
}

}  // namespace terracast::capture
