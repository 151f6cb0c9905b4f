#pragma once

#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "core/schema.h"
#include "export/georeference.h"

/// What a dataset says of rigs whose cameras are not what their users believe.
namespace terracast::exporters {

/// Which of the two the format's own files state. Images, labels and everything of ours besides are of the
/// cameras as they are.
class StatedCalibration {
 public:
  void describe(core::SchemaVisitor& visit);

  const std::string& name() const { return name_; }
  bool is_believed() const { return name_ == "believed"; }
  const std::vector<capture::CameraCalibration>& cameras(const capture::SequenceInfo& info) const;
  /// For formats that can state cameras as they are alone.
  /// throws   Config: believed is asked for, and something else is believed of this camera
  void check_is_true(const capture::SequenceInfo& info, int camera_index, const char* format) const;
  /// When a camera's image was taken; believed: by the camera's own clock.
  double time_s(const capture::FrameRecord& record, int camera_index) const;
  /// What the clock of a sensor shows at a time, without jitter; not believed: the time.
  double reading_s(const capture::StreamInfo& stream, double time_s) const;
  /// When samples of a sensor were taken; believed: by its own clock.
  std::vector<double> times_s(const capture::StreamInfo& stream,
                              const capture::Samples& samples) const;

 private:
  std::string name_ = "true";
};

/// Files of ours in the folder of a sequence whose rigs have errors.
inline constexpr const char* kTrueCalibrationFile = "calibration_true.json";
inline constexpr const char* kBelievedCalibrationFile = "calibration_believed.json";
inline constexpr const char* kTimestampsFile = "timestamps.csv";  ///< where clocks err

/// What dataset.json says of a camera.
core::Json describe_camera(const std::string& name, const capture::CameraCalibration& camera);

/// A calibration file: the cameras as dataset.json describes them; the true one has their clocks.
std::string calibration_text(const capture::SequenceReader& sequence,
                             const std::vector<ExportedCamera>& cameras, bool is_believed);

/// timestamps.csv: one row for each frame and camera, the time and what the camera's clock showed.
std::string timestamps_csv(const capture::SequenceReader& sequence,
                           const std::vector<ExportedCamera>& cameras);

/// Adds to a sequence's entry in dataset.json which calibration its files state and where both are, where rigs have errors,
/// and whose times its files state of sensors with clocks of their own.
void describe_errors(const capture::SequenceReader& sequence, const StatedCalibration& stated,
                     const std::string& path, core::Json& entry);

}  // namespace terracast::exporters
