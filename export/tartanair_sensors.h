#pragma once

#include <string>

#include "core/context.h"
#include "export/dataset_writer.h"
#include "export/frame_scans.h"

/// TartanAir V2's files of sensors beside cameras.
namespace terracast::exporters {

/// lidar/NNNNNN_lcam_front_lidar.ply: float x, y, z of each point at the frame's time, x right, y forward, z up of the left
/// front camera's axes, about its centre.
/// left      index of that camera
/// returns   the sequence's "lidar" in dataset.json
core::Json write_tartanair_scans(const FrameScans& scans, int left, const std::string& path,
                                 DatasetWriter& writer, const core::Context& context);

/// imu/: ten samples a frame interval, (frames - 1) * 10 rows, of the truth of an IMU that stands at the left front camera's
/// centre; body axes are that camera's x forward, y right, z down, the world is north, east, down.
///   imu_time, cam_time            s (float64, float32)
///   acc                           specific force along the body's axes with TartanAir's gravity of 9.8 m/s^2
///   gyro                          turn rate along the body's axes, against the Earth
///   pos_global, vel_global        m, m/s
///   ori_global                    Euler angles of body to world about x, then the turned y and z, rad
///   vel_body, acc_nograv_body     along the body's axes
///   acc_nograv                    acceleration against the Earth
/// Each as .npy and .txt; parameter.yaml has both rates.
/// returns   the sequence's "imu" in dataset.json; null: no IMU of the rig fits, of which a warning tells
core::Json write_tartanair_imu(const capture::SequenceReader& sequence, const std::string& rig,
                               int left, const std::string& path, DatasetWriter& writer,
                               const core::Context& context);

}  // namespace terracast::exporters
