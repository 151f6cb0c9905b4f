#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "geo/box3.h"
#include "geo/trajectory.h"

/// What moves through a sequence, beside the body that carries its cameras.
namespace terracast::capture {

struct SequenceInfo;
struct FrameRecord;

/// A rigid body that moves: a thing, or a part of it that turns, such as a rotor. Its frame: x forward, y left,
/// z up, m.
struct MovingBody {
  std::string name;   ///< its own in the sequence
  std::string thing;  ///< what it is, or a part of, of the built-in things
  /// From core::kFirstMovingId up, in the order of SequenceInfo::moving. A part has that of its thing, which it
  /// follows.
  std::uint32_t instance_id = 0;
  /// Triangles of all bodies of a thing are numbered one after the other (capture/channel.h): 0: the thing
  /// itself, else a part.
  std::uint32_t first_triangle = 0;
  std::uint32_t semantic_id = 0;  ///< SemanticClass of the thing; spots of it may be of others
  geo::Box3d box_m;               ///< of its shape, in its own frame
  bool is_part() const { return first_triangle > 0; }
  bool operator==(const MovingBody& other) const;
};

/// The body that a pixel shows; null: what it shows stands still, or is none of these.
const MovingBody* body_shown(const std::vector<MovingBody>& bodies, std::uint32_t instance_id,
                             std::uint32_t primitive_id);

/// How a body moves between the times of two frames. About each frame's time it goes on as its state then says
/// (geo::BodyState::pose_after).
struct BodyMotion {
  geo::BodyState from;
  std::optional<geo::BodyState> to;  ///< nothing: it is not there
};

/// What moves between two frames, to be found by what pixels show. Threads: safe.
class BodyMotions {
 public:
  BodyMotions() = default;
  /// Of all bodies that are there in the first frame.
  BodyMotions(const std::vector<MovingBody>& bodies,
              const std::vector<std::optional<geo::BodyState>>& from,
              const std::vector<std::optional<geo::BodyState>>& to);
  BodyMotions(const SequenceInfo& info, const FrameRecord& from, const FrameRecord& to);

  /// Of the body that a pixel shows; null: what it shows stands still.
  const BodyMotion* find(std::uint32_t instance_id, std::uint32_t primitive_id) const;

 private:
  /// By instance id and the first triangle.
  std::map<std::pair<std::uint32_t, std::uint32_t>, BodyMotion> motions_;
};

}  // namespace terracast::capture
