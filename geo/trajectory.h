#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/choice.h"
#include "core/log.h"
#include "core/schema.h"
#include "geo/body_state.h"
#include "geo/geodesy.h"
#include "geo/geoid.h"

namespace terracast::geo {

/// A motion that can be asked at any time. Its poses are one curve, of which velocity, acceleration, jerk, angular
/// velocity and angular acceleration are the exact derivatives. Positions are twice continuously
/// differentiable, attitudes once; jerk and angular acceleration may jump at knots, where they are those that follow. Threads: safe.
class Trajectory {
 public:
  virtual ~Trajectory() = default;
  virtual double duration_s() const = 0;
  /// time_s   any that is finite. The motion proper lasts from 0 to duration_s; a shutter or another sensor may look
  ///          a little before and after. There a closed path goes round, a recording follows its own fixes, or its
  ///          end piece, and another motion keeps the acceleration that it has at its end.
  /// accuracy   each is the derivative of the one before it to 1e-9 of its largest; TrajectoryLaws
  virtual MotionState at(double time_s) const = 0;
  /// Times from 0 to duration_s, increasing, between which the motion has all derivatives. Not listed are the times at
  /// which the blend of a slow recording's heading (`slow_mps`) begins and ends, where its third derivative jumps.
  virtual std::vector<double> knots_s() const = 0;
  /// Wind at the body, along the world's axes; 0 of motions in still air.
  virtual Eigen::Vector3d wind_world_mps(double /*time_s*/) const {
    return Eigen::Vector3d::Zero();
  }
  /// UTC of time 0 in seconds since 1970, of motions that were recorded with their time of day.
  virtual std::optional<double> utc_start_unix_s() const { return std::nullopt; }
};

/// Knots in order, each once, for knots_s().
std::vector<double> sorted_knots(std::vector<double> knots_s);

/// Ellipsoidal height of the measured ground (never of synthetic detail) below or above a place;
/// nothing where the world has no ground.
using GroundHeight = std::function<std::optional<double>(double lat_deg, double lon_deg)>;

/// What trajectories are built on.
struct TrajectoryContext {
  const WorldFrame& frame;
  GroundHeight ground_height_m;
  std::shared_ptr<const Geoid> geoid;  ///< may be null; then heights above the geoid are refused
  const core::Log* log = nullptr;      ///< where what was dropped from a recording is told; or null
  double rate_hz = 10.0;               ///< frames a second that will be taken
  double reach_s = 0.0;                ///< a frame's exposures lie so near to its time
  /// Bodies stay so near the world's origin along its x and y: inside the world with all they carry.
  double half_size_m = std::numeric_limits<double>::infinity();

  /// What keeps to the ground or the water is put there later: how high its motion is does not matter.
  bool is_on_surface = false;

  bool is_inside(const Eigen::Vector3d& position_world) const {
    return std::abs(position_world.x()) <= half_size_m &&
           std::abs(position_world.y()) <= half_size_m;
  }
};

/// Options of one kind of trajectory; the derived class describes its keys and builds the motion.
class TrajectoryKind {
 public:
  virtual ~TrajectoryKind() = default;
  virtual void describe(core::SchemaVisitor& visit) = 0;
  /// throws Config: options that contradict each other
  virtual void validate() const {}
  virtual std::unique_ptr<TrajectoryKind> clone() const = 0;
  /// Whether split() is to be asked: the entry becomes several sequences.
  virtual bool is_split() const { return false; }
  /// The kinds of those sequences in order; motions shorter than that are left out, and told.
  /// throws as build()
  virtual std::vector<std::unique_ptr<TrajectoryKind>> split(const TrajectoryContext& context,
                                                             double least_duration_s) const;
  /// throws Config: options that contradict each other
  ///        Input: places without ground, motion under ground
  virtual std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const = 0;
};

struct TrajectoryKindInfo {
  std::string_view name;
  std::string_view summary;
  std::unique_ptr<TrajectoryKind> (*make)();
};

/// The table of kinds, in the order of their names.
std::span<const TrajectoryKindInfo> trajectory_kinds();

/// A motion of a config: its kind, and beside it the kind's own keys.
struct MotionOptions {
  std::string kind;

  void describe_kind(core::SchemaVisitor& visit);
  /// The keys of the kind that describe_kind() found.
  void describe_keys(core::SchemaVisitor& visit);

  bool has_kind_options() const { return kind_options_.is_made(); }
  /// The kind's own options, which there are once describe_keys() was called.
  const TrajectoryKind& kind_options() const { return *kind_options_; }
  void set_kind_options(std::unique_ptr<TrajectoryKind> options) {
    kind_options_.set(kind, std::move(options));
  }

 private:
  core::KindOptions<TrajectoryKindInfo> kind_options_;
};

/// A `[trajectory]` of a config: its motion, and when frames are taken.
struct TrajectoryOptions : MotionOptions {
  std::string name = "P000";
  double rate_hz = 10.0;           ///< frames a second
  std::int64_t num_frames = 0;     ///< 0: as many as the motion's duration holds
  double start_s = 0.0;            ///< time of frame 0 on the motion
  std::string utc_start = "auto";  ///< UTC of frame 0; the sun stands accordingly
  /// The thing as which the body is seen from the other trajectories' cameras; empty: it is not.
  std::string shown_as;
  std::vector<std::string>
      rigs;  ///< names of the rigs that the body carries; empty: all that there are
  std::string
      split_from;  ///< name of the entry of which split_sequences() made this; empty: of none

  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// The sequences that an entry becomes: itself, or parts of it, called name_0, name_1, ….
/// throws Input: no part is long enough for num_frames, or for two where that is 0
std::vector<TrajectoryOptions> split_sequences(const TrajectoryOptions& options,
                                               const TrajectoryContext& context);

/// The motion of a sequence's body, which starts somewhere on a trajectory. Threads: safe.
struct BodyMotion {
  std::shared_ptr<const Trajectory> trajectory;
  double start_s = 0.0;  ///< time of the trajectory at which the sequence's time is 0

  /// The state at a time of the sequence.
  MotionState at(double time_s) const;
  Eigen::Vector3d wind_world_mps(double time_s) const {
    return trajectory->wind_world_mps(start_s + time_s);
  }
};

/// Frames of a sequence.
struct SampledFrames {
  std::vector<BodyState> states;
  BodyMotion motion;
  std::string utc_start;  ///< of the first; utc_start = "auto" is the recording's own, where it has
                          ///< one, or else 2025-06-21T10:00:00Z
};

/// The states at which frames are taken: frame i at start_s + i / rate_hz of the motion, its own
/// time i / rate_hz. Each goes on as the motion does within context.reach_s (fit_terms()). The options' rate
/// takes the place of context.rate_hz.
/// throws Config: more frames asked for than the motion has time for (says how many fit)
SampledFrames sample_frames(const TrajectoryOptions& options, const TrajectoryContext& context);

}  // namespace terracast::geo
