#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "validate/evaluate/error_pictures.h"
#include "validate/evaluate/measures.h"
#include "validate/evaluate/results/result_files.h"
#include "validate/evaluate/results/result_images.h"
#include "validate/evaluate/task.h"
#include "validate/evaluate/truth.h"

/// Scene flow from each frame to the next, as RAFT-3D (Teed and Deng, CVPR 2021) measures it: of
/// the point p of a pixel, in the camera's frame of now, that stands at p' in the camera's frame of
/// the next moment, it is the vector p' - p. (Both frames x right, y down, z forward; what stands
/// still moves against a camera that flies.) EPE3D is the mean length of the difference, delta3D
/// the share of it under a bound.
///
/// A result of flow (u, v), disparity d now and d' of the same points in the next moment stands for
///
///     p = f b / d * ray(x, y)      p' = f b / d' * ray(x + u, y + v)
namespace terracast::validate {

namespace {

constexpr float kUnjudged = std::numeric_limits<float>::quiet_NaN();
constexpr float kMissing = std::numeric_limits<float>::infinity();
constexpr double kBounds_m[] = {5.0, 10.0};

enum Index { kEpe2d, kF1, kEpe3d, kDelta5, kDelta10, kNumMeasures };

/// What a result says of a frame.
struct Found {
  core::ImageF flow;           ///< empty: it is not measured
  core::Image<double> motion;  ///< p' - p, m; NaN: none
};

/// A value between pixel centres, from the four around it; NaN where one of them is.
double bilinear(const core::ImageF& image, const Eigen::Vector2d& pixel) {
  const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
  if (!(x >= 0.0) || !(y >= 0.0) || x > image.width() - 1 || y > image.height() - 1)
    return std::numeric_limits<double>::quiet_NaN();
  const int left = std::min(static_cast<int>(x), std::max(0, image.width() - 2));
  const int top = std::min(static_cast<int>(y), std::max(0, image.height() - 2));
  double value = 0.0;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      const double weight = (i == 0 ? left + 1 - x : x - left) * (j == 0 ? top + 1 - y : y - top);
      // A pixel that weighs nothing need not be there.
      if (weight > 0.0) value += weight * static_cast<double>(image(left + i, top + j));
    }
  return value;
}

class SceneFlowTask : public Task {
 public:
  explicit SceneFlowTask(const EvaluateOptions& options) : options_(options) {}

  std::vector<Measure> measures() const override {
    return {{.name = "EPE2D", .unit = "px"},
            {.name = "F1-all", .unit = "%"},
            {.name = "EPE3D", .unit = "m"},
            {.name = "d3D<5m", .unit = "%", .is_higher_better = true},
            {.name = "d3D<10m", .unit = "%", .is_higher_better = true}};
  }

  std::vector<std::string> terms() const override {
    std::vector<std::string> terms = flow_terms(options_);
    if (!options_.disparity.empty())
      terms.emplace_back(options_.disparity_next.empty()
                             ? "the next moment's disparity looked up in the next frame's"
                             : "the next moment's disparity in the pixels of this one");
    else if (options_.flow.empty())
      terms.emplace_back("motions alone: no flow to measure");
    return terms;
  }

  bool has_truth(const Subject& subject, int frame) const override {
    return has_scene_flow_truth(subject, frame);
  }

  SubjectScore score(const Subject& subject, core::Progress& progress) const override {
    const Files files = results_of(subject);
    std::atomic<std::int64_t> num_moving = 0;
    SubjectScore score = score_frames(
        *this, subject, subject.sequence.num_frames - 1, progress,
        [&](int frame) { return files.has(frame); },
        [&](int frame) {
          const SceneFlowTruth truth = scene_flow_truth(subject, frame, options_.mask);
          num_moving += truth.num_moving;
          return judge(truth, result_of(subject, files, frame), frame, nullptr);
        });
    for (const NumberedFiles* const some :
         {&files.motion, &files.flow, &files.disparity, &files.disparity_next})
      score.notes.insert(score.notes.end(), some->notes.begin(), some->notes.end());
    if (num_moving > 0)
      score.notes.push_back(
          fmt::format("{}, {}: {} pixels of things that move are left out; the dataset does not "
                      "say how they move in space",
                      score.sequence, score.camera, num_moving.load()));
    return score;
  }

  std::vector<CheckResult::Picture> pictures(const Subject& subject, int frame) const override {
    const SceneFlowTruth truth = scene_flow_truth(subject, frame, options_.mask);
    const Found found = result_of(subject, results_of(subject), frame);
    core::ImageF errors;
    judge(truth, found, frame, &errors);
    const float full_px = longest_flow(truth.image.flow);
    std::vector<CheckResult::Picture> pictures;
    const auto show = [&](const char* what, const core::ImageF& flow) {
      pictures.push_back(
          shown_picture(fmt::format("{}: {}; hue is direction, full colour {:.3g} px",
                                    subject.place(frame), what, full_px),
                        flow_picture(flow, full_px)));
    };
    show("true flow", truth.image.flow);
    if (!found.flow.empty()) show("the result's flow", found.flow);
    pictures.push_back(shown_errors("End-point error in space", "m", errors, 0.1F));
    return pictures;
  }

 private:
  struct Files {
    NumberedFiles motion, flow, disparity, disparity_next;
    bool is_looked_up = false;  ///< the next disparity is that of the next frame

    bool has(int frame) const {
      const auto holds = [frame](const NumberedFiles& files) {
        return files.folder.empty() || files.has(frame);
      };
      return holds(motion) && holds(flow) && holds(disparity) && holds(disparity_next) &&
             (!is_looked_up || disparity.has(frame + 1));
    }
  };

  Files results_of(const Subject& subject) const {
    Files files;
    const int num_frames = subject.sequence.num_frames;
    const auto find = [&](const std::filesystem::path& folder,
                          const std::vector<std::string>& extensions, NumberedFiles& found) {
      if (!folder.empty())
        found = find_numbered_files(subject.result_folder(folder), num_frames, extensions,
                                    {"_mask.npy"});
    };
    find(options_.result, scene_flow_extensions(), files.motion);
    find(options_.flow, flow_extensions(), files.flow);
    find(options_.disparity, disparity_extensions(), files.disparity);
    find(options_.disparity_next, disparity_extensions(), files.disparity_next);
    files.is_looked_up = !options_.disparity.empty() && options_.disparity_next.empty();
    return files;
  }

  Found result_of(const Subject& subject, const Files& files, int frame) const {
    const Intrinsics& k = sound_intrinsics(subject);
    const ImageSize size{k.width_px, k.height_px};
    Found found;
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    found.motion = core::Image<double>(k.width_px, k.height_px, 3, kNone);
    if (!files.flow.folder.empty())
      found.flow = read_result(files.flow.path(frame), size, &parse_flow);
    if (!files.motion.folder.empty()) {
      const core::ImageF motion = read_result(files.motion.path(frame), size, &parse_scene_flow);
      std::copy(motion.data().begin(), motion.data().end(), found.motion.data().begin());
      return found;
    }
    const double product = focal_times_baseline(subject);
    const core::ImageF now = read_result(files.disparity.path(frame), size, &parse_disparity);
    const core::ImageF then =
        files.is_looked_up ? read_result(files.disparity.path(frame + 1), size, &parse_disparity)
                           : read_result(files.disparity_next.path(frame), size, &parse_disparity);
    for (int y = 0; y < k.height_px; ++y)
      for (int x = 0; x < k.width_px; ++x) {
        const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
        const Eigen::Vector2d there = pixel + vector_at(found.flow, x, y);
        const double disparity_then =
            files.is_looked_up ? bilinear(then, there) : static_cast<double>(then(x, y));
        const Eigen::Vector3d point =
            product / static_cast<double>(now(x, y)) * k.ray_from_pixel(pixel);
        const Eigen::Vector3d point_next = product / disparity_then * k.ray_from_pixel(there);
        for (int c = 0; c < 3; ++c) found.motion(x, y, c) = point_next[c] - point[c];
      }
    return found;
  }

  FrameScore judge(const SceneFlowTruth& truth, const Found& found, int frame,
                   core::ImageF* errors) const {
    const core::ImageF& flow = truth.image.flow;
    if (errors != nullptr) *errors = core::ImageF(flow.width(), flow.height(), 1, kUnjudged);
    FrameScore score{.frame = frame};
    score.sums.resize(kNumMeasures);
    for (int y = 0; y < flow.height(); ++y)
      for (int x = 0; x < flow.width(); ++x) {
        if (!is_judged(truth.image, x, y, options_)) continue;
        ++score.num_truth;
        if (!found.flow.empty()) {
          const Eigen::Vector2d is = vector_at(flow, x, y);
          const double error_px = (vector_at(found.flow, x, y) - is).norm();
          add_flow_error(score, std::isfinite(error_px), error_px, is.norm(), options_.missing);
        }
        Eigen::Vector3d off;
        for (int c = 0; c < 3; ++c)
          off[c] = found.motion(x, y, c) - (truth.points_next(x, y, c) - truth.points(x, y, c));
        const double error_m = off.norm();
        const bool is_known = std::isfinite(error_m);
        score.num_answered += is_known ? 1 : 0;
        if (is_known) add(score.sums[kEpe3d], error_m);
        if (is_known || options_.missing == MissingPixels::Wrong)
          for (std::size_t i = 0; i < std::size(kBounds_m); ++i)
            add_share(score.sums[kDelta5 + i], is_known && error_m < kBounds_m[i]);
        if (errors != nullptr) (*errors)(x, y) = is_known ? static_cast<float>(error_m) : kMissing;
      }
    return score;
  }

  EvaluateOptions options_;
};

}  // namespace

std::unique_ptr<Task> make_scene_flow_task(const EvaluateOptions& options) {
  return std::make_unique<SceneFlowTask>(options);
}

}  // namespace terracast::validate
