#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "geo/trajectory.h"
#include "rigs/rig.h"

/// Which rigs of a config each of its bodies carries.
namespace terracast::job {

/// throws   Config: two rigs of one name; a trajectory that names a rig twice, or one that there is not; a rig that no
///          trajectory carries
void check_carried_rigs(const std::vector<rigs::RigOptions>& rigs,
                        std::span<const geo::TrajectoryOptions> trajectories);

/// Those of a body, in the config's order.
std::vector<rigs::RigOptions> carried_rigs(const std::vector<rigs::RigOptions>& rigs,
                                           const geo::TrajectoryOptions& trajectory);

/// Removes rigs that none of the trajectories carries, and names those of a body in the order of the rigs; of one that
/// carries all, none. What is left says the same of these trajectories.
void keep_carried_rigs(std::vector<rigs::RigOptions>& rigs,
                       std::vector<geo::TrajectoryOptions>& trajectories);

/// The cameras that the bodies of a config carry. Threads: safe.
class CarriedCameras {
 public:
  CarriedCameras() = default;
  /// throws   Config: as rigs::build_cameras() of each body's rigs
  CarriedCameras(const std::vector<rigs::RigOptions>& rigs,
                 std::span<const geo::TrajectoryOptions> trajectories);

  /// As the config has them; errors are sequences'.
  /// trajectory   one of the config's, or a part of one
  const std::vector<capture::CameraCalibration>& of(const geo::TrajectoryOptions& trajectory) const;
  /// From the body to where its farthest ray starts.
  double reach_m(const geo::TrajectoryOptions& trajectory) const;

 private:
  /// By the names that a trajectory has.
  std::map<std::vector<std::string>, std::vector<capture::CameraCalibration>> cameras_;
};

}  // namespace terracast::job
