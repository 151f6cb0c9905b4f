#include "job/carried_rigs.h"

#include <algorithm>
#include <iterator>
#include <set>

#include "core/error.h"
#include "core/registry.h"
#include "geo/camera_model.h"

namespace terracast::job {
namespace {

using core::ErrorKind;
using core::fail;

bool carries(const geo::TrajectoryOptions& trajectory, const std::string& rig) {
  const std::vector<std::string>& names = trajectory.rigs;
  return names.empty() || std::find(names.begin(), names.end(), rig) != names.end();
}

bool is_carried(const std::string& rig, std::span<const geo::TrajectoryOptions> trajectories) {
  return std::any_of(
      trajectories.begin(), trajectories.end(),
      [&](const geo::TrajectoryOptions& trajectory) { return carries(trajectory, rig); });
}

std::vector<std::string> names_of(const std::vector<rigs::RigOptions>& rigs) {
  std::vector<std::string> names;
  for (const rigs::RigOptions& rig : rigs) names.push_back(rig.name);
  return names;
}

/// index   of the trajectory in the config
void check_names(const geo::TrajectoryOptions& trajectory, std::size_t index,
                 const std::vector<std::string>& known) {
  const auto key = [&] {
    return fmt::format("trajectories[{}].rigs of {}", index, trajectory.name);
  };
  std::set<std::string> seen;
  for (const std::string& name : trajectory.rigs) {
    if (std::find(known.begin(), known.end(), name) == known.end())
      fail(ErrorKind::Config, "{}: {}", key(), core::unknown_name_message("rig", name, known));
    if (!seen.insert(name).second)
      fail(ErrorKind::Config, "{}: \"{}\" is named twice; once is right", key(), name);
  }
}

}  // namespace

void check_carried_rigs(const std::vector<rigs::RigOptions>& rigs,
                        std::span<const geo::TrajectoryOptions> trajectories) {
  const std::vector<std::string> known = names_of(rigs);
  std::set<std::string> seen;
  for (const std::string& name : known)
    if (!seen.insert(name).second)
      fail(ErrorKind::Config, "two rigs are called {}; each needs its own name", name);
  for (std::size_t i = 0; i < trajectories.size(); ++i) check_names(trajectories[i], i, known);
  for (std::size_t i = 0; i < rigs.size(); ++i)
    if (!is_carried(known[i], trajectories))
      fail(ErrorKind::Config,
           "rigs[{}]: no trajectory carries the rig {}; name it in the `rigs` of one, or leave it "
           "out",
           i, known[i]);
}

std::vector<rigs::RigOptions> carried_rigs(const std::vector<rigs::RigOptions>& rigs,
                                           const geo::TrajectoryOptions& trajectory) {
  std::vector<rigs::RigOptions> carried;
  std::copy_if(rigs.begin(), rigs.end(), std::back_inserter(carried),
               [&](const rigs::RigOptions& rig) { return carries(trajectory, rig.name); });
  return carried;
}

void keep_carried_rigs(std::vector<rigs::RigOptions>& rigs,
                       std::vector<geo::TrajectoryOptions>& trajectories) {
  std::erase_if(rigs,
                [&](const rigs::RigOptions& rig) { return !is_carried(rig.name, trajectories); });
  for (geo::TrajectoryOptions& trajectory : trajectories) {
    trajectory.rigs = names_of(carried_rigs(rigs, trajectory));
    if (trajectory.rigs.size() == rigs.size()) trajectory.rigs.clear();
  }
}

CarriedCameras::CarriedCameras(const std::vector<rigs::RigOptions>& rigs,
                               std::span<const geo::TrajectoryOptions> trajectories) {
  for (const geo::TrajectoryOptions& trajectory : trajectories) {
    if (cameras_.contains(trajectory.rigs)) continue;
    const auto build = [&] { return rigs::build_cameras(carried_rigs(rigs, trajectory)); };
    cameras_.emplace(
        trajectory.rigs,
        trajectory.rigs.empty()
            ? build()
            : core::with_context(
                  build, fmt::format("building the rigs of trajectory {}", trajectory.name)));
  }
}

const std::vector<capture::CameraCalibration>& CarriedCameras::of(
    const geo::TrajectoryOptions& trajectory) const {
  return cameras_.at(trajectory.rigs);
}

double CarriedCameras::reach_m(const geo::TrajectoryOptions& trajectory) const {
  double reach_m = 0.0;
  for (const capture::CameraCalibration& camera : of(trajectory)) {
    const auto model = geo::make_camera(camera.intrinsics);
    for (const double x : {0.0, static_cast<double>(model->width_px())})
      for (const double y : {0.0, static_cast<double>(model->height_px())})
        reach_m = std::max(reach_m,
                           (camera.body_from_camera() * model->origin_from_pixel({x, y})).norm());
  }
  return reach_m;
}

}  // namespace terracast::job
