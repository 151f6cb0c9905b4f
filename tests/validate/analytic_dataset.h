#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "tests/support/listed_files.h"

/// Small datasets of the formats, written by code of the tests alone from a scene in closed
/// form.
namespace terracast::test {

/// A camera of the scene. Pixel centres at +0.5; camera x right, y down, z forward; body x forward,
/// y left, z up.
struct SceneCamera {
  std::string name;
  int width = 160;
  int height = 128;
  double focal_px = 120.0;
  Eigen::Matrix3d body_from_camera = Eigen::Matrix3d::Identity();
  Eigen::Vector3d offset_body = Eigen::Vector3d::Zero();
  double line_time_s = 0.0;  ///< of a rolling shutter; 0: all lines at once
  std::string readout = "down";

  /// When the line through an image point is exposed, after the frame's time.
  double line_offset_s(double u, double v) const {
    if (readout == "down") return line_time_s * (v - 0.5 * height);
    if (readout == "up") return line_time_s * (0.5 * height - v);
    if (readout == "right") return line_time_s * (u - 0.5 * width);
    return line_time_s * (0.5 * width - u);
  }
};

/// Rotation of a camera into the world, and its centre.
struct SaidPose {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d centre;
};

/// What a scene's cameras record, in double where it can be.
struct Recording {
  std::vector<SceneCamera> cameras;
  double rate_hz = 10.0;
  std::vector<Eigen::Matrix3d> world_from_body;
  std::vector<Eigen::Vector3d> body_world;
  /// Of flights that are known between their frames.
  std::vector<Eigen::Vector3d> velocity_mps, acceleration_mps2, rate_body_radps;
  /// By camera, then frame.
  std::vector<std::vector<core::Image8>> color;
  std::vector<std::vector<core::Image<double>>> depth;  ///< planar, m; +inf: sky
  std::vector<std::vector<core::Image8>> classes;       ///< 0 sky, 1 ground, 2 water; empty: all 1
  std::function<double(double, double)> height_m;
  /// The ground ends so far from the scene's origin, and beyond it is sky.
  double island_m = std::numeric_limits<double>::infinity();
  double shore_m = 0.0;  ///< of an island, where all ground below it is water

  int num_frames() const { return static_cast<int>(body_world.size()); }
  Eigen::Matrix3d rotation(std::size_t camera, std::size_t frame) const {
    return world_from_body[frame] * cameras[camera].body_from_camera;
  }
  Eigen::Vector3d centre(std::size_t camera, std::size_t frame) const {
    return body_world[frame] + world_from_body[frame] * cameras[camera].offset_body;
  }
  /// So much after the frame's time, of a flight with derivatives: acceleration and turn rate stay what they are.
  SaidPose pose_after(std::size_t camera, std::size_t frame, double offset_s) const;
  /// Where a camera's image shows a point, and how deep; by the line that sees it, found by trying again and again.
  struct Shown {
    Eigen::Vector2d pixel;
    double depth_m;
  };
  Shown shown(std::size_t camera, std::size_t frame, const Eigen::Vector3d& point_world) const;
};

enum class Ground { Smooth, Facets };

/// A banked, climbing, speeding turn above hills, of which every `frame_step`-th frame is taken.
Recording record_flight(const std::vector<SceneCamera>& cameras, int num_frames,
                        Ground ground = Ground::Smooth, int frame_step = 1);

/// A flight in closed form at 1 Hz, with all its derivatives.
Recording record_smooth_flight(const std::vector<SceneCamera>& cameras, int num_frames);

/// A banked, climbing turn, or a level straight flight at constant speed, at 1 Hz in closed form with
/// all derivatives, above an island of low hills and water under the sky.
enum class Path { Curved, Straight };
Recording record_island_flight(const std::vector<SceneCamera>& cameras, int num_frames, Path path);
/// The same path without images.
Recording island_path(const std::vector<SceneCamera>& cameras, int num_frames, Path path);
/// The same flight seen by cameras that are lower by rows above and below alike.
Recording cropped(const Recording& recording, const std::vector<SceneCamera>& cameras);

/// A mistake in COLMAP's model alone.
struct ColmapMistake {
  double observation_px = 0.0;                ///< of one observation
  std::uint32_t track_index = 0;              ///< added to one index of one track
  double rig_move_m = 0.0;                    ///< of every camera but the first in the rig
  bool is_last_image_without_frame = false;   ///< its camera alone
  std::size_t most_points = ~std::size_t{0};  ///< more are not written
  std::size_t most_images = ~std::size_t{0};  ///< of a track
  double point_depth_relative = 0.0;          ///< of points beyond the surface
  int color_levels = 0;                       ///< by which points are brighter
  bool is_color_swapped = false;              ///< points' colours are blue, green, red
  double observations_px = 0.0;               ///< added to all, both ways
  /// Those of each frame stand in the image of the frame before, those of the first in the last.
  bool are_observations_of_next_frame = false;
  /// The pose that is written of a camera and frame; observations stay right.
  std::function<SaidPose(std::size_t c, std::size_t f)> written_pose = {};
  /// The place that is written of a point; its observations stay right.
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> written_point = {};
  /// The pose as it is written: camera from world, COLMAP's convention.
  std::function<void(Eigen::Quaterniond&, Eigen::Vector3d&)> raw_pose = {};
  /// Size and parameters (fx, fy, cx, cy) of a camera.
  std::function<void(int& width, int& height, std::array<double, 4>&)> written_camera = {};
};

/// A mistake in KITTI raw's packets alone.
struct OxtsMistake {
  double axes_east_m = 0.0;  ///< angles in the east, north, up of a place so far east
  double altitude_m = 0.0;   ///< added to all
  double velocity_relative = 0.0;
  int velocity_shift_frames = 0;  ///< velocities of the frame so much later
  double gravity = 1.0;           ///< share of it that forces hold
  double force_mps2 = 0.0;        ///< added forward
  double rate_degps = 0.0;        ///< added about up
  double level_left_mps = 0.0;    ///< added to one level velocity of one packet
};

/// A mistake in what a dataset says; its images stay right unless told.
struct Mistake {
  double principal_x_px = 0.0;  ///< TartanAir, whose intrinsics are fixed: of the stored flow
  double principal_y_px = 0.0;
  double focal_relative = 0.0;        ///< the same
  double stated_principal_px = 0.0;   ///< in dataset.json alone
  double stated_mount_yaw_deg = 0.0;  ///< of the last camera, in dataset.json alone
  double stated_mount_move_m = 0.0;   ///< the same, to the left
  double depth_relative = 0.0;        ///< depth by 1 + this
  int depth_frame = -1;               ///< the frame whose depth is wrong; -1: all
  int pose_shift_frames = 0;          ///< poses (and georeference) of the frame so much later
  std::vector<std::size_t> pose_order = {};  ///< the frame of which each frame has the pose
  int color_shift_frames = 0;                ///< colours of the frame so much earlier
  double mount_yaw_deg = 0.0;  ///< of the last camera, about its y axis, in all that is said of it
  /// Frame whose pose alone is wrong, in the format's files and georeference.csv.
  int pose_frame = -1;
  Eigen::Vector3d pose_turn_deg = Eigen::Vector3d::Zero();
  Eigen::Vector3d pose_move_m = Eigen::Vector3d::Zero();  ///< along the camera's axes
  double pose_entry = 0.0;            ///< KITTI: added to one entry of its matrix
  bool poses_only_in_format = false;  ///< pose_frame's mistake is not in georeference.csv
  double flow_sign = 1.0;
  std::optional<bool> covisible = std::nullopt;  ///< of all pixels
  /// By which the last camera's colours stand to the right and below.
  Eigen::Vector2d color_offset_px = Eigen::Vector2d::Zero();
  double color_gain = 1.0;
  double disparity_relative = 0.0;
  int one_disparity_counts = 0;  ///< 1/256 px added to one pixel
  bool is_one_disparity_missing = false;
  double times_relative = 0.0;  ///< factor on time stamps
  ColmapMistake colmap = {};
  OxtsMistake oxts = {};
};

/// TartanAir's forms of flow.
enum class FlowForm { Npz, Png };
void write_tartanair(const Recording& recording, const std::filesystem::path& folder,
                     const Mistake& mistake = {}, FlowForm form = FlowForm::Npz);
void write_tartanair_v1(const Recording& recording, const std::filesystem::path& folder,
                        const Mistake& mistake = {});
void write_kitti(const Recording& recording, const std::filesystem::path& folder,
                 const Mistake& mistake = {});
/// Of a flight with derivatives.
void write_kitti_raw(const Recording& recording, const std::filesystem::path& folder,
                     const Mistake& mistake = {});
void write_colmap(const Recording& recording, const std::filesystem::path& folder,
                  const Mistake& mistake = {});

/// The same cameras with rolling shutters.
std::vector<SceneCamera> with_shutters(std::vector<SceneCamera> cameras, double line_time_s,
                                       const std::string& readout);

/// The rigs of the scenes: image_2 and image_3; image_02 and image_03; lcam_front and rcam_front;
/// left and right; rig/cam0 to cam2 that look apart.
std::vector<SceneCamera> kitti_cameras();
std::vector<SceneCamera> kitti_raw_cameras();
std::vector<SceneCamera> tartanair_cameras();
std::vector<SceneCamera> tartanair_v1_cameras();
std::vector<SceneCamera> colmap_cameras();

}  // namespace terracast::test
