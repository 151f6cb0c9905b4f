#include "core/plugin_rows.h"
#include "core/random.h"
#include "validate/checks/checker.h"
#include "validate/colmap/job.h"
#include "validate/dataset.h"

// One line a check, alphabetical; the file is checks/<name>.cpp and defines make_<name>_check().
#define TERRACAST_CHECKS(X)                                                                        \
  X(bounds, "what bounds.csv says that depth and flow may err by, against the depths")             \
  X(calibration, "intrinsics and mounts of the format's files against dataset.json")               \
  X(clocks,                                                                                        \
    "time stamps by cameras' and sensors' own clocks against what is said of these clocks")        \
  X(colmap_files,                                                                                  \
    "database.db, rig_config.json, georegistration.txt against the model and georeference.csv")    \
  X(colmap_model,                                                                                  \
    "COLMAP's sparse model: reprojection, tracks, rigs, text against binary, depth, colours")      \
  X(colors, "colours of single images: missing levels, marks of JPEG")                             \
  X(depth, "depths of single images: how many different ones, and whether they end at one")        \
  X(depth_unit, "whether frames that share no place by their depth do so by another unit of it")   \
  X(events, "rows of event cameras by the sensor's own rules, and sums of events against images")  \
  X(flow, "stored flow and its masks against depth, poses and intrinsics")                         \
  X(georeference, "poses and times against georeference.csv on WGS84")                             \
  X(georegistration, "places of COLMAP's georegistration.txt against georeference.csv")            \
  X(imu_files, "an IMU in the format's own files, row by row, against its samples")                \
  X(inertial, "truth of IMUs, integrated from frame to frame, against the poses")                  \
  X(lidar,                                                                                         \
    "points of scanners: order, places by the poses between frames, against the world's tiles")    \
  X(lidar_files,                                                                                   \
    "a lidar's points and labels in the format's own files against its scans, poses and depth")    \
  X(motion, "velocity, acceleration and turn of motion.csv against the body's poses")              \
  X(moving,                                                                                        \
    "depth and flow of what moves, carried by its poses into other images, against those there")   \
  X(moving_bodies, "what is said of things that move: their motion, parts, classes and boxes")     \
  X(navigation,                                                                                    \
    "truth of satellite fixes, pressures and magnetic fields against poses, WGS84 and models")     \
  X(oracle,                                                                                        \
    "depth, classes and visibility against exact rays through the world's tiles (--world)")        \
  X(oxts, "velocity, force and turn rate of inertial packets against their places and attitudes")  \
  X(photometric, "colours carried by depth and poses into other images against the colours there") \
  X(rays, "the table of rays beside a camera's model: each goes to its pixel's centre")            \
  X(reprojection, "depth carried by poses into other images against the depth there")              \
  X(segmentation, "classes carried by depth and poses into other images against those there")      \
  X(sensors, "samples of sensors beside cameras: times, mounts, ranges against the world's tiles") \
  X(signals, "signals of satellites against poses, orbits, RINEX and the world that hides some")   \
  X(stereo, "disparity against depth, focal length and baseline, and left against right images")   \
  X(structure,                                                                                     \
    "files of dataset.json: presence, size, hash; numbering, sizes, readability; nothing beside "  \
    "them")                                                                                        \
  X(trajectory, "poses: true rotations, no jumps")

namespace terracast::validate {

#define TERRACAST_DECLARE(name, summary) \
  std::unique_ptr<Checker> make_##name##_check(const ValidateOptions&);
TERRACAST_CHECKS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const CheckInfo> checks() {
#define TERRACAST_ROW(name, summary) {#name, summary, &make_##name##_check},
  static const auto table = core::with_plugin_rows<CheckInfo>({TERRACAST_CHECKS(TERRACAST_ROW)});
#undef TERRACAST_ROW
  return table;
}

std::vector<NameAndSummary> check_list() {
  std::vector<NameAndSummary> list;
  for (const CheckInfo& info : checks()) list.push_back({info.name, info.summary});
  for (const ColmapMode& mode : colmap_modes()) list.push_back({mode.check, mode.summary});
  return list;
}

std::string names_of_checks() {
  std::string names;
  for (const NameAndSummary& check : check_list()) names += fmt::format("{}\n", check.name);
  return names;
}

std::vector<std::string> format_names() { return reader_names(); }

CheckResult skipped_result(std::string name, std::string why) {
  CheckResult result;
  result.name = std::move(name);
  result.ok = true;
  result.skipped = true;
  result.worst = std::move(why);
  return result;
}

CheckResult unseen_result(std::string name, std::string why) {
  CheckResult result = skipped_result(std::move(name), std::move(why));
  result.is_unseen = true;
  return result;
}

void note_worst(CheckResult& result, double value, const std::string& where) {
  if (!std::isfinite(value)) value = 1e9;
  if (value < result.value || (value == result.value && !result.worst.empty())) return;
  result.value = value;
  result.worst = where;
}

std::string place_of(const View& view) {
  return fmt::format("{}, frame {}", view.camera->name, view.frame);
}
std::string place_of(const View& view, int x, int y) {
  return fmt::format("{}, frame {}, pixel ({}, {})", view.camera->name, view.frame, x, y);
}

std::vector<Eigen::Vector2i> draw_pixels(const Intrinsics& camera, std::int64_t count,
                                         const ValidateOptions& options, const View& view,
                                         std::uint64_t salt) {
  std::vector<Eigen::Vector2i> pixels;
  if (count <= 0) return pixels;
  pixels.reserve(static_cast<std::size_t>(count));
  const std::uint64_t stream =
      core::stream_of(core::stream_of(salt, static_cast<std::uint64_t>(view.camera_index)),
                      static_cast<std::uint64_t>(view.frame));
  const auto seed = static_cast<std::uint64_t>(options.seed);
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(count); ++i)
    pixels.emplace_back(
        static_cast<int>(camera.width_px * core::random_unit(seed, stream, 2 * i)),
        static_cast<int>(camera.height_px * core::random_unit(seed, stream, 2 * i + 1)));
  return pixels;
}

}  // namespace terracast::validate
