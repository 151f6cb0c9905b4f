#include "rigs/rig.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <span>
#include <utility>

#include "capture/channel.h"
#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/plugin_rows.h"
#include "core/printable.h"
#include "core/registry.h"
#include "geo/frames.h"
#include "geo/units.h"

namespace terracast::rigs {
namespace {

using core::ErrorKind;
using core::fail;

void check_name(const char* what, const std::string& name) {
  if (!capture::is_safe_name(name)) {
    fail(ErrorKind::Config,
         "{} name \"{}\" names a folder; it takes 1 to 64 letters, digits, _ or -", what, name);
  }
}

void check_numbers(const std::string& camera, const char* key, const std::vector<double>& values,
                   std::size_t count) {
  if (values.empty()) return;
  if (values.size() != count) {
    fail(ErrorKind::Config, "camera {}: {} has {} numbers; it takes {}", camera, key, values.size(),
         count);
  }
  for (const double value : values) {
    if (!std::isfinite(value)) {
      fail(ErrorKind::Config, "camera {}: {} holds {}; it takes finite numbers", camera, key,
           value);
    }
  }
}

Eigen::Vector3d vector_of(const std::vector<double>& values) {
  return values.empty() ? Eigen::Vector3d::Zero()
                        : Eigen::Vector3d(values[0], values[1], values[2]);
}

/// A camera that looks along `axis_rig` with its x axis level in the rig; straight up or down, the
/// image's upper edge points forward or back.
Eigen::Matrix3d rig_from_camera_looking_along(const Eigen::Vector3d& axis_rig) {
  const Eigen::Vector3d forward = axis_rig.normalized();
  Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ());
  if (right.norm() < 1e-9) right = -Eigen::Vector3d::UnitY();
  right.normalize();
  Eigen::Matrix3d rotation;
  rotation << right, forward.cross(right), forward;
  return rotation;
}

/// The rotation that a camera's file states, of a camera that looked along the rig's x axis, in the
/// file's axes.
Eigen::Matrix3d stated_rotation(const CameraOptions& camera) {
  if (!camera.axis_angle_rad.empty()) {
    const Eigen::Vector3d vector = vector_of(camera.axis_angle_rad);
    const double angle = vector.norm();
    if (angle == 0.0) return Eigen::Matrix3d::Identity();
    return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
  }
  if (!camera.quaternion_wxyz.empty()) {
    const std::vector<double>& q = camera.quaternion_wxyz;
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  }
  return Eigen::Matrix3d::Identity();
}

geo::Rigid3d rig_from_camera(const CameraOptions& camera, const Eigen::Matrix3d& rig_from_file) {
  const Eigen::Vector3d offset_rig = rig_from_file * (vector_of(camera.offset_mm) * 1e-3);
  Eigen::Matrix3d rotation;
  if (!camera.look_at_mm.empty()) {
    const Eigen::Vector3d target_rig = rig_from_file * (vector_of(camera.look_at_mm) * 1e-3);
    rotation = rig_from_camera_looking_along(target_rig - offset_rig);
  } else if (!camera.euler_deg.empty()) {
    const std::vector<double>& e = camera.euler_deg;
    rotation =
        rotation_of_euler_deg(e[0], e[1], e[2]).toRotationMatrix() * geo::rig_from_forward_camera();
  } else {
    rotation = rig_from_file * stated_rotation(camera) * rig_from_file.transpose() *
               geo::rig_from_forward_camera();
  }
  return {.rotation = Eigen::Quaterniond(rotation).normalized(), .translation = offset_rig};
}

int num_orientations(const CameraOptions& camera) {
  return static_cast<int>(!camera.axis_angle_rad.empty()) +
         static_cast<int>(!camera.euler_deg.empty()) +
         static_cast<int>(!camera.quaternion_wxyz.empty()) +
         static_cast<int>(!camera.look_at_mm.empty());
}

geo::Shutter shutter_of(const CameraOptions& camera) {
  const auto* const readout =
      std::find(std::begin(geo::kReadoutNames), std::end(geo::kReadoutNames), camera.readout);
  if (readout == std::end(geo::kReadoutNames))
    fail(ErrorKind::Config, "camera {}: readout = \"{}\"; known are down, up, right and left",
         camera.name, camera.readout);
  return {.exposure_s = 1e-3 * camera.exposure_ms,
          .line_time_s = 1e-6 * camera.line_time_us,
          .readout = static_cast<geo::Readout>(readout - std::begin(geo::kReadoutNames))};
}

geo::CameraIntrinsics intrinsics_of(const CameraOptions& camera) {
  double fx = camera.fx_px;
  double fy = camera.fy_px > 0.0 ? camera.fy_px : camera.fx_px;
  if (camera.focal_length_mm > 0.0) {
    fx =
        camera.focal_length_mm * static_cast<double>(camera.width_px) / camera.image_plane_width_mm;
    fy = camera.focal_length_mm * static_cast<double>(camera.width_px) /
         (camera.image_plane_width_mm * camera.pixel_aspect);
  }
  LensOptions lens = camera.lens;
  lens.set_model(camera.model);
  const auto width_px = static_cast<int>(camera.width_px);
  const auto height_px = static_cast<int>(camera.height_px);
  if (fx <= 0.0 && lens.model().whole_view != nullptr) {
    const Eigen::Vector2d focal_px = lens.model().whole_view(width_px, height_px);
    fx = focal_px.x();
    fy = focal_px.y();
  }
  const std::vector<double>& center = camera.principal_point_px;
  const double cx = center.empty() ? 0.5 * static_cast<double>(camera.width_px) : center[0];
  const double cy = center.empty() ? 0.5 * static_cast<double>(camera.height_px) : center[1];
  return {.model = camera.model,
          .width_px = width_px,
          .height_px = height_px,
          .parameters = lens.parameters(fx, fy, cx, cy)};
}

/// Whether the rig's error of focal lengths can be this camera's.
void check_focal_length_error(const RigOptions& rig, const CameraOptions& camera) {
  if (rig.errors.focal_length_sd_mm > 0.0 && !(camera.focal_length_mm > 0.0))
    fail(
        ErrorKind::Config,
        "rig {}: errors.focal_length_sd_mm is given, but camera {} states no focal_length_mm; give "
        "focal_length_sd_px",
        rig.name, camera.name);
  const geo::CameraModelInfo& info =
      core::find_registered(geo::camera_models(), "camera model", camera.model);
  if (rig.errors.has_focal_length() && info.read != nullptr)
    fail(ErrorKind::Config,
         "rig {}: errors of the focal length, but camera {} is of the model {}, which comes from a "
         "file and has none",
         rig.name, camera.name, camera.model);
}

/// Whether models that count pixels or rows a metre have these.
void check_scale_on_the_ground(const CameraOptions& camera) {
  const bool is_pushbroom = camera.model == "pushbroom";
  if (!is_pushbroom && camera.model != "orthographic") return;
  if (camera.focal_length_mm > 0.0)
    fail(ErrorKind::Config, "camera {}: focal_length_mm with the model {}; give fx_px, {}",
         camera.name, camera.model,
         is_pushbroom ? "in pixels, and fy_px, rows a metre of the way"
                      : "pixels a metre, and fy_px where it differs");
  if (is_pushbroom && !(camera.fy_px > 0.0))
    fail(ErrorKind::Config,
         "camera {}: no fy_px; of the model pushbroom it is rows a metre of the way, and fx_px, in "
         "pixels, says nothing of it",
         camera.name);
}

/// Whether a model whose rays start at many places can have the camera's shutter and lens.
void check_shutter_and_lens(const geo::CameraModel& model, const CameraOptions& camera) {
  if (model.is_central()) return;
  if (camera.aperture_mm > 0.0)
    fail(
        ErrorKind::Config,
        "camera {}: aperture_mm = {} with the model {}, whose rays start at many places: it has no "
        "one entrance pupil; leave aperture_mm and focus_m out, all is sharp",
        camera.name, camera.aperture_mm, camera.model);
  if (camera.line_time_us > 0.0 && camera.model == "pushbroom")
    fail(ErrorKind::Config,
         "camera {}: line_time_us = {} with the model pushbroom, whose rows are taken on the way "
         "that "
         "fy_px states; leave line_time_us out, or take a pinhole of one row on a body that moves",
         camera.name, camera.line_time_us);
}

/// Gives a sensor the camera that it names, and that one's place.
void look_through_camera(const std::vector<capture::CameraCalibration>& cameras,
                         sensors::MountedSensor& mounted) {
  const std::string name = mounted.sensor->camera();
  if (name.empty()) return;
  capture::StreamInfo& info = mounted.info;
  const auto camera = std::find_if(cameras.begin(), cameras.end(), [&](const auto& one) {
    return one.rig == info.rig && one.name == name;
  });
  if (camera == cameras.end())
    fail(ErrorKind::Config, "rig {}: sensor {} looks through camera = \"{}\", which the rig lacks",
         info.rig, info.name, core::printable(name));
  if (!geo::make_camera(camera->intrinsics)->is_central())
    fail(ErrorKind::Config,
         "rig {}: sensor {} looks through camera {} of the model {}, whose rays start at many "
         "places; give it one with one centre of projection",
         info.rig, info.name, name, camera->intrinsics.model);
  mounted.camera = *camera;
  info.body_from_rig = camera->body_from_rig;
  info.rig_from_sensor = {
      .rotation = Eigen::Quaterniond(camera->rig_from_camera.rotation.toRotationMatrix() *
                                     geo::rig_from_forward_camera().transpose())
                      .normalized(),
      .translation = camera->rig_from_camera.translation};
}

}  // namespace

void CameraOptions::describe(core::SchemaVisitor& visit) {
  const core::Constraint three = core::size_of(3);
  visit.key("name", name, "Name of the camera, and of its folder.", core::required());
  visit.key("model", model,
            "Camera model; it decides further keys (`terracast config explain MODEL`).",
            core::one_of(core::registry_names(geo::camera_models())));
  visit.key("width_px", width_px, "Width of the image.", core::required(core::between(1, 16384)));
  visit.key("height_px", height_px, "Height of the image.",
            core::required(core::between(1, 16384)));
  visit.key("focal_length_mm", focal_length_mm,
            "Focal length; with image_plane_width_mm, instead of fx_px: fu = f Nu / d.",
            core::between(0.0, 5000.0));
  visit.key("image_plane_width_mm", image_plane_width_mm,
            "Width d of the image plane over all Nu columns.", core::between(0.0, 1000.0));
  visit.key("pixel_aspect", pixel_aspect,
            "Height of a pixel over its width, gamma: fv = f Nu / (d gamma).",
            core::between(0.1, 10.0));
  visit.key(
      "fx_px", fx_px,
      "Focal length in pixels, horizontally; of panoramas pixels a radian, 0: the whole view; "
      "of orthographic cameras pixels a metre; of pushbroom cameras pixels across the way.",
      core::between(0.0, 1e6));
  visit.key(
      "fy_px", fy_px,
      "Focal length in pixels, vertically; 0: as fx_px. Of pushbroom cameras rows a metre of the "
      "way, which must be given.",
      core::between(0.0, 1e6));
  visit.key("principal_point_px", principal_point_px,
            "cx, cy with pixel centres at +0.5; empty: the image's centre.", core::size_of(2));
  lens.set_model(model);
  lens.describe(visit);
  visit.key(
      "offset_mm", offset_mm,
      "Centre of projection in the rig's axes; of orthographic and pushbroom cameras where the "
      "principal point's ray starts. Empty: 0.",
      three);
  visit.key("axis_angle_rad", axis_angle_rad,
            "Rotation vector, in the rig's axes, that turns a camera that looks forward.", three);
  visit.key("euler_deg", euler_deg,
            "Yaw about up (positive left), pitch about left (positive down), roll about forward; "
            "intrinsic, in this order.",
            three);
  visit.key("quaternion_wxyz", quaternion_wxyz,
            "Hamilton quaternion, in the rig's axes, that turns a camera that looks forward.",
            core::size_of(4));
  visit.key(
      "look_at_mm", look_at_mm,
      "A point, in the rig's axes, that the optical axis passes through; the image's rows stay "
      "level.",
      three);
  visit.key(
      "exposure_ms", exposure_ms,
      "How long each line of the image is exposed: colour is blurred by what moves meanwhile. "
      "Ground truth is that of the exposure's middle.",
      core::between(0.0, 1000.0));
  visit.key("line_time_us", line_time_us,
            "Time from a line's exposure to the next one's, a rolling shutter; 0: all at once. A "
            "frame's time is that of the image's middle.",
            core::between(0.0, 10000.0));
  visit.key(
      "readout", readout,
      "Which way a rolling shutter's lines follow each other: rows down or up, columns right or "
      "left.",
      core::one_of({std::begin(geo::kReadoutNames), std::end(geo::kReadoutNames)}));
  visit.key(
      "aperture_mm", aperture_mm,
      "Diameter of the lens's entrance pupil, its focal length over its f-number: what is out of "
      "focus is blurred in colour. 0: all is sharp.",
      core::between(0.0, 1000.0));
  visit.key("focus_m", focus_m,
            "Depth at which colour is sharp; of fisheyes, panoramas and other models whose rays "
            "have no depth, the "
            "range. 0: infinitely far.",
            core::between(0.0, 1e6));
}

void CameraOptions::validate() const {
  check_name("camera", name);
  if (width_px < 1 || width_px > 16384 || height_px < 1 || height_px > 16384) {
    fail(ErrorKind::Config, "camera {}: image of {} x {} px; each side takes 1 to 16384", name,
         width_px, height_px);
  }
  check_numbers(name, "principal_point_px", principal_point_px, 2);
  check_numbers(name, "offset_mm", offset_mm, 3);
  check_numbers(name, "axis_angle_rad", axis_angle_rad, 3);
  check_numbers(name, "euler_deg", euler_deg, 3);
  check_numbers(name, "quaternion_wxyz", quaternion_wxyz, 4);
  check_numbers(name, "look_at_mm", look_at_mm, 3);

  const bool is_physical = focal_length_mm > 0.0 || image_plane_width_mm > 0.0;
  const bool is_in_pixels = fx_px > 0.0 || fy_px > 0.0;
  if (is_physical && is_in_pixels) {
    fail(
        ErrorKind::Config,
        "camera {}: both focal_length_mm / image_plane_width_mm and fx_px / fy_px are given; state "
        "the optics in one way",
        name);
  }
  if (is_physical && !(focal_length_mm > 0.0 && image_plane_width_mm > 0.0)) {
    fail(ErrorKind::Config,
         "camera {}: focal_length_mm = {} with image_plane_width_mm = {}; both must be positive",
         name, focal_length_mm, image_plane_width_mm);
  }
  const geo::CameraModelInfo& info =
      core::find_registered(geo::camera_models(), "camera model", model);
  const bool needs_focal_length = info.whole_view == nullptr && info.read == nullptr;
  if (!is_physical && !(fx_px > 0.0) && needs_focal_length) {
    fail(ErrorKind::Config,
         "camera {}: no focal length; give focal_length_mm with image_plane_width_mm, or fx_px",
         name);
  }
  check_scale_on_the_ground(*this);
  if (is_in_pixels && pixel_aspect != 1.0) {
    fail(ErrorKind::Config,
         "camera {}: pixel_aspect = {} beside fx_px; it belongs to focal_length_mm, give fy_px",
         name, pixel_aspect);
  }
  const int num_stated = num_orientations(*this);
  if (num_stated > 1) {
    fail(ErrorKind::Config,
         "camera {}: {} orientations are given; state one of axis_angle_rad, euler_deg, "
         "quaternion_wxyz and look_at_mm",
         name, num_stated);
  }
  if (!quaternion_wxyz.empty()) {
    const std::vector<double>& q = quaternion_wxyz;
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (std::abs(norm - 1.0) > 1e-3) {
      fail(ErrorKind::Config, "camera {}: quaternion_wxyz has length {}; a rotation has 1", name,
           norm);
    }
  }
  if (readout != "down" && line_time_us == 0.0)
    fail(ErrorKind::Config,
         "camera {}: readout = \"{}\", but no line_time_us: all lines are exposed at once; give "
         "line_time_us, or leave readout out",
         name, readout);
  if (focus_m > 0.0 && aperture_mm == 0.0)
    fail(ErrorKind::Config,
         "camera {}: focus_m = {}, but no aperture_mm: all is sharp; give aperture_mm, or leave "
         "focus_m out",
         name, focus_m);
  if (!look_at_mm.empty() && (vector_of(look_at_mm) - vector_of(offset_mm)).norm() < 1e-6) {
    fail(ErrorKind::Config, "camera {}: look_at_mm is the camera's own place, offset_mm", name);
  }
}

void CameraOptions::set_intrinsics(const geo::CameraIntrinsics& intrinsics) {
  const std::vector<double>& p = intrinsics.parameters;
  TERRACAST_CHECK(p.size() >= 4, "camera model {} with {} parameters; fx, fy, cx, cy are the least",
                  intrinsics.model, p.size());
  model = intrinsics.model;
  lens.set_model(model);
  lens.set_own_parameters(std::span(p).subspan(4));
  width_px = intrinsics.width_px;
  height_px = intrinsics.height_px;
  fx_px = p[0];
  fy_px = p[1];
  principal_point_px = {p[2], p[3]};
}

void CameraOptions::set_pose(const geo::Rigid3d& rig_from_camera) {
  const Eigen::Vector3d offset = rig_from_camera.translation * 1e3;
  offset_mm = {offset.x(), offset.y(), offset.z()};
  const Eigen::Quaterniond turn(rig_from_camera.rotation.toRotationMatrix() *
                                geo::rig_from_forward_camera().transpose());
  quaternion_wxyz = {turn.w(), turn.x(), turn.y(), turn.z()};
}

void RigOptions::describe(core::SchemaVisitor& visit) {
  visit.key("name", name, "Name of the rig, and of its folder.", core::required());
  std::vector<std::string> templates = core::registry_names(rig_templates());
  templates.emplace_back();
  visit.key(
      "template", template_name,
      "An arrangement of like cameras: one is given, whose optics all share; it decides further "
      "keys.",
      core::one_of(templates));
  if (template_name.empty())
    arrangement = {};
  else
    arrangement.describe(visit, rig_templates(), "rig template", template_name);
  visit.key("axes", axes,
            "Axes of the cameras' offsets and rotations: flu (x forward, y left, z up) or rdf (x "
            "right, y down, z forward).",
            core::one_of({"flu", "rdf"}));
  visit.key("mount_yaw_deg", mount_yaw_deg, "Turn of the rig on the body, positive to the left.",
            core::between(-360.0, 360.0));
  visit.key("mount_pitch_deg", mount_pitch_deg, "Tilt of the rig on the body, positive down.",
            core::between(-180.0, 180.0));
  visit.key("mount_roll_deg", mount_roll_deg,
            "Roll of the rig on the body, about its forward axis.", core::between(-360.0, 360.0));
  visit.key("mount_offset_m", mount_offset_m,
            "The rig's origin on the body: forward, left, up; empty: 0.", core::size_of(3));
  visit.section("errors", errors,
                "How far the cameras are from what is said of them: standard deviations.");
  visit.section(
      "imaging", imaging,
      "How the cameras make an image of the light: lens, exposure, sensor, color; each part "
      "is left out by default.");
  visit.list("cameras", cameras, "The rig's cameras.");
  visit.list("sensors", sensors, "The rig's sensors beside cameras, each at times of its own.");
}

void RigOptions::validate() const {
  check_name("rig", name);
  if (name == capture::kRecordsFolder || name == capture::kLabelsFolder) {
    fail(ErrorKind::Config, "rig name \"{}\" is the folder of the capture's {}; take another", name,
         name == capture::kRecordsFolder ? "records" : "labels");
  }
  if (axes != "flu" && axes != "rdf") {
    fail(ErrorKind::Config, "rig {}: axes = \"{}\"; known are flu and rdf", name, axes);
  }
  if (cameras.empty()) fail(ErrorKind::Config, "rig {} has no cameras; it needs one or more", name);
  if (arrangement.is_made()) {
    if (cameras.size() != 1)
      fail(ErrorKind::Config,
           "rig {} has {} cameras beside template = \"{}\"; it takes one, whose optics all share",
           name, cameras.size(), template_name);
    if (num_orientations(cameras[0]) > 0 || !cameras[0].offset_mm.empty())
      fail(ErrorKind::Config,
           "rig {}, camera {}: its offset or orientation is given beside template = \"{}\", which "
           "says "
           "where cameras are; leave it out",
           name, cameras[0].name, template_name);
    if (axes != "flu")
      fail(ErrorKind::Config,
           "rig {}: axes = \"{}\" beside a template, which has none to read; leave it out", name,
           axes);
    arrangement->validate();
  }
  if (!mount_offset_m.empty() && mount_offset_m.size() != 3) {
    fail(ErrorKind::Config, "rig {}: mount_offset_m has {} numbers; it takes 3", name,
         mount_offset_m.size());
  }
  for (const CameraOptions& camera : cameras) check_focal_length_error(*this, camera);
}

Eigen::Matrix3d RigOptions::rig_from_file() const {
  return axes == "rdf" ? geo::rig_from_rdf() : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
}

std::vector<CameraOptions> RigOptions::placed_cameras() const {
  if (!arrangement.is_made()) return cameras;
  std::vector<CameraOptions> placed;
  for (const CameraPlace& place : arrangement->places()) {
    CameraOptions& camera = placed.emplace_back(cameras.at(0));
    camera.name += place.suffix;
    camera.set_pose(place.rig_from_camera);
  }
  return placed;
}

std::vector<sensors::ImagingOptions> imaging_of_cameras(const std::vector<RigOptions>& rigs) {
  std::vector<sensors::ImagingOptions> imaging;
  for (const RigOptions& rig : rigs)
    imaging.insert(imaging.end(), rig.placed_cameras().size(), rig.imaging);
  const bool is_any_on =
      std::any_of(imaging.begin(), imaging.end(),
                  [](const sensors::ImagingOptions& camera) { return camera.is_on(); });
  return is_any_on ? imaging : std::vector<sensors::ImagingOptions>{};
}

geo::Rigid3d RigOptions::body_from_rig() const {
  return {.rotation = rotation_of_euler_deg(mount_yaw_deg, mount_pitch_deg, mount_roll_deg),
          .translation = vector_of(mount_offset_m)};
}

std::vector<sensors::MountedSensor> mount_sensors(const std::vector<RigOptions>& rigs) {
  return mount_sensors(rigs, build_cameras(rigs));
}

std::vector<sensors::MountedSensor> mount_sensors(
    const std::vector<RigOptions>& rigs, const std::vector<capture::CameraCalibration>& cameras) {
  std::vector<sensors::MountedSensor> mounted;
  for (const RigOptions& rig : rigs) {
    std::set<std::string> names;
    for (const CameraOptions& camera : rig.placed_cameras()) names.insert(camera.name);
    for (const sensors::SensorOptions& options : rig.sensors) {
      if (!names.insert(options.name).second)
        fail(ErrorKind::Config,
             "rig {}: a second sensor or camera is called {}; each needs its own name", rig.name,
             options.name);
      std::vector<capture::StreamChannel> channels = options.sensor->channels();
      if (options.clock.is_on()) channels.push_back({.name = capture::kStampChannel, .unit = "s"});
      if (const std::string wrong = capture::wrong_channels(channels); !wrong.empty())
        fail(ErrorKind::Internal, "sensor {}/{} {}{}", rig.name, options.name,
             core::printable(wrong), core::bug_of_plugin(options.sensor.kind()));
      const std::vector<double>& e = options.euler_deg;
      mounted.push_back(
          {.info = {.rig = rig.name,
                    .name = options.name,
                    .kind = options.sensor.kind(),
                    .rate_hz = options.rate_hz,
                    .channels = channels,
                    .rig_from_sensor = {.rotation = e.empty()
                                                        ? Eigen::Quaterniond::Identity()
                                                        : rotation_of_euler_deg(e[0], e[1], e[2]),
                                        .translation = rig.rig_from_file() *
                                                       (vector_of(options.offset_mm) * 1e-3)},
                    .body_from_rig = rig.body_from_rig(),
                    .settings_toml = options.sensor.settings_toml(),
                    .is_scan = dynamic_cast<const sensors::Scanner*>(&*options.sensor) != nullptr,
                    .clock = options.clock.believed()},
           .sensor = options.sensor,
           .clock = options.clock});
      look_through_camera(cameras, mounted.back());
    }
  }
  return mounted;
}

std::vector<capture::CameraCalibration> build_cameras(const std::vector<RigOptions>& rigs) {
  if (rigs.empty()) fail(ErrorKind::Config, "no rig; a sequence needs one or more");
  std::vector<capture::CameraCalibration> calibrations;
  std::set<std::string> rig_names;
  for (const RigOptions& rig : rigs) {
    rig.validate();
    if (!rig_names.insert(rig.name).second) {
      fail(ErrorKind::Config, "two rigs are called {}; each needs its own name", rig.name);
    }
    const geo::Rigid3d body_from_rig = rig.body_from_rig();
    std::set<std::string> camera_names;
    for (const CameraOptions& camera : rig.placed_cameras()) {
      core::with_context(
          [&] {
            camera.validate();
            if (!camera_names.insert(camera.name).second) {
              fail(ErrorKind::Config, "two cameras are called {}; each needs its own name",
                   camera.name);
            }
            capture::CameraCalibration calibration{
                .rig = rig.name,
                .name = camera.name,
                .intrinsics = intrinsics_of(camera),
                .rig_from_camera = rig_from_camera(camera, rig.rig_from_file()),
                .body_from_rig = body_from_rig,
                .shutter = shutter_of(camera),
                .aperture = {.diameter_m = 1e-3 * camera.aperture_mm, .focus_m = camera.focus_m}};
            // Refuses what the model cannot hold.
            check_shutter_and_lens(*geo::make_camera(calibration.intrinsics), camera);
            calibrations.push_back(std::move(calibration));
          },
          fmt::format("building rig {}", rig.name));
    }
  }
  if (calibrations.size() > static_cast<std::size_t>(capture::kMaxCameras)) {
    fail(ErrorKind::Config, "{} cameras; a sequence takes up to {}", calibrations.size(),
         capture::kMaxCameras);
  }
  return calibrations;
}

}  // namespace terracast::rigs
