#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "export/dataset_writer.h"
#include "export/georeference.h"

/// Clouds of lidars as other programs read them, beside the scans that every dataset has.
namespace terracast::exporters {

/// A point as it is shown, in the frame of the sequence's poses.
struct CloudPoint {
  double time_s = 0.0;
  Eigen::Vector3d local = Eigen::Vector3d::Zero();
  Eigen::Vector3d origin_local = Eigen::Vector3d::Zero();  ///< where its beam began
  Eigen::Vector3d in_sensor = Eigen::Vector3d::Zero();
  double true_range_m = 0.0;
  float reflectance = 0.0F;
  float incidence_rad = 0.0F;
  std::uint16_t ring = 0;
  std::uint8_t return_number = 1;
  std::uint8_t num_returns = 1;
  std::uint8_t class_id = 0;
  std::uint32_t instance_id = 0;
};

/// Points of the scans that begin from a frame's time to before the next one's.
/// stream   of a lidar
std::vector<CloudPoint> cloud_of(const capture::SequenceReader& sequence, int stream_index,
                                 int frame, const LocalFrame& local);

/// Binary PLY: double x, y, z and time, the rest beside.
std::vector<std::byte> ply_bytes(std::span<const CloudPoint> points);
/// Binary PCD 0.7: float32 x, y, z as PCL's points have them, double time, the rest beside; the viewpoint is where the
/// first beam began.
std::vector<std::byte> pcd_bytes(std::span<const CloudPoint> points);

/// Names of the forms in which clouds can be written: las, pcd, ply.
std::vector<std::string> cloud_forms();

/// Writes all lidars of a sequence. sensors/RIG/NAME/000000.ply and .pcd beside the scans; strip_000.las, … of up to
/// kMostLasPoints points each, on the map of UTM's zone at the sequence's origin, heights above EGM96.
/// forms    some of cloud_forms()
/// memory   one strip's points and a frame's scans: up to 400 bytes a point (342 measured, a strip of 3 million)
/// throws   Config: LAS beyond UTM; Io: no grid of EGM96
void write_clouds(DatasetWriter& writer, const std::string& folder,
                  const capture::SequenceReader& sequence, const std::vector<std::string>& forms);
inline constexpr std::size_t kMostLasPoints = 5'000'000;

}  // namespace terracast::exporters
