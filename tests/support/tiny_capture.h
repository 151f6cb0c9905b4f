#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "capture/channel.h"
#include "capture/frame.h"
#include "geo/camera_model.h"
#include "geo/rigid3.h"

/// A capture whose truth has closed form: a tilted plane with a free-standing wall, seen from a
/// turning, banking flight 22 km from the world's origin.
namespace terracast::test {

struct TinyHit {
  double range_m = std::numeric_limits<double>::infinity();
  Eigen::Vector3d normal_world = Eigen::Vector3d::Zero();
  capture::SemanticClass semantic = capture::SemanticClass::Sky;
  std::uint32_t instance_id = 0;
  std::uint32_t primitive_id = capture::kNoPrimitive;
};

/// The ground plane goes on to 80 km from the eye, beyond it is sky. The wall is a rectangle above
/// the ground.
struct TinyScene {
  geo::Geodetic origin{.lat_deg = 42.5, .lon_deg = 1.5, .height_m = 1200.0};
  Eigen::Vector3d ground_point = {20000.0, 9000.0, 300.0};
  Eigen::Vector3d ground_normal = Eigen::Vector3d(0.03, -0.05, 1.0).normalized();
  Eigen::Vector3d wall_center = {20170.0, 9010.0, 330.0};
  Eigen::Vector3d wall_right = Eigen::Vector3d(0.2, 1.0, 0.0).normalized();
  Eigen::Vector3d wall_up = Eigen::Vector3d::UnitZ();
  double wall_half_width_m = 25.0;
  double wall_half_height_m = 40.0;
  double horizon_m = 80000.0;

  Eigen::Vector3d wall_normal() const;

  /// Ray parameter (in lengths of `direction`) where the wall is met; +inf where it is not.
  double wall_parameter(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) const;

  TinyHit cast(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) const;

  /// Whether something stands between the eye and a point of the scene.
  bool is_hidden(const Eigen::Vector3d& eye, const Eigen::Vector3d& point_world) const;

  /// How far a point is from the nearer of the scene's two surfaces.
  double distance_to_surface(const Eigen::Vector3d& point_world) const;
};

struct TinyCaptureOptions {
  std::string name = "valley";
  std::string input_hash = "0123456789abcdef0123456789abcdef";
  int num_frames = 4;
  bool has_tartan2 = true;              ///< the 640 x 640 pair
  bool has_mcs4 = true;                 ///< four small cameras, 0 and 3 a rectified pair
  bool has_tartan_v1 = false;           ///< the 640 x 480 pair
  std::vector<std::string> faces = {};  ///< of tartan2 beside its pair: "lcam_left", "rcam_top", …
  double step_m = 12.0;                 ///< flown from frame to frame
  /// As the records say; the flight itself is straight and steady.
  Eigen::Vector3d acceleration_world_mps2 = Eigen::Vector3d::Zero();
  std::string utc_start = "2024-06-21T10:00:00Z";
  bool has_camera_errors = false;  ///< cameras are another than is believed, each by its own error
  bool has_clock_errors = false;
  bool has_sensor = false;  ///< a stream mcs4/laser of two channels, 25 samples a second
  bool has_events =
      false;  ///< scans mcs4/dvs through the camera mcs4/cam0, and mcs4/own of a lens of its own
  bool has_imaging = false;  ///< the first camera is exposed for a while, the second has settings
};

capture::CameraCalibration tiny_camera(const std::string& rig, const std::string& name,
                                       int width_px, int height_px, double focal_length_px,
                                       const Eigen::Vector3d& axis_angle_rdf,
                                       const Eigen::Vector3d& offset_rdf_m);

/// TartanAir's faces: the turn of a camera that looks forward, as a rotation vector in x right, y
/// down, z forward.
Eigen::Vector3d tiny_face_turn(const std::string& face);

capture::SequenceInfo tiny_sequence(const TinyCaptureOptions& options = {});

/// Events that mean nothing: some hundreds a tick, several at one time, at whole nanoseconds.
capture::Samples tiny_events(const capture::TickRange& ticks, double rate_hz);

/// A climb on a straight line, turning to the left and banking on the way.
inline constexpr double kTinyYawStep_rad = 0.05;
inline constexpr double kTinyBankStep_rad = 0.03;
double tiny_bank_rad(int frame);
Eigen::Vector3d tiny_step(const TinyCaptureOptions& options);
geo::Rigid3d tiny_world_from_body(const TinyCaptureOptions& options, int frame);

geo::Rigid3d tiny_world_from_camera(const TinyCaptureOptions& options, int frame,
                                    const capture::CameraCalibration& camera);

/// Pixel of a pinhole camera, written out here so that tests need no camera of the program.
Eigen::Vector3d tiny_ray(const capture::CameraCalibration& camera, double u, double v);
bool tiny_sees(const capture::CameraCalibration& camera, const Eigen::Vector3d& point_camera,
               Eigen::Vector2d* pixel = nullptr);

/// Smooth and of the place alone, so that a point has one colour in all images.
Eigen::Vector3d tiny_color(const Eigen::Vector3d& point_world);

/// What the record of a frame's camera says of bounds: made up, another of each; flow to the previous frame
/// from the second frame on.
capture::LabelBounds tiny_bounds(int frame, int camera_index);

std::vector<capture::TrackPoint> tiny_tracks();

capture::CameraFrame tiny_frame(const TinyCaptureOptions& options,
                                const capture::SequenceInfo& info, int frame, int camera_index);

/// What the clock of a camera shows, with clock errors.
double tiny_stamp_s(int camera_index, double time_s);

/// The samples of mcs4/laser at some times.
capture::Samples tiny_samples(std::vector<double> times_s);

/// Writes `<capture_folder>/<name>`, with the labels of its one object, the wall, a truck.
std::filesystem::path write_tiny_capture(const std::filesystem::path& capture_folder,
                                         const TinyCaptureOptions& options = {});

}  // namespace terracast::test
