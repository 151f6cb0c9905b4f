#include "rigs/rig_template.h"

#include <array>

#include "geo/frames.h"
#include "geo/units.h"

// Every template, in alphabetical order: X(name) is render/rig_templates/name.cpp, which defines
// `RigTemplateInfo name_rig()`.
#define TERRACAST_RIG_TEMPLATES(X) \
  X(array) X(compound_eye) X(cube) X(cylinder) X(stereo) X(surround)

namespace terracast::rigs {

#define TERRACAST_DECLARE(name) RigTemplateInfo name##_rig();
TERRACAST_RIG_TEMPLATES(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const RigTemplateInfo> rig_templates() {
#define TERRACAST_ENTRY(name) name##_rig(),
  static const std::array table = {TERRACAST_RIG_TEMPLATES(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

Eigen::Quaterniond rotation_of_euler_deg(double yaw_deg, double pitch_deg, double roll_deg) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return AngleAxisd(geo::radians_from_degrees(yaw_deg), Vector3d::UnitZ()) *
         AngleAxisd(geo::radians_from_degrees(pitch_deg), Vector3d::UnitY()) *
         AngleAxisd(geo::radians_from_degrees(roll_deg), Vector3d::UnitX());
}

geo::Rigid3d rig_from_camera_of_euler_deg(double yaw_deg, double pitch_deg,
                                          const Eigen::Vector3d& place_mm) {
  return {.rotation = (rotation_of_euler_deg(yaw_deg, pitch_deg, 0.0) *
                       Eigen::Quaterniond(geo::rig_from_forward_camera()))
                          .normalized(),
          .translation = place_mm * 1e-3};
}

geo::Rigid3d rig_from_eye_camera(double roll_deg, double pitch_deg, double radius_mm) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  const Eigen::Quaterniond rotation =
      Eigen::Quaterniond(geo::rig_from_forward_camera()) *
      AngleAxisd(geo::radians_from_degrees(roll_deg), Vector3d::UnitZ()) *
      AngleAxisd(geo::radians_from_degrees(pitch_deg), Vector3d::UnitX());
  return {.rotation = rotation.normalized(),
          .translation = rotation * Vector3d::UnitZ() * (1e-3 * radius_mm)};
}

}  // namespace terracast::rigs
