#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "core/error.h"
#include "validate/evaluate/measures.h"
#include "validate/evaluate/results/trajectory_files.h"
#include "validate/evaluate/task.h"
#include "validate/evaluate/trajectory_error.h"

/// Camera poses, by Sturm et al. (IROS 2012): the root mean square of distances of positions after an
/// alignment (ATE), and of steps from each frame to one some frames later (RPE), translations alone, all
/// such pairs. Frames without a pose are left out of both, counted and told.
namespace terracast::validate {

namespace {

enum Index { kAte, kAteMean, kRpe, kRpeMean, kNumMeasures };

class TrajectoryTask : public Task {
 public:
  explicit TrajectoryTask(const EvaluateOptions& options)
      : options_(options), alignment_(options.align.value_or(Alignment::Se3)) {}

  std::vector<Measure> measures() const override {
    return {{.name = "ATE", .unit = "m", .is_root = true},
            {.name = "ATE mean", .unit = "m"},
            {.name = "RPE", .unit = "m", .is_root = true},
            {.name = "RPE mean", .unit = "m"}};
  }

  std::vector<std::string> terms() const override {
    return {alignment_ == Alignment::None  ? "no alignment"
            : alignment_ == Alignment::Se3 ? "aligned by rotation and shift (se3)"
                                           : "aligned by rotation, shift and scale (sim3)",
            fmt::format("steps of {} frame{}", options_.rpe_delta_frames,
                        options_.rpe_delta_frames == 1 ? "" : "s"),
            "translations alone"};
  }

  bool has_truth(const Subject& subject, int frame) const override {
    return subject.camera().local_from_camera[static_cast<std::size_t>(frame)].has_value();
  }

  SubjectScore score(const Subject& subject, core::Progress& progress) const override {
    const auto file = find_trajectory(options_.result, subject);
    const ResultTrajectory result =
        read_trajectory(file, subject, options_.time_offset_s, options_.max_time_difference_s);
    const auto& truth = subject.camera().local_from_camera;
    const auto& found = result.world_from_camera;
    const Similarity truth_from_found =
        core::with_context([&] { return align_trajectory(truth, found, alignment_); },
                           fmt::format("laying {} on the truth", file.string()));
    const TrajectoryErrors errors = trajectory_errors(
        truth, found, truth_from_found, static_cast<std::size_t>(options_.rpe_delta_frames));
    SubjectScore score{.sequence = subject.sequence.name, .camera = subject.camera().name};
    score.notes = result.notes;
    score.notes.push_back(fmt::format("{}, {}: poses of that camera from {}, as {} writes them",
                                      subject.sequence.name, subject.camera().name,
                                      file.filename().string(), result.form));
    if (alignment_ == Alignment::Sim3) {
      score.notes.push_back(fmt::format("{}, {}: scaled by {:.9g}", subject.sequence.name,
                                        subject.camera().name, truth_from_found.scale));
      score.found.emplace_back("scale", truth_from_found.scale);
    }
    CheckResult::Plot true_map{.title = "the true positions",
                               .x_label = "east, m",
                               .y_label = "north, m",
                               .x = {},
                               .y = {}};
    CheckResult::Plot found_map = true_map;
    found_map.title = "the result's, laid on them";
    for (std::size_t i = 0; i < truth.size(); ++i) {
      progress.advance();
      if (!truth[i]) continue;
      FrameScore frame{.frame = static_cast<int>(i)};
      frame.sums.resize(kNumMeasures);
      frame.num_truth = 1;
      true_map.x.push_back(truth[i]->translation.x());
      true_map.y.push_back(truth[i]->translation.y());
      if (found[i]) {
        frame.is_answered = true;
        frame.num_answered = 1;
        const Eigen::Vector3d laid = truth_from_found * found[i]->translation;
        found_map.x.push_back(laid.x());
        found_map.y.push_back(laid.y());
      }
      if (const auto& off_m = errors.position_m[i]) {
        add(frame.sums[kAte], *off_m * *off_m);
        add(frame.sums[kAteMean], *off_m);
      }
      if (const auto& off_m = errors.step_m[i]) {
        add(frame.sums[kRpe], *off_m * *off_m);
        add(frame.sums[kRpeMean], *off_m);
      }
      score.frames.push_back(std::move(frame));
    }
    score.plots = {std::move(true_map), std::move(found_map)};
    return score;
  }

 private:
  EvaluateOptions options_;
  Alignment alignment_;
};

}  // namespace

std::unique_ptr<Task> make_trajectory_task(const EvaluateOptions& options) {
  return std::make_unique<TrajectoryTask>(options);
}

}  // namespace terracast::validate
