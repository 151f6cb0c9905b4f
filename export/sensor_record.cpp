#include "export/sensor_record.h"

#include <fmt/format.h>

#include <string_view>
#include <vector>

#include "core/json.h"
#include "export/georeference.h"

namespace terracast::exporters {
namespace {

using core::Json;

/// A table; of a scanner the folder of its scans.
std::string path_of(const capture::StreamInfo& stream) {
  return fmt::format("sensors/{}/{}{}", stream.rig, stream.name, stream.is_scan ? "" : ".csv");
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

/// Channels that begin so are coordinates of the world; of a dataset they are the poses' own frame's.
constexpr std::string_view kWorld = "world_";

std::vector<capture::StreamChannel> local_channels(std::vector<capture::StreamChannel> channels) {
  for (capture::StreamChannel& channel : channels)
    if (channel.name.starts_with(kWorld)) channel.name.replace(0, kWorld.size(), "local_");
  return channels;
}

/// Scans with their world's coordinates brought into the dataset's frame.
capture::Samples local_scans(const capture::StreamInfo& stream, const LocalFrame& local,
                             capture::Samples scans) {
  const std::size_t num_channels = stream.channels.size();
  // Channels that hold the first of a point's three coordinates.
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k + 2 < num_channels; ++k)
    if (stream.channels[k].name.starts_with(kWorld) && stream.channels[k].name.ends_with("x_m"))
      places.push_back(k);
  for (std::size_t row = 0; row < scans.values.size(); row += num_channels)
    for (const std::size_t place : places) {
      Eigen::Map<Eigen::Vector3d> point(&scans.values[row + place]);
      point = local.local_from_world * Eigen::Vector3d(point);
    }
  return scans;
}

Json json_from_pose(const geo::Rigid3d& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return Json::object()
      .set("quaternion_wxyz", Json::array_of({q.w(), q.x(), q.y(), q.z()}))
      .set("translation_m", Json::array_of({t.x(), t.y(), t.z()}));
}

void write_stream(DatasetWriter& writer, const std::string& folder,
                  const capture::SequenceReader& sequence, int stream_index) {
  const capture::StreamInfo& stream =
      sequence.info().streams[static_cast<std::size_t>(stream_index)];
  if (!stream.is_scan) {
    writer.write_kept(folder + "/" + path_of(stream),
                      [&] { return samples_csv(stream, sequence.read_samples(stream_index)); });
    return;
  }
  const LocalFrame local = local_frame(sequence);
  for (int frame = 0; frame < sequence.info().num_frames; ++frame)
    writer.write_kept(fmt::format("{}/{}/{:06}.npy", folder, path_of(stream), frame), [&] {
      return capture::encode_scans(
          local_scans(stream, local, sequence.read_samples(stream_index, frame)),
          local_channels(stream.channels));
    });
}

Json json_from_channel(const capture::StreamChannel& channel) {
  return Json::object().set("name", channel.name).set("unit", channel.unit);
}

Json json_from_clock(const capture::StreamClock& clock) {
  return Json::object()
      .set("offset_s", clock.offset_s)
      .set("drift", clock.drift)
      .set("jitter_sd_s", clock.jitter_sd_s)
      .set("believed", Json::object()
                           .set("offset_s", clock.believed_offset_s)
                           .set("drift", clock.believed_drift));
}

}  // namespace

void write_sensors(DatasetWriter& writer, const std::string& folder,
                   const capture::SequenceReader& sequence) {
  if (sequence.info().streams.empty()) return;
  Json sensors = Json::array();
  for (std::size_t i = 0; i < sequence.info().streams.size(); ++i) {
    const capture::StreamInfo& stream = sequence.info().streams[i];
    write_stream(writer, folder, sequence, static_cast<int>(i));
    Json channels = Json::array();
    for (const capture::StreamChannel& channel :
         stream.is_scan ? local_channels(stream.channels) : stream.channels)
      channels.push(json_from_channel(channel));
    Json sensor = Json::object()
                      .set("rig", stream.rig)
                      .set("name", stream.name)
                      .set("kind", stream.kind)
                      .set(stream.is_scan ? "folder" : "file", path_of(stream))
                      .set("rate_hz", stream.rate_hz)
                      .set("channels", std::move(channels))
                      .set("body_from_sensor", json_from_pose(stream.body_from_sensor()))
                      .set("rig_from_sensor", json_from_pose(stream.rig_from_sensor))
                      .set("settings_toml", stream.settings_toml);
    if (stream.clock) sensor.set("clock", json_from_clock(*stream.clock));
    sensors.push(std::move(sensor));
  }
  writer.write(folder + "/" + kSensorsFile,
               Json::object()
                       .set("frames", "body, rig and sensor: x forward, y left, z up")
                       .set("sensors", std::move(sensors))
                       .text() +
                   "\n");
}

}  // namespace terracast::exporters
