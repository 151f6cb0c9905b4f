#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "core/registry.h"
#include "validate/evaluate/baseline.h"
#include "validate/evaluate/cloud_truth.h"
#include "validate/evaluate/error_pictures.h"
#include "validate/evaluate/evaluate_report.h"
#include "validate/evaluate/task.h"
#include "validate/evaluate/truth.h"

namespace terracast::validate {

namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// What a user must name for each task.
void check_results(const EvaluateOptions& options) {
  const bool has_result = !options.result.empty();
  const bool has_flow = !options.flow.empty();
  const bool has_disparity = !options.disparity.empty();
  const auto refuse = [&](const std::string& right) {
    fail(ErrorKind::Usage, "--task {}: {}", options.task, right);
  };
  if (options.is_depth_clamped && options.max_depth_m == 0.0)
    refuse("--clamp takes the limit --max-depth-m, which 0 lifts");
  if (options.has_baseline && options.task == "cloud")
    refuse("it has no baseline; name --result, a cloud of points");
  if (options.has_baseline) {
    const std::string name = baseline_name(options.task);
    if (!options.baseline.empty() && options.baseline != name)
      refuse(fmt::format("its baseline is {}, not {}", name, options.baseline));
    if (options.is_at_result_times)
      refuse("--times result takes a TUM trajectory; the baseline has poses of frames");
    if (has_result || has_flow || has_disparity || !options.disparity_next.empty())
      refuse("--baseline makes the result; leave out --result, --flow and --disparity");
    return;
  }
  if (options.task == "depth") {
    if (has_result == has_disparity)
      refuse("name either --result, a folder of depth images, or --disparity");
  } else if (options.task == "scene-flow") {
    if (has_result == has_disparity || (has_disparity && !has_flow))
      refuse(
          "name either --result, a folder of motions in space, or --flow and --disparity (and "
          "--disparity-next)");
    if (!has_disparity && !options.disparity_next.empty())
      refuse("--disparity-next belongs to --disparity");
  } else if (options.task == "cloud") {
    if (!has_result) refuse("name --result, a cloud of points");
  } else if (!has_result) {
    refuse("name --result, or take --baseline for a first number");
  }
}

std::vector<int> chosen_cameras(const Sequence& sequence, const EvaluateOptions& options) {
  std::vector<int> chosen;
  if (options.cameras.empty()) {
    chosen.push_back(sequence.stereo ? sequence.stereo->left : 0);
    return chosen;
  }
  std::vector<std::string> known;
  for (const Camera& camera : sequence.cameras) known.push_back(camera.name);
  for (const std::string& name : options.cameras) {
    if (name == "all") {
      chosen.clear();
      for (int i = 0; i < static_cast<int>(known.size()); ++i) chosen.push_back(i);
      return chosen;
    }
    const int index = sequence.camera_index(name);
    if (index < 0)
      fail(ErrorKind::Config, "--camera: {}", core::unknown_name_message("camera", name, known));
    if (std::find(chosen.begin(), chosen.end(), index) == chosen.end()) chosen.push_back(index);
  }
  return chosen;
}

/// Adds the frames of a subject to a row's counts.
void count_frames(const SubjectScore& subject, ScoreRow& row) {
  for (const FrameScore& frame : subject.frames) {
    ++row.num_frames;
    if (!frame.is_answered) continue;
    ++row.num_answered_frames;
    row.num_truth += frame.num_truth;
    row.num_answered += frame.num_answered;
  }
}

void take_values(const Evaluation& evaluation, const std::vector<const FrameScore*>& frames,
                 Averaging averaging, ScoreRow& row) {
  for (std::size_t i = 0; i < evaluation.measures.size(); ++i)
    row.values.push_back(figure_of(evaluation.measures[i], i, frames, averaging));
}

void add_rows(Evaluation& evaluation, Averaging averaging) {
  ScoreRow all{.sequence = "all", .camera = ""};
  std::vector<const FrameScore*> frames;
  for (const SubjectScore& subject : evaluation.subjects) {
    ScoreRow row{.sequence = subject.sequence, .camera = subject.camera};
    std::vector<const FrameScore*> own;
    for (const FrameScore& frame : subject.frames) own.push_back(&frame);
    frames.insert(frames.end(), own.begin(), own.end());
    count_frames(subject, row);
    count_frames(subject, all);
    take_values(evaluation, own, averaging, row);
    evaluation.rows.push_back(std::move(row));
  }
  take_values(evaluation, frames, averaging, all);
  evaluation.rows.push_back(std::move(all));
}

/// What is missing in a result, in words.
void note_missing(const SubjectScore& subject, std::vector<std::string>& notes) {
  const bool has_rows = !subject.row_times_s.empty();
  constexpr std::size_t kMostNamed = 8;
  std::vector<std::string> named;
  std::size_t num_missing = 0;
  for (const FrameScore& frame : subject.frames) {
    if (frame.is_answered || num_missing++ >= kMostNamed) continue;
    named.push_back(
        has_rows
            ? fmt::format("{:.6g} s", subject.row_times_s[static_cast<std::size_t>(frame.frame)])
            : fmt::format("{}", frame.frame));
  }
  if (num_missing == 0) return;
  notes.push_back(fmt::format(
      "{}, {}: {} of {} {} are missing in the result and in the figures ({}{})", subject.sequence,
      subject.camera, num_missing, subject.frames.size(), has_rows ? "rows" : "frames",
      fmt::join(named, ", "), num_missing > kMostNamed ? ", …" : ""));
}

/// The frame with the worst first figure.
struct Worst {
  std::size_t subject = 0;
  int frame = -1;
};
Worst worst_frame(const Evaluation& evaluation) {
  Worst worst;
  double largest = -1.0;
  for (std::size_t s = 0; s < evaluation.subjects.size(); ++s)
    for (const FrameScore& frame : evaluation.subjects[s].frames)
      for (std::size_t i = 0; i < evaluation.measures.size(); ++i) {
        // The first figure that there is ranks: a result of motions alone has no flow.
        const auto value = figure_of(evaluation.measures[i], i, {&frame}, Averaging::Pixels);
        if (!value) continue;
        if (*value > largest) {
          largest = *value;
          worst = {s, frame.frame};
        }
        break;
      }
  return worst;
}

/// Why nothing was scored.
[[noreturn]] void fail_empty(const Evaluation& evaluation, const std::vector<Subject>& subjects) {
  const ScoreRow& all = evaluation.rows.back();
  if (all.num_frames == 0)
    fail(ErrorKind::Input, "{}: no frame has a truth for {}{}",
         subjects.front().dataset.root.string(), evaluation.task,
         evaluation.task == "trajectory"
             ? ": no pose could be read"
             : fmt::format(" in {}: its depth images (and two poses of a pair) make it",
                           subjects.front().camera().name));
  if (all.num_answered_frames == 0)
    fail(ErrorKind::Input, "the result holds none of the {} frames that have a truth",
         all.num_frames);
  std::vector<std::string> limits;
  for (const std::string& term : evaluation.terms)
    if (term.find(" < ") != std::string::npos) limits.push_back(term);
  float nearest_m = std::numeric_limits<float>::infinity();
  for (std::size_t s = 0; s < subjects.size() && std::isinf(nearest_m); ++s)
    for (const FrameScore& frame : evaluation.subjects[s].frames) {
      if (!frame.is_answered) continue;
      const core::ImageF depth = depth_truth(subjects[s], frame.frame);
      for (const float value : depth.data())
        if (value < nearest_m) nearest_m = value;
      break;
    }
  fail(ErrorKind::Input,
       "nothing to score: no pixel of the {} answered frames is within the limits ({}); the "
       "nearest of the first is {:.5g} m away (--max-depth-m 0 and --max-flow-px 0 lift them)",
       all.num_answered_frames, fmt::join(limits, ", "), static_cast<double>(nearest_m));
}

/// Of a camera whose images have no truth at all, as KITTI's right one has no depth, no result is asked for.
SubjectScore score_of(const Task& task, const Subject& subject, core::Progress& progress) {
  const int num_frames = subject.sequence.num_frames;
  for (int frame = 0; frame < num_frames; ++frame)
    if (task.has_truth(subject, frame)) return task.score(subject, progress);
  progress.advance(num_frames);
  SubjectScore score{.sequence = subject.sequence.name, .camera = subject.camera().name};
  score.notes.push_back(fmt::format("{}, {}: the dataset has no truth of any frame: left out",
                                    score.sequence, score.camera));
  return score;
}

}  // namespace

std::vector<Subject> chosen_subjects(const Dataset& dataset, const EvaluateOptions& options) {
  std::vector<std::string> known;
  for (const Sequence& sequence : dataset.sequences) known.push_back(sequence.name);
  for (const std::string& name : options.sequences)
    if (std::find(known.begin(), known.end(), name) == known.end())
      fail(ErrorKind::Config, "--sequence: {}",
           core::unknown_name_message("sequence", name, known));
  std::vector<const Sequence*> sequences;
  for (const Sequence& sequence : dataset.sequences)
    if (options.sequences.empty() || std::find(options.sequences.begin(), options.sequences.end(),
                                               sequence.name) != options.sequences.end())
      sequences.push_back(&sequence);
  std::vector<Subject> subjects;
  for (const Sequence* const sequence : sequences) {
    const std::vector<int> cameras = chosen_cameras(*sequence, options);
    for (const int camera : cameras)
      subjects.push_back({.dataset = dataset,
                          .sequence = *sequence,
                          .camera_index = camera,
                          .is_only_sequence = sequences.size() == 1,
                          .is_only_camera = cameras.size() == 1});
  }
  return subjects;
}

fs::path Subject::result_folder(const fs::path& folder) const {
  std::vector<fs::path> tried{folder / sequence.name / camera().name};
  if (is_only_camera) tried.push_back(folder / sequence.name);
  if (is_only_sequence) tried.push_back(folder / camera().name);
  if (is_only_camera && is_only_sequence) tried.push_back(folder);
  std::vector<std::string> names;
  for (const fs::path& path : tried) {
    std::error_code error;
    if (fs::is_directory(path, error)) return path;
    names.push_back(path.string());
  }
  fail(ErrorKind::Input, "no folder with results of sequence {}, camera {}: {} was looked for",
       sequence.name, camera().name, fmt::join(names, ", "));
}

std::string Subject::place(int frame) const {
  return fmt::format("{}, {}, frame {}", sequence.name, camera().name, frame);
}

std::string limit_text(const char* what, double limit, const char* unit) {
  return limit > 0.0 ? fmt::format("{} < {} {}", what, limit, unit)
                     : fmt::format("{} without limit", what);
}

SubjectScore score_frames(const Task& task, const Subject& subject, int num_expected,
                          core::Progress& progress, const std::function<bool(int)>& has_result,
                          const std::function<FrameScore(int)>& judge) {
  SubjectScore score{.sequence = subject.sequence.name, .camera = subject.camera().name};
  const int num_frames = subject.sequence.num_frames;
  const std::size_t num_measures = task.measures().size();
  int num_without = 0;
  for (int frame = 0; frame < num_frames; ++frame) {
    if (task.has_truth(subject, frame))
      score.frames.push_back({.frame = frame,
                              .is_answered = has_result(frame),
                              .sums = std::vector<Sum>(num_measures)});
    else
      ++num_without;
  }
  progress.advance(num_without);  // there is nothing to do for them
  const int num_lacking = num_expected - (num_frames - num_without);
  if (num_lacking > 0)
    score.notes.push_back(fmt::format("{}, {}: the dataset has no truth of {} of {} frames",
                                      score.sequence, score.camera, num_lacking, num_expected));
  core::parallel_for(static_cast<std::int64_t>(score.frames.size()), [&](std::int64_t index) {
    FrameScore& frame = score.frames[static_cast<std::size_t>(index)];
    if (frame.is_answered) {
      frame = core::with_context([&] { return judge(frame.frame); },
                                 "scoring " + subject.place(frame.frame));
      frame.is_answered = true;
    }
    progress.advance();
  });
  return score;
}

Evaluation run_evaluate(const EvaluateOptions& wanted, const fs::path& report_folder,
                        const core::Context& context) {
  const core::ThreadLimit limit(context.num_threads);
  const TaskInfo& info = core::find_registered(tasks(), "task", wanted.task);
  check_results(wanted);
  Findings findings;
  const Dataset dataset = wanted.task == "cloud" && is_cloud_file(wanted.truth)
                              ? dataset_of_cloud(wanted.truth)
                              : read_dataset(wanted.truth, wanted.format, findings);
  if (dataset.sequences.empty())
    fail(ErrorKind::Input, "{}: no sequence could be read: {}", wanted.truth.string(),
         fmt::join(findings.lines(3), "; "));
  constexpr std::size_t kMostNamed = 3;
  for (const std::string& line : findings.lines(kMostNamed)) context.log.warn("truth: {}", line);
  if (findings.count() > 0)
    context.log.warn("{}: {} findings; `terracast validate` says all", wanted.truth.string(),
                     findings.count());
  const std::vector<Subject> subjects = chosen_subjects(dataset, wanted);

  EvaluateOptions options = wanted;
  std::optional<BaselineResult> baseline;
  if (wanted.has_baseline) {
    baseline.emplace(run_baseline(wanted, subjects, report_folder, context));
    baseline->apply(options);
  }
  const std::unique_ptr<Task> task = info.make(options);
  Evaluation evaluation;
  evaluation.task = info.name;
  evaluation.title = fmt::format("{}: {}", dataset.format, dataset.world_name);
  evaluation.measures = task->measures();
  evaluation.terms = task->terms();
  const bool is_by_frame = options.average == Averaging::Frames;
  if (evaluation.task != "trajectory" && evaluation.task != "cloud") {
    evaluation.terms.emplace_back(is_by_frame ? "mean of the frames' figures"
                                              : "mean of all pixels");
    evaluation.terms.emplace_back(options.missing == MissingPixels::Wrong
                                      ? "pixels without result count as wrong in shares"
                                      : "pixels without result are left out");
  }
  if (findings.count() > 0)
    evaluation.notes.push_back(fmt::format(
        "the truth has {} findings; `terracast validate` says which", findings.count()));
  if (baseline) evaluation.notes.push_back(baseline->note);

  std::int64_t num_frames = 0;
  for (const Subject& subject : subjects) num_frames += subject.sequence.num_frames;
  {
    core::Progress progress(context, "frames", num_frames);
    for (const Subject& subject : subjects) {
      SubjectScore score = score_of(*task, subject, progress);
      for (const std::string& note : score.notes) evaluation.notes.push_back(note);
      note_missing(score, evaluation.notes);
      evaluation.subjects.push_back(std::move(score));
    }
  }
  // Notes name files of the result.
  for (std::string& note : evaluation.notes) note = core::printable(note);
  add_rows(evaluation, options.average);
  if (evaluation.rows.back().num_answered_frames == 0 || evaluation.rows.back().num_truth == 0)
    fail_empty(evaluation, subjects);
  if (report_folder.empty()) return evaluation;

  const Worst worst = worst_frame(evaluation);
  std::vector<CheckResult::Picture> pictures;
  // A row of a trajectory has no image.
  if (worst.frame >= 0 && evaluation.subjects[worst.subject].row_times_s.empty()) {
    const Subject& subject = subjects[worst.subject];
    pictures = task->pictures(subject, worst.frame);
    const FrameFiles& files = subject.camera().files[static_cast<std::size_t>(worst.frame)];
    Findings damage;  // a picture that cannot be read is only missed here
    if (!pictures.empty() && !files.color.empty())
      damage.attempt(files.color, [&] {
        pictures.insert(
            pictures.begin(),
            shown_picture(subject.place(worst.frame),
                          subject.reader().color(dataset, subject.camera(), worst.frame)));
      });
  }
  core::make_folder(report_folder);
  write_evaluation(evaluation, pictures, report_folder);
  return evaluation;
}

}  // namespace terracast::validate
