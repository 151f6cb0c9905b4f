#include "cli/evaluate_command.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>

#include "cli/reference.h"
#include "cli/within.h"
#include "core/error.h"

namespace terracast::cli {
namespace {

using validate::Alignment;
using validate::Averaging;
using validate::CloudCrop;
using validate::FlowMask;
using validate::MissingPixels;

/// The tasks that an option is for; one that stands here not is for all.
const std::map<std::string, std::vector<std::string>>& tasks_of_options() {
  static const std::map<std::string, std::vector<std::string>> table{
      {"--flow", {"scene-flow"}},
      {"--disparity", {"scene-flow", "depth"}},
      {"--disparity-next", {"scene-flow"}},
      {"--max-depth-m", {"flow", "scene-flow", "depth", "cloud"}},
      {"--max-flow-px", {"flow", "scene-flow"}},
      {"--mask", {"flow", "scene-flow"}},
      {"--average", {"flow", "scene-flow", "depth"}},
      {"--missing", {"flow", "scene-flow", "depth"}},
      {"--median-scale", {"depth"}},
      {"--clamp", {"depth"}},
      {"--align", {"trajectory"}},
      {"--rpe-delta", {"trajectory"}},
      {"--rpe-delta-m", {"trajectory"}},
      {"--drift-length-m", {"trajectory"}},
      {"--drift-stride", {"trajectory"}},
      {"--times", {"trajectory"}},
      {"--distance-m", {"cloud"}},
      {"--crop", {"cloud"}},
      {"--max-truth-error-m", {"trajectory"}},
      {"--time-offset-s", {"trajectory"}},
      {"--max-time-difference-s", {"trajectory"}},
  };
  return table;
}

/// An option whose words stand for the values of an enumeration.
template <class Value>
CLI::Option* add_choice(CLI::App& command, const std::string& name, Value& value,
                        const std::map<std::string, Value>& words, const std::string& summary) {
  std::vector<std::string> known;
  for (const auto& [word, meant] : words) known.push_back(word);
  return command
      .add_option_function<std::string>(
          name, [&value, words](const std::string& word) { value = words.at(word); }, summary)
      ->type_name("WORD")
      ->check(CLI::IsMember(known));
}

constexpr const char* kExamples =
    "Results are found by the frames' numbers: the first digits of a file's name. Of a dataset of\n"
    "one sequence, and one camera, they lie in the folder itself:\n"
    "  result/000000.flo result/000001.flo …\n"
    "  terracast evaluate --task flow --truth out/demo/export/kitti --result result\n"
    "else in RESULT/SEQUENCE/CAMERA (RESULT/SEQUENCE of one camera, RESULT/CAMERA of one "
    "sequence):\n"
    "  result/00/image_2/000000.npy …\n"
    "  terracast evaluate --task depth --truth out/demo/export/kitti --result result --camera all\n"
    "A trajectory is a file, or RESULT/SEQUENCE.txt, RESULT/SEQUENCE/images.bin:\n"
    "  terracast evaluate --task trajectory --truth out/demo/export/tartanair --result slam.txt "
    "--align sim3\n"
    "Flow is .flo, KITTI's PNG, .npy, TartanAir's .npz; depth .npy, .pfm, KITTI's or TartanAir's "
    "PNG;\n"
    "disparity KITTI's PNG, .pfm, .npy; scene flow flow and disparity, or .npy of p' - p, m, of "
    "each\n"
    "pixel's point p in the camera's frame of now (x right, y down, z forward) and p' in that of "
    "the\n"
    "next frame; trajectories TUM, KITTI's and TartanAir's rows, COLMAP's images.txt and "
    "images.bin.\n"
    "A first number in minutes:\n"
    "  terracast evaluate --task flow --truth out/demo/export/kitti --baseline --max-depth-m 0\n"
    "docs/evaluate.md says what each figure is.";

}  // namespace

CLI::App* add_evaluate_command(CLI::App& app, EvaluateArguments& arguments) {
  validate::EvaluateOptions& options = arguments.options;
  CLI::App* command = app.add_subcommand(
      "evaluate",
      "Score a method's flow, scene flow, depth, trajectory or cloud against a dataset.");
  command->footer(kExamples);
  command->add_option("--task", options.task, "One of " + joined(validate::task_names()) + ".")
      ->required()
      ->check(CLI::IsMember(validate::task_names()));
  command
      ->add_option("--truth", options.truth,
                   "Folder of one exported dataset; of clouds also a file.")
      ->required();
  command->add_option("--format", options.format,
                      "Its format; found out from the folder when left out.");
  command->add_option("--result", options.result,
                      "Folder of the method's files, or its trajectory or cloud.");
  command->add_option("--flow", options.flow, "Folder of flow, of scene flow.");
  command->add_option("--disparity", options.disparity,
                      "Folder of disparity of the left images, of scene flow or depth.");
  command->add_option(
      "--disparity-next", options.disparity_next,
      "Folder of the next moment's disparity in the pixels of this one (KITTI's "
      "disp_1); left out: --disparity of the next frame, looked up along the flow.");
  command
      ->add_option("--baseline", options.baseline,
                   "Score a well-known method in place of a result: dis (flow), sgbm (depth), "
                   "dis+sgbm (scene-flow), colmap (trajectory); the task's own when no name is "
                   "given.")
      ->type_name("[NAME]")
      ->expected(0, 1);
  command->add_option("--report", arguments.report,
                      "Folder for report.json, index.html, and what a baseline made.");
  command->add_option("--sequence", options.sequences, "Score only this one (repeatable).")
      ->allow_extra_args(false);
  command
      ->add_option("--camera", options.cameras,
                   "Score this one (repeatable), or all; left out: the left one of the pair, or "
                   "the first.")
      ->allow_extra_args(false);
  command
      ->add_option("--max-depth-m", arguments.max_depth_m,
                   "Pixels count whose true depth is less: 250 of flow and scene flow, 100 of "
                   "depth and clouds; 0 lifts the limit.")
      ->check(within(0.0, 1e12));
  command
      ->add_option("--max-flow-px", options.max_flow_px,
                   "Pixels count whose true flow is shorter: 250; 0 lifts the limit.")
      ->check(within(0.0, 1e12));
  add_choice<FlowMask>(
      *command, "--mask", options.mask,
      {{"all", FlowMask::All}, {"in-view", FlowMask::InView}, {"covisible", FlowMask::Covisible}},
      "Which points of flow count: all (the default), in-view (within the next "
      "image), covisible (seen there; of formats that say so).");
  add_choice<Averaging>(*command, "--average", options.average,
                        {{"pixels", Averaging::Pixels}, {"frames", Averaging::Frames}},
                        "Mean of all pixels (the default), or of the frames' own figures.");
  add_choice<MissingPixels>(*command, "--missing", options.missing,
                            {{"wrong", MissingPixels::Wrong}, {"skip", MissingPixels::Skip}},
                            "Pixels without result in shares: wrong (the default), or left out.");
  command->add_flag("--median-scale", options.is_depth_median_scaled,
                    "Scale each image's depth by median(truth) / median(result) first.");
  command->add_flag("--clamp", options.is_depth_clamped,
                    "Take depths beyond --max-depth-m for just that, as DDAD's evaluation does.");
  add_choice<Alignment>(
      *command, "--align", arguments.align,
      {{"none", Alignment::None},
       {"yaw", Alignment::Yaw},
       {"se3", Alignment::Se3},
       {"sim3", Alignment::Sim3}},
      "How a trajectory is laid on the truth: none, yaw (a turn about the vertical and a shift), "
      "se3 (the default), sim3 (also its scale; the default of the baseline).");
  CLI::Option* const delta =
      command->add_option("--rpe-delta", options.rpe_delta_frames, "Frames of a step of RPE: 1.")
          ->check(CLI::Range(1, 1'000'000));
  command
      ->add_option("--rpe-delta-m", arguments.rpe_delta_m,
                   "Metres of true path of a step of RPE, in place of frames.")
      ->check(within(1e-6, 1e9))
      ->excludes(delta);
  command
      ->add_option("--drift-length-m", options.drift_lengths_m,
                   "A length of the segments of drift (repeatable): 100 to 800 by 100, KITTI's.")
      ->allow_extra_args(false)
      ->check(within(1e-6, 1e9));
  command
      ->add_option("--drift-stride", options.drift_stride_frames,
                   "Frames from the start of a segment to the next one's: 10.")
      ->check(CLI::Range(1, 1'000'000));
  command
      ->add_option("--distance-m", options.cloud_distances_m,
                   "A distance within which a point is right (repeatable): 0.1, 0.25 and 1.")
      ->allow_extra_args(false)
      ->check(within(1e-9, 1e9));
  add_choice<CloudCrop>(
      *command, "--crop", options.crop,
      {{"truth", CloudCrop::Truth}, {"common", CloudCrop::Common}, {"none", CloudCrop::None}},
      "Which points of clouds count: truth (the default: the result's within the true cloud's "
      "bounds "
      "and the largest --distance-m beyond), common (of both, within their common bounds), none.");
  add_choice<bool>(
      *command, "--times", options.is_at_result_times, {{"frames", false}, {"result", true}},
      "Where a trajectory is scored: at the frames (the default), or at the result's own "
      "times, as of an IMU or a lidar, by the truth between frames.");
  command
      ->add_option("--max-truth-error-m", options.max_truth_error_m,
                   "By which the truth between frames may be off, as frames left out show: 0.001.")
      ->check(within(0.0, 1e9));
  command->add_option("--time-offset-s", options.time_offset_s,
                      "Added to a result's time stamps; the first frame is at 0.");
  command
      ->add_option("--max-time-difference-s", options.max_time_difference_s,
                   "By which a time stamp may miss its frame's: 0.01.")
      ->check(within(0.0, 1e12));
  return command;
}

validate::EvaluateOptions checked_options(const CLI::App& command,
                                          const EvaluateArguments& arguments) {
  validate::EvaluateOptions options = arguments.options;
  for (const auto& [name, tasks] : tasks_of_options())
    if (command.count(name) > 0 &&
        std::find(tasks.begin(), tasks.end(), options.task) == tasks.end())
      core::fail(core::ErrorKind::Usage, "{} belongs to --task {}, not to {}", name, joined(tasks),
                 options.task);
  options.has_baseline = command.count("--baseline") > 0;
  if (command.count("--max-depth-m") > 0) options.max_depth_m = arguments.max_depth_m;
  if (command.count("--rpe-delta-m") > 0) options.rpe_delta_m = arguments.rpe_delta_m;
  if (command.count("--align") > 0) options.align = arguments.align;
  return options;
}

}  // namespace terracast::cli
