#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/choice.h"
#include "core/schema.h"
#include "geo/fixes/cleaning.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/placing.h"
#include "geo/fixes/telling.h"
#include "geo/paths/interpolating_spline.h"
#include "geo/paths/recorded_motion.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// Which recording is read, where it stands, how it is cleaned and made smooth.
struct RecordingOptions {
  core::Path file;
  std::string format;
  PlacingOptions placing;
  std::string timing = "recorded";
  double speed_mps = 15.0;
  CleaningOptions cleaning;
  double sigma_m = 0.0;
  double sigma_height_m = 0.0;
  double sigma_attitude_deg = 0.5;

  void describe(core::SchemaVisitor& visit);
  /// throws   Config: as PlacingOptions and FixFormat
  void validate() const;
  const FixFormat& format_options() const { return *format_options_; }

 private:
  core::KindOptions<FixFormatInfo> format_options_;
};

/// A part of a recording as a smooth motion. Times count from Recording::zero_s.
struct SmoothPart {
  double begin_s = 0.0, end_s = 0.0;
  std::size_t num_fixes = 0;
  std::optional<InterpolatingSpline> position;  ///< flattened coordinates; always there
  std::optional<RotationSpline> rotation;
  double horizontal_rms_m = 0.0;  ///< of the residuals in east and in north, outliers left out
  double vertical_rms_m = 0.0;
  double attitude_rms_deg = 0.0;
  std::size_t num_outliers = 0;                       ///< residuals beyond 3 sigma
  std::optional<double> median_speed_difference_mps;  ///< to the speeds that were recorded
};

struct Recording {
  std::size_t num_fixes = 0;
  std::size_t num_without_place = 0;
  std::size_t num_without_height = 0;
  std::size_t num_without_ground = 0;
  std::size_t num_without_attitude = 0;
  std::size_t num_attitudes_repeated = 0;
  std::size_t num_attitudes_without_time = 0;
  CleaningCounts dropped;
  std::string attitude_from;          ///< gimbal, body or path
  double zero_s = 0.0;                ///< on the file's clock
  std::optional<double> zero_unix_s;  ///< the same instant in UTC since 1970, where it is known
  std::vector<SmoothPart> parts;
  FileFacts facts;
};

/// Reads, places, cleans and smooths a recording.
/// Parts without enough attitudes, where attitudes are wanted, are left out with a warning.
/// throws   Io, Input: as the format's read; Input: no part has three fixes (says what was dropped), or
///          none has attitudes throughout
Recording read_recording(const RecordingOptions& options, const TrajectoryContext& context,
                         Continuity continuity = Continuity::Second);

/// "757 fixes; dropped: 6 repeated, 2 impossible (...)", for messages and logs.
std::string summary_of(const Recording& recording, const RecordingOptions& options);

}  // namespace terracast::geo
