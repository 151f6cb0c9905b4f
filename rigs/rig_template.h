#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/schema.h"
#include "geo/rigid3.h"

namespace terracast::rigs {

/// Where a template puts a camera.
struct CameraPlace {
  std::string suffix;  ///< added to the name of the camera that is put there: "0", "_left"
  geo::Rigid3d rig_from_camera;
};

/// An arrangement of like cameras; the derived class describes its keys and finds the places.
class RigTemplate {
 public:
  virtual ~RigTemplate() = default;
  virtual void describe(core::SchemaVisitor& visit) = 0;
  /// throws Config: keys that contradict each other
  virtual void validate() const {}
  virtual std::unique_ptr<RigTemplate> clone() const = 0;
  /// In the order of the cameras; at most capture::kMaxCameras are of use.
  virtual std::vector<CameraPlace> places() const = 0;
};

struct RigTemplateInfo {
  std::string_view name;
  std::string_view summary;
  std::unique_ptr<RigTemplate> (*make)();
};

/// The table of templates.
std::span<const RigTemplateInfo> rig_templates();

/// Of a camera that looks along the rig's x axis, turned by yaw about up (positive to the left), then
/// by pitch about left (positive down), then by roll about forward; rows of the image are level without roll.
Eigen::Quaterniond rotation_of_euler_deg(double yaw_deg, double pitch_deg, double roll_deg);

/// rig_from_camera of that camera at a place in the rig.
geo::Rigid3d rig_from_camera_of_euler_deg(double yaw_deg, double pitch_deg,
                                          const Eigen::Vector3d& place_mm);

/// rig_from_camera on a compound eye whose axis is the rig's forward: Rz(roll) Rx(pitch) in the axes of a
/// camera that looks along it (x right, y down, z forward), the centre a radius out along the camera's axis.
geo::Rigid3d rig_from_eye_camera(double roll_deg, double pitch_deg, double radius_mm);

}  // namespace terracast::rigs
