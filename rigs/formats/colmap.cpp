#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "geo/fixes/text.h"
#include "geo/frames.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"

// COLMAP's cameras.txt and rig_config.json in one folder: the k-th camera of the rig has the k-th CAMERA_ID. Its frame of a rig is
// its reference camera's; where that stands in ours is told by members that COLMAP passes over, rig_from_ref_….
// https://colmap.github.io/format.html, https://colmap.github.io/rigs.html
namespace terracast::rigs {
namespace {

using capture::CameraCalibration;
using core::ErrorKind;
using core::fail;
using core::Json;
namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = std::size_t{1} << 22;

struct ColmapModel {
  std::string_view name;
  std::size_t num_focal_lengths;
  std::size_t num_own;     ///< after focal lengths and principal point, in the order of ours
  std::string_view model;  ///< ours, which may have more, 0 here
  std::size_t num_own_of_model;
};
/// The first one of a model of ours is what it is written as.
constexpr std::array kModels = {
    ColmapModel{"PINHOLE", 2, 0, "pinhole", 0},
    ColmapModel{"SIMPLE_PINHOLE", 1, 0, "pinhole", 0},
    ColmapModel{"SIMPLE_RADIAL", 1, 1, "simple_radial", 1},
    ColmapModel{"RADIAL", 1, 2, "radial", 2},
    ColmapModel{"OPENCV", 2, 4, "opencv", 4},
    ColmapModel{"OPENCV_FISHEYE", 2, 4, "opencv_fisheye", 4},
    ColmapModel{"SIMPLE_RADIAL_FISHEYE", 1, 1, "opencv_fisheye", 4},
    ColmapModel{"RADIAL_FISHEYE", 1, 2, "opencv_fisheye", 4},
    ColmapModel{"FULL_OPENCV", 2, 8, "full_opencv", 8},
    ColmapModel{"FOV", 2, 1, "fov", 1},
    ColmapModel{"THIN_PRISM_FISHEYE", 2, 8, "thin_prism_fisheye", 8},
};

geo::CameraIntrinsics intrinsics_of(std::string_view name, const std::vector<double>& numbers,
                                    const std::string& where) {
  for (const ColmapModel& known : kModels) {
    if (known.name != name) continue;
    const std::size_t count = known.num_focal_lengths + 2 + known.num_own;
    if (numbers.size() != count)
      fail(ErrorKind::Input, "{}: {} parameters; {} takes {}", where, numbers.size(), name, count);
    auto rest = numbers.begin() + static_cast<std::ptrdiff_t>(known.num_focal_lengths);
    geo::CameraIntrinsics intrinsics{.model = std::string(known.model),
                                     .width_px = 0,
                                     .height_px = 0,
                                     .parameters = {numbers[0], rest[-1]}};
    intrinsics.parameters.insert(intrinsics.parameters.end(), rest, numbers.end());
    intrinsics.parameters.resize(4 + known.num_own_of_model, 0.0);
    return intrinsics;
  }
  std::vector<std::string_view> names;
  for (const ColmapModel& known : kModels) names.push_back(known.name);
  fail(ErrorKind::Input, "{}: model {} is not known; known are {}", where, name,
       fmt::join(names, ", "));
}

/// The cameras of cameras.txt by their ids.
std::map<std::int64_t, geo::CameraIntrinsics> read_cameras(const fs::path& file) {
  const std::string text = core::read_text_file(file, kMostBytes);
  std::map<std::int64_t, geo::CameraIntrinsics> cameras;
  std::size_t line_number = 0;
  for (const std::string_view line : geo::lines_of_text(text)) {
    ++line_number;
    const std::string where = fmt::format("{}:{}", file.string(), line_number);
    const std::vector<std::string_view> words = geo::words_of(line);
    if (words.empty() || words[0].starts_with('#')) continue;
    if (words.size() < 5)
      fail(ErrorKind::Input, "{}: {} words; a camera takes CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]",
           where, words.size());
    std::vector<double> numbers;
    for (std::size_t i = 0; i < words.size(); ++i) {
      if (i == 1) continue;
      const std::optional<double> number = geo::number_of(words[i]);
      if (!number)
        fail(ErrorKind::Input, "{}: \"{}\", word {}, is no number", where, words[i], i + 1);
      numbers.push_back(*number);
    }
    geo::CameraIntrinsics intrinsics =
        intrinsics_of(words[1], std::vector<double>(numbers.begin() + 3, numbers.end()), where);
    for (std::size_t i : {std::size_t{1}, std::size_t{2}})
      if (!(numbers[i] >= 1.0 && numbers[i] <= 16384.0))
        fail(ErrorKind::Input, "{}: a side of {} px; an image has 1 to 16384", where, numbers[i]);
    intrinsics.width_px = static_cast<int>(numbers[1]);
    intrinsics.height_px = static_cast<int>(numbers[2]);
    if (!(std::abs(numbers[0]) < 1e9) ||
        !cameras.emplace(static_cast<std::int64_t>(numbers[0]), std::move(intrinsics)).second)
      fail(ErrorKind::Input, "{}: CAMERA_ID {} is no number of its own", where, words[0]);
  }
  return cameras;
}

geo::Rigid3d pose_of(const Json& object, const std::string& prefix, const std::string& where) {
  const std::vector<double> q = object.at(prefix + "_rotation").numbers();
  const std::vector<double> t = object.at(prefix + "_translation").numbers();
  if (q.size() != 4 || t.size() != 3)
    fail(ErrorKind::Input,
         "{}: {}_rotation has {} numbers and {}_translation {}; they take 4 (w x y z) and 3", where,
         prefix, q.size(), prefix, t.size());
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (!(std::abs(rotation.norm() - 1.0) < 1e-3))
    fail(ErrorKind::Input, "{}: {}_rotation has length {}; a rotation has 1", where, prefix,
         rotation.norm());
  return {.rotation = rotation.normalized(), .translation = {t[0], t[1], t[2]}};
}

/// Rig and camera of "rig/camera/".
std::pair<std::string, std::string> names_of(std::string prefix) {
  while (prefix.ends_with('/')) prefix.pop_back();
  const std::size_t slash = prefix.rfind('/');
  if (slash == std::string::npos) return {"", safe_name(prefix)};
  return {safe_name(prefix.substr(0, slash)), safe_name(prefix.substr(slash + 1))};
}

fs::path folder_of(const fs::path& path) {
  return fs::is_directory(path) ? path : path.parent_path();
}

rigs::RigOptions read_colmap(const fs::path& path, const ReadOptions& options) {
  const fs::path config_file = folder_of(path) / "rig_config.json";
  const auto intrinsics_by_id = read_cameras(folder_of(path) / "cameras.txt");
  const Json config =
      Json::parse(core::read_text_file(config_file, kMostBytes), config_file.string());
  if (!config.is_array() || config.size() != 1)
    fail(ErrorKind::Input, "{}: a list of one rig is wanted", config_file.string());
  const Json& rig = config.at(std::size_t{0});
  const Json& entries = rig.at("cameras");
  if (!entries.is_array() || entries.size() != intrinsics_by_id.size())
    fail(ErrorKind::Input,
         "{}: {} cameras, but cameras.txt beside it has {}; each takes a line there",
         config_file.string(), entries.size(), intrinsics_by_id.size());
  geo::Rigid3d rig_from_reference{
      .rotation = Eigen::Quaterniond(geo::rig_from_forward_camera()).normalized(),
      .translation = Eigen::Vector3d::Zero()};
  if (rig.has("rig_from_ref_rotation"))
    rig_from_reference = pose_of(rig, "rig_from_ref", config_file.string());

  std::vector<CameraCalibration> cameras;
  std::string rig_name = options.name;
  std::size_t num_references = 0;
  auto intrinsics = intrinsics_by_id.begin();
  for (std::size_t i = 0; i < entries.size(); ++i, ++intrinsics) {
    const Json& entry = entries.at(i);
    const std::string where =
        fmt::format("{}: camera {} (counted from 0)", config_file.string(), i);
    const bool is_reference = entry.has("ref_sensor") && entry.at("ref_sensor").boolean();
    num_references += is_reference ? 1 : 0;
    const auto [rig_of_prefix, name] = names_of(entry.at("image_prefix").string());
    if (rig_name.empty()) rig_name = rig_of_prefix;
    cameras.push_back(
        {.rig = "",
         .name = name,
         .intrinsics = intrinsics->second,
         .rig_from_camera =
             is_reference ? rig_from_reference
                          : rig_from_reference * pose_of(entry, "cam_from_rig", where).inverse(),
         .body_from_rig = {}});
  }
  if (num_references != 1)
    fail(ErrorKind::Input, "{}: {} cameras say ref_sensor; one is wanted", config_file.string(),
         num_references);
  if (rig_name.empty())
    rig_name = safe_name(fs::absolute(config_file).parent_path().filename().string());
  return rig_of_cameras(rig_name, cameras);
}

/// COLMAP's name of a camera's model and its parameters there.
std::pair<std::string_view, std::vector<double>> parameters_of(const CameraCalibration& camera) {
  const std::vector<double>& p = camera.intrinsics.parameters;
  for (const ColmapModel& known : kModels) {
    if (known.model != camera.intrinsics.model) continue;
    if (known.num_focal_lengths == 2) return {known.name, p};
    if (p[0] != p[1])
      fail(ErrorKind::Config,
           "camera {}: COLMAP's {} has one focal length, not fx = {} and fy = {} px", camera.name,
           known.name, p[0], p[1]);
    return {known.name, std::vector<double>(p.begin() + 1, p.end())};
  }
  std::set<std::string_view> models;
  for (const ColmapModel& known : kModels) models.insert(known.model);
  fail(ErrorKind::Config, "camera {}: COLMAP has no model {}; it holds {}", camera.name,
       camera.intrinsics.model, fmt::join(models, ", "));
}

void set_pose(Json& object, const std::string& prefix, const geo::Rigid3d& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  object.set(prefix + "_rotation", Json::array_of({q.w(), q.x(), q.y(), q.z()}))
      .set(prefix + "_translation", Json::array_of({t.x(), t.y(), t.z()}));
}

void write_colmap(const rigs::RigOptions& rig, const fs::path& folder) {
  const std::vector<CameraCalibration> cameras = rigs::build_cameras({rig});
  std::string cameras_text = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  Json entries = Json::array();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraCalibration& camera = cameras[i];
    const auto [name, parameters] = parameters_of(camera);
    cameras_text += fmt::format("{} {} {} {} {}\n", i + 1, name, camera.intrinsics.width_px,
                                camera.intrinsics.height_px, fmt::join(parameters, " "));
    Json entry = Json::object()
                     .set("image_prefix", fmt::format("{}/{}/", camera.rig, camera.name))
                     .set("camera_model_name", name)
                     .set("camera_params", Json::array_of(parameters));
    if (i == 0)
      entry.set("ref_sensor", true);
    else
      set_pose(entry, "cam_from_rig",
               camera.rig_from_camera.inverse() * cameras[0].rig_from_camera);
    entries.push(std::move(entry));
  }
  Json config = Json::object().set("cameras", std::move(entries));
  set_pose(config, "rig_from_ref", cameras[0].rig_from_camera);
  core::make_folder(folder);
  core::write_file(folder / "cameras.txt", cameras_text);
  core::write_file(folder / "rig_config.json", Json::array().push(std::move(config)).text() + "\n");
}

}  // namespace

RigFormatInfo colmap_rigs() {
  return {.name = "colmap",
          .summary = "A folder with COLMAP's cameras.txt and rig_config.json.",
          .recognises =
              [](const fs::path& path, std::string_view) {
                return fs::is_directory(path) || path.filename() == "rig_config.json" ||
                       path.filename() == "cameras.txt";
              },
          .read = read_colmap,
          .write = write_colmap};
}

}  // namespace terracast::rigs
