#include <fmt/format.h>

#include <algorithm>
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
/// returns  nothing of few depths, of one alone (level ground from straight above), and where float32 itself has hardly
///          more steps between the nearest and the farthest than there are pixels
std::optional<DepthMarks> marks_of(const core::ImageF& depth) {
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
    const int step = std::max(1, window.sequence().num_frames / 20);
    if (window.frame() % step != 0) return;
    const auto num_cameras = window.sequence().cameras.size();
    std::vector<std::optional<DepthMarks>> marks(num_cameras);
    core::parallel_for(static_cast<std::int64_t>(num_cameras), [&](std::int64_t camera) {
      const std::optional<View> view = window.view(static_cast<int>(camera), window.frame());
      // On level ground all that a camera sees straight below is equally deep.
      constexpr double kStraight = 1.0 - 1e-5;  // 0.26 deg
      if (!view || view->image->depth.empty()) return;
      if (std::abs(view->local_from_camera.rotation(2, 2)) > kStraight) return;
      marks[static_cast<std::size_t>(camera)] = marks_of(view->image->depth);
    });
    for (std::size_t camera = 0; camera < num_cameras; ++camera) {
      if (!marks[camera]) continue;
      if (marks[camera]->steps) shares_in_steps_.push_back(marks[camera]->steps->share);
      stretches_per_value_.push_back(marks[camera]->stretches_per_value);
      share_at_most_.push_back(marks[camera]->share_at_most);
      if (marks[camera]->share_at_most < worst_share_ && !worst_place_.empty()) continue;
      worst_share_ = marks[camera]->share_at_most;
      worst_place_ = fmt::format("{}, frame {}: {:.2g}", window.sequence().cameras[camera].name,
                                 window.frame(), worst_share_);
    }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    const bool has_depth =
        std::any_of(sequence.cameras.begin(), sequence.cameras.end(), [](const Camera& camera) {
          return std::any_of(camera.files.begin(), camera.files.end(),
                             [](const FrameFiles& files) { return !files.depth.empty(); });
        });
    const auto none = has_depth ? unseen_result : skipped_result;
    const auto why_none = [&](const char* why) {
      return has_depth ? why : "the dataset holds no depth";
    };
    std::vector<CheckResult> results;
    if (stretches_per_value_.empty()) {
      const char* why = why_none("no image has 2000 depths off level ground seen from above");
      results = {none("depth_levels", why), none("depth_limit", why)};
    } else {
      results = {levels_result(), limit_result()};
    }
    results.push_back(shares_in_steps_.empty()
                          ? none("depth_steps", why_none("no image has 500 different depths"))
                          : steps_result());
    return results;
  }

 private:
  CheckResult levels_result() {
    CheckResult levels;
    levels.name = "depth_levels";
    levels.value = median(stretches_per_value_);
    levels.bound = 3.0;
    levels.unit = "stretches";
    levels.ok = levels.is_within_bound();
    levels.summary =
        "Stretches of pixels of one depth, to the bit, by different depths; along rows or columns, "
        "of which it is less; median of the images.";
    levels.reason =
        "float32 tells depths of 100 m apart to 8 µm: nearly every pixel has its own, or, of level "
        "ground, every line.";
    levels.detects = "depth of 10 bits, or in steps of that size";
    return levels;
  }

  CheckResult limit_result() {
    CheckResult limit;
    limit.name = "depth_limit";
    limit.value = median(share_at_most_);
    limit.bound = 2e-3;
    limit.unit = "share";
    limit.ok = limit.is_within_bound();
    limit.worst = worst_place_;
    limit.summary =
        "Pixels that hold exactly the greatest depth of their image, as those to their right and "
        "below do: share of all with depth, median of the images.";
    limit.reason = "The farthest ground is a pixel, or a line of them.";
    limit.detects = "depth that is clipped; sky that is written as a depth";
    return limit;
  }

  CheckResult steps_result() {
    CheckResult steps;
    steps.name = "depth_steps";
    steps.value = median(shares_in_steps_);
    steps.bound = 0.5;
    steps.unit = "share";
    steps.ok = steps.is_within_bound();
    steps.summary =
        "Different depths of an image that are whole steps of a metre's decimal or binary part, or "
        "have no more digits "
        "than a float of 16 bits; the steps that fit most of them, median of the images.";
    steps.reason =
        "Of float32 one depth in twenty is such by chance, where float32's own steps are a "
        "twentieth of them: to 512 m of millimetres, to 8 km of centimetres.";
    steps.detects =
        "steps of a millimetre up to 512 m, of a centimetre up to 8 km; floats of 16 bits";
    return steps;
  }

  ValidateOptions options_;
  std::vector<double> shares_in_steps_;
  std::vector<double> stretches_per_value_, share_at_most_;
  double worst_share_ = 0.0;
  std::string worst_place_;
};

}  // namespace

std::unique_ptr<Checker> make_depth_check(const ValidateOptions& options) {
  return std::make_unique<DepthChecker>(options);
}

}  // namespace terracast::validate
