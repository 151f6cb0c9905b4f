#include "export/sensor_record.h"

#include <fmt/format.h>

#include "core/json.h"

namespace terracast::exporters {
namespace {

using core::Json;

std::string csv_path(const capture::StreamInfo& stream) {
  return fmt::format("sensors/{}/{}.csv", stream.rig, stream.name);
}

std::string samples_csv(const capture::StreamInfo& stream, const capture::Samples& samples) {
  std::string text = "time_s";
  for (const capture::StreamChannel& channel : stream.channels) text += "," + channel.name;
  text += "\n";
  const std::size_t num_channels = stream.channels.size();
  for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
    text += fmt::format("{}", samples.times_s[i]);
    for (std::size_t k = 0; k < num_channels; ++k)
      text += fmt::format(",{}", samples.values[i * num_channels + k]);
    text += "\n";
  }
  return text;
}

Json json_from_pose(const geo::Rigid3d& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return Json::object()
      .set("quaternion_wxyz", Json::array_of({q.w(), q.x(), q.y(), q.z()}))
      .set("translation_m", Json::array_of({t.x(), t.y(), t.z()}));
}

}  // namespace

void write_sensors(DatasetWriter& writer, const std::string& folder,
                   const capture::SequenceReader& sequence) {
  if (sequence.info().streams.empty()) return;
  Json sensors = Json::array();
  for (std::size_t i = 0; i < sequence.info().streams.size(); ++i) {
    const capture::StreamInfo& stream = sequence.info().streams[i];
    const std::string path = csv_path(stream);
    writer.write_kept(folder + "/" + path, [&] {
      return samples_csv(stream, sequence.read_samples(static_cast<int>(i)));
    });
    Json channels = Json::array();
    for (const capture::StreamChannel& channel : stream.channels)
      channels.push(Json::object().set("name", channel.name).set("unit", channel.unit));
    sensors.push(Json::object()
                     .set("rig", stream.rig)
                     .set("name", stream.name)
                     .set("kind", stream.kind)
                     .set("file", path)
                     .set("rate_hz", stream.rate_hz)
                     .set("channels", std::move(channels))
                     .set("body_from_sensor", json_from_pose(stream.body_from_sensor()))
                     .set("rig_from_sensor", json_from_pose(stream.rig_from_sensor))
                     .set("settings_toml", stream.settings_toml));
  }
  writer.write(folder + "/" + kSensorsFile,
               Json::object()
                       .set("frames", "body, rig and sensor: x forward, y left, z up")
                       .set("sensors", std::move(sensors))
                       .text() +
                   "\n");
}

}  // namespace terracast::exporters
