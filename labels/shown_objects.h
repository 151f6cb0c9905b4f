#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/object_labels.h"
#include "geo/trajectory.h"
#include "scene/moving/moving_bodies.h"
#include "world/box_tree.h"
#include "world/instance_frame.h"
#include "world/lod.h"
#include "world/tile_store.h"
#include "world/triangle_crossing.h"

/// The geometry of objects that a sequence shows, one by one.
namespace terracast::labels {

/// A shape that is looked at alone. Immutable; threads: safe.
class LoneShape {
 public:
  using Edge = std::array<std::uint32_t, 2>;

  LoneShape(const world::Shape& shape, const Eigen::Vector3i& origin_steps);

  /// Those that triangles have, m.
  std::span<const Eigen::Vector3d> vertices() const { return vertices_; }
  /// Of triangles, each once.
  std::span<const Edge> edges() const { return edges_; }
  /// Whether a ray meets it: by the same decision as in a rendered world.
  /// direction   of any length
  bool is_met(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  /// The class of most of its surface; the lower number where two have as much.
  core::SemanticClass semantic_class() const { return semantic_class_; }

 private:
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Edge> edges_;
  world::BoxTree tree_;
  std::vector<world::TriangleBlock> blocks_;  ///< by leaf
  core::SemanticClass semantic_class_ = core::SemanticClass::Object;
};

/// A rigid part of an object.
struct ShownPart {
  std::shared_ptr<const LoneShape> shape;
  /// From the shape's, of what stands; of an object with its own shape the world's.
  world::InstanceFrame frame = {};
  std::size_t body = 0;  ///< of what moves: its place in SequenceInfo::moving
};

/// An object as the tiles of a sequence show it, or of what moves through it.
struct ShownObject {
  capture::LabelledObject label;
  std::vector<ShownPart> parts;     ///< of what moves the thing, then what turns on it; else one
  geo::Rigid3d body_from_box = {};  ///< of what moves: of its box in the thing's frame
};

/// A part about the time of a frame.
struct PlacedPart {
  const LoneShape* shape = nullptr;
  world::InstanceFrame frame = {};                      ///< of its shape, at the frame's time
  std::optional<geo::BodyState> moving = std::nullopt;  ///< nothing: it stands

  /// So much after the frame's time.
  world::InstanceFrame frame_at(double offset_s) const;
};

/// Where an object is at a frame.
struct Placement {
  std::vector<PlacedPart> parts;
  geo::Rigid3d world_from_box;
  std::optional<capture::BoxMotion> motion = std::nullopt;  ///< nothing: it stands
};
/// Refers to the object's shapes.
/// throws   Input: it moves, and is not there
Placement placement_at(const ShownObject& object, const capture::FrameRecord& record);

/// Objects of a sequence, by their instance ids, which ascend.
/// ids       that the sequence shows
/// returns   as many, in the same order
/// cost      loads every tile once at which a ray of the sequence was cast
/// throws    Input: the store is not the world of the sequence (another tile, or one of the objects is not
///           in it)
std::vector<ShownObject> find_objects(const world::TileStore& store,
                                      const capture::SequenceInfo& info,
                                      const std::vector<capture::FrameRecord>& frames,
                                      const std::vector<std::uint32_t>& ids);

/// Those of what moves, likewise. A thing has a box along its own axes that holds it with its parts, whichever way
/// they have turned. Things that share shapes (MovingShape::shown) do so here.
/// things   of the sequence
std::vector<ShownObject> moving_objects(std::span<const scene::MovingThing> things,
                                        const std::vector<std::uint32_t>& ids);

/// The tiles that a sequence shows, as a cut.
/// throws    Input: the store has not the tiles that it was captured with
std::vector<world::CutTile> cut_of(const world::TileStore& store,
                                   const capture::SequenceInfo& info);

/// The upright box with the least ground area around points.
/// frame     rotation whose columns are two level axes and up
/// returns   x along the longer side; of the two ways the one toward larger x of `frame`
/// accuracy  1e-9 m for points within 100 km of the origin
capture::OrientedBox smallest_upright_box(std::span<const Eigen::Vector3d> points_world,
                                          const Eigen::Matrix3d& world_from_level);

}  // namespace terracast::labels
