#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/label_bounds.h"
#include "capture/moving.h"
#include "capture/stream.h"
#include "core/image.h"
#include "geo/camera_model.h"
#include "geo/geodesy.h"
#include "geo/rigid3.h"
#include "geo/shutter.h"

namespace terracast::capture {

/// A camera of a sequence. Its folder in the capture is `<rig>/<name>`.
struct CameraCalibration {
  std::string rig;
  std::string name;
  geo::CameraIntrinsics intrinsics;
  geo::Rigid3d rig_from_camera;
  geo::Rigid3d body_from_rig;
  geo::Shutter shutter = {};
  geo::Aperture aperture = {};

  geo::Rigid3d body_from_camera() const { return body_from_rig * rig_from_camera; }
  bool operator==(const CameraCalibration&) const = default;
};

/// A camera's clock against the sequence's time t: it stamps t + offset_s + drift t, and each stamp errs
/// besides by a normal deviate of jitter_sd_s.
struct CameraClock {
  double offset_s = 0.0;
  double drift = 0.0;  ///< seconds a second
  double jitter_sd_s = 0.0;
  bool operator==(const CameraClock&) const = default;
};

/// How a camera makes an image of its light, where something lies in between (render/imaging).
struct CameraImaging {
  /// The digital numbers of a mosaic that are stored beside the image.
  struct RawFormat {
    std::string
        mosaic;  ///< color filters from the top left pixel: rggb, bggr, grbg, gbrg; empty: no raw
    int bits = 0;
    double black_level_dn = 0.0;
    double white_level_dn = 0.0;
    double dn_per_electron = 0.0;  ///< 0: without noise, electrons do not count
    bool operator==(const RawFormat&) const = default;
  };

  std::string settings_toml;  ///< `[rigs.imaging]`, every key
  RawFormat raw = {};
  /// Photosites that see nothing or are always full: of a mosaic y width_px + x, else 3 times that and the
  /// color; ascending.
  std::vector<std::int64_t> dead_sites = {};
  std::vector<std::int64_t> hot_sites = {};
  bool operator==(const CameraImaging&) const = default;

  bool is_on() const { return !settings_toml.empty(); }
  bool has_raw() const { return !raw.mosaic.empty(); }
};

/// What one camera recorded in one frame. All images have the camera's size.
struct CameraFrame {
  core::Image8 color;          ///< 3 channels, sRGB
  core::ImageF range_m;        ///< along the ray; sky +inf
  core::ImageF normal_world;   ///< 3 channels, unit; sky 0
  core::ImageU32 semantic_id;  ///< SemanticClass
  core::ImageU32 instance_id;  ///< 0: ground and sky
  /// Ground: tile index << 17 | cell y << 9 | cell x << 1 | upper triangle; objects: from
  /// kObjectPrimitives up; sky kNoPrimitive.
  core::ImageU32 primitive_id;
  core::ImageU32 flags;  ///< FactFlag and visible_in_camera
  /// In the world without water: to the bed of waters; range_m elsewhere. Empty: not asked for.
  core::ImageF bottom_range_m;
  /// Digital numbers behind a mosaic, one channel. Empty: none are stored.
  core::Image16 raw = {};
};

/// A file of a frame, relative to the sequence's folder.
struct FrameFile {
  std::string path;
  std::uint64_t num_bytes = 0;
  std::string content_hash;
  bool operator==(const FrameFile&) const = default;
};

/// A camera's part of a frame's record.
struct CameraRecord {
  FrameFile color;
  FrameFile facts;
  std::optional<FrameFile> raw = std::nullopt;       ///< digital numbers of a mosaic
  std::optional<double> exposure_ev = std::nullopt;  ///< stops above the sequence's exposure
  std::int64_t num_sky = 0;                          ///< pixels
  std::int64_t num_outside = 0;
  std::int64_t num_edge = 0;
  LabelBounds bounds;  ///< what depth and flow that follow from the facts err by
  std::vector<std::int64_t>
      visible_tracks;  ///< ids of the track points that this camera sees, ascending
  bool operator==(const CameraRecord&) const = default;

  /// All of its files.
  std::vector<const FrameFile*> files() const {
    if (raw) return {&color, &facts, &*raw};
    return {&color, &facts};
  }
};

/// A tile over which rays of a frame pass, all of them above its highest point.
struct PassedTile {
  int tile = 0;  ///< index into ShownGeometry::tiles
  /// All pass higher than this, by less than two steps at the lowest; a whole number of kPassedStep_m.
  double above_z_world_m = 0.0;
  bool operator==(const PassedTile&) const = default;
};
inline constexpr double kPassedStep_m = 0.0625;

/// frames/NNNNNN.json, written last: the frame is done when it exists.
struct FrameRecord {
  int index = 0;
  double time_s = 0.0;                ///< since the sequence's first frame, in truth
  std::vector<double> stamps_s = {};  ///< by each camera's clock; empty: all show time_s
  geo::Rigid3d world_from_body;
  Eigen::Vector3d velocity_world_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_world_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_body_radps = Eigen::Vector3d::Zero();
  /// For the times of the lines of its images; none where all images are of one instant, and none in captures of
  /// before version 7, whose lines follow constants.
  geo::MotionTerms terms = {};
  std::vector<CameraRecord> cameras;  ///< in the order of SequenceInfo::cameras
  /// Samples of streams from the frame's time to before the next frame's, in the order of SequenceInfo::streams.
  std::vector<FrameFile> streams = {};
  /// Where what moves is and how it moves, in the order of SequenceInfo::moving; nothing: it is not there.
  std::vector<std::optional<geo::BodyState>> moving = {};
  /// Hash of all that determines the cameras' files, given that these tiles are all that their rays
  /// come to (render/input_hash.h).
  std::string key;
  /// Tiles at which rays of the images were cast, as indices into ShownGeometry::tiles, ascending.
  std::vector<int> touched_tiles;
  /// Other tiles over which they pass (render/visited_tiles.h says up to what height), ascending.
  std::vector<PassedTile> passed_tiles;
  bool operator==(const FrameRecord&) const = default;

  /// The files of all cameras and streams.
  std::vector<const FrameFile*> files() const {
    std::vector<const FrameFile*> all;
    for (const CameraRecord& camera : cameras)
      for (const FrameFile* file : camera.files()) all.push_back(file);
    for (const FrameFile& file : streams) all.push_back(&file);
    return all;
  }

  /// The body that carries the cameras.
  geo::BodyState state() const {
    return {.time_s = time_s,
            .world_from_body = world_from_body,
            .velocity_world_mps = velocity_world_mps,
            .acceleration_world_mps2 = acceleration_world_mps2,
            .angular_velocity_body_radps = angular_velocity_body_radps,
            .terms = terms};
  }

  double stamp_s(int camera_index) const {
    return stamps_s.empty() ? time_s : stamps_s[static_cast<std::size_t>(camera_index)];
  }
};

/// Some frames of a sequence: first, first + step, … below end. A shard i/n is every n-th from i on; a
/// range is first to end.
struct FrameSelection {
  int first = 0;
  int end = std::numeric_limits<int>::max();
  int step = 1;
  bool operator==(const FrameSelection&) const = default;

  /// Those of a sequence of so many, ascending.
  std::vector<int> frames_of(int num_frames) const;
};

/// A point of the surface that is followed through the whole sequence.
struct TrackPoint {
  std::int64_t id = 0;
  Eigen::Vector3d point_world = Eigen::Vector3d::Zero();
  bool operator==(const TrackPoint&) const = default;
};

/// Tiles that a sequence can show: primitive ids count so far, and kNoPrimitive is none.
inline constexpr std::size_t kMaxShownTiles = (std::size_t{1} << 15) - 1;

/// A tile of the world, and what it held.
struct ShownTile {
  int level = 0;
  int x = 0;
  int y = 0;
  std::string content_hash;
  double highest_z_world_m = 0.0;
  bool operator==(const ShownTile&) const = default;
};

/// The ground that a sequence shows: which tiles of the world stood, chosen once for all frames and
/// cameras, and the rule that asked for them (world/lod.h).
struct ShownGeometry {
  double cell_px = 0.0;
  double finest_spacing_m = 0.0;
  std::vector<ShownTile> tiles;  ///< by level, x, y
  bool operator==(const ShownGeometry&) const = default;
};

/// sequence.json: what all frames share; written before the first frame, the same by every shard.
struct SequenceInfo {
  std::string name;
  /// Of all that determines the frames: world, rigs, motion, conditions, seeds, version.
  std::string input_hash;
  std::string world_name;
  std::string world_input_hash;
  geo::Geodetic origin;  ///< of the world frame
  std::string utc_start;
  double rate_hz = 0.0;
  int num_frames = 0;
  ShownGeometry geometry;
  std::vector<CameraCalibration> cameras;  ///< as they are: images and labels are made with them
  /// As their users believe them to be, in the same order; empty: as they are.
  std::vector<CameraCalibration> believed_cameras = {};
  std::vector<CameraClock> clocks = {};     ///< one a camera; empty: all show the time
  std::vector<CameraImaging> imaging = {};  ///< one a camera; empty: nothing lies in between at any
  std::vector<MovingBody> moving = {};      ///< none: all stands still but the cameras
  std::vector<StreamInfo> streams = {};     ///< sensors that are not cameras
  std::string config_toml;                  ///< the resolved config, paths as written
  std::vector<std::string> licences;        ///< of the sources
  bool operator==(const SequenceInfo&) const = default;

  bool has_errors() const { return !believed_cameras.empty() || !clocks.empty(); }
  bool has_rolling_shutter() const;
  const std::vector<CameraCalibration>& believed() const {
    return believed_cameras.empty() ? cameras : believed_cameras;
  }

  /// Index of a camera; -1 when there is none.
  int camera_index(const std::string& rig, const std::string& name) const;
  std::vector<int> cameras_of_rig(const std::string& rig) const;
  std::vector<std::string> rig_names() const;
};

}  // namespace terracast::capture
