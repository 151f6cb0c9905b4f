#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "geo/box3.h"
#include "geo/geodesy.h"
#include "geo/trajectory.h"
#include "world/moving_scene.h"
#include "world/ray_query.h"

namespace terracast::scene {

/// What a thing moves on.
enum class Ride {
  Free,  ///< as its motion has it
  Ground,  ///< it stands on the ground with its four corners; of its motion place and course on the map count
  Way,  ///< as Ground; where a bridge's deck is about as high as its motion is there, it stands on that
  Rails,  ///< as Way, on the places of its footing alone, and on bridges on the rails
  Water,  ///< it floats upright at the surface's height; likewise
};

/// A shape that moves, or a part of one, of a thing called `thing`.
struct MovingShape {
  std::string thing;
  std::shared_ptr<const world::PrototypeLibrary::Shown> shown;
};

/// A part of a thing that turns about an axis, or swings to and fro about it.
struct TurningPart {
  std::string name;   ///< "rotor1"
  MovingShape shape;  ///< its frame: that of the thing, about origin_m
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< of the part, in the thing's frame
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     ///< unit
  double rate_radps = 0.0;                             ///< about the axis, as time goes
  double per_metre_rad = 0.0;  ///< and as the thing goes forward: a wheel's 1 / radius
  /// Above 0: it swings so far to both sides, and what goes on at these rates is the swing's phase. Its angle is 0 at the
  /// phases 0 and pi, grows at the first, and changes nearly evenly between its ends.
  double swing_rad = 0.0;
  double phase_rad = 0.0;  ///< at time 0, before the thing has gone anywhere
};

/// About the part's axis.
/// rate_radps   of the angle, for a thing that goes forward at a speed
struct PartTurn {
  double angle_rad = 0.0;
  double rate_radps = 0.0;
};
PartTurn turn_of_part(const TurningPart& part, double time_s, double gone_m, double forward_mps);

/// A thing that moves through a sequence.
struct MovingThing {
  std::string name;
  MovingShape shape;
  std::uint32_t semantic_id = 0;
  std::uint8_t variety = 0;
  Ride ride = Ride::Free;
  /// Along and across, between the four places on which it stands, of what rides rails.
  Eigen::Vector2d footing_m = Eigen::Vector2d::Zero();
  std::vector<TurningPart> parts;
  std::vector<std::optional<geo::BodyState>> states;  ///< one a frame; nothing: it is not there
  std::vector<double> gone_m;  ///< one a frame: how far it went forward on the map since time 0
};

/// A body as images and labels know it.
struct BodyInfo {
  std::string name;
  std::string thing;                 ///< the kind of thing whose shape it has
  std::uint32_t instance_id = 0;     ///< shared by a thing and its parts
  std::uint32_t first_triangle = 0;  ///< added to the numbers of its triangles
  std::uint32_t semantic_id = 0;
  geo::Box3d box_m;  ///< of its shape, in its own frame
};

/// The bodies of things one after the other, each thing before its parts.
std::vector<BodyInfo> list_bodies(std::span<const MovingThing> things);

/// All bodies that move through a sequence, on the ground and the water of its world. Threads: safe.
class MovingBodies {
 public:
  MovingBodies() = default;
  /// query    of the world with its water; asked here alone
  /// throws   Input: as settle(); the thing and the frame are named
  MovingBodies(std::span<const MovingThing> things, const world::RayQuery& query,
               const geo::WorldFrame& frame);

  /// Bodies whose states are known already, as those of a captured sequence are.
  /// frames   for each frame the states of all bodies in the order of list_bodies(); states of `things` do not count
  MovingBodies(std::span<const MovingThing> things,
               std::span<const std::vector<std::optional<geo::BodyState>>> frames);

  bool is_empty() const { return bodies_.empty(); }
  /// In the order of list_bodies().
  std::vector<std::optional<geo::BodyState>> states(int frame) const;
  /// About the time of a frame.
  world::MovingScene scene(int frame, double reach_s) const;
  /// Of all that its bodies bring into a frame's images.
  std::string text_of(int frame) const;

 private:
  struct Body {
    BodyInfo info;
    std::shared_ptr<const world::PrototypeLibrary::Shown> shown;
    std::uint8_t variety = 0;
    std::vector<std::optional<geo::BodyState>> states;  ///< one a frame
  };
  std::vector<Body> bodies_;
};

/// Of the shapes and classes of things, for hashes.
std::string text_of_shapes(std::span<const MovingThing> things);

/// Where something on the ground, or on water, is and how it moves, from where its motion would have it be.
/// length_m, width_m   its own; 0 of both: it stands upright on its feet, as people do. On rails, between the places on
///                     which it stands
/// throws              Input: it is outside the world, in water that should ride the ground, or the other way round
geo::BodyState settle(const geo::BodyState& wanted, Ride ride, double length_m, double width_m,
                      const world::RayQuery& query, const geo::WorldFrame& frame);

/// The state of a part that turns on a thing that moves.
/// gone_m   by its thing
geo::BodyState state_of_part(const geo::BodyState& thing, const TurningPart& part, double gone_m);

}  // namespace terracast::scene
