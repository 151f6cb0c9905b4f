#include "export/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/error.h"
#include "export/motion_record.h"
#include "export/utc_stamps.h"

namespace terracast::exporters {

using core::Json;

namespace {

constexpr int kCalibrationVersion = 1;

/// By whole nanoseconds, rounded as formats that state them round.
std::string seconds_text(double time_s) {
  return seconds_with_nanoseconds(std::llround(time_s * 1e9));
}

}  // namespace

void StatedCalibration::describe(core::SchemaVisitor& visit) {
  visit.key("calibration", name_,
            "Where a rig has errors, which calibration and times the format's own files state: "
            "true, of the cameras as they are, or believed, as the rig's config says. Images and "
            "labels are of the cameras as they are.",
            core::one_of({"true", "believed"}));
}

const std::vector<capture::CameraCalibration>& StatedCalibration::cameras(
    const capture::SequenceInfo& info) const {
  return is_believed() ? info.believed() : info.cameras;
}

double StatedCalibration::time_s(const capture::FrameRecord& record, int camera_index) const {
  return is_believed() ? record.stamp_s(camera_index) : record.time_s;
}

double StatedCalibration::reading_s(const capture::StreamInfo& stream, double time_s) const {
  return is_believed() && stream.clock ? stream.clock->reading_s(time_s) : time_s;
}

std::vector<double> StatedCalibration::times_s(const capture::StreamInfo& stream,
                                               const capture::Samples& samples) const {
  if (!is_believed() || !stream.clock) return samples.times_s;
  const std::size_t num_channels = stream.channels.size();
  std::vector<double> stamps_s;
  stamps_s.reserve(samples.times_s.size());
  for (std::size_t i = 0; i < samples.times_s.size(); ++i)
    stamps_s.push_back(samples.values[(i + 1) * num_channels - 1]);
  return stamps_s;
}

Json describe_camera(const std::string& name, const capture::CameraCalibration& camera) {
  const std::vector<double>& p = camera.intrinsics.parameters;
  const geo::Rigid3d pose = camera.body_from_camera();
  const Eigen::Quaterniond q = canonical(pose.rotation);
  const Eigen::Vector3d& t = pose.translation;
  Json entry = Json::object()
                   .set("name", name)
                   .set("rig", camera.rig)
                   .set("camera", camera.name)
                   .set("width_px", camera.intrinsics.width_px)
                   .set("height_px", camera.intrinsics.height_px)
                   .set("fx_px", p[0])
                   .set("fy_px", p[1])
                   .set("cx_px", p[2])
                   .set("cy_px", p[3])
                   .set("body_from_camera",
                        Json::object()
                            .set("rotation_wxyz", Json::array_of({q.w(), q.x(), q.y(), q.z()}))
                            .set("translation_m", Json::array_of({t.x(), t.y(), t.z()})));
  if (camera.intrinsics.model != "pinhole")
    entry.set("model", camera.intrinsics.model).set("parameters", Json::array_of(p));
  if (camera.shutter.is_rolling()) entry.set("shutter", describe_shutter(camera.shutter));
  return entry;
}

std::string calibration_text(const capture::SequenceReader& sequence,
                             const std::vector<ExportedCamera>& cameras, bool is_believed) {
  const capture::SequenceInfo& info = sequence.info();
  Json list = Json::array();
  for (const ExportedCamera& exported : cameras) {
    const auto index = static_cast<std::size_t>(exported.camera_index);
    Json entry =
        describe_camera(exported.name, is_believed ? info.believed()[index] : info.cameras[index]);
    if (!is_believed && !info.clocks.empty()) {
      const capture::CameraClock& clock = info.clocks[index];
      entry.set("clock", Json::object()
                             .set("offset_s", clock.offset_s)
                             .set("drift", clock.drift)
                             .set("jitter_sd_s", clock.jitter_sd_s));
    }
    list.push(std::move(entry));
  }
  return Json::object()
             .set("format", "terracast-calibration")
             .set("version", kCalibrationVersion)
             .set("calibration", is_believed ? "believed" : "true")
             .set("cameras", std::move(list))
             .text() +
         "\n";
}

void StatedCalibration::check_is_true(const capture::SequenceInfo& info, int camera_index,
                                      const char* format) const {
  const auto k = static_cast<std::size_t>(camera_index);
  if (is_believed() && info.believed()[k] != info.cameras[k])
    core::fail(core::ErrorKind::Config,
               "{}: calibration = \"believed\", but camera {} of sequence {} is not where it is "
               "believed to be, and the format's files can only state rectified cameras as they "
               "are; give its rig errors of clocks alone, or calibration = \"true\"",
               format, info.cameras[k].name, info.name);
}

std::string timestamps_csv(const capture::SequenceReader& sequence,
                           const std::vector<ExportedCamera>& cameras) {
  std::string text = "frame,camera,time_s,stamp_s\n";
  for (const capture::FrameRecord& record : sequence.frames())
    for (const ExportedCamera& camera : cameras)
      text += fmt::format("{},{},{},{}\n", record.index, camera.name, seconds_text(record.time_s),
                          seconds_text(record.stamp_s(camera.camera_index)));
  return text;
}

void describe_errors(const capture::SequenceReader& sequence, const StatedCalibration& stated,
                     const std::string& path, Json& entry) {
  const std::vector<capture::StreamInfo>& streams = sequence.info().streams;
  if (std::any_of(streams.begin(), streams.end(),
                  [](const capture::StreamInfo& stream) { return stream.clock.has_value(); }))
    entry.set("sensor_stamps", stated.name());
  if (!sequence.info().has_errors()) return;
  entry.set("calibration", stated.name())
      .set("calibration_true", path + "/" + kTrueCalibrationFile)
      .set("calibration_believed", path + "/" + kBelievedCalibrationFile);
  if (!sequence.info().clocks.empty()) entry.set("timestamps", path + "/" + kTimestampsFile);
}

}  // namespace terracast::exporters
