#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "capture/frame.h"
#include "core/schema.h"
#include "geo/trajectory.h"
#include "scene/moving/moving_bodies.h"
#include "tiler/objects/things.h"

namespace terracast::job {

/// throws   Config: there is no such thing; says what is near
const tiler::ThingInfo& thing_called(const std::string& name);
/// A thing that moves, without its motion.
scene::MovingThing moving_thing(const std::string& name, const tiler::ThingInfo& info, int variant);

/// Makes things that move, of which those of one kind and colour share their shapes, made when the first of them is
/// asked for. Threads: one at a time.
class MovingThings {
 public:
  /// As moving_thing().
  scene::MovingThing of(const std::string& name, const tiler::ThingInfo& info, int variant);

 private:
  std::map<std::pair<const tiler::ThingInfo*, int>, scene::MovingThing> known_;
};

/// Config `[[moving]]`: a thing that moves through every sequence.
struct MovingOptions : geo::MotionOptions {
  std::string name;
  std::string thing;
  std::int64_t variant = 0;
  std::string ride = "auto";
  double start_s = 0.0;
  bool repeat = false;

  void describe(core::SchemaVisitor& visit);
  /// throws Config: no such thing, one that does not move, no such colour or name
  void validate() const;
};

/// throws Config: a body that is shown as what is no thing, or two of one name; says which
void check_moving(std::span<const MovingOptions> moving,
                  std::span<const geo::TrajectoryOptions> trajectories);

/// The bodies that carry cameras, and how near to the world's origin along its x and y each of them stays, as in
/// geo::TrajectoryContext: what one carries may reach farther than what another does.
struct Bodies {
  std::span<const geo::TrajectoryOptions> trajectories = {};
  std::span<const double> half_sizes_m = {};
};

/// All that moves through a sequence: the things of the config, then the other bodies that are shown, whose motions
/// are those of their own sequences.
/// sequence   one of the bodies'; parts of the same flight are not shown in it
/// frames     the sequence's
/// context    of things that carry no cameras
/// throws     as geo::Trajectory's kinds; the message names the thing
std::vector<scene::MovingThing> lay_out_moving(std::span<const MovingOptions> moving,
                                               const Bodies& bodies,
                                               const geo::TrajectoryOptions& sequence,
                                               std::span<const geo::BodyState> frames,
                                               const geo::TrajectoryContext& context);

/// All that moves through a sequence that was captured, without its motion. Things of one kind share their shapes. What
/// swings does so as far as such things ever do.
/// throws   Input: a thing that this program does not know
std::vector<scene::MovingThing> captured_things(const capture::SequenceInfo& info);

}  // namespace terracast::job
