#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "validate/evaluate/measures.h"
#include "validate/evaluate/results/trajectory_files.h"
#include "validate/evaluate/task.h"
#include "validate/evaluate/trajectory_error.h"
#include "validate/evaluate/truth_between.h"

/// Camera poses: the root mean square of distances of positions after an alignment (ATE) and of all steps
/// of one length (RPE), by Sturm et al. (IROS 2012), and the drift of segments of the path by Geiger et
/// al. (CVPR 2012). Frames without a pose are left out of all, counted and told.
namespace terracast::validate {

namespace {

enum Index {
  kAte,
  kAteMean,
  kRpe,
  kRpeMean,
  kRpeTurn,
  kTRel,
  kRRel,
  kTDrift,
  kRDrift,
  kNumMeasures
};

/// Truth and result, one pose each a frame, or a row of the result.
struct ComparedPaths {
  std::vector<std::optional<Pose>> truth, found;
  std::vector<double> times_s;
  std::vector<double> path_m;  ///< length of the true path up to each
  std::string form;
  std::vector<std::string> notes;
};

ComparedPaths paths_at_frames(const std::filesystem::path& file, const Subject& subject,
                              const EvaluateOptions& options) {
  ResultTrajectory result =
      read_trajectory(file, subject, options.time_offset_s, options.max_time_difference_s);
  return {.truth = subject.camera().local_from_camera,
          .found = std::move(result.world_from_camera),
          .times_s = frame_times_s(subject.sequence),
          .path_m = path_lengths_m(subject.camera().local_from_camera),
          .form = std::move(result.form),
          .notes = std::move(result.notes)};
}

/// At the result's own times. Rows that no truth can judge are left out; those that the result lacks count
/// as missing.
ComparedPaths paths_at_result_times(const std::filesystem::path& file, const Subject& subject,
                                    const EvaluateOptions& options) {
  constexpr double kMostLeftOut_deg = 0.01;
  const PosePath frames = subject.camera().local_from_camera;
  const std::vector<double> frames_s = frame_times_s(subject.sequence);
  FilledTrajectory result = fill_gaps(read_timed_trajectory(file, options.time_offset_s), frames_s);
  std::vector<double>& times_s = result.rows.times_s;
  std::vector<std::optional<Pose>>& found = result.rows.world_from_camera;
  TruthAtTimes truth = core::with_context(
      [&] {
        return truth_at_times(frames, frames_s, times_s, options.max_truth_error_m,
                              kMostLeftOut_deg);
      },
      "the truth between frames of " + subject.sequence.name);
  std::int64_t num_matched = 0, num_missing = 0;
  for (std::size_t i = 0; i < times_s.size(); ++i)
    if (truth.poses[i]) ++(found[i] ? num_matched : num_missing);
  // Rows that were added lie between the frames: all outside are the file's.
  const std::int64_t num_rows = static_cast<std::int64_t>(times_s.size()) - result.num_filled;
  const std::string why = fmt::format(
      "{} outside the frames' times, {} where the truth between frames is not known to {:.4g} m "
      "and {} deg (--max-truth-error-m)",
      truth.num_outside, num_rows - num_matched - truth.num_outside, options.max_truth_error_m,
      kMostLeftOut_deg);
  if (num_matched == 0)
    core::fail(
        core::ErrorKind::Input,
        "{}: none of its {} rows can be compared: {}; --times frames takes the rows nearest to "
        "frames",
        file.string(), num_rows, why);
  ComparedPaths paths{.truth = std::move(truth.poses),
                      .found = std::move(found),
                      .times_s = std::move(times_s),
                      .path_m = {},
                      .form = "TUM",
                      .notes = {}};
  paths.path_m = path_lengths_at_m(frames, frames_s, paths.times_s);
  paths.notes.push_back(
      fmt::format("{}: {} of {} rows are compared, at their own times; unmatched: {}",
                  file.string(), num_matched, num_rows, why));
  if (result.num_filled > 0)
    paths.notes.push_back(fmt::format(
        "{}: rows are {:.4g} s apart (median); {} more would fill its gaps from the first frame to "
        "the last: {} where the truth is known count as missing",
        file.string(), result.interval_s, result.num_filled, num_missing));
  if (truth.worst_left_out_m > 0.0)
    paths.notes.push_back(
        fmt::format("{}: frames around them, predicted without themselves from steps twice as "
                    "long, are off by at most {:.3g} m and {:.3g} deg",
                    file.string(), truth.worst_left_out_m, truth.worst_left_out_deg));
  return paths;
}

/// Least, median, largest and deviation, as evo's tables have them.
void add_statistics(const std::string& name, const std::vector<std::optional<double>>& errors,
                    SubjectScore& score) {
  std::vector<double> values;
  for (const std::optional<double>& error : errors)
    if (error) values.push_back(*error);
  if (values.empty()) return;
  std::sort(values.begin(), values.end());
  const auto count = static_cast<double>(values.size());
  double mean = 0.0, square = 0.0;
  for (const double value : values) mean += value / count;
  for (const double value : values) square += (value - mean) * (value - mean) / count;
  const std::size_t half = values.size() / 2;
  const double median =
      values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
  score.found.emplace_back(name + " min", values.front());
  score.found.emplace_back(name + " median", median);
  score.found.emplace_back(name + " max", values.back());
  score.found.emplace_back(name + " std", std::sqrt(square));
}

std::string align_text(Alignment alignment) {
  switch (alignment) {
    case Alignment::None:
      return "no alignment";
    case Alignment::Yaw:
      return "aligned by a turn about the vertical and a shift (yaw)";
    case Alignment::Se3:
      return "aligned by rotation and shift (se3)";
    case Alignment::Sim3:
      return "aligned by rotation, shift and scale (sim3)";
  }
  return "";
}

class TrajectoryTask : public Task {
 public:
  explicit TrajectoryTask(const EvaluateOptions& options)
      : options_(options), alignment_(options.align.value_or(Alignment::Se3)) {
    sort_and_unite(options_.drift_lengths_m);
  }

  std::vector<Measure> measures() const override {
    return {{.name = "ATE", .unit = "m", .is_root = true},
            {.name = "ATE mean", .unit = "m"},
            {.name = "RPE", .unit = "m", .is_root = true},
            {.name = "RPE mean", .unit = "m"},
            {.name = "RPE turn", .unit = "deg", .is_root = true},
            {.name = "t_rel", .unit = "%"},
            {.name = "r_rel", .unit = "deg/m"},
            {.name = "t_drift", .unit = "m/s"},
            {.name = "r_drift", .unit = "deg/s"}};
  }

  std::vector<std::string> terms() const override {
    const char* const each = options_.is_at_result_times ? "row" : "frame";
    return {
        align_text(alignment_),
        options_.rpe_delta_m
            ? fmt::format("steps of more than {} m of true path", *options_.rpe_delta_m)
            : fmt::format("steps of {} {}{}", options_.rpe_delta_frames, each,
                          options_.rpe_delta_frames == 1 ? "" : "s"),
        fmt::format("drift of segments of {} m from every {}th {}",
                    fmt::join(options_.drift_lengths_m, ", "), options_.drift_stride_frames, each),
        options_.is_at_result_times ? "at the result's own times" : "at the frames"};
  }

  bool has_truth(const Subject& subject, int frame) const override {
    return subject.camera().local_from_camera[static_cast<std::size_t>(frame)].has_value();
  }

  SubjectScore score(const Subject& subject, core::Progress& progress) const override {
    const auto file = find_trajectory(options_.result, subject);
    const ComparedPaths paths = options_.is_at_result_times
                                    ? paths_at_result_times(file, subject, options_)
                                    : paths_at_frames(file, subject, options_);
    progress.advance(subject.sequence.num_frames);
    const Similarity laid =
        core::with_context([&] { return align_trajectory(paths.truth, paths.found, alignment_); },
                           fmt::format("laying {} on the truth", file.string()));
    SubjectScore score{.sequence = subject.sequence.name, .camera = subject.camera().name};
    score.notes = paths.notes;
    if (options_.is_at_result_times) score.row_times_s = paths.times_s;
    score.notes.push_back(fmt::format("{}, {}: poses of that camera from {}, as {} writes them",
                                      subject.sequence.name, subject.camera().name,
                                      file.filename().string(), paths.form));
    note_scale(paths, laid, score);
    add_frames(paths, laid, score);
    add_drift(paths, laid.scale, score);
    return score;
  }

 private:
  static std::string place(const SubjectScore& score) {
    return score.sequence + ", " + score.camera;
  }

  void note_scale(const ComparedPaths& paths, const Similarity& laid, SubjectScore& score) const {
    if (alignment_ == Alignment::Sim3) {
      score.notes.push_back(fmt::format("{}: scaled by {:.9g}", place(score), laid.scale));
      score.found.emplace_back("scale", laid.scale);
    } else if (const auto scale = scale_of(paths.truth, paths.found)) {
      score.notes.push_back(
          fmt::format("{}: not scaled; sim3 would scale by {:.9g}", place(score), *scale));
      score.found.emplace_back("scale of sim3", *scale);
    }
  }

  void add_frames(const ComparedPaths& paths, const Similarity& laid, SubjectScore& score) const {
    const auto& truth = paths.truth;
    const StepEnds ends =
        options_.rpe_delta_m
            ? steps_of_length(paths.path_m, *options_.rpe_delta_m)
            : steps_of_frames(truth.size(), static_cast<std::size_t>(options_.rpe_delta_frames));
    const TrajectoryErrors errors = trajectory_errors(truth, paths.found, laid, ends);
    CheckResult::Plot true_map{.title = "the true positions",
                               .x_label = "east, m",
                               .y_label = "north, m",
                               .x = {},
                               .y = {}};
    CheckResult::Plot found_map = true_map;
    found_map.title = "the result's, laid on them";
    const auto add_both = [](FrameScore& frame, Index root, Index mean, double value) {
      add(frame.sums[root], value * value);
      add(frame.sums[mean], value);
    };
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (!truth[i]) continue;
      FrameScore frame{.frame = static_cast<int>(i)};
      frame.sums.resize(kNumMeasures);
      frame.num_truth = 1;
      true_map.x.push_back(truth[i]->translation.x());
      true_map.y.push_back(truth[i]->translation.y());
      if (paths.found[i]) {
        frame.is_answered = true;
        frame.num_answered = 1;
        const Eigen::Vector3d there = laid * paths.found[i]->translation;
        found_map.x.push_back(there.x());
        found_map.y.push_back(there.y());
      }
      if (errors.position_m[i]) add_both(frame, kAte, kAteMean, *errors.position_m[i]);
      if (errors.step_m[i]) add_both(frame, kRpe, kRpeMean, *errors.step_m[i]);
      if (errors.step_deg[i]) add(frame.sums[kRpeTurn], *errors.step_deg[i] * *errors.step_deg[i]);
      score.frames.push_back(std::move(frame));
    }
    score.plots = {std::move(true_map), std::move(found_map)};
    add_statistics("ATE", errors.position_m, score);
    add_statistics("RPE", errors.step_m, score);
    add_statistics("RPE turn", errors.step_deg, score);
  }

  /// Why segments are not in the drift.
  void note_drift(const Drift& drift, double path_m, SubjectScore& score) const {
    const std::int64_t num_segments =
        static_cast<std::int64_t>(drift.segments.size()) + drift.num_lost + drift.num_unjudged;
    if (num_segments == 0)
      score.notes.push_back(
          fmt::format("{}: no drift: the true path, {:.6g} m, has no segment of {:.6g} m "
                      "(--drift-length-m)",
                      place(score), path_m, options_.drift_lengths_m.front()));
    if (drift.num_lost > 0)
      score.notes.push_back(
          fmt::format("{}: {} of {} segments have an end without pose and are not in the drift",
                      place(score), drift.num_lost, num_segments));
    if (drift.num_unjudged > 0)
      score.notes.push_back(
          fmt::format("{}: {} of {} segments have an end without truth and are not in the drift",
                      place(score), drift.num_unjudged, num_segments));
  }

  void add_drift(const ComparedPaths& paths, double scale, SubjectScore& score) const {
    const std::vector<double>& lengths_m = options_.drift_lengths_m;
    const Drift drift = drift_of(paths.truth, paths.found, scale, paths.times_s, paths.path_m,
                                 lengths_m, static_cast<std::size_t>(options_.drift_stride_frames));
    note_drift(drift, paths.path_m.back(), score);
    std::vector<Sum> share(lengths_m.size()), turn(lengths_m.size());
    auto frame = score.frames.begin();
    for (const DriftSegment& segment : drift.segments) {
      while (static_cast<std::size_t>(frame->frame) != segment.first) ++frame;
      const double length_m = lengths_m[segment.length_index];
      const double percent = 100.0 * segment.translation_m / length_m;
      const double deg_per_m = segment.rotation_deg / length_m;
      add(frame->sums[kTRel], percent);
      add(frame->sums[kRRel], deg_per_m);
      add(share[segment.length_index], percent);
      add(turn[segment.length_index], deg_per_m);
      if (segment.duration_s > 0.0) {
        add(frame->sums[kTDrift], segment.translation_m / segment.duration_s);
        add(frame->sums[kRDrift], segment.rotation_deg / segment.duration_s);
      }
    }
    CheckResult::Plot by_length{.title = "t_rel over the segments' length",
                                .x_label = "length, m",
                                .y_label = "t_rel, %",
                                .x = {},
                                .y = {}};
    CheckResult::Plot turn_by_length{.title = "r_rel over the segments' length",
                                     .x_label = "length, m",
                                     .y_label = "r_rel, deg/m",
                                     .x = {},
                                     .y = {}};
    for (std::size_t k = 0; k < lengths_m.size(); ++k) {
      if (share[k].count == 0) continue;
      const auto count = static_cast<double>(share[k].count);
      by_length.x.push_back(lengths_m[k]);
      by_length.y.push_back(share[k].total / count);
      turn_by_length.x.push_back(lengths_m[k]);
      turn_by_length.y.push_back(turn[k].total / count);
      score.found.emplace_back(fmt::format("segments of {} m", lengths_m[k]), count);
      score.found.emplace_back(fmt::format("t_rel of {} m", lengths_m[k]), by_length.y.back());
      score.found.emplace_back(fmt::format("r_rel of {} m", lengths_m[k]), turn_by_length.y.back());
    }
    if (by_length.x.size() > 1) score.curves = {std::move(by_length), std::move(turn_by_length)};
  }

  EvaluateOptions options_;
  Alignment alignment_;
};

}  // namespace

std::unique_ptr<Task> make_trajectory_task(const EvaluateOptions& options) {
  return std::make_unique<TrajectoryTask>(options);
}

}  // namespace terracast::validate
