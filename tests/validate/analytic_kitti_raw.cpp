#include <fmt/format.h>

#include <cmath>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/validate/analytic_writer.h"

/// KITTI raw: calibration, packets of an inertial unit, images.
namespace terracast::test {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
namespace fs = std::filesystem;

constexpr double kDegPerRad = 180.0 / 3.14159265358979323846;

std::string row_of(const Matrix3d& matrix) {
  std::string text;
  for (int i = 0; i < 9; ++i) text += fmt::format(" {:.15g}", matrix(i / 3, i % 3));
  return text;
}
std::string row_of(const Vector3d& vector) {
  return fmt::format(" {:.15g} {:.15g} {:.15g}", vector.x(), vector.y(), vector.z());
}

void write_calibration(const Said& said, const fs::path& folder) {
  const Recording& recording = said.recording;
  const double baseline_m =
      (recording.cameras[1].offset_body - recording.cameras[0].offset_body).norm();
  const double f = said.focal(0), cx = said.cx(0) - 0.5, cy = said.cy(0) - 0.5;
  std::string cameras = "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.95e-02\n";
  for (int k = 0; k < 4; ++k) {
    const double offset_m = k % 2 == 1 ? baseline_m : 0.0;
    const std::string size =
        fmt::format("{} {}", recording.cameras[0].width, recording.cameras[0].height);
    cameras += fmt::format("S_{0:02}: {1}\nS_rect_{0:02}: {1}\n", k, size);
    cameras += fmt::format("K_{:02}: {:.15g} 0 {:.15g} 0 {:.15g} {:.15g} 0 0 1\n", k, f, cx, f, cy);
    cameras += fmt::format("D_{0:02}: 0 0 0 0 0\nR_{0:02}: 1 0 0 0 1 0 0 0 1\n", k);
    cameras += fmt::format("T_{:02}: {:.15g} 0 0\n", k, -offset_m);
    cameras += fmt::format("R_rect_{:02}: 1 0 0 0 1 0 0 0 1\n", k);
    cameras += fmt::format("P_rect_{:02}: {:.15g} 0 {:.15g} {:.15g} 0 {:.15g} {:.15g} 0 0 0 1 0\n",
                           k, f, cx, -f * offset_m, f, cy);
  }
  core::write_file(folder / "calib_cam_to_cam.txt", cameras);
  // A scanner somewhere, so that both steps of the chain carry something.
  const Matrix3d body_from_velodyne =
      Eigen::AngleAxisd(0.3, Vector3d(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  const Vector3d velodyne_body(0.2, -0.1, 0.4);
  const Matrix3d camera_from_body = said.mount(0).transpose();
  core::write_file(
      folder / "calib_velo_to_cam.txt",
      "R:" + row_of(Matrix3d(camera_from_body * body_from_velodyne)) + "\nT:" +
          row_of(Vector3d(camera_from_body * (velodyne_body - recording.cameras[0].offset_body))) +
          "\n");
  const Matrix3d velodyne_from_body = body_from_velodyne.transpose();
  core::write_file(folder / "calib_imu_to_velo.txt",
                   "R:" + row_of(velodyne_from_body) +
                       "\nT:" + row_of(Vector3d(-(velodyne_from_body * velodyne_body))) + "\n");
}

std::string packet(const Said& said, std::size_t f) {
  const Recording& recording = said.recording;
  const OxtsMistake& wrong = said.mistake.oxts;
  const SaidPose camera = said.pose(0, f);
  const Matrix3d world_from_body = camera.rotation * said.mount(0).transpose();
  const Vector3d body_world = camera.centre - world_from_body * recording.cameras[0].offset_body;
  const ScenePlace place = place_of_scene(body_world);
  const Matrix3d enu_from_world = enu_from_scene(place);
  const Matrix3d axes =
      enu_from_scene(place_of_scene(body_world + wrong.axes_east_m * Vector3d::UnitX())) *
      world_from_body;
  const double yaw = std::atan2(axes(1, 0), axes(0, 0));
  const double pitch = -std::asin(axes(2, 0));
  const double roll = std::atan2(axes(2, 1), axes(2, 2));

  const std::size_t later = std::min(f + static_cast<std::size_t>(wrong.velocity_shift_frames),
                                     recording.velocity_mps.size() - 1);
  const Vector3d velocity =
      (1.0 + wrong.velocity_relative) * (enu_from_world * recording.velocity_mps[later]);
  const Matrix3d level_from_enu = Eigen::AngleAxisd(-yaw, Vector3d::UnitZ()).toRotationMatrix();
  Vector3d velocity_level = level_from_enu * velocity;
  if (f == 2) velocity_level.y() += wrong.level_left_mps;
  const Vector3d up_world = enu_from_world.transpose().col(2);
  const Vector3d force = world_from_body.transpose() *
                             (recording.acceleration_mps2[f] + wrong.gravity * 9.80665 * up_world) +
                         wrong.force_mps2 * Vector3d::UnitX();
  const Vector3d rate =
      recording.rate_body_radps[f] + wrong.rate_degps / kDegPerRad * Vector3d::UnitZ();
  const Matrix3d level_from_body = level_from_enu * axes;
  return fmt::format("{:.13f} {:.13f} {:.6f}", place.lat_deg, place.lon_deg,
                     place.height_m + wrong.altitude_m) +
         row_of(Vector3d(roll, pitch, yaw)) +
         row_of(Vector3d(velocity.y(), velocity.x(), velocity_level.x())) +
         fmt::format(" {:.15g} {:.15g}", velocity_level.y(), velocity.z()) + row_of(force) +
         row_of(Vector3d(level_from_body * force)) + row_of(rate) +
         row_of(Vector3d(level_from_body * rate)) + " 0.000001000 0.000000001 -1 -1 -1 -1 -1\n";
}

}  // namespace

void write_kitti_raw(const Recording& recording, const fs::path& folder, const Mistake& mistake) {
  const Said said{recording, mistake};
  const std::string name = "2024_06_21_drive_0005_sync";
  const std::string path = "2024_06_21/" + name;
  write_calibration(said, folder / "2024_06_21");
  std::string poses, times;
  const SaidPose first = said.pose(0, 0, false);
  for (std::size_t f = 0; f < recording.body_world.size(); ++f) {
    const std::string digits = fmt::format("{:010}", f);
    core::write_file(folder / path / "oxts/data" / (digits + ".txt"), packet(said, f));
    times +=
        fmt::format("2024-06-21 10:00:{:012.9f}\n",
                    static_cast<double>(f) / recording.rate_hz * (1.0 + mistake.times_relative));
    const SaidPose pose = said.pose(0, f, false);
    const Matrix3d r = first.rotation.transpose() * pose.rotation;
    const Vector3d t = first.rotation.transpose() * (pose.centre - first.centre);
    for (int row = 0; row < 3; ++row)
      poses += fmt::format("{:.15g} {:.15g} {:.15g} {:.15g}{}", r(row, 0), r(row, 1), r(row, 2),
                           t[row], row < 2 ? " " : "\n");
    for (std::size_t c = 0; c < 2; ++c)
      core::write_file(folder / path / recording.cameras[c].name / "data" / (digits + ".png"),
                       core::encode_png(said.color(c, f)));
    write_depth_npy(said, 0, f, folder / path / "depth_02/data" / (digits + ".npy"));
  }
  core::write_file(folder / path / "poses.txt", poses);
  for (const char* unit : {"image_02", "image_03", "oxts"})
    core::write_file(folder / path / unit / "timestamps.txt", times);
  write_metadata(said, folder, "kitti_raw", name, path, path + "/georeference.csv");
}

}  // namespace terracast::test
