#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/context.h"
#include "validate/check.h"

/// Scores what a user's method makes of an exported dataset: optical flow, scene flow, depth,
/// trajectories, by the measures that benchmarks use.
namespace terracast::validate {

/// Which pixels of the truth of flow count, beside those that limits leave.
enum class FlowMask {
  All,       ///< also those whose point is hidden in the next frame, or out of its view
  InView,    ///< the point stands within the next image
  Covisible  ///< and the next frame sees it, as the format's own mask says
};

/// Over what a figure of several frames is the mean.
enum class Averaging {
  Pixels,  ///< of all pixels of all frames together (KITTI; Eigen et al. 2014)
  Frames   ///< of the figures of the frames, each counted alike (Monodepth2, DDAD)
};

/// What a truth's pixel counts as of which a result's frame says nothing.
enum class MissingPixels {
  Wrong,  ///< wrong, in shares of right or wrong pixels; no mean can hold it
  Skip    ///< left out there too
};

/// What is free when a trajectory is laid on the truth.
enum class Alignment {
  None,
  Yaw,  ///< a turn about the vertical and a shift: 4 unknowns, those of visual-inertial odometry
  Se3,
  Sim3
};

/// Which points of two clouds are compared.
enum class CloudCrop {
  Truth,   ///< the result's within the true cloud's bounds, and as far beyond as points may be off
  Common,  ///< of both, those within the bounds that they have in common
  None     ///< all
};

struct EvaluateOptions {
  std::string task;                   ///< task_names()
  std::filesystem::path truth;        ///< an exported dataset; of clouds also a file
  std::string format = {};            ///< its format; empty: what dataset.json says
  std::filesystem::path result = {};  ///< folder of numbered files, or a trajectory
  /// In place of `result`: scene flow as flow, disparity now and (else looked up in the next
  /// frame's) disparity of the next moment in the pixels of this one; depth as disparity.
  std::filesystem::path flow = {};
  std::filesystem::path disparity = {};
  std::filesystem::path disparity_next = {};
  bool has_baseline = false;                ///< no result: the task's baseline is run
  std::string baseline = {};                ///< its name; empty: baseline_name() of the task
  std::vector<std::string> sequences = {};  ///< by name; empty: all
  /// By name; empty: the left one of the pair, or the first; "all".
  std::vector<std::string> cameras = {};
  std::optional<double> max_depth_m = {};  ///< exclusive; nothing: the task's; 0: no limit
  double max_flow_px = 250.0;              ///< exclusive; 0: no limit
  FlowMask mask = FlowMask::All;
  Averaging average = Averaging::Pixels;
  MissingPixels missing = MissingPixels::Wrong;
  bool is_depth_median_scaled = false;  ///< each image by median(truth) / median(result)
  bool is_depth_clamped = false;        ///< results beyond max_depth_m count as max_depth_m
  std::optional<Alignment> align = {};  ///< nothing: Se3, of COLMAP's baseline Sim3
  double time_offset_s = 0.0;           ///< added to the time stamps of a result
  double max_time_difference_s = 0.01;  ///< of a time stamp from its frame's
  std::int64_t rpe_delta_frames = 1;
  std::optional<double> rpe_delta_m = {};  ///< steps by length of the true path instead
  /// Lengths of the segments of drift, m; KITTI odometry's.
  std::vector<double> drift_lengths_m = {100, 200, 300, 400, 500, 600, 700, 800};
  std::int64_t drift_stride_frames = 10;  ///< from each segment's first frame to the next one's
  /// A trajectory is scored at its own times, against the truth between frames, in place of at frames.
  bool is_at_result_times = false;
  std::vector<double> cloud_distances_m = {0.1, 0.25, 1.0};  ///< at which a point is right
  CloudCrop crop = CloudCrop::Truth;
  double max_truth_error_m = 0.001;  ///< by which such a truth may be off, by frames left out
};

/// What one figure is.
struct Measure {
  std::string name;  ///< "EPE2D", as papers print it
  std::string unit;  ///< "px", "m", "%", or nothing
  bool is_higher_better = false;
  bool is_root = false;  ///< of the mean of squares
};

/// A sum over pixels, or frames, and how many there are.
struct Sum {
  double total = 0.0;
  std::int64_t count = 0;
};

/// One frame of one camera.
struct FrameScore {
  int frame = 0;
  bool is_answered = false;       ///< the result holds it
  std::int64_t num_truth = 0;     ///< pixels that the truth and the limits leave; 1 of a pose
  std::int64_t num_answered = 0;  ///< of them, those that the result says something about
  std::vector<Sum> sums = {};     ///< one a measure
};

/// One camera of one sequence.
struct SubjectScore {
  std::string sequence = {};
  std::string camera = {};
  std::vector<FrameScore> frames = {};  ///< that the truth can judge, in order
  /// Of a trajectory at its own times: then FrameScore::frame counts these rows, not frames.
  std::vector<double> row_times_s = {};
  std::vector<std::string> notes = {};         ///< what a reader of the figures must know
  std::vector<CheckResult::Plot> plots = {};   ///< paths from above: true, then found
  std::vector<CheckResult::Plot> curves = {};  ///< each a plot of its own
  std::vector<std::pair<std::string, double>> found = {};  ///< "scale", 1.02: beside the measures
};

/// A row of the table.
struct ScoreRow {
  std::string sequence;  ///< "all" of the last one
  std::string camera;
  int num_frames = 0;
  int num_answered_frames = 0;
  std::int64_t num_truth = 0;                      ///< of the answered frames
  std::int64_t num_answered = 0;                   ///< of those
  std::vector<std::optional<double>> values = {};  ///< one a measure; nothing: nothing to measure
};

struct Evaluation {
  std::string task;
  std::string title;               ///< "kitti: demo"
  std::vector<std::string> terms;  ///< limits, masks, alignment: what the figures rest on
  std::vector<Measure> measures;
  std::vector<SubjectScore> subjects;
  std::vector<ScoreRow> rows;  ///< one a subject, and all together
  std::vector<std::string> notes;
};

/// Reads the truth by the validator's own readers, and the result; scores every frame.
/// report_folder  gets report.json and a self-contained index.html with the worst frame's error map
///                and plots over the frames, and what a baseline made; empty: nothing is written
/// threads        the figures do not depend on their number
/// throws         Usage: options that do not belong together; Config: unknown names; Input: a truth
///                or result that is damaged, of another size, or has nothing to score; Io
Evaluation run_evaluate(const EvaluateOptions& options, const std::filesystem::path& report_folder,
                        const core::Context& context);

/// The table as text: a row for each camera of each sequence, one for all, then the notes.
std::string table_text(const Evaluation& evaluation);

/// Names ("scene-flow") and summaries of all tasks.
std::vector<NameAndSummary> task_list();
std::vector<std::string> task_names();

/// What --baseline runs for a task: "dis", "sgbm", "dis+sgbm", "colmap".
/// throws  Config: unknown task
std::string baseline_name(const std::string& task);

}  // namespace terracast::validate
