#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "core/json.h"
#include "geo/geodesy.h"
#include "geo/rigid3.h"

namespace terracast::exporters {

class StatedCalibration;

/// The frame of an export's poses: the ENU frame at a round place near the sequence's first body
/// position, so that numbers stay small enough for readers that cast them to float32.
struct LocalFrame {
  geo::Geodetic origin;  ///< latitude and longitude in whole 1e-6 deg, height in whole m
  geo::Rigid3d local_from_world;
};
/// accuracy   10 nm: both frames' origins pass through ecef
LocalFrame local_frame(const capture::SequenceReader& sequence);

/// A camera of the capture under the word that the format has for it.
struct ExportedCamera {
  std::string name;
  int camera_index = 0;
  double flow_step_px = 0.0;  ///< what the format rounds its flow to, after float32; 0: nothing
};

geo::Rigid3d local_from_camera(const LocalFrame& local, const capture::SequenceReader& sequence,
                               int frame_index, int camera_index);
/// The same of a camera that is not as the sequence's is.
geo::Rigid3d local_from_camera(const LocalFrame& local, const capture::SequenceReader& sequence,
                               int frame_index, const capture::CameraCalibration& camera);

/// The same rotation with w >= 0 and of unit length.
Eigen::Quaterniond canonical(const Eigen::Quaterniond& rotation);

/// Files of ours in a sequence's folder.
inline constexpr const char* kGeoreferenceFile = "georeference.csv";
inline constexpr const char* kBoundsFile = "bounds.csv";
inline constexpr const char* kGeometryFile = "geometry.json";

/// georeference.csv: one row for each frame and camera. The camera's centre on WGS84 and its
/// rotation into the east-north-up of that very place.
std::string georeference_csv(const capture::SequenceReader& sequence,
                             const std::vector<ExportedCamera>& cameras);

/// geometry.json: the capture's geometry, what ground the sequence shows, with format and version.
std::string geometry_text(const capture::SequenceReader& sequence);

/// A sequence's entry in dataset.json; its cameras are as they are, whatever the format's files state.
/// name, path   as the format lays them out; the path relative to the dataset
core::Json describe_sequence(const capture::SequenceReader& sequence, const LocalFrame& local,
                             const std::string& name, const std::string& path,
                             const std::vector<ExportedCamera>& cameras,
                             const StatedCalibration& stated);

}  // namespace terracast::exporters
