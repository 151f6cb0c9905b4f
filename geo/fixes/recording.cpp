#include "geo/fixes/recording.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/registry.h"
#include "geo/paths/smoothing_spline.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

/// Times of a path that is travelled at one speed; places that repeat are dropped.
void time_by_speed(PlacedFixes& placed, double speed_mps, CleaningCounts& counts) {
  constexpr double kLeastStep_m = 0.01;
  std::vector<PlacedFix> timed;
  bool starts_part = false;
  for (PlacedFix& fix : placed.fixes) {
    starts_part |= fix.starts_part;
    const double step_m =
        timed.empty() ? 0.0 : (fix.position_world - timed.back().position_world).norm();
    if (!timed.empty() && step_m < kLeastStep_m) {
      ++counts.num_repeated;
      continue;
    }
    fix.time_s = timed.empty() ? 0.0 : timed.back().time_s + step_m / speed_mps;
    fix.speed_mps.reset();
    fix.starts_part = starts_part;
    starts_part = false;
    timed.push_back(std::move(fix));
  }
  placed.fixes = std::move(timed);
}

std::vector<double> times_of(const std::vector<PlacedFix>& fixes, double zero_s) {
  std::vector<double> times;
  times.reserve(fixes.size());
  for (const PlacedFix& fix : fixes) times.push_back(fix.time_s - zero_s);
  return times;
}

void smooth_positions(const FixPart& part, const RecordingOptions& options, double zero_s,
                      const Flattened& flattened, Continuity continuity, SmoothPart& smooth) {
  const std::vector<double> times = times_of(part.positions, zero_s);
  const auto count = static_cast<Eigen::Index>(times.size());
  Eigen::MatrixXd level(count, 2), height(count, 1);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d at =
        flattened.flattened_from_world(part.positions[static_cast<std::size_t>(i)].position_world);
    level.row(i) = at.head<2>().transpose();
    height(i, 0) = at.z();
  }
  const double sigma_height_m =
      options.sigma_height_m > 0.0 ? options.sigma_height_m : options.sigma_m;
  const Smoothed smooth_level = smooth_robustly(times, level, options.sigma_m);
  const Smoothed smooth_height = smooth_robustly(times, height, sigma_height_m);
  std::vector<Eigen::Vector3d> points(times.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    points[i] = {smooth_level.values(row, 0), smooth_level.values(row, 1),
                 smooth_height.values(row, 0)};
  }
  smooth.begin_s = times.front();
  smooth.end_s = times.back();
  smooth.num_fixes = times.size();
  smooth.position.emplace(times, std::move(points), false, continuity);
  smooth.horizontal_rms_m = smooth_level.rms;
  smooth.vertical_rms_m = smooth_height.rms;
  smooth.num_outliers = smooth_level.num_outliers + smooth_height.num_outliers;
}

// The four parts of a quaternion change by half the angle.
void smooth_rotations(const FixPart& part, double sigma_deg, double max_gap_s, double zero_s,
                      Continuity continuity, SmoothPart& smooth) {
  constexpr std::size_t kFewestRotations = 2;
  if (part.orientations.size() < kFewestRotations)
    fail(ErrorKind::Input,
         "the part of the recording from {:.1f} s to {:.1f} s holds {} attitudes; it needs {} or "
         "more, or attitude = \"path\"",
         smooth.begin_s, smooth.end_s, part.orientations.size(), kFewestRotations);
  const std::vector<double> times = times_of(part.orientations, zero_s);
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    if (times[i + 1] - times[i] > max_gap_s)
      fail(ErrorKind::Input,
           "there is no attitude between {:.1f} s and {:.1f} s of the recording, while its places "
           "go on; raise max_gap_s, or follow the path by attitude = \"path\"",
           times[i], times[i + 1]);
  }
  // It is flown where both are known.
  smooth.begin_s = std::max(smooth.begin_s, times.front());
  smooth.end_s = std::min(smooth.end_s, times.back());
  Eigen::MatrixXd parts(static_cast<Eigen::Index>(times.size()), 4);
  for (Eigen::Index i = 0; i < parts.rows(); ++i) {
    const Eigen::Quaterniond& q = *part.orientations[static_cast<std::size_t>(i)].world_from_body;
    parts.row(i) << q.w(), q.x(), q.y(), q.z();
    // q and -q are one rotation: the one in the half of its neighbour.
    if (i > 0 && parts.row(i).dot(parts.row(i - 1)) < 0.0) parts.row(i) = -parts.row(i).eval();
  }
  const Smoothed smoothed_parts =
      smooth_robustly(times, parts, 0.5 * radians_from_degrees(sigma_deg));
  std::vector<Eigen::Vector4d> quaternions(times.size());
  for (std::size_t i = 0; i < quaternions.size(); ++i)
    quaternions[i] = smoothed_parts.values.row(static_cast<Eigen::Index>(i)).transpose();
  smooth.rotation.emplace(times, std::move(quaternions), continuity);
  smooth.attitude_rms_deg = 2.0 * degrees_from_radians(smoothed_parts.rms);
  smooth.num_outliers += smoothed_parts.num_outliers;
}

/// Median of the differences between the smooth motion's speed over ground and the recorded one.
std::optional<double> median_speed_difference_mps(const FixPart& part, double zero_s,
                                                  const Flattened& flattened,
                                                  const WorldFrame& frame,
                                                  const SmoothPart& smooth) {
  std::vector<double> differences;
  for (const PlacedFix& fix : part.positions) {
    if (!fix.speed_mps) continue;
    const PointMotion motion = point_motion_at(*smooth.position, flattened, fix.time_s - zero_s);
    const Eigen::Vector3d up = frame.up_world(motion.position);
    const double speed = (motion.velocity - up.dot(motion.velocity) * up).norm();
    differences.push_back(std::abs(speed - *fix.speed_mps));
  }
  if (differences.empty()) return std::nullopt;
  const auto middle = differences.begin() + static_cast<long>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  return *middle;
}

/// What may help where hardly a fix is left.
std::string way_out(const Recording& recording, const RecordingOptions& options) {
  const CleaningCounts& counts = recording.dropped;
  if (recording.num_without_height > 0)
    return fmt::format("; a fix needs a height; {}", kNoHeightsWayOut);
  if (recording.num_without_place > 0)
    return "; a fix needs a place, of latitude and longitude or of x, y and z";
  const bool has_bad_times =
      counts.num_without_time + counts.num_out_of_order + counts.num_of_same_time > 0;
  if (has_bad_times && options.timing == "recorded")
    return "; timing = \"speed\" flies tracks without times";
  if (counts.num_in_short_parts > 0)
    return fmt::format(
        "; fixes more than max_gap_s = {:g} s apart are in different parts: is the "
        "unit of the times right?",
        options.cleaning.max_gap_s);
  return "";
}

}  // namespace

void RecordingOptions::describe(core::SchemaVisitor& visit) {
  visit.key("file", file, "The recording.", core::required());
  visit.key("format", format, "Its format, which decides some of the keys below.",
            core::required(core::one_of(core::registry_names(fix_formats()))));
  // A manual without a config shows the keys of the commonest format.
  format_options_.describe(visit, fix_formats(), "format of recordings",
                           format.empty() ? "csv" : format);
  placing.describe(visit, format_options_->frame(), format_options_->heights_above());
  visit.key("timing", timing,
            "Fly at the recorded times, or at speed_mps from place to place (of tracks without "
            "times).",
            core::one_of({"recorded", "speed"}));
  if (timing == "speed" || format.empty())
    visit.key("speed_mps", speed_mps, "Speed of timing = \"speed\".", core::between(0.01, 1000.0));
  visit.key("sigma_m", sigma_m,
            "Standard deviation of the recorded places in east and in north: the smoothest motion "
            "with such residuals is flown. 0: through every fix.",
            core::between(0.0, 10000.0));
  visit.key("sigma_height_m", sigma_height_m, "The same of the heights; 0: as sigma_m.",
            core::between(0.0, 10000.0));
  visit.key("sigma_attitude_deg", sigma_attitude_deg, "The same of recorded attitudes.",
            core::between(0.0, 45.0));
  visit.key("max_gap_s", cleaning.max_gap_s, "A longer time between fixes splits the recording.",
            core::between(0.001, 1e6));
  visit.key("max_speed_mps", cleaning.max_speed_mps,
            "Fixes that only a faster body could reach are dropped.", core::between(0.1, 10000.0));
  visit.key("hold_s", cleaning.hold_s,
            "A place that is repeated within this time is one fix, recorded again until the next "
            "came (where places come more seldom than rows, whatever their heights); 0: three "
            "times the median "
            "time between two places.",
            core::between(0.0, 3600.0));
}

void RecordingOptions::validate() const {
  if (!format_options_.is_made()) return;
  format_options_->validate();
  placing.validate(format_options_->frame(), format_options_->heights_above());
}

Recording read_recording(const RecordingOptions& options, const TrajectoryContext& context,
                         Continuity continuity) {
  const FixFormat& format = options.format_options();
  const std::string above =
      options.placing.above.empty() ? format.heights_above() : options.placing.above;
  FixTable table = format.read(options.file.resolved, above);
  PlacedFixes placed =
      place_fixes(table, options.placing, above, options.cleaning.max_gap_s, context);
  Recording recording;
  recording.num_fixes = table.fixes.size();
  recording.num_without_place = placed.num_without_place;
  recording.num_without_height = placed.num_without_height;
  recording.num_without_ground = placed.num_without_ground;
  recording.num_without_attitude = placed.num_without_attitude;
  recording.num_attitudes_repeated = placed.num_attitudes_repeated;
  recording.num_attitudes_without_time = placed.num_attitudes_without_time;
  recording.attitude_from = placed.attitude_from;
  recording.facts = {std::move(table.ledger), std::move(table.empty), std::move(table.remarks)};
  if (placed.is_over_ground)
    recording.facts.remarks.push_back(fmt::format(
        "no heights are read: it is flown {:g} m above the ground, as height_offset_m says",
        options.placing.height_offset_m));
  if (options.timing == "recorded") recording.zero_unix_s = table.zero_unix_s;
  if (options.timing == "speed" && placed.attitude_from == "body" && !placed.attitudes.empty())
    fail(ErrorKind::Config,
         "{}: its attitudes have times of their own, which timing = \"speed\" gives up; fly it by "
         "attitude = \"path\", or at the recorded times",
         options.file.resolved.string());
  if (options.timing == "speed") time_by_speed(placed, options.speed_mps, recording.dropped);
  CleaningOptions cleaning = options.cleaning;
  if (options.timing == "speed") cleaning.max_gap_s = std::numeric_limits<double>::infinity();
  constexpr double kNoise_sigma = 6.0;
  cleaning.slack_m = kNoise_sigma * std::max(options.sigma_m, options.sigma_height_m);
  std::vector<FixPart> parts = clean_fixes(placed.fixes, cleaning, recording.dropped);
  if (recording.attitude_from == "body" && !placed.attitudes.empty())
    take_attitudes(placed.attitudes, parts);
  if (parts.empty())
    fail(ErrorKind::Input, "{}: no part of the recording has {} fixes: {}{}",
         options.file.resolved.string(), kFewestFixes, summary_of(recording, options),
         way_out(recording, options));
  recording.zero_s = parts.front().positions.front().time_s;
  if (recording.zero_unix_s) *recording.zero_unix_s += recording.zero_s;
  const Flattened flattened(context.frame.origin());
  std::optional<core::Error> unfit;
  for (const FixPart& part : parts) {
    SmoothPart smooth;
    smooth_positions(part, options, recording.zero_s, flattened, continuity, smooth);
    if (recording.attitude_from != "path") {
      try {
        smooth_rotations(part, options.sigma_attitude_deg, cleaning.max_gap_s, recording.zero_s,
                         continuity, smooth);
      } catch (const core::Error& error) {
        if (!unfit) unfit = error;
        if (context.log) context.log->warn("{}; that part is left out", error.message());
        continue;
      }
    }
    smooth.median_speed_difference_mps =
        median_speed_difference_mps(part, recording.zero_s, flattened, context.frame, smooth);
    recording.parts.push_back(std::move(smooth));
  }
  if (recording.parts.empty()) throw core::Error(*unfit);
  return recording;
}

std::string summary_of(const Recording& recording, const RecordingOptions& options) {
  std::vector<std::string> dropped;
  const auto add = [&](std::size_t count, const std::string& what) {
    if (count > 0) dropped.push_back(fmt::format("{} {}", count, what));
  };
  const CleaningCounts& counts = recording.dropped;
  add(recording.num_without_place, "without a place");
  add(recording.num_without_height, "without a height");
  add(recording.num_without_ground, "without ground below");
  add(recording.num_without_attitude, "without an attitude for lever_arm_m");
  add(recording.num_attitudes_repeated, "attitudes at the time of another");
  add(recording.num_attitudes_without_time, "attitudes without a time");
  add(counts.num_without_time, "without a time");
  add(counts.num_repeated, "repeated");
  add(counts.num_of_same_time, "at the time of another");
  add(counts.num_out_of_order, "out of the order of time");
  add(counts.num_impossible,
      fmt::format("impossible (faster than {} m/s)", options.cleaning.max_speed_mps));
  add(counts.num_in_short_parts, "in parts of one or two fixes");
  return fmt::format("{} fixes; dropped: {}", recording.num_fixes,
                     dropped.empty() ? "none" : fmt::format("{}", fmt::join(dropped, ", ")));
}

}  // namespace terracast::geo
