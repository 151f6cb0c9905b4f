#pragma once

#include <string>
#include <vector>

#include "capture/frame.h"
#include "core/choice.h"
#include "core/schema.h"
#include "geo/camera_model.h"
#include "geo/rigid3.h"
#include "rigs/lens_options.h"
#include "rigs/rig_error_options.h"
#include "rigs/rig_template.h"
#include "sensors/camera/imaging/imaging_options.h"
#include "sensors/sensor.h"

namespace terracast::rigs {

/// A camera of a rig file: a model with its lens, physical optics or fx, fy, cx, cy; one way of stating
/// its orientation.
struct CameraOptions {
  std::string name;
  std::string model = "pinhole";
  LensOptions lens;  ///< of the model, once describe() was called
  std::int64_t width_px = 0;
  std::int64_t height_px = 0;
  double focal_length_mm =
      0.0;  ///< with image_plane_width_mm: fu = f Nu / d, fv = f Nu / (d gamma)
  double image_plane_width_mm = 0.0;
  double pixel_aspect = 1.0;  ///< gamma
  double fx_px = 0.0;
  double fy_px = 0.0;
  std::vector<double>
      principal_point_px;         ///< cx, cy with pixel centres at +0.5; empty: the image's centre
  std::vector<double> offset_mm;  ///< of the centre of projection, in the rig's axes; empty: 0
  std::vector<double> axis_angle_rad;  ///< rotation vector, in the rig's axes, that turns a camera
                                       ///< that looks forward
  std::vector<double>
      euler_deg;  ///< yaw, pitch, roll about the rig's up, left and forward axes, intrinsic z-y-x
  std::vector<double> quaternion_wxyz;
  std::vector<double>
      look_at_mm;  ///< a point in the rig's axes that the optical axis passes through
  double exposure_ms = 0.0;
  double line_time_us = 0.0;  ///< 0: a global shutter
  std::string readout = "down";
  double aperture_mm = 0.0;  ///< diameter of the entrance pupil; 0: a pinhole
  double focus_m = 0.0;      ///< 0: infinitely far

  void describe(core::SchemaVisitor& visit);
  void validate() const;

  /// Focal lengths in pixels, and the model's parameters.
  /// throws Config: a model that comes from a file
  void set_intrinsics(const geo::CameraIntrinsics& intrinsics);
  /// As offset_mm and quaternion_wxyz in FLU.
  void set_pose(const geo::Rigid3d& rig_from_camera);
};

/// A rig: cameras on a body. `axes = "rdf"`: offsets and rotations of the file are in x right, y
/// down, z forward (the axis-angle of a camera is then identity when it looks forward); "flu": x
/// forward, y left, z up. Either is turned into FLU once, here. With a template one camera is given,
/// whose optics all share; the template, whose keys stand beside, says where they are.
struct RigOptions {
  std::string name;
  std::string template_name = {};                       ///< empty: the cameras are as given
  core::KindOptions<RigTemplateInfo> arrangement = {};  ///< of the template
  std::string axes = "flu";
  double mount_yaw_deg = 0.0;    ///< body_from_rig: intrinsic z-y-x; positive yaw to the left
  double mount_pitch_deg = 0.0;  ///< positive: the rig looks down
  double mount_roll_deg = 0.0;
  std::vector<double> mount_offset_m;    ///< of the rig's origin in the body; empty: 0
  RigErrorOptions errors;                ///< of what the cameras are said to be
  sensors::ImagingOptions imaging = {};  ///< of each of the cameras
  std::vector<CameraOptions> cameras;
  std::vector<sensors::SensorOptions> sensors = {};  ///< beside cameras

  void describe(core::SchemaVisitor& visit);
  void validate() const;

  geo::Rigid3d body_from_rig() const;
  /// From the axes that offsets and rotations are given in.
  Eigen::Matrix3d rig_from_file() const;

  /// The cameras as given, or where the template puts them: then with offset_mm and quaternion_wxyz, in
  /// FLU.
  std::vector<CameraOptions> placed_cameras() const;
};

/// How the cameras of the rigs make their images, in the order of build_cameras; empty where none does any
/// but as the light is.
std::vector<sensors::ImagingOptions> imaging_of_cameras(const std::vector<RigOptions>& rigs);

/// The cameras of the rigs as the config says they are, in file order, with FLU rig frames.
/// throws Config: no rig, a rig without cameras, names that repeat, more than kMaxCameras, optics
/// that contradict
std::vector<capture::CameraCalibration> build_cameras(const std::vector<RigOptions>& rigs);

/// The rigs' sensors beside cameras, in file order, their clocks as they are believed to be. Those that look through a camera do so through the one that is given.
/// cameras   of the rigs, as they are
/// throws Config: two of a rig with one name, or that of a camera; a camera that a rig does not have, or through which a
///        sensor cannot look
std::vector<sensors::MountedSensor> mount_sensors(
    const std::vector<RigOptions>& rigs, const std::vector<capture::CameraCalibration>& cameras);
/// Through the cameras as the rigs have them.
std::vector<sensors::MountedSensor> mount_sensors(const std::vector<RigOptions>& rigs);

}  // namespace terracast::rigs
