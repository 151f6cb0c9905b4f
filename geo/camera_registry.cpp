#include <cmath>

#include "core/error.h"
#include "core/plugin_rows.h"
#include "core/registry.h"
#include "geo/camera_model.h"

// Every camera model, in alphabetical order: X(name) is geo/cameras/name.cpp, which defines
// `CameraModelInfo name_camera()`.
// clang-format off
#define TERRACAST_CAMERA_MODELS(X) \
  X(cylindrical)                   \
  X(double_sphere)                 \
  X(equirectangular)               \
  X(extended_unified)              \
  X(fov)                           \
  X(full_opencv)                   \
  X(opencv)                        \
  X(opencv_fisheye)                \
  X(orthographic)                  \
  X(pinhole)                       \
  X(pushbroom)                     \
  X(radial)                        \
  X(simple_radial)                 \
  X(tabulated)                     \
  X(thin_prism_fisheye)            \
  X(unified)
// clang-format on

namespace terracast::geo {

#define TERRACAST_DECLARE(name) CameraModelInfo name##_camera();
TERRACAST_CAMERA_MODELS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const CameraModelInfo> camera_models() {
#define TERRACAST_ENTRY(name) name##_camera(),
  static const auto table =
      core::with_plugin_rows<CameraModelInfo>({TERRACAST_CAMERA_MODELS(TERRACAST_ENTRY)});
#undef TERRACAST_ENTRY
  return table;
}

std::string CameraModelInfo::parameter_names() const {
  std::string names = "fx, fy, cx, cy";
  for (const CameraParameter& parameter : parameters) names += fmt::format(", {}", parameter.name);
  return names;
}

std::unique_ptr<CameraModel> make_camera(const CameraIntrinsics& intrinsics) {
  using core::ErrorKind;
  using core::fail;
  const CameraModelInfo& info =
      core::find_registered(camera_models(), "camera model", intrinsics.model);
  const std::vector<double>& p = intrinsics.parameters;
  if (intrinsics.width_px <= 0 || intrinsics.height_px <= 0)
    fail(ErrorKind::Config, "camera image of {} x {} px: both must be 1 or more",
         intrinsics.width_px, intrinsics.height_px);
  constexpr std::size_t kCommon = 4;
  const std::size_t num_parameters = kCommon + info.parameters.size();
  if (info.read == nullptr ? p.size() != num_parameters : p.size() < num_parameters)
    fail(ErrorKind::Config, "camera model {} has {} parameters; it takes {}: {}", info.name,
         p.size(), num_parameters, info.parameter_names());
  for (const double parameter : p)
    if (!std::isfinite(parameter))
      fail(ErrorKind::Config, "camera model {}: a parameter of {} is {}", info.name,
           info.parameter_names(), parameter);
  if (!(p[0] > 0.0) || !(p[1] > 0.0))
    fail(ErrorKind::Config,
         "camera model {}: focal lengths fx = {} px, fy = {} px; both must be positive", info.name,
         p[0], p[1]);
  for (std::size_t i = 0; i < info.parameters.size(); ++i) {
    const CameraParameter& own = info.parameters[i];
    const double value = p[kCommon + i];
    if (value < own.lowest || value > own.highest)
      fail(ErrorKind::Config, "camera model {}: {} = {} is outside {} to {}", info.name, own.name,
           value, own.lowest, own.highest);
  }
  return core::made(info.make(intrinsics), "camera model", info.name);
}

}  // namespace terracast::geo
