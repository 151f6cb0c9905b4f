#pragma once

#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "geo/trajectory.h"
#include "sensors/camera/camera_plan.h"
#include "sensors/camera/tracks.h"
#include "sensors/sensor.h"
#include "world/lod.h"

namespace terracast::render {

/// Everything that determines a sequence's frames.
struct SequencePlan : sensors::CameraPlan {
  double rate_hz = 10.0;
  geo::BodyMotion motion = {};  ///< of which `states` are samples; needed where there are sensors
  std::vector<sensors::MountedSensor> sensors = {};  ///< beside cameras
  /// Nominal, and the cameras' clocks, as in capture::SequenceInfo.
  std::vector<capture::CameraCalibration> believed_cameras = {};
  std::vector<capture::CameraClock> clocks = {};
  /// Of all sequences that show one geometry, its own among them; null: it shows a geometry of its own.
  std::shared_ptr<const std::vector<world::Viewpoint>> shared_viewpoints = nullptr;
  sensors::TrackOptions tracks;
  world::DetailOptions detail;
  std::string config_toml;
};

}  // namespace terracast::render
