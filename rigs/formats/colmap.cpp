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
#include "rigs/json_value.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"

// COLMAP's cameras.txt and rig_config.json in one folder. Since 3.12 (rig_configurator) one camera says ref_sensor and none has a
// number: the k-th camera of the rig has the k-th CAMERA_ID, or camera_model_name and camera_params of its own. Before
// (rig_bundle_adjuster) ref_camera_id and camera_id name lines of cameras.txt; up to 3.8 poses were rel_qvec and rel_tvec. All
// are the camera's axes from the rig's, rotations w x y z. Where the reference camera stands in our rig is told by members that COLMAP
// passes over, rig_from_ref_…. https://colmap.github.io/format.html, https://colmap.github.io/rigs.html
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

constexpr std::array kKnown = {
    core::KnownName{"[].ref_camera_id", "the reference camera's camera_id"},
    core::KnownName{"[].cameras", "the cameras"},
    core::KnownName{"[].cameras[].camera_id", "the camera's line of cameras.txt"},
    core::KnownName{"[].cameras[].image_prefix", "names of rig and camera"},
    core::KnownName{"[].cameras[].ref_sensor", "whether it is the reference camera"},
    core::KnownName{"[].cameras[].cam_from_rig_rotation", "w x y z"},
    core::KnownName{"[].cameras[].cam_from_rig_translation", "m"},
    core::KnownName{"[].cameras[].rel_qvec", "as cam_from_rig_rotation"},
    core::KnownName{"[].cameras[].rel_tvec", "as cam_from_rig_translation"},
    core::KnownName{"[].cameras[].camera_model_name", "the camera's model, before cameras.txt"},
    core::KnownName{"[].cameras[].camera_params", "its parameters"},
    core::KnownName{"[].rig_from_ref_rotation", "of our own: how the reference camera is turned"},
    core::KnownName{"[].rig_from_ref_translation", "of our own: where it stands"},
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

geo::Rigid3d pose_of(const JsonValue& object, std::string_view rotation_key,
                     std::string_view translation_key) {
  const std::vector<double> q = object.at(rotation_key).json().numbers();
  const std::vector<double> t = object.at(translation_key).json().numbers();
  if (q.size() != 4 || t.size() != 3)
    fail(ErrorKind::Input, "{}: {} has {} numbers and {} {}; they take 4 (w x y z) and 3",
         object.where(), rotation_key, q.size(), translation_key, t.size());
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (!(std::abs(rotation.norm() - 1.0) < 1e-3))
    fail(ErrorKind::Input, "{}: {} has length {}; a rotation has 1", object.where(), rotation_key,
         rotation.norm());
  return {.rotation = rotation.normalized(), .translation = {t[0], t[1], t[2]}};
}

/// The camera's axes from the rig's.
std::optional<geo::Rigid3d> read_pose(const JsonValue& camera) {
  const auto has_any = [&](const char* a, const char* b) { return camera.has(a) || camera.has(b); };
  if (has_any("cam_from_rig_rotation", "cam_from_rig_translation"))
    return pose_of(camera, "cam_from_rig_rotation", "cam_from_rig_translation");
  if (has_any("rel_qvec", "rel_tvec")) return pose_of(camera, "rel_qvec", "rel_tvec");
  return std::nullopt;
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

using Lines = std::map<std::int64_t, geo::CameraIntrinsics>;  ///< of cameras.txt, by CAMERA_ID

std::string ids_of(const Lines& lines) {
  std::vector<std::int64_t> ids;
  for (const auto& [id, intrinsics] : lines) ids.push_back(id);
  return fmt::format("{}", fmt::join(ids, ", "));
}

/// For each camera of the rig its line of cameras.txt.
std::vector<Lines::const_iterator> lines_of(const std::vector<JsonValue>& cameras,
                                            const Lines& lines, const JsonValue& rig) {
  std::vector<Lines::const_iterator> found;
  std::set<std::int64_t> ids;
  for (const JsonValue& camera : cameras) {
    if (!camera.has("camera_id")) continue;
    const std::int64_t id = camera.at("camera_id").json().integer();
    if (!ids.insert(id).second)
      fail(ErrorKind::Input, "{}: camera_id {} stands twice", camera.where(), id);
    found.push_back(lines.find(id));
    if (found.back() == lines.end())
      fail(ErrorKind::Input, "{}: camera_id {}; cameras.txt beside it has {}", camera.where(), id,
           ids_of(lines));
  }
  if (found.size() == cameras.size() && !found.empty()) return found;
  if (!found.empty())
    fail(ErrorKind::Input, "{}: {} of {} cameras have a camera_id; give it to all or to none",
         rig.where(), found.size(), cameras.size());
  if (cameras.size() != lines.size())
    fail(ErrorKind::Input,
         "{}: {} cameras, but cameras.txt beside it has {}; each takes a line there, the k-th the "
         "k-th, or says with camera_id which",
         rig.where(), cameras.size(), lines.size());
  for (auto line = lines.begin(); line != lines.end(); ++line) found.push_back(line);
  return found;
}

/// Index of the camera that the poses are from.
std::size_t find_reference(const std::vector<JsonValue>& cameras, const JsonValue& rig) {
  std::vector<std::size_t> references;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (cameras[i].has("ref_sensor") && cameras[i].at("ref_sensor").json().boolean())
      references.push_back(i);
  if (rig.has("ref_camera_id")) {
    const std::int64_t id = rig.at("ref_camera_id").json().integer();
    const auto is_it = [&](const JsonValue& camera) {
      return camera.has("camera_id") && camera.at("camera_id").json().integer() == id;
    };
    const auto found = std::find_if(cameras.begin(), cameras.end(), is_it);
    if (found == cameras.end())
      fail(ErrorKind::Input, "{}: ref_camera_id is {}, which no camera has as camera_id",
           rig.where(), id);
    const auto index = static_cast<std::size_t>(found - cameras.begin());
    if (!references.empty() && references != std::vector{index})
      fail(ErrorKind::Input, "{}: ref_camera_id is {}, but another camera says ref_sensor",
           rig.where(), id);
    return index;
  }
  if (references.size() != 1)
    fail(ErrorKind::Input,
         "{}: {} cameras say ref_sensor, and no ref_camera_id names one; one is wanted",
         rig.where(), references.size());
  return references[0];
}

/// What a camera of the rig states of its own goes before its line of cameras.txt, as in COLMAP.
geo::CameraIntrinsics read_intrinsics(const JsonValue& camera, const geo::CameraIntrinsics& line,
                                      core::Ledger& ledger) {
  if (!camera.has("camera_model_name") && !camera.has("camera_params")) return line;
  geo::CameraIntrinsics own =
      intrinsics_of(camera.at("camera_model_name").json().string(),
                    camera.at("camera_params").json().numbers(), camera.where());
  own.width_px = line.width_px;
  own.height_px = line.height_px;
  if (own != line)
    ledger.ignore("cameras.txt: MODEL and PARAMS[]",
                  "rig_config.json states others for this camera, which COLMAP takes");
  return own;
}

fs::path cameras_file_in(const fs::path& folder) {
  fs::path file = folder / "cameras.txt";
  if (!fs::exists(file) && fs::exists(folder / "cameras.bin"))
    fail(ErrorKind::Input,
         "{}: has cameras.bin, and no cameras.txt, which is read; write it with colmap "
         "model_converter --output_type TXT",
         folder.string());
  if (!fs::exists(file))
    fail(ErrorKind::Io,
         "{}: no such file; the images' sizes and the optics of the rig's cameras stand there",
         file.string());
  return file;
}

ImportedRig read_colmap(const fs::path& path, const ReadOptions& options) {
  const fs::path config_file =
      path.extension() == ".json" ? path : folder_of(path) / "rig_config.json";
  const Lines lines = read_cameras(cameras_file_in(folder_of(path)));
  const JsonValue config = JsonValue::read(config_file, kMostBytes);
  if (!config.json().is_array() || config.json().size() != 1)
    fail(ErrorKind::Input,
         "{}: a list of one rig is wanted; of several, keep the one that is to be imported",
         config_file.string());
  const JsonValue rig = config.items()[0];
  const std::vector<JsonValue> entries = rig.at("cameras").items();
  const std::vector<Lines::const_iterator> line_of = lines_of(entries, lines, rig);
  std::vector<std::optional<geo::Rigid3d>> camera_from_rig;
  for (const JsonValue& entry : entries) camera_from_rig.push_back(read_pose(entry));
  const std::size_t reference = find_reference(entries, rig);
  if (!camera_from_rig[reference]) camera_from_rig[reference] = geo::Rigid3d{};
  const geo::Rigid3d rig_from_reference =
      rig.has("rig_from_ref_rotation")
          ? pose_of(rig, "rig_from_ref_rotation", "rig_from_ref_translation")
          : rig_from_rdf();

  ImportedRig read;
  std::vector<CameraCalibration> cameras;
  std::string rig_name = options.name;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (!camera_from_rig[i])
      fail(ErrorKind::Input,
           "{} has no cam_from_rig_rotation and cam_from_rig_translation (rel_qvec and rel_tvec up "
           "to COLMAP 3.8), and is not the reference camera: nothing says where it is",
           entries[i].where());
    const auto [rig_of_prefix, name] = names_of(entries[i].at("image_prefix").json().string());
    if (rig_name.empty()) rig_name = rig_of_prefix;
    cameras.push_back({.rig = "",
                       .name = name,
                       .intrinsics = read_intrinsics(entries[i], line_of[i]->second, read.ledger),
                       .rig_from_camera = rig_from_reference * *camera_from_rig[reference] *
                                          camera_from_rig[i]->inverse(),
                       .body_from_rig = {}});
  }
  if (rig_name.empty())
    rig_name = safe_name(fs::absolute(config_file).parent_path().filename().string());
  if (const std::size_t num_others = lines.size() - entries.size(); num_others > 0)
    read.ledger.ignore("cameras.txt: CAMERA_ID", "no camera of the rig has this camera_id",
                       static_cast<std::int64_t>(num_others));
  read.ledger.merge(config.ledger(kKnown));
  read.rig = rig_of_cameras(rig_name, cameras);
  return read;
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
  return {
      .name = "colmap",
      .summary = "A folder with COLMAP's cameras.txt and rig_config.json.",
      .recognises =
          [](const fs::path& path, std::string_view first_bytes) {
            if (fs::is_directory(path))
              return fs::exists(path / "rig_config.json") || fs::exists(path / "cameras.txt");
            // A list of rigs; a map with cameras is of OpenCV.
            const std::size_t begin = first_bytes.find_first_not_of(" \t\r\n");
            const bool is_list = begin != std::string_view::npos && first_bytes[begin] == '[';
            const bool is_of_rig =
                is_list && (first_bytes.find("\"cameras\"") != std::string_view::npos ||
                            first_bytes.find("\"ref_camera_id\"") != std::string_view::npos);
            return path.filename() == "rig_config.json" || path.filename() == "cameras.txt" ||
                   (path.extension() == ".json" && is_of_rig);
          },
      .read = read_colmap,
      .write = write_colmap,
      .known =
          [] {
            return std::vector<core::KnownTable>{{"colmap", "members of rig_config.json", kKnown}};
          }};
}

}  // namespace terracast::rigs
