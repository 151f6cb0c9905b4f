#pragma once

#include <vector>

#include "validate/colmap/bundle_errors.h"
#include "validate/colmap/job.h"

/// A model that COLMAP made, as a bundle at its own poses or at those of the dataset.
namespace terracast::validate {

/// An image of the job that COLMAP placed.
struct Placed {
  const Shot* shot = nullptr;
  const ColmapImage* image = nullptr;
  Pose model_from_camera;
};
std::vector<Placed> placed_shots(const ColmapJob& job, const ColmapModel& model);

/// The bundle where COLMAP placed it, with the steps from frame to frame of each camera; views as in `placed`, no
/// view is in the drift.
Bundle found_bundle(const ColmapModel& model, const std::vector<Placed>& placed);

/// The same observations at the dataset's poses, with the points where these poses have them.
Bundle known_bundle(const ColmapModel& model, const std::vector<Placed>& placed);

}  // namespace terracast::validate
