// What moves, as objects: a thing and what turns on it are one.

#include <algorithm>
#include <cmath>
#include <memory>
#include <unordered_map>

#include "core/error.h"
#include "core/instance_id.h"
#include "labels/shown_objects.h"

namespace terracast::labels {
namespace {

using Eigen::Vector3d;

/// Around a part, in its thing's frame, whichever way it has turned: around the circles that its corners go
/// round on, of radius r in the plane across the axis a, which reach r sqrt(1 - a_k^2) along the axis k.
void extend_by_turning(const LoneShape& shape, const scene::TurningPart& part, geo::Box3d& box) {
  const Vector3d axis = part.axis.normalized();
  const Vector3d reach_per_m = (1.0 - axis.array().square()).max(0.0).sqrt();
  for (const Vector3d& vertex : shape.vertices()) {
    const double along_m = axis.dot(vertex);
    const Vector3d middle = part.origin_m + along_m * axis;
    const Vector3d reach_m = (vertex - along_m * axis).norm() * reach_per_m;
    box.extend(middle - reach_m);
    box.extend(middle + reach_m);
  }
}

/// Around a part that swings, in its thing's frame: around the arcs that its corners go along. A corner's place along each
/// axis is m + c cos(turn) + s sin(turn), greatest and least at the ends or at atan2(s, c), where that is within the swing.
void extend_by_swinging(const LoneShape& shape, const scene::TurningPart& part, geo::Box3d& box) {
  const Vector3d axis = part.axis.normalized();
  for (const Vector3d& vertex : shape.vertices()) {
    const Vector3d along = axis.dot(vertex) * axis;
    const Vector3d across = vertex - along, aside = axis.cross(vertex);
    const auto at = [&](double turn_rad) -> Vector3d {
      return part.origin_m + along + std::cos(turn_rad) * across + std::sin(turn_rad) * aside;
    };
    for (const double end : {-part.swing_rad, part.swing_rad}) box.extend(at(end));
    for (int k = 0; k < 3; ++k)
      for (const double sign : {1.0, -1.0}) {
        const double turn_rad = std::atan2(sign * aside[k], sign * across[k]);
        if (std::abs(turn_rad) < part.swing_rad) box.extend(at(turn_rad));
      }
  }
}

/// Things that share a shape share what it is looked at with. Shapes are made when they are first asked for.
class LoneShapes {
 public:
  std::shared_ptr<const LoneShape> of(const scene::MovingShape& shape) {
    std::shared_ptr<const LoneShape>& lone = known_[shape.shown.get()];
    if (!lone)
      lone = std::make_shared<const LoneShape>(shape.shown->shape, Eigen::Vector3i::Zero());
    return lone;
  }

 private:
  std::unordered_map<const world::PrototypeLibrary::Shown*, std::shared_ptr<const LoneShape>>
      known_;
};

/// first_body   the thing's own place among the sequence's bodies
ShownObject object_of(const scene::MovingThing& thing, std::uint32_t instance_id,
                      std::size_t first_body, LoneShapes& shapes) {
  ShownObject object;
  object.parts.push_back({.shape = shapes.of(thing.shape), .body = first_body});
  geo::Box3d box;
  for (const Vector3d& vertex : object.parts[0].shape->vertices()) box.extend(vertex);
  for (const scene::TurningPart& part : thing.parts) {
    object.parts.push_back(
        {.shape = shapes.of(part.shape), .body = first_body + object.parts.size()});
    if (part.swing_rad > 0.0)
      extend_by_swinging(*object.parts.back().shape, part, box);
    else
      extend_by_turning(*object.parts.back().shape, part, box);
  }
  object.body_from_box.translation = box.center();
  object.label = {.instance_id = instance_id,
                  .semantic_class = static_cast<core::SemanticClass>(thing.semantic_id),
                  .layer = {},
                  .prototype = thing.shape.thing,
                  .box = {.world_from_box = {}, .half_size_m = 0.5 * box.sizes()},
                  .moving = thing.name};
  return object;
}

/// Of a place of a body that stays where it is in it.
Vector3d velocity_at(const geo::BodyState& state, const Vector3d& place_body) {
  return state.velocity_world_mps +
         state.world_from_body.rotation * state.angular_velocity_body_radps.cross(place_body);
}

}  // namespace

world::InstanceFrame PlacedPart::frame_at(double offset_s) const {
  if (!moving || offset_s == 0.0) return frame;
  const geo::Rigid3d world_from_body = moving->pose_after(offset_s);
  return {.place_world = world_from_body.translation,
          .world_from_prototype = world_from_body.rotation};
}

Placement placement_at(const ShownObject& object, const capture::FrameRecord& record) {
  Placement placement;
  if (!object.label.is_moving()) {
    for (const ShownPart& part : object.parts)
      placement.parts.push_back({.shape = part.shape.get(), .frame = part.frame});
    placement.world_from_box = object.label.box.world_from_box;
    return placement;
  }
  for (const ShownPart& part : object.parts) {
    const std::optional<geo::BodyState>& state = record.moving.at(part.body);
    if (!state)
      core::fail(core::ErrorKind::Input, "{} is shown in frame {}, where it is not",
                 object.label.moving, record.index);
    placement.parts.push_back({.shape = part.shape.get(),
                               .frame = {.place_world = state->world_from_body.translation,
                                         .world_from_prototype = state->world_from_body.rotation},
                               .moving = state});
  }
  const geo::BodyState& thing = *record.moving[object.parts[0].body];
  placement.world_from_box = thing.world_from_body * object.body_from_box;
  placement.motion =
      capture::BoxMotion{.world_from_box = placement.world_from_box,
                         .velocity_world_mps = velocity_at(thing, object.body_from_box.translation),
                         .angular_velocity_box_radps = thing.angular_velocity_body_radps};
  return placement;
}

std::vector<ShownObject> moving_objects(std::span<const scene::MovingThing> things,
                                        const std::vector<std::uint32_t>& ids) {
  std::vector<ShownObject> objects;
  LoneShapes shapes;
  std::size_t first_body = 0;
  for (std::size_t i = 0; i < things.size(); ++i) {
    const auto id = core::kFirstMovingId + static_cast<std::uint32_t>(i);
    if (std::binary_search(ids.begin(), ids.end(), id))
      objects.push_back(object_of(things[i], id, first_body, shapes));
    first_body += 1 + things[i].parts.size();
  }
  if (objects.size() != ids.size())
    core::fail(core::ErrorKind::Input,
               "a sequence shows {} things that move, of which {} are its own; render it again",
               ids.size(), objects.size());
  return objects;
}

}  // namespace terracast::labels
