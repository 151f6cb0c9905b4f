#include "export/events/dsec.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "export/events/hdf5_file.h"
#include "export/stream_columns.h"
#include "export/utc_stamps.h"
#include "geo/camera_model.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kChunk = 100'000;
constexpr std::int64_t kNanoseconds = 1000;   // a microsecond
constexpr std::int64_t kMicroseconds = 1000;  // a millisecond

/// A frame's events, column by column.
struct EventColumns {
  std::vector<std::uint16_t> x, y;
  std::vector<std::uint8_t> p;
  std::vector<std::uint64_t> t_us;

  EventColumns(const capture::StreamInfo& stream, const capture::Samples& scans) {
    const StreamColumns columns(stream);
    const std::size_t column_x = columns.at("x_px"), column_y = columns.at("y_px"),
                      column_p = columns.at("polarity");
    for (std::size_t i = 0; i < scans.times_s.size(); ++i) {
      const double* const values = &scans.values[i * stream.channels.size()];
      x.push_back(static_cast<std::uint16_t>(values[column_x]));
      y.push_back(static_cast<std::uint16_t>(values[column_y]));
      p.push_back(static_cast<std::uint8_t>(values[column_p]));
      // Times are whole nanoseconds.
      t_us.push_back(
          static_cast<std::uint64_t>(std::llround(1e9 * scans.times_s[i]) / kNanoseconds));
    }
  }
};

/// The end of the last frame's scans, in milliseconds, rounded up.
std::int64_t end_ms(const capture::SequenceInfo& info, const capture::StreamInfo& stream) {
  const capture::TickRange last =
      capture::ticks_of_frame(stream.rate_hz, info.rate_hz, info.num_frames - 1, info.num_frames);
  return static_cast<std::int64_t>(std::ceil(1e3 * static_cast<double>(last.end) / stream.rate_hz));
}

void write_events(const capture::SequenceReader& sequence, int stream_index,
                  const std::filesystem::path& path) {
  const capture::SequenceInfo& info = sequence.info();
  const capture::StreamInfo& stream = info.streams[static_cast<std::size_t>(stream_index)];
  const std::int64_t start_ns = unix_nanoseconds(info.utc_start, 0.0);
  if (start_ns < 0)
    fail(ErrorKind::Config,
         "sequence {} begins before 1970, from where DSEC's t_offset counts; a later utc_start "
         "would do",
         info.name);
  const std::int64_t last_ms = end_ms(info, stream) + 1;
  const bool is_long = last_ms * kMicroseconds > std::numeric_limits<std::uint32_t>::max();
  const Hdf5Lock lock;
  Hdf5File file(path);
  file.make_group("events");
  file.make_list("events/x", H5T_STD_U16LE, kChunk);
  file.make_list("events/y", H5T_STD_U16LE, kChunk);
  file.make_list("events/p", H5T_STD_U8LE, kChunk);
  file.make_list("events/t", is_long ? H5T_STD_U64LE : H5T_STD_U32LE, kChunk);
  std::vector<std::uint64_t> ms_to_idx;
  std::uint64_t num_events = 0;
  for (int frame = 0; frame < info.num_frames; ++frame) {
    const EventColumns events(stream, sequence.read_samples(stream_index, frame));
    for (const std::uint64_t t_us : events.t_us) {
      while (ms_to_idx.size() * kMicroseconds <= t_us) ms_to_idx.push_back(num_events);
      ++num_events;
    }
    file.append("events/x", H5T_NATIVE_UINT16, events.x.data(), events.x.size());
    file.append("events/y", H5T_NATIVE_UINT16, events.y.data(), events.y.size());
    file.append("events/p", H5T_NATIVE_UINT8, events.p.data(), events.p.size());
    file.append("events/t", H5T_NATIVE_UINT64, events.t_us.data(), events.t_us.size());
  }
  ms_to_idx.resize(
      std::max<std::size_t>(ms_to_idx.size() + 1, static_cast<std::size_t>(last_ms) + 1),
      num_events);
  file.make_list("ms_to_idx", H5T_STD_U64LE, kChunk);
  file.append("ms_to_idx", H5T_NATIVE_UINT64, ms_to_idx.data(), ms_to_idx.size());
  const std::int64_t t_offset_us = start_ns / kNanoseconds;
  file.write_scalar("t_offset", H5T_STD_I64LE, H5T_NATIVE_INT64, &t_offset_us);
  file.close();
}

/// The lens through which a stream's sensor looks.
geo::CameraIntrinsics lens_of(const capture::SequenceInfo& info,
                              const capture::StreamInfo& stream) {
  const std::string camera = text_of_settings(stream, "camera");
  for (const capture::CameraCalibration& one : info.cameras)
    if (one.rig == stream.rig && one.name == camera) return one.intrinsics;
  if (!camera.empty())
    fail(ErrorKind::Input, "sensor {}/{} looks through camera {}, which the sequence lacks",
         stream.rig, stream.name, camera);
  const double width_px = number_of_settings(stream, "", "width_px");
  const double height_px = number_of_settings(stream, "", "height_px");
  const double fx_px = number_of_settings(stream, "", "fx_px");
  return {.model = "pinhole",
          .width_px = static_cast<int>(width_px),
          .height_px = static_cast<int>(height_px),
          .parameters = {fx_px, fx_px, 0.5 * width_px, 0.5 * height_px}};
}

/// Where each pixel lies in a pinhole of the lens's first four parameters.
std::vector<float> rectify_map(const geo::CameraIntrinsics& lens) {
  const std::unique_ptr<geo::CameraModel> model = geo::make_camera(lens);
  const bool is_pinhole = lens.model == "pinhole";
  std::vector<float> map;
  for (int y = 0; y < lens.height_px; ++y)
    for (int x = 0; x < lens.width_px; ++x) {
      Eigen::Vector2d place(x, y);
      if (!is_pinhole) {
        const Eigen::Vector3d ray = model->ray_from_pixel({x + 0.5, y + 0.5});
        const double nan = std::numeric_limits<double>::quiet_NaN();
        place = {nan, nan};
        if (ray.allFinite() && ray.z() > 0.0)
          place = {lens.parameters[0] * ray.x() / ray.z() + lens.parameters[2] - 0.5,
                   lens.parameters[1] * ray.y() / ray.z() + lens.parameters[3] - 0.5};
      }
      map.push_back(static_cast<float>(place.x()));
      map.push_back(static_cast<float>(place.y()));
    }
  return map;
}

void write_rectify_map(const geo::CameraIntrinsics& lens, const std::filesystem::path& path) {
  const std::vector<float> map = rectify_map(lens);
  const std::array<hsize_t, 3> sizes = {static_cast<hsize_t>(lens.height_px),
                                        static_cast<hsize_t>(lens.width_px), 2};
  const Hdf5Lock lock;
  Hdf5File file(path);
  file.write_array("rectify_map", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, sizes, map.data());
  file.close();
}

}  // namespace

std::vector<std::string> event_forms() { return {"dsec"}; }

void write_dsec_events(DatasetWriter& writer, const std::string& folder,
                       const capture::SequenceReader& sequence) {
  const std::vector<capture::StreamInfo>& streams = sequence.info().streams;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    if (streams[i].kind != "events") continue;
    const std::string path =
        fmt::format("{}/sensors/{}/{}/", folder, streams[i].rig, streams[i].name);
    if (!writer.keep(path + "events.h5"))
      writer.write_by(path + "events.h5", [&](const std::filesystem::path& temporary) {
        write_events(sequence, static_cast<int>(i), temporary);
      });
    if (!writer.keep(path + "rectify_map.h5"))
      writer.write_by(path + "rectify_map.h5", [&](const std::filesystem::path& temporary) {
        write_rectify_map(lens_of(sequence.info(), streams[i]), temporary);
      });
  }
}

}  // namespace terracast::exporters
