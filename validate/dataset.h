#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "validate/findings.h"
#include "validate/geodesy.h"
#include "validate/geometry.h"
#include "validate/imaging.h"
#include "validate/moving.h"
#include "validate/readers/colmap_model.h"
#include "validate/readers/oxts.h"
#include "validate/shutter.h"

/// One neutral model of an exported dataset, whatever its format: what a user of the format would
/// get by reading it.
namespace terracast::validate {

/// A row of georeference.csv.
struct Georeference {
  double time_s = 0.0;
  Geodetic place;                                                 ///< of the camera's centre
  Eigen::Matrix3d enu_from_camera = Eigen::Matrix3d::Identity();  ///< ENU of that very place
};

/// A row of bounds.csv: what the depth and flow of an image are said to err by; NaN where it has none.
struct StatedBounds {
  double depth_error_mm = 0.0;     ///< of the arithmetic
  double depth_rounding_mm = 0.0;  ///< of keeping it
  double flow_error_px = 0.0;
  double flow_rounding_px = 0.0;
  std::int64_t num_left_out = 0;  ///< pixels at edges
  std::int64_t num_pixels = 0;
};

/// Paths of one frame's files, relative to the dataset's root; empty where the format has none.
struct FrameFiles {
  std::string color;
  std::string depth;
  std::string segmentation;
  std::string flow;       ///< from this frame to the next, and back
  std::string disparity;  ///< in this (left) image
  std::string moving;     ///< which body each pixel shows
  std::string normals;
  std::string instances;
};

/// A camera's model as dataset.json has it.
struct StatedModel {
  std::string name = "pinhole";
  std::vector<double> parameters;  ///< fx, fy, cx, cy, and its own; empty: those of a pinhole
  bool operator==(const StatedModel&) const = default;
};

/// What a format says of the ray through each pixel's centre, in the camera's frame.
struct PixelRays {
  Intrinsics camera;  ///< that it says they are of
  std::vector<Eigen::Vector3d> directions;
  std::vector<Eigen::Vector3d> origins;
};

/// A camera's clock as calibration_true.json has it: it stamps t + offset_s + drift t, each stamp off by a jitter.
struct StatedClock {
  double offset_s = 0.0;
  double drift = 0.0;
  double jitter_sd_s = 0.0;
};

struct Camera {
  std::string name;                  ///< the camera's word in the format
  std::string rig, name_in_rig;      ///< as the config has them; empty: not stated
  Intrinsics intrinsics;             ///< from the format's own files
  std::optional<Intrinsics> stated;  ///< from dataset.json
  StatedModel stated_model;
  Imaging imaging;                       ///< of imaging.json
  std::optional<Pose> body_from_camera;  ///< from dataset.json; body x forward, y left, z up
  /// Of formats that hold a table of rays beside the model: directions and places of origin (none: all at the
  /// camera's place), one a pixel, row by row; NaN where there is none.
  std::shared_ptr<const PixelRays> pixel_rays = nullptr;
  /// From the format's own files, in the sequence's local frame (ENU at its origin); one a frame,
  /// empty where it is missing.
  std::vector<std::optional<Pose>> local_from_camera;
  std::optional<Shutter>
      shutter;  ///< rolling, from dataset.json; nothing: all lines are exposed at once
  std::vector<std::optional<Georeference>> georeference;
  std::vector<std::optional<StatedBounds>> bounds;
  /// By its own clock, of timestamps.csv; empty: its stamps are the times.
  std::vector<double> stamps_s;
  std::optional<StatedClock> clock;  ///< nothing: it shows the time
  Pose camera0_from_camera;          ///< KITTI: by its calibration
  std::vector<FrameFiles> files;
  /// Stored flow is rounded to whole steps; 0: float32, without end.
  double flow_step_px = 0.0;
  /// Flow is NaN where the other image's camera does not see the point at all.
  bool marks_missing_flow = false;
  /// The longest component that such flow holds, of either sign.
  double flow_reach_px = std::numeric_limits<double>::infinity();

  /// The most that the steps leave between a flow and what is stored of it.
  double flow_rounding_px() const { return 0.5 * std::hypot(flow_step_px, flow_step_px); }
};

/// A lidar's points as the format's own files hold them, a file a frame: those whose pulses' times are nearest to the
/// frame's, floor(time_s * rate_hz + 0.5) being its number.
struct FormatScans {
  std::string rig, name;  ///< of sensors.json
  std::int64_t num_points = 0;
  std::int64_t num_after_last_frame = 0;
  std::map<std::string, std::int64_t> num_without_label;  ///< by our class
  bool is_ply = false;                                    ///< else KITTI's four float32 a point
  bool is_deskewed =
      true;  ///< carried to the frame's time; else as they were at their pulses' times
  std::vector<std::string>
      points;  ///< files, relative to the dataset's root; empty where one is missing
  std::vector<std::string> labels;  ///< SemanticKITTI's; empty: the format has none
  std::string instances;            ///< instances.csv
  int camera = -1;                  ///< that the points are placed by
  int depth_camera = -1;            ///< whose depth they are compared with
  Pose camera_from_points;          ///< by the format's files or rules
  std::string mount_file;           ///< that states it; empty: the format fixes it
  /// Seconds since the sequence's first frame: first, middle and last of each scan; empty: the format has none.
  std::vector<double> begin_s, middle_s, end_s;
};

/// A rectified pair among the cameras of a sequence.
struct StereoPair {
  int left = 0;
  int right = 0;
  double baseline_m = 0.0;  ///< as the format states it (or its poses, where it states none)
};

struct SensorRecord;  // validate/readers/sensors.h

struct Sequence {
  std::string name;
  std::string path;
  int num_frames = 0;
  double rate_hz = 0.0;
  std::string utc_start;
  Geodetic origin;
  std::string geometry;         ///< path of its geometry.json; empty: an older version's dataset
  std::vector<double> times_s;  ///< of the format's own file; empty where it has none
  /// The format's own files state the calibration and the times that are believed, where rigs have errors;
  /// intrinsics, poses, models and times here are the true ones all the same (validate/belief.h).
  bool states_belief = false;
  /// The format's own files stamp samples of sensors beside cameras by the sensors' own clocks.
  bool states_sensor_stamps = false;
  bool has_poses_of_rows = false;  ///< the format has no poses but those of georeference.csv
  /// Of motion.csv, one a frame; empty: none is there.
  std::vector<std::optional<BodyMotion>> motion;
  std::optional<Moving> moving;  ///< nothing: all stands still but the cameras
  std::vector<Camera> cameras;
  std::optional<StereoPair> stereo;
  std::optional<FormatScans> scans;    ///< nothing: the format's own files hold no lidar's points
  std::map<int, std::string> classes;  ///< of the segmentation's values
  Pose local_from_first;               ///< KITTI: camera 0 of the first frame, by georeference.csv
  std::optional<ColmapModel> binary_model;
  std::optional<ColmapModel> text_model;
  /// Cameras and images (without observations) as the files of the binary model state them, where they are believed and
  /// shutters roll: what the points' ERROR is by.
  std::optional<ColmapModel> believed_model;
  std::vector<std::optional<OxtsPacket>> oxts;  ///< KITTI raw: one a frame
  Pose camera0_from_imu;                        ///< KITTI raw: by its calibration
  std::vector<Pose> first_from_camera0;         ///< KITTI raw: of the poses beside the packets
  /// A diagnosis's sensors beside cameras, in the place of those of the files; null: the files'.
  std::shared_ptr<const std::vector<SensorRecord>> tried_sensors;

  /// Index of a camera; -1 when there is none.
  int camera_index(const std::string& camera_name) const;
  bool has_rolling_shutters() const;
};

struct FileRecord {
  std::uint64_t num_bytes = 0;
  std::string hash;
};

/// Flow of one pair of frames, px; masks 0 or 1. Without backward flow, those images are empty. Flow that
/// the format marks as beyond its reach is NaN, with both masks 0.
struct FlowFields {
  core::ImageF forward;   ///< 2 channels, in the image of the first frame
  core::ImageF backward;  ///< 2 channels, in the image of the second frame
  core::Image8 in_view_forward, in_view_backward;
  core::Image8 covisible_forward, covisible_backward;
};

struct Dataset {
  std::filesystem::path root;
  std::string format;
  std::string world_name;
  std::string world_input_hash;  ///< of everything that determines the world
  float sky_depth_m = 1e5F;      ///< TartanAir, both versions: the depth of the sky
  std::map<std::string, FileRecord> files;
  std::vector<Sequence> sequences;
};

/// Reads one format's own files.
class Reader {
 public:
  virtual ~Reader() = default;
  /// Fills intrinsics, poses, file paths, stereo pair and models of a sequence whose members from
  /// dataset.json are set. Whatever is wrong becomes a finding.
  virtual void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const = 0;

  /// Cameras that stand or look otherwise against each other than the format fixes, by their poses.
  virtual void check_mounts(const Sequence&, Findings&) const {}

  /// Depth, or of cameras with a plane range, m; NaN where there is none (sky).
  /// throws  Input, Io
  virtual core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const = 0;
  /// Disparity, px; NaN where there is none.
  virtual core::ImageF disparity(const Dataset&, const Camera&, int frame) const;
  virtual FlowFields flow(const Dataset&, const Camera&, int frame) const;
  /// Class indices.
  virtual core::Image8 segmentation(const Dataset&, const Camera&, int frame) const;
  /// Of the surfaces, unit, in the sequence's local frame; NaN where there is none.
  virtual core::ImageF normals(const Dataset&, const Camera&, int frame) const;
  /// Which object each pixel shows; 0: the ground, or nothing.
  virtual core::ImageU32 instances(const Dataset&, const Camera&, int frame) const;
  /// Colour of 3 channels (a grey image thrice).
  core::Image8 color(const Dataset& dataset, const Camera& camera, int frame) const;
};

/// throws  Config: unknown format
const Reader& find_reader(const std::string& format);
std::vector<std::string> reader_names();

/// Reads dataset.json, georeference.csv, bounds.csv and the format's files.
/// format  empty: what dataset.json says
/// throws  Input: no dataset.json, or one that names no format that is known
Dataset read_dataset(const std::filesystem::path& root, const std::string& format,
                     Findings& findings);

/// "000042".
std::string frame_digits(int frame, int num_digits = 6);

/// Names of the entries of a folder (files or folders), sorted; empty when it does not exist.
std::vector<std::string> list_folder(const std::filesystem::path& folder);

/// Whether a path stays inside the folder it is relative to.
bool is_safe_relative_path(const std::string& path);

/// A finding for each file of `folder` that should be there (`NNNNNN` + suffix for each frame) and
/// is not.
/// is_optional  a folder that neither exists nor stands in dataset.json is a modality that the
///              dataset does not hold
/// returns  paths relative to the root, empty where a file is missing
std::vector<std::string> numbered_files(const Dataset& dataset, const std::string& folder,
                                        const std::string& suffix, int num_frames,
                                        Findings& findings, bool is_optional = false,
                                        int num_digits = 6);

/// A PNG of 8 or 16 bits with the wanted size and channels.
/// throws  Input: another size, number of channels or depth
core::Image8 read_png8(const std::filesystem::path& file, const std::string& name, int channels,
                       const Intrinsics& size);
core::Image16 read_png16(const std::filesystem::path& file, const std::string& name, int channels,
                         const Intrinsics& size);
/// An npy of float32 (height, width); values that are not positive and finite become NaN.
core::ImageF read_depth_npy(const std::filesystem::path& file, const std::string& name,
                            const Intrinsics& size);

}  // namespace terracast::validate
