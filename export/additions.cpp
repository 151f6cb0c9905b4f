#include "export/additions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "export/calibration.h"
#include "export/clouds/cloud.h"
#include "export/events/dsec.h"
#include "export/imaging_record.h"
#include "export/motion_record.h"
#include "export/moving_record.h"
#include "export/nmea.h"
#include "export/rinex.h"
#include "export/sensor_record.h"

namespace terracast::exporters {
namespace {

using capture::LabelError;

/// The larger of two, figure by figure.
std::optional<LabelError> larger(const std::optional<LabelError>& a,
                                 const std::optional<LabelError>& b) {
  if (!a || !b) return a ? a : b;
  return LabelError{.arithmetic = std::max(a->arithmetic, b->arithmetic),
                    .rounding = std::max(a->rounding, b->rounding)};
}

/// Of flow that is kept in whole steps both ways; the step's half is added to what is there before.
std::optional<LabelError> in_steps(std::optional<LabelError> error, double step_px) {
  if (error) error->rounding += 0.5 * std::hypot(step_px, step_px);
  return error;
}

/// "3.1e-09,0.00024", or two empty cells. Three digits err by half a per cent: no figure is below its bound.
std::string cells(const std::optional<LabelError>& error, double per_unit) {
  if (!error) return ",";
  constexpr double kUp = 1.005;
  return fmt::format("{:.3g},{:.3g}", error->arithmetic * per_unit * kUp,
                     error->rounding * per_unit * kUp);
}

}  // namespace

std::string bounds_csv(const capture::SequenceReader& sequence,
                       const std::vector<ExportedCamera>& cameras) {
  constexpr double kMillimetres = 1e3;
  std::string text =
      "frame,camera,depth_error_mm,depth_rounding_mm,flow_error_px,flow_rounding_px,left_out,"
      "pixels\n";
  for (const capture::FrameRecord& record : sequence.frames()) {
    for (const ExportedCamera& camera : cameras) {
      const auto index = static_cast<std::size_t>(camera.camera_index);
      const capture::LabelBounds& bounds = record.cameras[index].bounds;
      const geo::CameraIntrinsics& image = sequence.info().cameras[index].intrinsics;
      text += fmt::format(
          "{},{},{},{},{},{}\n", record.index, camera.name, cells(bounds.depth_m, kMillimetres),
          cells(in_steps(larger(bounds.flow_next_px, bounds.flow_previous_px), camera.flow_step_px),
                1.0),
          bounds.num_left_out, std::int64_t{image.width_px} * image.height_px);
    }
  }
  return text;
}

void write_additions(DatasetWriter& writer, const std::string& folder,
                     const capture::SequenceReader& sequence,
                     const std::vector<ExportedCamera>& cameras, const ScanForms& forms) {
  writer.write(folder + "/" + kGeoreferenceFile, georeference_csv(sequence, cameras));
  writer.write(folder + "/" + kBoundsFile, bounds_csv(sequence, cameras));
  writer.write(folder + "/" + kGeometryFile, geometry_text(sequence));
  write_moving(writer, folder, sequence, cameras);
  write_sensors(writer, folder, sequence);
  write_fixes(writer, folder, sequence);
  write_observations(writer, folder, sequence);
  if (!forms.clouds.empty()) write_clouds(writer, folder, sequence, forms.clouds);
  if (!forms.events.empty()) write_dsec_events(writer, folder, sequence);
  if (has_imaging(sequence.info()))
    writer.write(folder + "/" + kImagingFile, imaging_text(sequence, cameras));
  if (sequence.info().has_rolling_shutter())
    writer.write(folder + "/" + kMotionFile, motion_csv(sequence));
  if (!sequence.info().has_errors()) return;
  for (const bool is_believed : {false, true})
    writer.write(folder + "/" + (is_believed ? kBelievedCalibrationFile : kTrueCalibrationFile),
                 calibration_text(sequence, cameras, is_believed));
  if (!sequence.info().clocks.empty())
    writer.write(folder + "/" + kTimestampsFile, timestamps_csv(sequence, cameras));
}

}  // namespace terracast::exporters
