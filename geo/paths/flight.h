#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "geo/paths/path.h"
#include "geo/paths/path_motion.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// How a body that travels a path holds itself, and how smoothly it goes.
struct AttitudeOptions {
  std::string bank = "coordinated";
  double max_bank_deg = 30.0;
  double bank_smoothing_s = 1.0;
  std::string pitch = "path";
  std::string continuity = "second";

  void describe(core::SchemaVisitor& visit);
  /// The attitude these options ask for, nose forward.
  Attitude attitude() const;
  /// Radius of a turn that banks by four fifths of what is allowed, or by 24 degrees where none banks.
  double turn_radius_m(double speed_mps) const;
  Continuity continuity_of_path() const {
    return continuity == "fourth" ? Continuity::Fourth : Continuity::Second;
  }
};

/// The keys that all kinds of flight share.
struct FlightOptions : AttitudeOptions {
  double speed_mps = 15.0;
  double min_agl_m = 5.0;
  bool terrain_following = false;
  double follow_length_m = 200.0;
  double max_climb_deg = 45.0;

  void describe(core::SchemaVisitor& visit);
};

/// What a kind of trajectory hands over to be flown.
struct FlightPlan {
  std::shared_ptr<const Path> path;
  /// Speeds wanted at parameters from 0 to the path's end; empty: the options' speed throughout.
  struct SpeedAtParameter {
    double u;
    double speed_mps;
  };
  std::vector<SpeedAtParameter> speeds;
  Attitude attitude;
  double laps = 1.0;
  /// What the user would change to raise the path at a parameter: "raise waypoint 3".
  std::function<std::string(double u)> how_to_raise;
  /// What makes the path follow the ground where it does not yet; empty: the kind cannot.
  std::string how_to_follow = "set terrain_following";
};

/// The motion along a plan, after raising it over the ground where the options say so.
/// throws Input: the path leaves the world, is below min_agl_m above ground, or climbs too steeply;
/// with the time and the place
std::unique_ptr<Trajectory> fly(const FlightPlan& plan, const FlightOptions& options,
                                const TrajectoryContext& context);

}  // namespace terracast::geo
