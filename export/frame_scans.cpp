#include "export/frame_scans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

/// Whether a lidar's scans follow the frames: some whole number of them a frame.
bool follows_frames(const capture::StreamInfo& stream, double frame_rate_hz) {
  const double scans_per_frame = stream.rate_hz / frame_rate_hz;
  const double whole = std::round(scans_per_frame);
  constexpr double kRounding = 1e-9;
  return whole >= 1.0 && std::abs(scans_per_frame - whole) <= kRounding * whole;
}

std::string why_not(const capture::StreamInfo& stream, double frame_rate_hz) {
  return fmt::format(
      "the lidar {}/{} scans at {} Hz, which is no whole multiple of the frames' {} Hz; rate_hz = "
      "{} is right",
      stream.rig, stream.name, stream.rate_hz, frame_rate_hz, frame_rate_hz);
}

}  // namespace

void LidarChoice::describe(core::SchemaVisitor& visit) {
  visit.key("lidar", name_,
            "Lidar of the rig whose points the format's own files hold: auto (the first one whose "
            "rate is a whole multiple of the frames'), off, or its name.");
}

FrameScans::FrameScans(const capture::SequenceReader& sequence, int stream_index)
    : sequence_(&sequence), stream_index_(stream_index), local_(local_frame(sequence)) {}

std::optional<FrameScans> FrameScans::find(const capture::SequenceReader& sequence,
                                           const std::string& rig, const LidarChoice& choice,
                                           const char* format, const core::Context& context) {
  if (choice.name() == "off") return std::nullopt;
  const capture::SequenceInfo& info = sequence.info();
  const bool is_auto = choice.name() == "auto";
  std::string names;
  for (std::size_t i = 0; i < info.streams.size(); ++i) {
    const capture::StreamInfo& stream = info.streams[i];
    if (stream.kind != "lidar" || stream.rig != rig) continue;
    names += (names.empty() ? "" : ", ") + stream.name;
    if (!is_auto && stream.name != choice.name()) continue;
    if (follows_frames(stream, info.rate_hz)) return FrameScans(sequence, static_cast<int>(i));
    const std::string why = why_not(stream, info.rate_hz);
    if (!is_auto) fail(ErrorKind::Config, "{}: {}", format, why);
    context.log.warn("{}: {}: {}; its scans stand in sensors/ alone", format, info.name, why);
  }
  if (!is_auto)
    fail(ErrorKind::Config, "{}: rig {} of {} has no lidar {}; {}", format, rig, info.name,
         choice.name(),
         names.empty() ? std::string("it has none; lidar = \"auto\" is right") : "it has " + names);
  return std::nullopt;
}

const capture::StreamInfo& FrameScans::stream() const {
  return sequence_->info().streams[static_cast<std::size_t>(stream_index_)];
}

std::string FrameScans::name() const { return stream().rig + "/" + stream().name; }

int FrameScans::frame_of(double time_s) const {
  return static_cast<int>(std::floor(time_s * sequence_->info().rate_hz + 0.5));
}

std::vector<CloudPoint> FrameScans::points(int frame) const {
  std::vector<CloudPoint> points;
  for (int file = std::max(0, frame - 1); file <= frame; ++file)
    for (const CloudPoint& point : cloud_of(*sequence_, stream_index_, file, local_))
      if (frame_of(point.time_s) == frame) points.push_back(point);
  return points;
}

std::int64_t FrameScans::num_after_last() const {
  const int num_frames = sequence_->info().num_frames;
  const std::vector<CloudPoint> last = cloud_of(*sequence_, stream_index_, num_frames - 1, local_);
  return std::count_if(last.begin(), last.end(), [&](const CloudPoint& point) {
    return frame_of(point.time_s) >= num_frames;
  });
}

geo::Rigid3d FrameScans::local_from_sensor(int frame) const {
  const capture::FrameRecord& record = sequence_->frames()[static_cast<std::size_t>(frame)];
  return local_.local_from_world * record.world_from_body * stream().body_from_sensor();
}

double FrameScans::begin_s(int frame) const {
  return std::max(0.0, (frame - 0.5) / sequence_->info().rate_hz);
}

double FrameScans::end_s(int frame) const {
  const capture::SequenceInfo& info = sequence_->info();
  const double end_s = (frame + 0.5) / info.rate_hz;
  if (frame + 1 < info.num_frames) return end_s;
  // The last frame has one scan of its own.
  return std::min(end_s, frame / info.rate_hz + 1.0 / stream().rate_hz);
}

core::Json describe_lidar(const FrameScans& scans, std::int64_t num_points) {
  return core::Json::object()
      .set("rig", scans.stream().rig)
      .set("name", scans.stream().name)
      .set("num_points", num_points)
      .set("num_points_after_last_frame", scans.num_after_last());
}

}  // namespace terracast::exporters
