#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/json.h"
#include "tests/validate/analytic_writer.h"

namespace terracast::test {

namespace {

using core::Json;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
namespace fs = std::filesystem;

constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;

// The place of the scene, and WGS84 by series of its own: Newton on the closed form of ECEF.
constexpr double kLat_deg = 42.5;
constexpr double kLon_deg = 1.5;
constexpr double kHeight_m = 1200.0;

Vector3d ecef(double lat_deg, double lon_deg, double h) {
  const double a = 6378137.0;
  const double b = a * (1.0 - 1.0 / 298.257223563);
  const double lat = lat_deg * kRadPerDeg, lon = lon_deg * kRadPerDeg;
  const double n =
      a * a /
      std::sqrt(a * a * std::cos(lat) * std::cos(lat) + b * b * std::sin(lat) * std::sin(lat));
  return {(n + h) * std::cos(lat) * std::cos(lon), (n + h) * std::cos(lat) * std::sin(lon),
          (b * b / (a * a) * n + h) * std::sin(lat)};
}

/// Columns east, north, up at a place.
Matrix3d ecef_from_enu(double lat_deg, double lon_deg) {
  const double lat = lat_deg * kRadPerDeg, lon = lon_deg * kRadPerDeg;
  const Vector3d up(std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat));
  const Vector3d east = Vector3d(0, 0, 1).cross(up).normalized();
  Matrix3d m;
  m << east, up.cross(east), up;
  return m;
}

ScenePlace place_of_ecef(const Vector3d& target) {
  ScenePlace p{kLat_deg, kLon_deg, kHeight_m};
  for (int i = 0; i < 8; ++i) {
    const Vector3d enu = ecef_from_enu(p.lat_deg, p.lon_deg).transpose() *
                         (target - ecef(p.lat_deg, p.lon_deg, p.height_m));
    p.lat_deg += enu.y() / 6.37e6 / kRadPerDeg;
    p.lon_deg += enu.x() / (6.37e6 * std::cos(p.lat_deg * kRadPerDeg)) / kRadPerDeg;
    p.height_m += enu.z();
  }
  return p;
}

/// A turn about a camera's y axis.
Matrix3d yawed(double angle_deg) {
  return Eigen::AngleAxisd(angle_deg * kRadPerDeg, Vector3d::UnitY()).toRotationMatrix();
}

/// An image between its pixels, by Lagrange's cubic both ways (of fourth order: waves of 8 pixels
/// keep their place to 0.01 px); the border goes on.
double value_at(const core::Image8& image, double x, double y, int channel) {
  const auto weights = [](double t) {
    return std::array<double, 4>{-t * (t - 1.0) * (t - 2.0) / 6.0,
                                 (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
                                 -(t + 1.0) * t * (t - 2.0) / 2.0, (t + 1.0) * t * (t - 1.0) / 6.0};
  };
  const auto wx = weights(x - std::floor(x));
  const auto wy = weights(y - std::floor(y));
  double value = 0.0;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i)
      value += wx[static_cast<std::size_t>(i)] * wy[static_cast<std::size_t>(j)] *
               image(std::clamp(static_cast<int>(std::floor(x)) + i - 1, 0, image.width() - 1),
                     std::clamp(static_cast<int>(std::floor(y)) + j - 1, 0, image.height() - 1),
                     channel);
  return value;
}

void write_npy_f4(const fs::path& file, const std::vector<std::size_t>& shape,
                  const std::vector<float>& values) {
  core::write_file(file, npy_bytes("<f4", shape, values.data(), values.size() * 4));
}

struct FlowAt {
  Vector2d flow;
  bool in_view;
  bool is_covisible;
};

/// Flow from the scene itself, as a camera of the said intrinsics has it.
FlowAt flow_at(const Said& said, std::size_t from, std::size_t to, int x, int y) {
  const Recording& recording = said.recording;
  const SceneCamera& camera = recording.cameras[0];
  const double f = said.focal(0);
  const Vector3d ray((x + 0.5 - said.cx(0)) / f, (y + 0.5 - said.cy(0)) / f, 1.0);
  const double depth_m = recording.depth[0][from](x, y);
  const bool is_sky = !std::isfinite(depth_m);
  if (camera.line_time_s > 0.0 && !is_sky) {
    const SaidPose line = recording.pose_after(0, from, camera.line_offset_s(x + 0.5, y + 0.5));
    const Recording::Shown end =
        recording.shown(0, to, line.centre + line.rotation * (ray * depth_m));
    const bool in_view = end.depth_m > 0.0 && end.pixel.x() >= 0.0 && end.pixel.y() >= 0.0 &&
                         end.pixel.x() < camera.width && end.pixel.y() < camera.height;
    return {end.pixel - Vector2d(x + 0.5, y + 0.5), in_view, in_view};
  }
  const Vector3d offset = recording.rotation(0, from) * (ray * (is_sky ? 1.0 : depth_m));
  const Vector3d moved = recording.centre(0, from) - recording.centre(0, to);
  const Vector3d there =
      recording.rotation(0, to).transpose() * (is_sky ? offset : Vector3d(offset + moved));
  if (!(there.z() > 0.0)) return {Vector2d::Zero(), false, false};
  const Vector2d at(f * there.x() / there.z() + said.cx(0), f * there.y() / there.z() + said.cy(0));
  const bool in_view = there.z() > 0.0 && at.x() >= 0.0 && at.y() >= 0.0 && at.x() < camera.width &&
                       at.y() < camera.height;
  // Gentle hills seen from above hide nothing.
  return {at - Vector2d(x + 0.5, y + 0.5), in_view, in_view && !is_sky};
}

void write_flow(const Said& said, std::size_t f, const fs::path& file) {
  const SceneCamera& camera = said.recording.cameras[0];
  const std::size_t count =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  const auto height = static_cast<std::size_t>(camera.height);
  const auto width = static_cast<std::size_t>(camera.width);
  std::map<std::string, std::string> arrays;
  for (const bool is_forward : {true, false}) {
    std::vector<float> flow(2 * count);
    std::vector<std::uint8_t> in_view(count), covisible(count);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const FlowAt at = flow_at(said, is_forward ? f : f + 1, is_forward ? f + 1 : f, x, y);
        const std::size_t i = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
        flow[i] = static_cast<float>(said.mistake.flow_sign * at.flow.x());
        flow[count + i] = static_cast<float>(said.mistake.flow_sign * at.flow.y());
        in_view[i] = at.in_view ? 1 : 0;
        covisible[i] = said.mistake.covisible.value_or(at.is_covisible) ? 1 : 0;
      }
    const std::string way = is_forward ? "fwd" : "bwd";
    arrays["flow_" + way + ".npy"] =
        npy_bytes("<f4", {1, 2, height, width}, flow.data(), flow.size() * 4);
    arrays["fov_mask_" + way + ".npy"] =
        npy_bytes("|b1", {1, height, width}, in_view.data(), count);
    arrays["covisible_mask_" + way + ".npy"] =
        npy_bytes("|b1", {1, height, width}, covisible.data(), count);
  }
  write_npz(file, arrays);
}

/// The older form of a frame's forward flow: 64 u + 32768 in blue, v in green, the mask in red.
void write_flow_png(const Said& said, std::size_t f, const fs::path& file) {
  const SceneCamera& camera = said.recording.cameras[0];
  core::Image16 image(camera.width, camera.height, 3);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const FlowAt at = flow_at(said, f, f + 1, x, y);
      const bool is_covisible = said.mistake.covisible.value_or(at.is_covisible);
      int mask = is_covisible ? 0 : at.in_view ? 1 : 100;
      for (const int axis : {0, 1}) {
        const double flow_px = said.mistake.flow_sign * at.flow[axis];
        const long count = std::lround(32768.0 + 64.0 * flow_px);
        if (count < 0 || count > 65535) mask = 200;
        image(x, y, 2 - axis) = static_cast<std::uint16_t>(std::clamp(count, 0L, 65535L));
      }
      image(x, y, 0) = static_cast<std::uint16_t>(mask);
    }
  core::write_file(file, core::encode_png(image));
}

/// motion.csv: the flight's derivatives along the body's axes.
std::string motion_rows(const Recording& recording) {
  std::string rows =
      "frame,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,wx_radps,wy_radps,wz_radps\n";
  for (std::size_t f = 0; f < recording.body_world.size(); ++f) {
    const Matrix3d body_from_world = recording.world_from_body[f].transpose();
    const Vector3d v = body_from_world * recording.velocity_mps[f];
    const Vector3d a = body_from_world * recording.acceleration_mps2[f];
    const Vector3d& w = recording.rate_body_radps[f];
    rows +=
        fmt::format("{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n",
                    f, v.x(), v.y(), v.z(), a.x(), a.y(), a.z(), w.x(), w.y(), w.z());
  }
  return rows;
}

/// Rows of a camera's poses: x forward, y right, z down in north, east, down.
std::string ned_poses(const Said& said, std::size_t c) {
  Matrix3d ned_from_enu;
  ned_from_enu << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  std::string poses;
  for (std::size_t f = 0; f < said.recording.body_world.size(); ++f) {
    const SaidPose pose = said.pose(c, f);
    // Columns: where the camera's forward, right and down point.
    Matrix3d frd;
    frd << pose.rotation.col(2), pose.rotation.col(0), pose.rotation.col(1);
    const Quaterniond q(ned_from_enu * frd);
    const Vector3d t = ned_from_enu * pose.centre;
    poses += fmt::format("{:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g}\n", t.x(), t.y(),
                         t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return poses;
}

}  // namespace

std::string npy_bytes(const std::string& type, const std::vector<std::size_t>& shape,
                      const void* values, std::size_t num_bytes) {
  std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (";
  for (const std::size_t extent : shape) header += std::to_string(extent) + ", ";
  header += "), }";
  while ((header.size() + 11) % 64 != 0) header += ' ';
  header += '\n';
  std::string bytes = "\x93NUMPY";
  bytes += '\x01';
  bytes += '\0';
  bytes += static_cast<char>(header.size() & 255);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(static_cast<const char*>(values), num_bytes);
  return bytes;
}

void write_npz(const fs::path& file, const std::map<std::string, std::string>& arrays) {
  fs::create_directories(file.parent_path());
  int error = 0;
  zip_t* archive = zip_open(file.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error);
  for (const auto& [name, bytes] : arrays) {
    const zip_int64_t index =
        zip_file_add(archive, name.c_str(),
                     zip_source_buffer(archive, bytes.data(), bytes.size(), 0), ZIP_FL_OVERWRITE);
    zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), ZIP_CM_STORE, 0);
  }
  zip_close(archive);
}

std::string digits(std::size_t frame) { return fmt::format("{:06}", frame); }

ScenePlace place_of_scene(const Vector3d& point) {
  return place_of_ecef(ecef(kLat_deg, kLon_deg, kHeight_m) +
                       ecef_from_enu(kLat_deg, kLon_deg) * point);
}

Vector3d ecef_of(const ScenePlace& place) {
  return ecef(place.lat_deg, place.lon_deg, place.height_m);
}

Vector3d scene_from_place(const ScenePlace& place) {
  return ecef_from_enu(kLat_deg, kLon_deg).transpose() *
         (ecef_of(place) - ecef(kLat_deg, kLon_deg, kHeight_m));
}

Matrix3d enu_from_scene(const ScenePlace& place) {
  return ecef_from_enu(place.lat_deg, place.lon_deg).transpose() *
         ecef_from_enu(kLat_deg, kLon_deg);
}

SaidPose Said::pose(std::size_t c, std::size_t f, bool is_format) const {
  const auto last = static_cast<std::size_t>(recording.num_frames() - 1);
  std::size_t from = std::min(f + static_cast<std::size_t>(mistake.pose_shift_frames), last);
  if (!mistake.pose_order.empty()) from = mistake.pose_order[f];
  SaidPose pose{recording.world_from_body[from] * mount(c), recording.centre(c, from)};
  if (static_cast<int>(f) == mistake.pose_frame && (is_format || !mistake.poses_only_in_format)) {
    const Vector3d turn = mistake.pose_turn_deg * kRadPerDeg;
    if (turn.norm() > 0.0)
      pose.rotation =
          pose.rotation * Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    pose.centre += pose.rotation * mistake.pose_move_m;
  }
  return pose;
}

Matrix3d Said::mount(std::size_t c) const {
  const bool is_last = c + 1 == recording.cameras.size();
  return recording.cameras[c].body_from_camera * yawed(is_last ? mistake.mount_yaw_deg : 0.0);
}

float Said::depth(std::size_t c, std::size_t f, int x, int y) const {
  if (!std::isfinite(recording.depth[c][f](x, y))) return sky_depth_m;
  const bool is_wrong = mistake.depth_frame < 0 || mistake.depth_frame == static_cast<int>(f);
  return static_cast<float>(recording.depth[c][f](x, y) *
                            (1.0 + (is_wrong ? mistake.depth_relative : 0.0)));
}

core::Image8 Said::color(std::size_t c, std::size_t f) const {
  const std::size_t from = f - std::min(f, static_cast<std::size_t>(mistake.color_shift_frames));
  const core::Image8& source = recording.color[c][from];
  const Vector2d offset_px =
      c + 1 == recording.cameras.size() ? mistake.color_offset_px : Vector2d(0.0, 0.0);
  if (mistake.color_gain == 1.0 && offset_px.isZero()) return source;
  core::Image8 moved = source;
  for (int y = 0; y < source.height(); ++y)
    for (int x = 0; x < source.width(); ++x)
      for (int k = 0; k < 3; ++k)
        moved(x, y, k) = static_cast<std::uint8_t>(std::lround(std::clamp(
            mistake.color_gain * value_at(source, x - offset_px.x(), y - offset_px.y(), k), 0.0,
            255.0)));
  return moved;
}

core::Image8 Said::classes(std::size_t c, std::size_t f) const {
  const SceneCamera& camera = recording.cameras[c];
  return recording.classes.empty() ? core::Image8(camera.width, camera.height, 1, 1)
                                   : recording.classes[c][f];
}

void write_depth_npy(const Said& said, std::size_t c, std::size_t f, const fs::path& file) {
  const SceneCamera& camera = said.recording.cameras[c];
  std::vector<float> values;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) values.push_back(said.depth(c, f, x, y));
  write_npy_f4(file,
               {static_cast<std::size_t>(camera.height), static_cast<std::size_t>(camera.width)},
               values);
}

void write_metadata(const Said& said, const fs::path& folder, const std::string& format,
                    const std::string& name, const std::string& path,
                    const std::string& georeference) {
  const Recording& recording = said.recording;
  std::string rows = "frame,camera,time_s,lat_deg,lon_deg,height_m,qw,qx,qy,qz\n";
  for (std::size_t f = 0; f < recording.body_world.size(); ++f)
    for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
      const SaidPose pose = said.pose(c, f, false);
      const ScenePlace place = place_of_scene(pose.centre);
      const Quaterniond q(enu_from_scene(place) * pose.rotation);
      rows += fmt::format(
          "{},{},{},{:.13f},{:.13f},{:.6f},{:.17g},{:.17g},{:.17g},{:.17g}\n", f,
          recording.cameras[c].name,
          static_cast<double>(f) / recording.rate_hz * (1.0 + said.mistake.times_relative),
          place.lat_deg, place.lon_deg, place.height_m, q.w(), q.x(), q.y(), q.z());
    }
  core::write_file(folder / georeference, rows);
  Json cameras = Json::array();
  bool has_lines = false;
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    const SceneCamera& camera = recording.cameras[c];
    const bool is_last = c + 1 == recording.cameras.size();
    const Mistake& mistake = said.mistake;
    const Quaterniond q(
        Matrix3d(said.mount(c) * yawed(is_last ? mistake.stated_mount_yaw_deg : 0.0)));
    const Vector3d offset =
        camera.offset_body + (is_last ? mistake.stated_mount_move_m : 0.0) * Vector3d::UnitY();
    Json entry =
        Json::object()
            .set("name", camera.name)
            .set("rig", "rig")
            .set("camera", "cam" + std::to_string(c))
            .set("width_px", camera.width)
            .set("height_px", camera.height)
            .set("fx_px", said.focal(c))
            .set("fy_px", said.focal(c))
            .set("cx_px", said.cx(c) + mistake.stated_principal_px)
            .set("cy_px", said.cy(c))
            .set("body_from_camera",
                 Json::object()
                     .set("rotation_wxyz",
                          Json::array_of(std::vector<double>{q.w(), q.x(), q.y(), q.z()}))
                     .set("translation_m",
                          Json::array_of(std::vector<double>{offset.x(), offset.y(), offset.z()})));
    if (camera.line_time_s > 0.0) {
      has_lines = true;
      entry.set("shutter", Json::object()
                               .set("exposure_s", 0.0)
                               .set("line_time_s", camera.line_time_s)
                               .set("readout", camera.readout));
    }
    cameras.push(std::move(entry));
  }
  Json sequence = Json::object();
  sequence.set("name", name)
      .set("path", path)
      .set("num_frames", recording.num_frames())
      .set("rate_hz", recording.rate_hz)
      .set("utc_start", "2024-06-21T10:00:00Z")
      .set("origin", Json::object()
                         .set("lat_deg", kLat_deg)
                         .set("lon_deg", kLon_deg)
                         .set("height_m", kHeight_m))
      .set("georeference", georeference)
      .set("cameras", cameras);
  if (has_lines) {
    sequence.set("motion", path + "/motion.csv");
    core::write_file(folder / path / "motion.csv", motion_rows(recording));
  }
  Json json = Json::object();
  json.set("format", format)
      .set("format_version", "1")
      .set("terracast_version", "0.1.0")
      .set("world", Json::object().set("name", "hills").set("input_hash", "0"))
      .set("files", Json::object())
      .set("sequences", Json::array().push(sequence));
  json.write(folder / "dataset.json");
  list_files_again(folder);
}

void write_tartanair_v1(const Recording& recording, const fs::path& folder,
                        const Mistake& mistake) {
  Said said{recording, mistake};
  said.sky_depth_m = 1e5F;
  const std::string path = "Hills/Easy/P000";
  core::write_file(folder / "Hills/seg_label_map.json",
                   std::string_view("{\"name_map\": {\"sky\": 0, \"ground\": 1, \"water\": 2}}"));
  const SceneCamera& camera = recording.cameras[0];
  const auto width = static_cast<std::size_t>(camera.width);
  const auto height = static_cast<std::size_t>(camera.height);
  const auto write_bytes = [&](const fs::path& file, const std::vector<std::uint8_t>& values) {
    core::write_file(file, npy_bytes("|u1", {height, width}, values.data(), values.size()));
  };
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    const std::string name = recording.cameras[c].name;
    for (std::size_t f = 0; f < recording.body_world.size(); ++f) {
      const std::string stem = digits(f) + "_" + name;
      core::write_file(folder / path / ("image_" + name) / (stem + ".png"),
                       core::encode_png(said.color(c, f)));
      write_depth_npy(said, c, f, folder / path / ("depth_" + name) / (stem + "_depth.npy"));
      const core::Image8 classes = said.classes(c, f);
      write_bytes(folder / path / ("seg_" + name) / (stem + "_seg.npy"),
                  std::vector<std::uint8_t>(classes.data().begin(), classes.data().end()));
      if (c > 0 || f + 1 == recording.body_world.size()) continue;
      std::vector<float> flow;
      std::vector<std::uint8_t> mask;
      for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
          const FlowAt at = flow_at(said, f, f + 1, x, y);
          flow.push_back(static_cast<float>(mistake.flow_sign * at.flow.x()));
          flow.push_back(static_cast<float>(mistake.flow_sign * at.flow.y()));
          const bool is_covisible = mistake.covisible.value_or(at.is_covisible);
          mask.push_back(is_covisible ? 0 : at.in_view ? 10 : 110);
        }
      const std::string pair = digits(f) + "_" + digits(f + 1);
      write_npy_f4(folder / path / "flow" / (pair + "_flow.npy"), {height, width, 2}, flow);
      write_bytes(folder / path / "flow" / (pair + "_mask.npy"), mask);
    }
    core::write_file(folder / path / ("pose_" + name + ".txt"), ned_poses(said, c));
  }
  write_metadata(said, folder, "tartanair_v1", "P000", path, path + "/georeference.csv");
}

void write_tartanair(const Recording& recording, const fs::path& folder, const Mistake& mistake,
                     FlowForm form) {
  Said said{recording, mistake};
  said.sky_depth_m = 1e5F;
  const std::string path = "Hills/Data_easy/P000";
  core::write_file(folder / "Hills/seg_label_map.json",
                   std::string_view("{\"name_map\": {\"sky\": 0, \"ground\": 1, \"water\": 2}}"));
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    const SceneCamera& camera = recording.cameras[c];
    for (std::size_t f = 0; f < recording.body_world.size(); ++f) {
      const std::string stem = digits(f) + "_" + camera.name;
      core::write_file(folder / path / ("image_" + camera.name) / (stem + ".png"),
                       core::encode_png(said.color(c, f)));
      core::Image8 depth(camera.width, camera.height, 4);
      for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
          const float value = said.depth(c, f, x, y);
          std::uint8_t bytes[4];
          std::memcpy(bytes, &value, 4);
          const int order[4] = {2, 1, 0, 3};
          for (int k = 0; k < 4; ++k) depth(x, y, k) = bytes[order[k]];
        }
      core::write_file(folder / path / ("depth_" + camera.name) / (stem + "_depth.png"),
                       core::encode_png(depth));
      core::write_file(folder / path / ("seg_" + camera.name) / (stem + "_seg.png"),
                       core::encode_png(said.classes(c, f)));
      if (c > 0 || f + 1 == recording.body_world.size()) continue;
      const fs::path flow = folder / path / "flow_lcam_front";
      const std::string pair = digits(f) + "_" + digits(f + 1);
      if (form == FlowForm::Png)
        write_flow_png(said, f, flow / (pair + "_flow.png"));
      else
        write_flow(said, f, flow / (pair + "_lcam_front_flow.npz"));
    }
    core::write_file(folder / path / ("pose_" + camera.name + ".txt"), ned_poses(said, c));
  }
  write_metadata(said, folder, "tartanair", "P000", path, path + "/georeference.csv");
}

void write_kitti(const Recording& recording, const fs::path& folder, const Mistake& mistake) {
  const Said said{recording, mistake};
  const std::string path = "dataset/sequences/00";
  const double baseline_m =
      (recording.cameras[1].offset_body - recording.cameras[0].offset_body).norm();
  std::string calibration;
  for (int k = 0; k < 4; ++k)
    calibration +=
        fmt::format("P{}: {:.12g} 0 {:.12g} {:.12g} 0 {:.12g} {:.12g} 0 0 0 1 0\n", k,
                    said.focal(0), said.cx(0) - 0.5, k % 2 == 1 ? -said.focal(0) * baseline_m : 0.0,
                    said.focal(0), said.cy(0) - 0.5);
  calibration += "Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n";
  core::write_file(folder / path / "calib.txt", calibration);
  std::string poses, times;
  const SaidPose first = said.pose(0, 0);
  for (std::size_t f = 0; f < recording.body_world.size(); ++f) {
    const SaidPose pose = said.pose(0, f);
    Matrix3d r = first.rotation.transpose() * pose.rotation;
    if (static_cast<int>(f) == mistake.pose_frame) r(0, 1) += mistake.pose_entry;
    const Vector3d t = first.rotation.transpose() * (pose.centre - first.centre);
    for (int row = 0; row < 3; ++row)
      poses += fmt::format("{:.12g} {:.12g} {:.12g} {:.12g}{}", r(row, 0), r(row, 1), r(row, 2),
                           t[row], row < 2 ? " " : "\n");
    times += fmt::format(
        "{:e}\n", static_cast<double>(f) / recording.rate_hz * (1.0 + mistake.times_relative));
    for (std::size_t c = 0; c < 2; ++c)
      core::write_file(folder / path / recording.cameras[c].name / (digits(f) + ".png"),
                       core::encode_png(said.color(c, f)));
    write_depth_npy(said, 0, f, folder / path / "depth_2" / (digits(f) + ".npy"));
    const SceneCamera& camera = recording.cameras[0];
    core::Image16 disparity(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        disparity(x, y) = static_cast<std::uint16_t>(
            std::lround(camera.focal_px * baseline_m / recording.depth[0][f](x, y) * 256.0 *
                        (1.0 + mistake.disparity_relative)));
    if (f == 1)
      disparity(80, 64) = static_cast<std::uint16_t>(
          mistake.is_one_disparity_missing ? 0 : disparity(80, 64) + mistake.one_disparity_counts);
    core::write_file(folder / path / "disp_2" / (digits(f) + ".png"), core::encode_png(disparity));
  }
  core::write_file(folder / "dataset/poses/00.txt", poses);
  core::write_file(folder / path / "times.txt", times);
  write_metadata(said, folder, "kitti", "00", path, path + "/georeference.csv");
}

}  // namespace terracast::test
