#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/progress.h"
#include "validate/dataset.h"
#include "validate/evaluate/evaluate.h"

namespace terracast::validate {

/// One camera of one sequence, and where its results lie.
struct Subject {
  const Dataset& dataset;
  const Sequence& sequence;
  int camera_index = 0;
  /// Whether SEQUENCE and CAMERA may be left out of paths to results: there is but one.
  bool is_only_sequence = true;
  bool is_only_camera = true;

  const Camera& camera() const { return sequence.cameras[static_cast<std::size_t>(camera_index)]; }
  const Reader& reader() const { return find_reader(dataset.format); }
  /// Where this one's results lie below the folder that a user names: FOLDER/SEQUENCE/CAMERA, or
  /// less where there is but one.
  /// throws  Input: no such folder
  std::filesystem::path result_folder(const std::filesystem::path& folder) const;
  std::string place(int frame) const;  ///< "00, image_2, frame 7"
};

/// The cameras and sequences that the options name: by default every sequence's left camera of the
/// pair, or its first.
/// throws  Config: an unknown name
std::vector<Subject> chosen_subjects(const Dataset& dataset, const EvaluateOptions& options);

/// A way to score results. A task reads the truth of one frame, and the result of one, at a time.
class Task {
 public:
  virtual ~Task() = default;

  /// What the figures are; the first ranks the frames.
  virtual std::vector<Measure> measures() const = 0;
  /// Limits and masks, in words.
  virtual std::vector<std::string> terms() const = 0;
  /// Whether the dataset can judge a frame of a camera.
  virtual bool has_truth(const Subject& subject, int frame) const = 0;
  /// Called where one frame at least has a truth.
  /// throws  Input: a truth that cannot judge this, no or a damaged result
  virtual SubjectScore score(const Subject& subject, core::Progress& progress) const = 0;
  /// Truth, result and error of a frame.
  virtual std::vector<CheckResult::Picture> pictures(const Subject&, int) const { return {}; }
};

struct TaskInfo {
  std::string_view name;  ///< as typed: "scene-flow"
  std::string_view summary;
  std::unique_ptr<Task> (*make)(const EvaluateOptions&);
};

/// The table of tasks, alphabetical.
std::span<const TaskInfo> tasks();

/// Scores the frames that have a truth for the task, in parallel.
/// num_expected  frames that a whole dataset has a truth for; fewer are told in the notes
/// has_result whether the result holds a frame
/// judge      the score of a frame that the result holds
SubjectScore score_frames(const Task& task, const Subject& subject, int num_expected,
                          core::Progress& progress, const std::function<bool(int)>& has_result,
                          const std::function<FrameScore(int)>& judge);

/// Values of an option that may be repeated: sorted, each once.
inline void sort_and_unite(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

/// "depth < 250 m", or that there is no limit.
std::string limit_text(const char* what, double limit, const char* unit);
/// Whether a limit leaves a value: below it, or there is none (0).
inline bool is_within_limit(double value, double limit) { return limit <= 0.0 || value < limit; }

}  // namespace terracast::validate
