#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "core/schema.h"
#include "geo/fixes/fix.h"
#include "geo/paths/place.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// Where a recording's coordinates stand in the world: keys that depend on what its places are.
struct PlacingOptions {
  std::string above;
  double pressure_offset_m = std::numeric_limits<double>::quiet_NaN();
  double home_height_m = 0.0;
  std::string home_above = "ground";
  Place origin;
  double x_heading_deg = 90.0;
  double height_offset_m = 0.0;
  std::string attitude = "auto";
  std::vector<double> lever_arm_m;  ///< along the body's axes; empty: 0

  /// frame          of the recording
  /// own_above      what its format says that heights are above; empty: nothing
  void describe(core::SchemaVisitor& visit, FixFrame frame, const std::string& own_above);
  /// throws   Config: heights that say not what they are above, a lever arm that is not finite
  void validate(FixFrame frame, const std::string& own_above) const;
};

/// A fix in the world.
struct PlacedFix {
  double time_s = 0.0;
  Eigen::Vector3d position_world = Eigen::Vector3d::Zero();
  /// The place as the file states it, which no lever arm moves.
  Eigen::Vector3d recorded = Eigen::Vector3d::Zero();
  /// What a receiver holds until its next fix: the place as the file states it, without the height, which may come
  /// from another sensor.
  Eigen::Vector3d held = Eigen::Vector3d::Zero();
  std::optional<Eigen::Quaterniond> world_from_body;
  std::optional<double> speed_mps;
  bool starts_part = false;
};

struct PlacedFixes {
  std::vector<PlacedFix> fixes;
  /// Those of FixTable::attitudes in the order of their times, which grow; each at the place where the body then is.
  std::vector<PlacedFix> attitudes;
  std::size_t num_without_place = 0;
  std::size_t num_without_height = 0;
  bool is_over_ground = false;         ///< no height of the file is taken; all fly over the ground
  std::size_t num_without_ground = 0;  ///< of heights above the ground, outside the world
  std::size_t num_without_attitude = 0;    ///< which the lever arm needs
  std::size_t num_attitudes_repeated = 0;  ///< of attitudes: at the time of another
  std::size_t num_attitudes_without_time = 0;
  std::string attitude_from;  ///< gimbal, body or path
};

/// Fixes of a table in the world; those without a place or height are counted and left out. With above = "none", or with
/// above = "ground" where the file states no height at all, all are height_offset_m above the ground.
/// With a lever arm they become places of the body's reference point; fixes without an attitude of the body, beyond the
/// first and last of its timed attitudes, or between two that are more than max_gap_s apart, are counted and left out
/// then.
/// throws   Config: no geoid or attitude where one is needed, no height anywhere; Input: no latitude or longitude,
///          heights beyond -12 km to 1000 km
PlacedFixes place_fixes(const FixTable& table, const PlacingOptions& options,
                        const std::string& heights_above, double max_gap_s,
                        const TrajectoryContext& context);

}  // namespace terracast::geo
