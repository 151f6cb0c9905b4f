#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "geo/trajectory.h"
#include "scene/conditions.h"
#include "scene/moving/moving_bodies.h"
#include "sensors/camera/fact_options.h"
#include "sensors/camera/imaging/imaging_options.h"

namespace terracast::sensors {

/// The cameras of a sequence and all that their images follow from beside the world.
struct CameraPlan {
  std::string name;
  std::string utc_start;
  std::int64_t seed = 1;
  std::vector<geo::BodyState> states;               ///< one a frame
  std::vector<capture::CameraCalibration> cameras;  ///< actual
  std::vector<ImagingOptions> imaging = {};         ///< one a camera; empty: no camera has any
  std::vector<scene::MovingThing> moving = {};      ///< beside the cameras' own body
  scene::ConditionOptions conditions;
  FactOptions facts = {};
};

}  // namespace terracast::sensors
