#include "validate/not_proved.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <string>

#include "core/printable.h"
#include "validate/plugin_format.h"

namespace terracast::validate {

namespace {

bool matches(std::string_view pattern, std::string_view text) {
  if (pattern.empty()) return text.empty();
  if (pattern.front() != '*')
    return !text.empty() && pattern.front() == text.front() &&
           matches(pattern.substr(1), text.substr(1));
  for (std::size_t skipped = 0; skipped <= text.size(); ++skipped)
    if (matches(pattern.substr(1), text.substr(skipped))) return true;
  return false;
}

/// Whether a list of words, parted by blanks, is empty or holds a word.
bool holds(std::string_view words, std::string_view word) {
  return words.empty() || matches("* " + std::string(word) + " *", " " + std::string(words) + " ");
}

/// Files that some check reads, of formats (none named: of all).
struct KnownFiles {
  std::string_view formats;
  std::string_view files;
};

constexpr KnownFiles kKnownFiles[] = {
    {"", "*/georeference.csv"},
    {"", "*/bounds.csv"},
    {"", "*/geometry.json"},
    {"", "*/imaging.json"},
    {"", "*/motion.csv"},
    {"", "*/moving.csv"},
    {"", "*/moving/*.png"},
    {"", "*/sensors.json"},
    {"", "*/sensors/*.csv"},
    {"", "*/sensors/*.npy"},
    {"", "*/sensors/*.nmea"},
    {"", "*/sensors/*.rnx"},
    {"", "*/sensors/*.las"},
    {"", "*/sensors/*.pcd"},
    {"", "*/sensors/*.ply"},
    {"", "*/calibration_true.json"},
    {"", "*/calibration_believed.json"},
    {"", "*/timestamps.csv"},
    {"coco", "annotations/instances.json"},
    {"coco", "annotations/panoptic.json"},
    {"coco", "images/*.png"},
    {"coco", "panoptic/*.png"},
    {"colmap", "*/images/*.png"},
    {"colmap", "*/depth/*.npy"},
    {"colmap", "*/sparse/0/cameras.bin"},
    {"colmap", "*/sparse/0/images.bin"},
    {"colmap", "*/sparse/0/points3D.bin"},
    {"colmap", "*/sparse/0/rigs.bin"},
    {"colmap", "*/sparse/0/frames.bin"},
    {"colmap", "*/sparse_txt/0/cameras.txt"},
    {"colmap", "*/sparse_txt/0/images.txt"},
    {"colmap", "*/sparse_txt/0/points3D.txt"},
    {"colmap", "*/sparse_txt/0/rigs.txt"},
    {"colmap", "*/sparse_txt/0/frames.txt"},
    {"colmap", "*/database.db"},
    {"colmap", "*/rig_config.json"},
    {"colmap", "*/georegistration.txt"},
    {"euroc", "*/mav0/cam*/sensor.yaml"},
    {"euroc", "*/mav0/cam*/data.csv"},
    {"euroc", "*/mav0/cam*/data/*.png"},
    {"euroc", "*/mav0/imu*/sensor.yaml"},
    {"euroc", "*/mav0/imu*/data.csv"},
    {"euroc", "*/mav0/state_groundtruth_estimate0/sensor.yaml"},
    {"euroc", "*/mav0/state_groundtruth_estimate0/data.csv"},
    {"euroc", "*/kalibr/*.yaml"},
    {"euroc", "*/openvins/*.yaml"},
    {"euroc", "*/range/cam*/*.npy"},
    {"kitti", "dataset/poses/*.txt"},
    {"kitti", "dataset/sequences/*/calib.txt"},
    {"kitti", "dataset/sequences/*/times.txt"},
    {"kitti", "dataset/sequences/*/poses.txt"},
    {"kitti", "dataset/sequences/*/velodyne/*.bin"},
    {"kitti", "dataset/sequences/*/labels/*.label"},
    {"kitti", "dataset/sequences/*/instances.csv"},
    {"kitti", "dataset/sequences/*/image_*/*.png"},
    {"kitti", "dataset/sequences/*/depth_2/*.npy"},
    {"kitti", "dataset/sequences/*/disp_2/*.png"},
    {"kitti_object", "training/image_2/*.png"},
    {"kitti_object", "training/calib/*.txt"},
    {"kitti_object", "training/label_2/*.txt"},
    {"kitti_raw", "*/calib_cam_to_cam.txt"},
    {"kitti_raw", "*/calib_velo_to_cam.txt"},
    {"kitti_raw", "*/calib_imu_to_velo.txt"},
    {"kitti_raw", "*/image_*/data/*.png"},
    {"kitti_raw", "*/depth_02/data/*.npy"},
    {"kitti_raw", "*/timestamps.txt"},
    {"kitti_raw", "*/oxts/dataformat.txt"},
    {"kitti_raw", "*/oxts/data/*.txt"},
    {"kitti_raw", "*/poses.txt"},
    {"kitti_raw", "*/velodyne_points/data/*.bin"},
    {"kitti_raw", "*/velodyne_points/timestamps_*.txt"},
    {"tartanair tartanair_v1", "*/seg_label_map.json"},
    {"tartanair tartanair_v1", "*/pose_*.txt"},
    {"tartanair tartanair_v1", "*/image_*/*.png"},
    {"tartanair", "*/depth_*/*.png"},
    {"tartanair", "*/seg_*/*.png"},
    {"tartanair", "*/lidar/*_lcam_front_lidar.ply"},
    {"tartanair", "*/imu/*.npy"},
    {"tartanair", "*/imu/*.txt"},
    {"tartanair", "*/imu/parameter.yaml"},
    {"tartanair", "*/flow_*/*.npz"},
    {"tartanair", "*/flow_*/*.png"},
    {"tartanair_v1", "*/depth_*/*.npy"},
    {"tartanair_v1", "*/seg_*/*.npy"},
    {"tartanair_v1", "*/flow/*.npy"},
    {"terracast", "classes.json"},
    {"terracast", "*/cameras.json"},
    {"terracast", "*/poses.csv"},
    {"terracast", "*/rays.npy"},
    {"terracast", "*/origins.npy"},
    {"terracast", "*/image/*.png"},
    {"terracast", "*/range/*.npy"},
    {"terracast", "*/class/*.png"},
    {"terracast", "*/instance/*.npy"},
    {"terracast", "*/normal/*.npy"},
    {"terracast", "*/flow_*/*.npy"},
    {"terracast", "*/flow_*/*_mask.png"},
    {"tum", "*/rgb.txt"},
    {"tum", "*/rgb/*.png"},
    {"tum", "*/depth.txt"},
    {"tum", "*/depth/*.png"},
    {"tum", "*/associations.txt"},
    {"tum", "*/groundtruth.txt"},
    {"tum", "*/range/*.npy"},
    {"tum", "*/trajectories/*.txt"},
};

bool always(const Dataset&) { return true; }

bool states_truth(const Dataset& dataset) {
  return std::none_of(dataset.sequences.begin(), dataset.sequences.end(),
                      [](const Sequence& sequence) { return sequence.states_belief; });
}

/// Fields of known files that no check proves.
struct Row {
  std::string_view formats;  ///< parted by blanks; empty: all
  std::string_view files, fields, why;
  bool (*applies)(const Dataset&) = always;
};

constexpr Row kRows[] = {
    {"", "dataset.json", "/additions/*", "words for people"},
    {"", "dataset.json", "/conventions/*", "words for people"},
    {"", "dataset.json", "/licences/*", "what the world's sources state"},
    {"", "dataset.json", "/*_version",
     "which program wrote it, and of which edition of the format"},
    {"", "dataset.json", "/source_hash", "of the capture, which no dataset holds"},
    {"", "dataset.json", "/sequences/*/capture_sequence", "a name in the capture"},
    {"kitti kitti_object kitti_raw tartanair tartanair_v1", "dataset.json",
     "/sequences/*/cameras/*/rig", "a name of the job's"},
    {"kitti kitti_object kitti_raw tartanair tartanair_v1", "dataset.json",
     "/sequences/*/cameras/*/camera", "a name of the job's"},
    {"coco colmap kitti kitti_object tartanair tartanair_v1 terracast", "dataset.json",
     "/sequences/*/utc_start", "the hour; light and shadows are not judged by it"},
    {"", "dataset.json", "/sequences/*/cameras/*/shutter/exposure_s",
     "how blurred images are is not judged"},
    {"", "dataset.json", "/sequences/*/moving/bodies/*/name", "a name of the job's"},
    {"", "dataset.json", "/sequences/*/moving/bodies/*/thing", "a name of a model"},
    {"coco colmap kitti kitti_object kitti_raw", "dataset.json",
     "/sequences/*/moving/bodies/*/class", "the format has no classes beside the masks"},
    {"", "dataset.json", "/sequences/*/moving/bodies/*est_m/*",
     "boxes hold what images show of the bodies; larger ones do so too"},
    {"", "dataset.json", "/sequences/*/origin/height_m", "a rounded place: within a metre"},
    {"kitti_raw", "dataset.json", "/sequences/*/extract/*", "names of the job's, and a count"},
    {"tartanair", "dataset.json", "/sequences/*/imu/*", "names of the job's, and a count"},
    {"tartanair", "*/imu/parameter.yaml", "*", "words for people"},
    {"kitti", "dataset.json", "/disparity/*",
     "counts of what was rounded, and the job's bounds for it"},
    {"tum", "dataset.json", "/depth_images/*",
     "what depth.txt states, and counts of what images of depth leave out"},
    {"tum", "*.txt", "comment", "words for people"},
    {"kitti_object", "dataset.json", "/largest_tilt_deg",
     "of the objects' own axes, which labels leave out"},
    {"kitti_object", "dataset.json", "/num_labels/*", "counts for people"},
    {"", "*/bounds.csv", "*_mm", "upper bounds: larger ones hold too, up to the check's own bound"},
    {"", "*/bounds.csv", "*_px", "upper bounds: larger ones hold too, up to the check's own bound"},
    {"", "*/bounds.csv", "left_out", "a count within what edges can be"},
    {"", "*/calibration_believed.json", "/cameras/*",
     "what users believe; the format's own files state the truth", states_truth},
    {"", "*/calibration_true.json", "/cameras/*/shutter/exposure_s",
     "how blurred images are is not judged"},
    {"", "*/calibration_true.json", "/cameras/*/clock/*", "within the jitter of the stamps"},
    {"", "*/timestamps.csv", "stamp_s", "within the jitter of the stamps"},
    {"", "*/geometry.json", "/cell_px", "a rule of levels; tiles of a coarser rule keep it too"},
    {"", "*/geometry.json", "/finest_spacing_m",
     "a rule of levels; tiles of a coarser rule keep it too"},
    {"", "*/imaging.json", "/cameras/*/*_m", "how blurred images are is not judged"},
    {"", "*/imaging.json", "/cameras/*/exposure*",
     "how bright and blurred images are is not judged"},
    {"", "*/imaging.json", "/cameras/*/settings",
     "how images are made of light is taken for granted, as it is stated"},
    {"", "*/motion.csv", "a*_mps2", "within 0.05 m/s^2"},
    {"", "*/motion.csv", "*_mps3", "moves the lines of an image by less than is seen"},
    {"", "*/motion.csv", "*_mps4", "moves the lines of an image by less than is seen"},
    {"", "*/motion.csv", "*_mps5", "moves the lines of an image by less than is seen"},
    {"", "*/motion.csv", "r*_radps*", "turns the lines of an image by less than is seen"},
    {"", "*/motion.csv", "s*_radps", "turns the lines of an image by less than is seen"},
    {"", "*/motion.csv", "v*_mps", "within 0.05 % of the speed"},
    {"", "*/motion.csv", "w*_radps", "within 0.05 degrees a second"},
    {"", "*/motion.csv", "reach_s", "how long the terms hold, beyond any exposure"},
    {"", "*/moving.csv", "a*_mps2", "within 0.05 m/s^2, of bodies that move slowly enough to tell"},
    {"", "*/moving.csv", "*_mps3", "moves the lines of an image by less than is seen"},
    {"", "*/moving.csv", "*_mps4", "moves the lines of an image by less than is seen"},
    {"", "*/moving.csv", "*_mps5", "moves the lines of an image by less than is seen"},
    {"", "*/moving.csv", "r*_radps*", "turns the lines of an image by less than is seen"},
    {"", "*/moving.csv", "s*_radps", "turns the lines of an image by less than is seen"},
    {"", "*/moving.csv", "v*_mps", "within 0.05 % of the speed"},
    {"", "*/moving.csv", "w*_radps", "of parts, which turn too fast to tell by their attitudes"},
    {"", "*/moving.csv", "q*", "of parts that no image shows"},
    {"", "*/moving.csv", "reach_s", "how long the terms hold, beyond any exposure"},
    {"coco kitti kitti_object kitti_raw", "*/moving/*.png", "channel *",
     "not all images have depths to hold masks against"},
    {"", "*/sensors.json", "/sensors/*/rig_from_sensor/translation_m/*",
     "where a rig of one sensor is on the body, no other file states"},
    {"", "*/sensors.json", "/sensors/*/settings_toml", "the job's words"},
    {"", "*/sensors.json", "/sensors/*/clock/believed/*",
     "what a calibration would say: no other file need state it"},
    {"", "*/sensors.json", "/sensors/*/clock/jitter_sd_s", "where too few stamps show it"},
    {"", "*/sensors/*.csv", "stamp_s", "single stamps: within four deviations of the jitter"},
    {"", "*/sensors/*.csv", "gyro_*", "what errors make of the truth beside it"},
    {"", "*/sensors/*.csv", "accel_*", "what errors make of the truth beside it"},
    {"", "*/sensors/*.csv", "field_*", "what errors make of the truth beside it"},
    {"", "*/sensors/*.csv", "pressure_pa", "what errors make of the truth beside it"},
    {"", "*/sensors/*.csv", "lat_deg", "within 8 of the deviations that are stated"},
    {"", "*/sensors/*.csv", "lon_deg", "within 8 of the deviations that are stated"},
    {"", "*/sensors/*.csv", "height_m", "within 8 of the deviations that are stated"},
    {"", "*/sensors/*.csv", "altitude_msl_m", "within 8 of the deviations that are stated"},
    {"", "*/sensors/*.csv", "velocity_*", "within 8 of the deviations that are stated"},
    {"", "*/sensors/*.csv", "sigma_*", "larger ones than those of the errors"},
    {"", "*/sensors/*.csv", "fix", "which of the kinds of fixes it is"},
    {"", "*/sensors/*.csv", "true_gyro_*",
     "single samples: their integrals are held against the poses, to what those are rounded to"},
    {"", "*/sensors/*.csv", "true_accel_*",
     "single samples: their integrals are held against the poses, to what those are rounded to"},
    {"", "*/sensors/*.csv", "true_l*_deg",
     "between the frames' times: to what the velocities between are known to"},
    {"", "*/sensors/*.csv", "true_height_m",
     "between the frames' times: to what the velocities between are known to"},
    {"", "*/sensors/*.csv", "true_velocity_*",
     "where motions change too fast between samples to tell"},
    {"", "*/sensors/*.csv", "true_altitude_msl_m",
     "between the frames' times: where the body is then is not stated"},
    {"", "*/sensors/*.csv", "true_range_m",
     "within its limits; no check casts as many rays as a cone takes"},
    {"", "*/sensors/*.csv", "true_field_*",
     "between the frames' times: how the body is turned then is not stated"},
    {"", "*/sensors/*.csv", "range_m",
     "between the frames' times: where the body is then is not stated"},
    {"", "*/sensors/*.rnx", "*", "orbits of satellites that stand below the mask"},
    {"coco", "annotations/instances.json", "/annotations/*/occlusion",
     "what is hidden is in no image"},
    {"coco", "annotations/instances.json", "/annotations/*/truncation",
     "what is beyond the border is in no image"},
    {"coco", "annotations/instances.json", "/annotations/*/whole_bbox/*",
     "what is hidden is in no image"},
    {"coco", "annotations/instances.json", "/annotations/*/distance_m", "the format has no depth"},
    {"coco", "annotations/*.json", "/info/*", "words for people"},
    {"coco", "annotations/*.json", "/licenses/*", "what the world's sources state"},
    {"coco", "images/*.png", "channel *",
     "single images: nothing beside them tells what they show"},
    {"colmap", "*.txt", "comment", "words for people"},
    {"kitti_object", "training/image_2/*.png", "channel *",
     "single images: nothing beside them tells what they show"},
    {"kitti_object", "training/label_2/*.txt", "*",
     "boxes lie within each other's projection, which leaves them room"},
    {"kitti_raw", "*/oxts/data/*.txt", "[4]",
     "within the bounds of oxts_*, next to 0 in level flight"},
    {"kitti_raw", "*/oxts/data/*.txt", "[10]",
     "within the bounds of oxts_*, next to 0 in level flight"},
    {"kitti_raw", "*/oxts/data/*.txt", "[11]",
     "within the bounds of oxts_*, next to 0 in level flight"},
    {"kitti_raw", "*/oxts/data/*.txt", "[17]",
     "within the bounds of oxts_*, next to 0 in level flight"},
    {"kitti_raw", "*/oxts/data/*.txt", "[20]",
     "within the bounds of oxts_*, next to 0 in level flight"},
    {"kitti_raw", "*/oxts/data/*.txt", "[21]",
     "within the bounds of oxts_*, next to 0 in level flight"},
    {"kitti_raw", "*/oxts/dataformat.txt", "yaw*", "words for people"},
    {"kitti_raw", "*/oxts/dataformat.txt", "words", "words for people"},
    {"kitti_raw", "*/oxts/data/*.txt", "[23]", "of the decimals; at most 1 mm"},
    {"kitti_raw", "*/oxts/data/*.txt", "[24]", "of the decimals; at most 1 mm/s"},
    {"kitti", "*/image_*.png", "channel *", "how bright a whole image is"},
    {"kitti_raw", "*/image_*.png", "channel *", "how bright a whole image is"},
    {"tartanair tartanair_v1", "*/image_*.png", "channel *", "how bright a whole image is"},
    {"colmap", "*/images/*.png", "channel *", "how bright a whole image is"},
    {"terracast", "*/image/*.png", "channel *", "how bright a whole image is"},
    {"euroc", "*/data/*.png", "channel *", "how bright a whole image is"},
    {"tum", "*/rgb/*.png", "channel *", "how bright a whole image is"},
};

/// The path with the digits of its last part as *.
std::string pattern_of(const std::string& path) {
  std::string pattern;
  const std::size_t name = path.rfind('/') + 1;
  for (std::size_t i = 0; i < path.size(); ++i)
    if (i < name || std::isdigit(static_cast<unsigned char>(path[i])) == 0)
      pattern += path[i];
    else if (!pattern.ends_with('*'))
      pattern += '*';
  return pattern;
}

/// Files that match none of the known kinds, by pattern; of very many patterns the first.
std::vector<NotProved> unknown_files(const Dataset& dataset) {
  std::map<std::string, std::int64_t> count_of;
  for (const auto& [path, record] : dataset.files) {
    const std::string& file = path;
    const auto is_known = [&](const KnownFiles& known) {
      return holds(known.formats, dataset.format) && matches(known.files, file);
    };
    if (std::none_of(std::begin(kKnownFiles), std::end(kKnownFiles), is_known))
      ++count_of[pattern_of(path)];
  }
  constexpr std::size_t kMostNamed = 100;
  constexpr const char* kWhy = "a kind of file that no check reads";
  std::vector<NotProved> named;
  std::int64_t num_others = 0;
  for (const auto& [pattern, count] : count_of)
    if (named.size() < kMostNamed)
      named.push_back({pattern, "*", kWhy, count});
    else
      num_others += count;
  if (num_others > 0)
    named.push_back(
        {fmt::format("and {} more", count_of.size() - kMostNamed), "*", kWhy, num_others});
  return named;
}

}  // namespace

std::vector<NotProved> not_proved(const Dataset& dataset) {
  if (is_format_of_plugin(dataset.format))
    return {{"*", "*", "a format of a plug-in: sizes and hashes of its files alone are checked",
             std::ssize(dataset.files)}};
  std::vector<NotProved> named = unknown_files(dataset);
  for (const Row& row : kRows) {
    if (!holds(row.formats, dataset.format) || !row.applies(dataset)) continue;
    NotProved one{std::string(row.files), std::string(row.fields), std::string(row.why)};
    one.num_files = std::count_if(dataset.files.begin(), dataset.files.end(),
                                  [&](const auto& file) { return matches(one.files, file.first); });
    if (row.files == "dataset.json") one.num_files = 1;
    if (one.num_files > 0) named.push_back(std::move(one));
  }
  return named;
}

const NotProved* named_by(const std::vector<NotProved>& named, const std::string& file,
                          const std::string& field) {
  const auto found = std::find_if(named.begin(), named.end(), [&](const NotProved& one) {
    return matches(one.files, file) && matches(one.fields, field);
  });
  return found == named.end() ? nullptr : &*found;
}

core::Json not_proved_json(const std::vector<NotProved>& named) {
  core::Json list = core::Json::array();
  for (const NotProved& one : named)
    list.push(core::Json::object()
                  .set("files", core::printable(one.files))
                  .set("fields", one.fields)
                  .set("why", one.why)
                  .set("num_files", one.num_files));
  return list;
}

}  // namespace terracast::validate
