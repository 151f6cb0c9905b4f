#include "validate/readers/terracast_cameras.h"

#include <cmath>
#include <map>
#include <memory>

#include "core/error.h"
#include "core/json.h"
#include "core/printable.h"
#include "validate/readers/stated_model.h"
#include "validate/readers/terracast_arrays.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;
using core::Json;
using Eigen::Vector3d;

Intrinsics intrinsics_of(const Json& json, const std::string& where) {
  const auto length = [&](const char* member) {
    const std::int64_t value = json.at(member).integer();
    if (value < 1 || value > (1 << 15)) fail(ErrorKind::Input, "{}: {} = {}", where, member, value);
    return static_cast<int>(value);
  };
  const std::vector<double> p = json.at("parameters").numbers();
  if (p.size() < 4)
    fail(ErrorKind::Input, "{}: {} parameters; fx, fy, cx, cy come first", where, p.size());
  Intrinsics camera{.width_px = length("width_px"),
                    .height_px = length("height_px"),
                    .fx_px = p[0],
                    .fy_px = p[1],
                    .cx_px = p[2],
                    .cy_px = p[3]};
  camera.plane = make_camera_plane(json.at("model").string(), {p.begin() + 4, p.end()});
  return camera;
}

/// docs/cameras.md's names of a model's parameters; of a table those before its nodes.
std::string parameter_names_of(const std::string& model) {
  static const std::map<std::string, std::string> own = {
      {"simple_radial", "k1"},
      {"radial", "k1, k2"},
      {"opencv", "k1, k2, p1, p2"},
      {"full_opencv", "k1, k2, p1, p2, k3, k4, k5, k6"},
      {"opencv_fisheye", "k1, k2, k3, k4"},
      {"thin_prism_fisheye", "k1, k2, p1, p2, k3, k4, sx1, sy1"},
      {"fov", "omega"},
      {"unified", "xi, k1, k2, p1, p2"},
      {"extended_unified", "alpha, beta"},
      {"double_sphere", "xi, alpha"},
      {"tabulated", "columns, rows"}};
  const auto found = own.find(model);
  return found == own.end() ? "fx, fy, cx, cy" : "fx, fy, cx, cy, " + found->second;
}

/// throws   Input: a member of text that is another
void check_text(const Json& json, const char* member, const std::string& right,
                const std::string& where) {
  const std::string& found = json.at(member).string();
  if (found != right)
    fail(ErrorKind::Input, "{}: {} = \"{}\"; \"{}\" is right", where, member,
         core::first_letters(found, 60), right);
}

/// How a camera is mounted.
/// throws   Input: not as in dataset.json
void check_mount(const Json& json, const Camera& camera, const std::string& where) {
  const std::vector<double> q = json.at("rotation_wxyz").numbers();
  const std::vector<double> t = json.at("translation_m").numbers();
  if (q.size() != 4 || t.size() != 3)
    fail(ErrorKind::Input, "{}: body_from_camera of {} and {} numbers, not 4 and 3", where,
         q.size(), t.size());
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (!(std::abs(rotation.norm() - 1.0) <= 1e-9))
    fail(ErrorKind::Input, "{}: a quaternion of length {}, not 1", where, rotation.norm());
  const Pose& right = *camera.body_from_camera;
  // Both files have all digits of the same numbers, and quaternions become matrices.
  constexpr double kRounding_rad = 1e-12, kRounding_m = 1e-12;
  const double angle_rad =
      rotation_angle_rad(right.rotation.transpose() * rotation.normalized().toRotationMatrix());
  const double way_m = (Vector3d(t[0], t[1], t[2]) - right.translation).norm();
  if (!(angle_rad <= kRounding_rad) || !(way_m <= kRounding_m * (1.0 + right.translation.norm())))
    fail(ErrorKind::Input, "{}: body_from_camera is {:.3g} deg and {:.3g} m off dataset.json's",
         where, degrees_from_radians(angle_rad), way_m);
}

/// throws   Input: lines that are exposed otherwise than dataset.json says, or no shutter
void check_shutter(const Json& json, const Camera& camera, const std::string& where) {
  const double exposure_s = json.at("exposure_s").number();
  const double line_time_s = json.at("line_time_s").number();
  const std::optional<Readout> readout = readout_of(json.at("readout").string());
  if (!(exposure_s >= 0.0) || !std::isfinite(exposure_s))
    fail(ErrorKind::Input, "{}: exposure_s = {}", where, exposure_s);
  if (!readout)
    fail(ErrorKind::Input, "{}: readout = \"{}\"; down, up, right and left are known", where,
         core::first_letters(json.at("readout").string(), 60));
  const double right_s = camera.shutter ? camera.shutter->line_time_s : 0.0;
  if (line_time_s != right_s)
    fail(ErrorKind::Input, "{}: line_time_s = {}, but {} in dataset.json", where, line_time_s,
         right_s);
  if (camera.shutter && *readout != camera.shutter->readout)
    fail(ErrorKind::Input, "{}: readout = {}, but {} in dataset.json", where, name_of(*readout),
         name_of(camera.shutter->readout));
}

/// All that an entry says beside the model.
void check_entry(const Json& json, const Camera& camera, const CameraPlane& plane,
                 const std::string& where, Findings& findings) {
  const auto check = [&](const std::function<void()>& part) { findings.attempt(where, part); };
  check([&] {
    const std::string parts = json.at("rig").string() + "/" + json.at("camera").string();
    if (parts != camera.name)
      fail(ErrorKind::Input, "{}: rig and camera are {}", where, core::first_letters(parts, 60));
  });
  check([&] { check_text(json, "parameter_names", parameter_names_of(plane.model()), where); });
  check([&] { check_mount(json.at("body_from_camera"), camera, where); });
  check([&] { check_shutter(json.at("shutter"), camera, where); });
  check([&] { check_text(json, "rays", camera.name + "/rays.npy", where); });
  check([&] {
    if (!plane.is_central())
      return check_text(json, "origins", camera.name + "/origins.npy", where);
    if (json.has("origins"))
      fail(ErrorKind::Input, "{}: origins of a {} camera, whose rays all start at its place", where,
           plane.model());
  });
}

/// rays.npy, and origins.npy of cameras that are not central.
void read_rays(const Dataset& dataset, const std::string& folder, Camera& camera) {
  auto rays = std::make_shared<PixelRays>();
  rays->camera = camera.intrinsics;
  const auto read = [&](const std::string& file, std::vector<Vector3d>& vectors) {
    const std::vector<double> values = read_array<double>(dataset, file, camera.intrinsics, 3, 'f');
    for (std::size_t i = 0; i < values.size(); i += 3)
      vectors.emplace_back(values[i], values[i + 1], values[i + 2]);
  };
  read(folder + "/rays.npy", rays->directions);
  const std::string origins = folder + "/origins.npy";
  const bool is_central = camera.intrinsics.plane->is_central();
  if (!is_central) read(origins, rays->origins);
  camera.pixel_rays = std::move(rays);
  if (is_central && std::filesystem::exists(dataset.root / origins))
    fail(ErrorKind::Input, "{}: beside a {} camera, whose rays all start at its place", origins,
         camera.intrinsics.plane->model());
}

}  // namespace

void read_terracast_cameras(const Dataset& dataset, Sequence& sequence, Findings& findings) {
  const std::string path = sequence.path + "/cameras.json";
  findings.attempt(path, [&] {
    const Json json = Json::read(dataset.root / path);
    if (json.at("format").string() != "terracast-cameras" || json.at("version").integer() != 1)
      fail(ErrorKind::Input, "{}: not terracast-cameras, version 1", path);
    const Json& cameras = json.at("cameras");
    if (!cameras.is_array() || cameras.size() != sequence.cameras.size())
      fail(ErrorKind::Input, "{}: other cameras than dataset.json has", path);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      Camera& camera = sequence.cameras[i];
      if (cameras.at(i).at("name").string() != camera.name)
        fail(ErrorKind::Input, "{}: camera {} where {} stands in dataset.json", path,
             core::first_letters(cameras.at(i).at("name").string(), 60), camera.name);
      const std::string where = path + ": " + camera.name;
      const Intrinsics read = intrinsics_of(cameras.at(i), where);
      complete_stated(camera);
      camera.intrinsics = read;
      check_entry(cameras.at(i), camera, *read.plane, where, findings);
    }
  });
  for (Camera& camera : sequence.cameras) {
    if (!camera.intrinsics.plane) continue;  // told above
    const std::string folder = sequence.path + "/" + camera.name;
    findings.attempt(folder + "/rays.npy", [&] { read_rays(dataset, folder, camera); });
  }
}

}  // namespace terracast::validate
