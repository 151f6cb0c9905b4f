#pragma once

#include <optional>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "core/context.h"
#include "core/json.h"
#include "core/schema.h"
#include "export/clouds/cloud.h"
#include "export/georeference.h"

/// Points of a lidar dealt to frames, for formats that hold one scan a frame.
namespace terracast::exporters {

/// The exporter's key that names the lidar: `auto` (the first of the rig that fits), `off`, or its name.
class LidarChoice {
 public:
  void describe(core::SchemaVisitor& visit);
  const std::string& name() const { return name_; }

 private:
  std::string name_ = "auto";
};

/// A lidar whose turns, lines or images follow the frames: its rate is a whole multiple of theirs. A pulse belongs to the
/// frame whose time is nearest: to floor(time_s * rate_hz + 0.5), the times from half an interval before the frame to half
/// an interval after it. Of a head that turns once a frame that is one turn about the frame's time. The first frame has no
/// earlier half; pulses of the last scan that are nearer to a further frame belong to none.
/// threads   const use is safe
class FrameScans {
 public:
  /// The lidar that the format writes; nothing: there is none, `off`, or, with `auto` and a warning, none that fits.
  /// throws    Config: the rig has no such lidar, or its scans do not follow the frames
  static std::optional<FrameScans> find(const capture::SequenceReader& sequence,
                                        const std::string& rig, const LidarChoice& choice,
                                        const char* format, const core::Context& context);

  const capture::SequenceReader& sequence() const { return *sequence_; }
  const capture::StreamInfo& stream() const;
  /// "RIG/NAME".
  std::string name() const;

  /// A frame's points in the order of their times.
  /// throws   Input: damaged samples
  std::vector<CloudPoint> points(int frame) const;
  /// Points of the last scan behind the last frame's half interval.
  std::int64_t num_after_last() const;

  /// The sensor at a frame's time, in the frame of the points' `local`.
  geo::Rigid3d local_from_sensor(int frame) const;
  /// First and last time that a frame's pulses can have, s.
  double begin_s(int frame) const;
  double end_s(int frame) const;

 private:
  FrameScans(const capture::SequenceReader& sequence, int stream_index);
  int frame_of(double time_s) const;

  const capture::SequenceReader* sequence_;  ///< outlives this
  int stream_index_ = 0;
  LocalFrame local_;
};

/// A sequence's "lidar" in dataset.json: the sensor that the format's own files are of, and which points they hold.
/// num_points   in the format's files
core::Json describe_lidar(const FrameScans& scans, std::int64_t num_points);

}  // namespace terracast::exporters
