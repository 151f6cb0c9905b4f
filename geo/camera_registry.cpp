#include <array>
#include <cmath>

#include "core/error.h"
#include "core/registry.h"
#include "geo/camera_model.h"

// Every camera model, in alphabetical order: X(name) is geo/cameras/name.cpp, which defines
// `CameraModelInfo name_camera()`.
#define TERRACAST_CAMERA_MODELS(X) X(pinhole)

namespace terracast::geo {

#define TERRACAST_DECLARE(name) CameraModelInfo name##_camera();
TERRACAST_CAMERA_MODELS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const CameraModelInfo> camera_models() {
#define TERRACAST_ENTRY(name) name##_camera(),
  static const std::array table = {TERRACAST_CAMERA_MODELS(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

std::unique_ptr<CameraModel> make_camera(const CameraIntrinsics& intrinsics) {
  const CameraModelInfo& info =
      core::find_registered(camera_models(), "camera model", intrinsics.model);
  if (intrinsics.width_px <= 0 || intrinsics.height_px <= 0) {
    core::fail(core::ErrorKind::Config, "camera image of {} x {} px: both must be 1 or more",
               intrinsics.width_px, intrinsics.height_px);
  }
  for (const double parameter : intrinsics.parameters) {
    if (!std::isfinite(parameter)) {
      core::fail(core::ErrorKind::Config, "camera model {}: a parameter of {} is {}", info.name,
                 info.parameters, parameter);
    }
  }
  return info.make(intrinsics);
}

}  // namespace terracast::geo
