#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "validate/evaluate/error_pictures.h"
#include "validate/evaluate/measures.h"
#include "validate/evaluate/results/result_files.h"
#include "validate/evaluate/results/result_images.h"
#include "validate/evaluate/task.h"
#include "validate/evaluate/truth.h"
#include "validate/pictures.h"

/// Planar depth. Of d against the truth d*, by Eigen, Puhrsch and Fergus (NIPS 2014):
///
///     AbsRel  mean |d - d*| / d*           RMSE      sqrt mean (d - d*)^2
///     SqRel   mean (d - d*)^2 / d*         RMSE log  sqrt mean (ln d - ln d*)^2
///     delta t share of max(d / d*, d* / d) < t      for t = 1.25, 1.25^2, 1.25^3
///
/// within 100 m, as DDAD's evaluation of surround methods. Median scaling (Zhou et al., CVPR 2017)
/// multiplies each image by median(d*) / median(d) over the pixels that count and are answered.
namespace terracast::validate {

namespace {

constexpr double kMostDepth_m = 100.0;
constexpr float kUnjudged = std::numeric_limits<float>::quiet_NaN();
constexpr float kMissing = std::numeric_limits<float>::infinity();

enum Index { kAbsRel, kSqRel, kRmse, kRmseLog, kDelta1, kDelta2, kDelta3, kNumMeasures };

/// The median; of an even number the mean of the two in the middle.
double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

class DepthTask : public Task {
 public:
  explicit DepthTask(const EvaluateOptions& options)
      : options_(options), most_m_(options.max_depth_m.value_or(kMostDepth_m)) {}

  std::vector<Measure> measures() const override {
    const auto share = [](const char* name) {
      return Measure{.name = name, .unit = "", .is_higher_better = true};
    };
    return {{.name = "AbsRel", .unit = ""},
            {.name = "SqRel", .unit = "m"},
            {.name = "RMSE", .unit = "m", .is_root = true},
            {.name = "RMSE log", .unit = "", .is_root = true},
            share("d<1.25"),
            share("d<1.25^2"),
            share("d<1.25^3")};
  }

  std::vector<std::string> terms() const override {
    std::vector<std::string> terms{limit_text("depth", most_m_, "m")};
    terms.emplace_back(options_.is_depth_median_scaled ? "each image scaled by its medians"
                                                       : "scale as it is");
    if (options_.is_depth_clamped && most_m_ > 0.0)
      terms.push_back(fmt::format("results clamped to {} m", most_m_));
    return terms;
  }

  bool has_truth(const Subject& subject, int frame) const override {
    return has_depth_truth(subject, frame);
  }

  SubjectScore score(const Subject& subject, core::Progress& progress) const override {
    const NumberedFiles files = results_of(subject);
    const auto num_frames = static_cast<std::size_t>(subject.sequence.num_frames);
    std::vector<double> scales(num_frames, 0.0);
    SubjectScore score = score_frames(
        *this, subject, subject.sequence.num_frames, progress,
        [&](int frame) { return files.has(frame); },
        [&](int frame) {
          return judge(subject, files, frame, scales[static_cast<std::size_t>(frame)], nullptr);
        });
    score.notes.insert(score.notes.begin(), files.notes.begin(), files.notes.end());
    if (options_.is_depth_median_scaled) note_scales(scales, score);
    return score;
  }

  std::vector<CheckResult::Picture> pictures(const Subject& subject, int frame) const override {
    const NumberedFiles files = results_of(subject);
    core::ImageF errors;
    double scale = 1.0;
    judge(subject, files, frame, scale, &errors);
    constexpr int kMostPixels = 480;
    const auto shown = [&](const char* what, const core::ImageF& depth) {
      return CheckResult::Picture{
          fmt::format("{}: {}, near (yellow) to far (violet), none light blue",
                      subject.place(frame), what),
          depth_picture(shrunk_nearest(depth, kMostPixels))};
    };
    return {shown("true depth", depth_truth(subject, frame)),
            shown("the result's depth", result_of(subject, files, frame)),
            shown_errors("|d - d*| / d*", "", errors, 0.01F)};
  }

 private:
  bool is_disparity() const { return !options_.disparity.empty(); }

  NumberedFiles results_of(const Subject& subject) const {
    return find_numbered_files(
        subject.result_folder(is_disparity() ? options_.disparity : options_.result),
        subject.sequence.num_frames, is_disparity() ? disparity_extensions() : depth_extensions());
  }

  /// Depth, m, of either kind of result.
  core::ImageF result_of(const Subject& subject, const NumberedFiles& files, int frame) const {
    const Intrinsics& k = sound_intrinsics(subject);
    const ImageSize size{k.width_px, k.height_px};
    if (!is_disparity()) return read_result(files.path(frame), size, &parse_depth);
    const double product = focal_times_baseline(subject);
    core::ImageF depth = read_result(files.path(frame), size, &parse_disparity);
    for (float& value : depth.data())
      value = static_cast<float>(product / static_cast<double>(value));
    return depth;
  }

  FrameScore judge(const Subject& subject, const NumberedFiles& files, int frame, double& scale,
                   core::ImageF* errors) const {
    const core::ImageF truth = depth_truth(subject, frame);
    const core::ImageF found = result_of(subject, files, frame);
    const auto counts = [&](std::size_t i) {
      const auto is = static_cast<double>(truth.data()[i]);
      return std::isfinite(is) && is_within_limit(is, most_m_);
    };
    scale = 1.0;
    if (options_.is_depth_median_scaled) {
      std::vector<double> is, says;
      for (std::size_t i = 0; i < truth.num_pixels(); ++i) {
        if (!counts(i) || !std::isfinite(found.data()[i])) continue;
        is.push_back(static_cast<double>(truth.data()[i]));
        says.push_back(static_cast<double>(found.data()[i]));
      }
      if (!is.empty()) scale = median_of(std::move(is)) / median_of(std::move(says));
    }
    if (errors != nullptr) *errors = core::ImageF(found.width(), found.height(), 1, kUnjudged);
    FrameScore score{.frame = frame};
    score.sums.resize(kNumMeasures);
    for (std::size_t i = 0; i < truth.num_pixels(); ++i) {
      if (!counts(i)) continue;
      ++score.num_truth;
      const auto is = static_cast<double>(truth.data()[i]);
      double says = scale * static_cast<double>(found.data()[i]);
      const bool is_known = std::isfinite(says);
      if (options_.is_depth_clamped && most_m_ > 0.0) says = std::min(says, most_m_);
      score.num_answered += is_known ? 1 : 0;
      add_pixel(score, is_known, says, is);
      if (errors != nullptr)
        errors->data()[i] = is_known ? static_cast<float>(std::abs(says - is) / is) : kMissing;
    }
    return score;
  }

  void add_pixel(FrameScore& score, bool is_known, double says, double is) const {
    if (is_known) {
      const double off = says - is;
      const double off_log = std::log(says / is);
      add(score.sums[kAbsRel], std::abs(off) / is);
      add(score.sums[kSqRel], off * off / is);
      add(score.sums[kRmse], off * off);
      add(score.sums[kRmseLog], off_log * off_log);
    } else if (options_.missing == MissingPixels::Skip) {
      return;
    }
    double bound = 1.0;
    for (const Index index : {kDelta1, kDelta2, kDelta3}) {
      bound *= 1.25;
      add(score.sums[index], is_known && is_ratio_under(says, is, bound) ? 1.0 : 0.0);
    }
  }

  static void note_scales(const std::vector<double>& scales, SubjectScore& score) {
    std::vector<double> used;
    for (const FrameScore& frame : score.frames)
      if (frame.num_answered > 0) used.push_back(scales[static_cast<std::size_t>(frame.frame)]);
    if (used.empty()) return;
    const auto [least, most] = std::minmax_element(used.begin(), used.end());
    score.notes.push_back(fmt::format("{}, {}: scaled by {:.6g} in the median, {:.6g} to {:.6g}",
                                      score.sequence, score.camera, median_of(used), *least,
                                      *most));
    score.found.emplace_back("median_scale", median_of(used));
  }

  EvaluateOptions options_;
  double most_m_;
};

}  // namespace

std::unique_ptr<Task> make_depth_task(const EvaluateOptions& options) {
  return std::make_unique<DepthTask>(options);
}

}  // namespace terracast::validate
