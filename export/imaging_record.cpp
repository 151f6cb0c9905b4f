#include "export/imaging_record.h"

#include <algorithm>

#include "core/json.h"

namespace terracast::exporters {
namespace {

using core::Json;

constexpr int kImagingVersion = 1;

bool is_open(const capture::CameraCalibration& camera) {
  return !camera.shutter.is_instant() || camera.aperture.diameter_m > 0.0;
}

Json describe(const capture::SequenceReader& sequence, const ExportedCamera& exported) {
  const capture::SequenceInfo& info = sequence.info();
  const auto index = static_cast<std::size_t>(exported.camera_index);
  const capture::CameraCalibration& camera = info.cameras[index];
  Json entry = Json::object()
                   .set("name", exported.name)
                   .set("exposure_s", camera.shutter.exposure_s)
                   .set("aperture_m", camera.aperture.diameter_m)
                   .set("focus_m", camera.aperture.focus_m);
  if (info.imaging.empty() || !info.imaging[index].is_on()) return entry;
  entry.set("settings", info.imaging[index].settings_toml);
  std::vector<double> exposures_ev;
  for (const capture::FrameRecord& record : sequence.frames())
    exposures_ev.push_back(record.cameras[index].exposure_ev.value_or(0.0));
  return std::move(entry.set("exposure_ev", Json::array_of(exposures_ev)));
}

}  // namespace

bool has_imaging(const capture::SequenceInfo& info) {
  return !info.imaging.empty() || std::any_of(info.cameras.begin(), info.cameras.end(), is_open);
}

std::string imaging_text(const capture::SequenceReader& sequence,
                         const std::vector<ExportedCamera>& cameras) {
  Json list = Json::array();
  for (const ExportedCamera& camera : cameras) list.push(describe(sequence, camera));
  return Json::object()
             .set("format", "terracast-imaging")
             .set("version", kImagingVersion)
             .set("cameras", std::move(list))
             .text() +
         "\n";
}

}  // namespace terracast::exporters
