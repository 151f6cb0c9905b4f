#include "validate/evaluate/baseline.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <set>
#include <system_error>

#include "core/atomic_file.h"
#include "core/cpu_quota.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/program.h"
#include "core/registry.h"
#include "validate/colmap/program.h"
#include "validate/evaluate/truth.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

constexpr const char* kProgram = "terracast_baseline";

/// What terracast_baseline is asked for, by the task.
std::vector<std::string> methods_of(const std::string& task) {
  if (task == "flow") return {"flow"};
  if (task == "depth") return {"stereo"};
  return {"flow", "stereo"};
}

/// Beside this program, or in PATH.
fs::path find_baseline() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  const fs::path beside = self.parent_path() / kProgram;
  if (!error && fs::is_regular_file(beside, error) && ::access(beside.c_str(), X_OK) == 0)
    return beside;
  if (const auto found = core::find_program(kProgram)) return *found;
  fail(ErrorKind::Usage,
       "--baseline: the program {} is not there. It needs OpenCV: install the packages "
       "libopencv-video-dev and libopencv-calib3d-dev (scripts/install baseline), then build {} "
       "(cmake --preset release && cmake --build --preset release --target {})",
       kProgram, kProgram, kProgram);
}

std::string end_of(const fs::path& log) {
  constexpr std::size_t kMostLines = 4;
  const std::string text = core::read_text_file(log);
  std::vector<TextLine> lines = split_lines(text);
  if (lines.size() > kMostLines)
    lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(kMostLines));
  std::string result;
  for (const TextLine& line : lines)
    result += "\n  " + core::printable(core::first_letters(line.text, 300));
  return result;
}

constexpr const char* kMark = "made_by_terracast_baseline";

/// Empties a folder that an earlier run filled: what it made of another dataset must not be scored.
/// throws  Usage: the folder holds what no run made
void begin_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_empty(folder, error) &&
      !fs::is_regular_file(folder / kMark, error))
    fail(ErrorKind::Usage,
         "{}: a folder that no baseline made is in the way; move it, or name another --report",
         folder.string());
  fs::remove_all(folder, error);
  if (error) fail(ErrorKind::Io, "{}: {}", folder.string(), error.message());
  core::make_folder(folder);
  core::write_file(folder / kMark, std::string_view());
}

fs::path temporary_folder() {
  std::string name = (fs::temp_directory_path() / "terracast-baseline-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)
    fail(ErrorKind::Io, "{}: {}", name, std::generic_category().message(errno));
  return name;
}

/// Flow, disparity, or both.
void run_opencv(const EvaluateOptions& options, const std::vector<Subject>& subjects,
                const fs::path& folder, const core::Context& context) {
  const fs::path program = find_baseline();
  std::size_t num_frames = 0;
  std::vector<std::string> chosen;
  std::set<std::string> named;
  for (const Subject& subject : subjects) {
    num_frames += static_cast<std::size_t>(subject.sequence.num_frames);
    if (named.insert("s " + subject.sequence.name).second)
      chosen.insert(chosen.end(), {"--sequence", subject.sequence.name});
    if (named.insert("c " + subject.camera().name).second)
      chosen.insert(chosen.end(), {"--camera", subject.camera().name});
  }
  for (const std::string& method : methods_of(options.task)) {
    std::vector<std::string> words{method,      fs::absolute(options.truth).string(),
                                   "--out",     fs::absolute(folder).string(),
                                   "--threads", std::to_string(context.num_threads)};
    words.insert(words.end(), chosen.begin(), chosen.end());
    const fs::path log = folder / (method + ".log");
    core::write_file(log, fmt::format("{} {}\n", kProgram, fmt::join(words, " ")));
    context.log.info("{} {}: log in {}", kProgram, method, log.string());
    const core::ProgramEnd end = core::run_program(
        program, words, log, {.timeout_s = 600.0 + 120.0 * static_cast<double>(num_frames)});
    if (!end.is_success())
      fail(ErrorKind::Io, "{} {} {}; its log ends with:{}", kProgram, method, end.text(),
           end_of(log));
  }
}

/// COLMAP's incremental reconstruction of one camera's images, which is told the intrinsics alone.
/// Every image is matched with the next few.
void run_colmap(const Subject& subject, const ColmapProgram& colmap, const fs::path& folder,
                const core::Context& context) {
  constexpr std::size_t kNextFrames = 10;
  const Camera& camera = subject.camera();
  std::vector<std::string> names;
  for (const FrameFiles& files : camera.files)
    if (!files.color.empty()) names.push_back(files.color);
  if (!names.empty() && names.front().find('#') != std::string::npos)
    fail(ErrorKind::Input,
         "{}: COLMAP reads images from files of their own, which {} has not; export the sequence "
         "as colmap or euroc too",
         names.front(), subject.dataset.format);
  for (const std::string& name : names)
    if (name.find_first_of(" \t\n\r") != std::string::npos)
      fail(ErrorKind::Input, "{}: COLMAP's lists hold no name with a blank", name);
  std::string pairs;
  std::size_t num_pairs = 0;
  for (std::size_t i = 0; i < names.size(); ++i)
    for (std::size_t k = i + 1; k <= std::min(names.size() - 1, i + kNextFrames); ++k, ++num_pairs)
      pairs += names[i] + " " + names[k] + "\n";
  core::make_folder(folder);
  core::write_file(folder / "images.lst", fmt::format("{}\n", fmt::join(names, "\n")));
  core::write_file(folder / "pairs.lst", pairs);
  const std::string root = fs::absolute(subject.dataset.root).string();
  const std::string database = (folder / "database.db").string();
  const std::string threads =
      std::to_string(context.num_threads > 0 ? context.num_threads : core::cpus_to_use());
  const Intrinsics& k = sound_intrinsics(subject);
  if (k.plane)
    fail(ErrorKind::Input,
         "{}, {}: the baseline of trajectories is COLMAP, which is given pinholes and lenses of "
         "its own models alone; export the camera to format colmap",
         subject.sequence.name, camera.name);
  const auto [model, parameters] = colmap_model({k.fx_px, k.fy_px, k.cx_px, k.cy_px, k.lens});
  const auto num_images = static_cast<double>(names.size());
  context.log.info("colmap: {} images, {} pairs; logs in {}", names.size(), num_pairs,
                   folder.parent_path().string());
  // Peak threshold and least angle as `validate --colmap` sets them, and for its reasons.
  colmap.run({"feature_extractor",
              {"--ImageReader.single_camera", "1", "--ImageReader.camera_model", model,
               "--ImageReader.camera_params", fmt::format("{:.17g}", fmt::join(parameters, ",")),
               "--SiftExtraction.use_gpu", "0", "--SiftExtraction.peak_threshold", "0.02",
               "--SiftExtraction.num_threads", threads}},
             {"--database_path", database, "--image_path", root, "--image_list_path",
              (folder / "images.lst").string()},
             "features.log", 120.0 + 60.0 * num_images);
  colmap.run({"matches_importer",
              {"--match_type", "pairs", "--SiftMatching.use_gpu", "0", "--SiftMatching.num_threads",
               threads}},
             {"--database_path", database, "--match_list_path", (folder / "pairs.lst").string()},
             "matches.log", 120.0 + 60.0 * static_cast<double>(num_pairs));
  colmap.run({"mapper",
              {"--random_seed", "0", "--Mapper.num_threads", "1", "--Mapper.multiple_models", "0",
               "--Mapper.ba_refine_focal_length", "0", "--Mapper.ba_refine_principal_point", "0",
               "--Mapper.ba_refine_extra_params", "0", "--Mapper.init_min_tri_angle", "4"}},
             {"--database_path", database, "--image_path", root, "--output_path", folder.string()},
             "mapper.log", 600.0 + 120.0 * num_images);
  const fs::path made = folder / "0/images.bin";
  if (!fs::is_regular_file(made))
    fail(ErrorKind::Input,
         "{}, {}: colmap mapper found no pair of images to begin with; frames may be too far "
         "apart, or show too little",
         subject.sequence.name, camera.name);
  std::error_code error;
  fs::rename(made, folder / "images.bin", error);
  if (error) fail(ErrorKind::Io, "{}: {}", made.string(), error.message());
}

std::string run_colmap_of_all(const std::vector<Subject>& subjects, const fs::path& folder,
                              const core::Context& context) {
  try {
    const ColmapProgram colmap(folder / "colmap_logs");
    for (const Subject& subject : subjects)
      run_colmap(
          subject, colmap,
          fs::absolute(folder / "trajectory" / subject.sequence.name / subject.camera().name),
          context);
    return colmap.version();
  } catch (const ColmapFailure& failure) {
    fail(core::find_program("colmap") ? ErrorKind::Io : ErrorKind::Usage, "--baseline: {}",
         failure.what());
  }
}

}  // namespace

std::string baseline_name(const std::string& task) {
  if (task == "flow") return "dis";
  if (task == "depth") return "sgbm";
  if (task == "scene-flow") return "dis+sgbm";
  if (task == "trajectory") return "colmap";
  fail(ErrorKind::Config, "{}", core::unknown_name_message("task", task, task_names()));
}

BaselineResult::BaselineResult(fs::path folder, bool is_temporary)
    : folder_(std::move(folder)), is_temporary_(is_temporary) {}

BaselineResult::BaselineResult(BaselineResult&& other) noexcept
    : note(std::move(other.note)), folder_(std::move(other.folder_)) {
  is_temporary_ = std::exchange(other.is_temporary_, false);
}

BaselineResult::~BaselineResult() {
  std::error_code ignored;
  if (is_temporary_) fs::remove_all(folder_, ignored);
}

void BaselineResult::apply(EvaluateOptions& options) const {
  if (options.task == "trajectory") {
    options.result = folder_ / "trajectory";
    // What only images say has no scale.
    if (!options.align) options.align = Alignment::Sim3;
  } else if (options.task == "depth") {
    options.disparity = folder_ / "disparity";
  } else if (options.task == "flow") {
    options.result = folder_ / "flow";
  } else {
    options.flow = folder_ / "flow";
    options.disparity = folder_ / "disparity";
  }
}

BaselineResult run_baseline(const EvaluateOptions& options, const std::vector<Subject>& subjects,
                            const fs::path& report_folder, const core::Context& context) {
  // What cannot be scored is not begun.
  if (options.task == "depth" || options.task == "scene-flow")
    for (const Subject& subject : subjects) focal_times_baseline(subject);
  const bool is_temporary = report_folder.empty();
  BaselineResult result(is_temporary ? temporary_folder() : report_folder / "baseline",
                        is_temporary);
  if (!is_temporary) begin_folder(result.folder());
  if (options.task == "trajectory") {
    result.note = fmt::format("baseline: {}, intrinsics known, every image matched with the next",
                              run_colmap_of_all(subjects, result.folder(), context));
  } else {
    run_opencv(options, subjects, result.folder(), context);
    const std::string name = baseline_name(options.task);
    result.note = fmt::format("baseline {}: OpenCV's {}", name,
                              name == "dis"    ? "DIS optical flow"
                              : name == "sgbm" ? "semi-global block matching"
                                               : "DIS optical flow and semi-global block matching");
  }
  return result;
}

}  // namespace terracast::validate
