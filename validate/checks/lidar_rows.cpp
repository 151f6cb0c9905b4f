#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "validate/checks/lidar_clouds.h"
#include "validate/checks/lidar_files.h"
#include "validate/oracle_view.h"

namespace terracast::validate {

using core::ErrorKind;
using core::fail;
using Eigen::Vector3d;

DealtScans::DealtScans(const Dataset& dataset, const Sequence& sequence, const FormatScans& scans)
    : dataset_(dataset), sequence_(sequence) {
  for (auto& [frame, rows] : files_) frame = -1;
  std::vector<SensorRecord> sensors = read_sensors(dataset, sequence);
  const auto found = std::find_if(sensors.begin(), sensors.end(), [&](const SensorRecord& one) {
    return one.kind == "lidar" && one.rig == scans.rig && one.name == scans.name;
  });
  if (found == sensors.end())
    fail(ErrorKind::Input, "dataset.json: sensors.json of {} has no lidar {}/{}", sequence.name,
         scans.rig, scans.name);
  lidar_ = std::move(*found);
  if (!sequence.moving) return;
  for (const MovingBody& body : sequence.moving->bodies) moving_.insert(body.instance_id);
}

const std::vector<ScanRow>& DealtScans::rows_of_file(int frame) {
  for (const auto& [number, rows] : files_)
    if (number == frame) return rows;
  const std::string name = fmt::format("{}/{:06}.npy", lidar_.file, frame);
  const NpyTable table = read_scans(dataset_, lidar_, frame);
  const std::vector<CloudRow> shown = shown_rows(table, name);
  const std::vector<double> x_m = table.numbers("x_m", name), y_m = table.numbers("y_m", name),
                            z_m = table.numbers("z_m", name);
  std::vector<ScanRow> rows(shown.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] = {.local = shown[i].place,
               .in_sensor = {x_m[i], y_m[i], z_m[i]},
               .time_s = shown[i].time_s,
               .reflectance = shown[i].intensity,
               .class_id = shown[i].class_id,
               .instance_id = shown[i].instance_id};
  auto& place = files_[oldest_];
  oldest_ = 1 - oldest_;
  place = {frame, std::move(rows)};
  return place.second;
}

std::vector<ScanRow> DealtScans::rows(int frame) {
  std::vector<ScanRow> dealt;
  for (int file = std::max(0, frame - 1); file <= frame; ++file)
    for (const ScanRow& row : rows_of_file(file))
      if (std::floor(row.time_s * sequence_.rate_hz + 0.5) == frame) dealt.push_back(row);
  return dealt;
}

std::optional<std::vector<ScanRow>> DealtScans::rows_if_whole(int frame) {
  try {
    return rows(frame);
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Input) throw;
    return std::nullopt;
  }
}

std::int64_t DealtScans::num_after_last_frame() {
  const std::vector<ScanRow>& last = rows_of_file(sequence_.num_frames - 1);
  return std::count_if(last.begin(), last.end(), [&](const ScanRow& row) {
    return std::floor(row.time_s * sequence_.rate_hz + 0.5) >= sequence_.num_frames;
  });
}

std::uint16_t DealtScans::label(const ScanRow& row) const {
  return semantic_kitti_of(static_cast<std::size_t>(row.class_id),
                           moving_.contains(row.instance_id));
}

PlacedRows::PlacedRows(const Dataset& dataset, const Sequence& sequence, const FormatScans& scans,
                       const std::optional<Pose>& local_from_camera, int frame,
                       const std::vector<ScanRow>& rows)
    : rows_(rows) {
  if (!scans.is_deskewed || !local_from_camera) return;
  local_from_points_ = *local_from_camera * scans.camera_from_points;
  const auto& first =
      sequence.cameras[static_cast<std::size_t>(scans.camera)].local_from_camera.front();
  const double distance_m =
      first && frame > 0 ? (local_from_camera->translation - first->translation).norm() : 0.0;
  const PoseRounding rounding = pose_rounding(dataset.format, distance_m);
  pose_m_ = rounding.position_m;
  pose_rad_ = rounding.angle_rad;
}

double PlacedRows::share(const Vector3d& place, std::size_t i) const {
  // Three coordinates, each rounded to a float32.
  const double float32_m = 0x1.0p-24 * std::sqrt(3.0) * place.norm();
  if (!local_from_points_) return (place - rows_[i].in_sensor).norm() / (1e-9 + 1.001 * float32_m);
  constexpr double kRounding_m = 1e-6;
  const double allowed_m = kRounding_m + 1.001 * float32_m + pose_m_ + pose_rad_ * place.norm();
  return (*local_from_points_ * place - rows_[i].local).norm() / allowed_m;
}

}  // namespace terracast::validate
