#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "validate/evaluate/error_pictures.h"
#include "validate/evaluate/measures.h"
#include "validate/evaluate/results/result_files.h"
#include "validate/evaluate/results/result_images.h"
#include "validate/evaluate/task.h"
#include "validate/evaluate/truth.h"

/// Optical flow from each frame to the next. EPE2D is the mean length of the difference, F1-all the
/// share of outliers among all pixels (KITTI 2015, `Fl-all`); the limits on depth and flow are those
/// of RAFT-3D (Teed and Deng, CVPR 2021), which the measures of scene flow come from.
namespace terracast::validate {

namespace {

constexpr float kUnjudged = std::numeric_limits<float>::quiet_NaN();
constexpr float kMissing = std::numeric_limits<float>::infinity();

class FlowTask : public Task {
 public:
  explicit FlowTask(const EvaluateOptions& options) : options_(options) {}

  std::vector<Measure> measures() const override {
    return {{.name = "EPE2D", .unit = "px"}, {.name = "F1-all", .unit = "%"}};
  }

  std::vector<std::string> terms() const override { return flow_terms(options_); }

  bool has_truth(const Subject& subject, int frame) const override {
    return has_flow_truth(subject, frame);
  }

  SubjectScore score(const Subject& subject, core::Progress& progress) const override {
    const NumberedFiles files = results_of(subject);
    SubjectScore score = score_frames(
        *this, subject, subject.sequence.num_frames - 1, progress,
        [&](int frame) { return files.has(frame); },
        [&](int frame) { return judge(subject, files, frame, nullptr); });
    score.notes.insert(score.notes.begin(), files.notes.begin(), files.notes.end());
    return score;
  }

  std::vector<CheckResult::Picture> pictures(const Subject& subject, int frame) const override {
    const NumberedFiles files = results_of(subject);
    const FlowTruth truth = flow_truth(subject, frame, options_.mask);
    const core::ImageF found = result_of(subject, files, frame);
    core::ImageF errors;
    judge(subject, files, frame, &errors);
    const float full_px = longest_flow(truth.flow);
    const auto title = [&](const char* what) {
      return fmt::format("{}: {}; hue is direction, full colour {:.3g} px", subject.place(frame),
                         what, full_px);
    };
    return {shown_picture(title("true flow"), flow_picture(truth.flow, full_px)),
            shown_picture(title("the result's flow"), flow_picture(found, full_px)),
            shown_errors("End-point error", "px", errors, 1.0F)};
  }

 private:
  NumberedFiles results_of(const Subject& subject) const {
    return find_numbered_files(subject.result_folder(options_.result), subject.sequence.num_frames,
                               flow_extensions(), {"_mask.npy"});
  }

  static core::ImageF result_of(const Subject& subject, const NumberedFiles& files, int frame) {
    const Intrinsics& k = subject.camera().intrinsics;
    return read_result(files.path(frame), {k.width_px, k.height_px}, &parse_flow);
  }

  FrameScore judge(const Subject& subject, const NumberedFiles& files, int frame,
                   core::ImageF* errors) const {
    const FlowTruth truth = flow_truth(subject, frame, options_.mask);
    const core::ImageF found = result_of(subject, files, frame);
    if (errors != nullptr) *errors = core::ImageF(found.width(), found.height(), 1, kUnjudged);
    FrameScore score{.frame = frame};
    score.sums.resize(2);
    for (int y = 0; y < found.height(); ++y)
      for (int x = 0; x < found.width(); ++x) {
        if (!is_judged(truth, x, y, options_)) continue;
        const Eigen::Vector2d is = vector_at(truth.flow, x, y);
        const Eigen::Vector2d says = vector_at(found, x, y);
        const double error_px = (says - is).norm();
        const bool is_known = std::isfinite(error_px);
        ++score.num_truth;
        score.num_answered += is_known ? 1 : 0;
        add_flow_error(score, is_known, error_px, is.norm(), options_.missing);
        if (errors != nullptr) (*errors)(x, y) = is_known ? static_cast<float>(error_px) : kMissing;
      }
    return score;
  }

  EvaluateOptions options_;
};

}  // namespace

std::unique_ptr<Task> make_flow_task(const EvaluateOptions& options) {
  return std::make_unique<FlowTask>(options);
}

}  // namespace terracast::validate
