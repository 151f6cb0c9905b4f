#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/depth_marks.h"
#include "validate/sampling.h"

/// Depths of single images as numbers: how many different ones there are, whether they end at one value, and to what
/// they are rounded.
namespace terracast::validate {

namespace {

/// What one depth image shows.
struct DepthMarks {
  /// Stretches of pixels of one depth, to the bit, by different depths; along rows or columns, of which it is less.
  double stretches_per_value = 0.0;
  double share_at_most = 0.0;  ///< pixels of the greatest depth, as those to their right and below
  std::optional<DepthSteps> steps;
};

/// Level ground is equally deep along a line of the image: it has one stretch of each depth, and no area. What is in
/// steps has many stretches of each, and what is cut has an area.
/// looks_straight_down  within 0.26 deg, or up
/// returns  nothing of few depths, of level ground from straight above, and where float32 itself has hardly more steps
///          between the nearest and the farthest than there are pixels
std::optional<DepthMarks> marks_of(const core::ImageF& depth, bool looks_straight_down) {
  std::vector<float> values;
  std::int64_t num_along_rows = 0, num_along_columns = 0;
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      const float value = depth(x, y);
      if (!std::isfinite(value)) continue;
      values.push_back(value);
      num_along_rows += x == 0 || depth(x - 1, y) != value ? 1 : 0;
      num_along_columns += y == 0 || depth(x, y - 1) != value ? 1 : 0;
    }
  constexpr std::size_t kEnough = 2000;
  if (values.size() < kEnough) return std::nullopt;
  const auto count = static_cast<double>(values.size());
  std::sort(values.begin(), values.end());
  const float least = values.front(), most = values.back();
  constexpr float kLevel = 0.99F;
  if (looks_straight_down && least > kLevel * most) return std::nullopt;
  constexpr double kMoreSteps = 4.0;
  const float next = std::nextafter(most, std::numeric_limits<float>::infinity());
  if (static_cast<double>(most - least) < kMoreSteps * count * static_cast<double>(next - most))
    return std::nullopt;
  const auto num_different =
      std::distance(values.begin(), std::unique(values.begin(), values.end()));
  std::int64_t num_at_most = 0;
  for (int y = 0; y + 1 < depth.height(); ++y)
    for (int x = 0; x + 1 < depth.width(); ++x)
      num_at_most +=
          depth(x, y) == most && depth(x + 1, y) == most && depth(x, y + 1) == most ? 1 : 0;
  return DepthMarks{static_cast<double>(std::min(num_along_rows, num_along_columns)) /
                        static_cast<double>(num_different),
                    static_cast<double>(num_at_most) / count, find_steps(depth)};
}

class DepthChecker : public Checker {
 public:
  explicit DepthChecker(const ValidateOptions& options) : options_(options) {}

  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    // Numbers of a kind are so in all frames alike: sorting some of them is enough.
    const int step = std::max(1, window.sequence().num_frames / 10);
    if (window.frame() % step != 0) return;
    const auto num_cameras = window.sequence().cameras.size();
    cameras_.resize(num_cameras);
    core::parallel_for(static_cast<std::int64_t>(num_cameras), [&](std::int64_t camera) {
      const std::optional<View> view = window.view(static_cast<int>(camera), window.frame());
      if (!view || view->image->depth.empty()) return;
      CameraMarks& marks = cameras_[static_cast<std::size_t>(camera)];
      const auto depths = view->image->depth.data();
      marks.sees_ground =
          marks.sees_ground || std::any_of(depths.begin(), depths.end(),
                                           [](float value) { return std::isfinite(value); });
      constexpr double kStraight = 1.0 - 1e-5;  // 0.26 deg
      const std::optional<DepthMarks> of_image = marks_of(
          view->image->depth, std::abs(view->local_from_camera.rotation(2, 2)) > kStraight);
      if (!of_image) return;
      if (of_image->steps) marks.in_steps.push_back(of_image->steps->share);
      marks.stretches_per_value.push_back(of_image->stretches_per_value);
      marks.at_most.push_back(of_image->share_at_most);
    });
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    CheckResult levels;
    levels.name = "depth_levels";
    levels.bound = 3.0;
    levels.unit = "stretches";
    levels.summary =
        "Stretches of pixels of one depth, to the bit, by different depths; along rows or columns, "
        "of which it is less; median of a camera's images.";
    levels.reason =
        "float32 tells depths of 100 m apart to 8 µm: nearly every pixel has its own, or, of level "
        "ground, every line.";
    levels.detects = "depth of 10 bits, or in steps of that size";

    CheckResult limit;
    limit.name = "depth_limit";
    limit.bound = 2e-3;
    limit.unit = "share";
    limit.summary =
        "Pixels that hold exactly the greatest depth of their image, as those to their right and "
        "below do: share of all with depth, median of a camera's images.";
    limit.reason = "The farthest ground is a pixel, or a line of them.";
    limit.detects = "depth that is clipped; sky that is written as a depth";

    CheckResult steps;
    steps.name = "depth_steps";
    steps.bound = 0.5;
    steps.unit = "share";
    steps.summary =
        "Different depths of an image that are whole steps of a metre's decimal or binary part, or "
        "have no more digits than a float of 16 bits; the steps that fit most of them, median of a "
        "camera's images.";
    steps.reason =
        "Of float32 one depth in twenty is such by chance, where float32's own steps are a "
        "twentieth of them: to 512 m of millimetres, to 8 km of centimetres.";
    steps.detects =
        "steps of a millimetre up to 512 m, of a centimetre up to 8 km; floats of 16 bits";

    const char* few =
        "fewer than 2000 depths, level ground from straight above, or depths as near to each other "
        "as float32 tells them";
    return {judged(levels, sequence, &CameraMarks::stretches_per_value, few),
            judged(limit, sequence, &CameraMarks::at_most, few),
            judged(steps, sequence, &CameraMarks::in_steps,
                   "fewer than 500 different depths, or level ground from straight above")};
  }

 private:
  /// What the images of one camera show, in any order.
  struct CameraMarks {
    bool sees_ground = false;
    std::vector<double> stretches_per_value, at_most, in_steps;
  };

  /// By the camera whose median is greatest; unseen where a camera that sees ground shows nothing of the kind.
  /// why   images of such a camera
  CheckResult judged(CheckResult result, const Sequence& sequence,
                     std::vector<double> CameraMarks::*marks, const char* why) {
    const bool has_depth =
        std::any_of(sequence.cameras.begin(), sequence.cameras.end(), [](const Camera& camera) {
          return std::any_of(camera.files.begin(), camera.files.end(),
                             [](const FrameFiles& files) { return !files.depth.empty(); });
        });
    if (!has_depth) return skipped_result(result.name, "the dataset holds no depth");
    std::vector<std::string> untold;
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      std::vector<double>& values = cameras_[i].*marks;
      if (!values.empty())
        note_worst(result, median(values), sequence.cameras[i].name);
      else if (cameras_[i].sees_ground)
        untold.push_back(sequence.cameras[i].name);
    }
    if (result.worst.empty() && untold.empty())
      return unseen_result(result.name, "no image shows ground");
    result.ok = result.worst.empty() || result.is_within_bound();
    if (result.ok && !untold.empty() && !options_.is_trial) {
      result.is_unseen = result.skipped = result.is_of_all = true;
      result.worst = fmt::format("images of {} have {}", fmt::join(untold, ", "), why);
    }
    return result;
  }

  ValidateOptions options_;
  std::vector<CameraMarks> cameras_;
};

}  // namespace

std::unique_ptr<Checker> make_depth_check(const ValidateOptions& options) {
  return std::make_unique<DepthChecker>(options);
}

}  // namespace terracast::validate
