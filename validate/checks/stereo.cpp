#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/pictures.h"
#include "validate/sampling.h"

/// A rectified pair: disparity x depth = focal length x baseline, and the right image carried by
/// the disparity against the left one. Where the format stores no disparity the one of depth is
/// used for the images.
namespace terracast::validate {

namespace {

class StereoChecker : public Checker {
 public:
  explicit StereoChecker(const ValidateOptions& options) : options_(options) {}

  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    if (!window.sequence().stereo) return;
    const StereoPair& stereo = *window.sequence().stereo;
    const std::optional<View> left = window.view(stereo.left, window.frame());
    const std::optional<View> right = window.view(stereo.right, window.frame());
    if (!left || !right || left->image->depth.empty()) return;
    ++num_frames_;
    const Intrinsics& k = left->camera->intrinsics;
    const double product = k.fx_px * stereo.baseline_m;
    // Rectified images of one height differ by the disparity and by what their principal points
    // differ.
    const double offset_px = k.cx_px - right->camera->intrinsics.cx_px;
    LoadedImage matched;
    matched.grey = left->image->grey;
    matched.disparity = left->image->disparity;
    const bool is_stored = !matched.disparity.empty();
    if (is_stored) {
      ++num_stored_;
      compare_disparity(*left, product, offset_px);
    } else {
      matched.disparity = left->image->depth;
      for (float& value : matched.disparity.data())
        value = static_cast<float>(product / static_cast<double>(value) + offset_px);
    }
    View seen = *left;
    seen.image = &matched;
    const std::int64_t count = std::max<std::int64_t>(options_.samples_per_image / 4, 1);
    const std::vector<Eigen::Vector2i> pixels = draw_pixels(k, count, options_, *left, 1ULL << 41);
    std::vector<std::optional<PatchMatch>> matches(pixels.size());
    core::parallel_for_blocks(static_cast<std::int64_t>(pixels.size()), 64,
                              [&](std::int64_t begin, std::int64_t end) {
                                for (std::int64_t i = begin; i < end; ++i) {
                                  const Eigen::Vector2i& at = pixels[static_cast<std::size_t>(i)];
                                  matches[static_cast<std::size_t>(i)] =
                                      match_patch_by_disparity(seen, *right, at.x(), at.y());
                                }
                              });
    for (const auto& match : matches)
      if (match && match->has_converged) {
        shift_x_.push_back(match->shift_px.x());
        shift_y_.push_back(match->shift_px.y());
      }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    if (!sequence.stereo || num_frames_ == 0)
      return {skipped_result("stereo", "the format holds no rectified pair with depth")};
    std::vector<CheckResult> results;
    if (num_stored_ > 0) {
      CheckResult disparity;
      disparity.name = "stereo_disparity";
      disparity.value = worst_px_;
      disparity.bound = 0.5 / 256.0 + 1e-4;
      disparity.unit = "px";
      // Where none is stored there is no limit below which they may be left out.
      const double limit_px = num_pixels_ > 0 ? least_stored_px_ : 0.0;
      if (greatest_left_out_px_ > limit_px + 1.0 / 256.0 &&
          greatest_left_out_px_ > disparity.value) {
        disparity.value = greatest_left_out_px_;
        worst_place_ =
            fmt::format("{}: no disparity, though {} stored", left_out_place_,
                        num_pixels_ > 0 ? "smaller ones are" : "depth is there and none at all is");
      }
      disparity.ok = disparity.is_within_bound();
      disparity.worst = worst_place_;
      disparity.summary = fmt::format(
          "Largest |disparity - f b / depth| over {} pixels of {} frames; f b = {:.6g} px m. {} "
          "pixels "
          "with depth are left out, all of them smaller than the least that is stored.",
          num_pixels_, num_stored_,
          sequence.cameras[static_cast<std::size_t>(sequence.stereo->left)].intrinsics.fx_px *
              sequence.stereo->baseline_m,
          num_left_out_);
      disparity.reason = "The format rounds to 1/256 px: half a step, and rounding of float32.";
      disparity.detects = "two counts of 1/256 px in one pixel, a pixel or all of them missing";
      results.push_back(std::move(disparity));

      const auto percent_of = [&](double sum) {
        return 100.0 * sum / std::max(sum_square_, 1e-300);
      };
      const double scale_percent = percent_of(sum_product_);
      // What this estimate comes to where every depth errs by the smallest error that must be found.
      const double least_seen_percent =
          std::min(percent_of(sum_when_larger_), -percent_of(sum_when_smaller_));
      CheckResult scale;
      scale.name = "stereo_scale";
      scale.value = std::abs(scale_percent);
      scale.bound = 50.0 * kLeastFactor;
      scale.unit = "%";
      // With a fifth to spare: an error that only just reached the bound would pass as often as not.
      scale.skipped = scale.is_unseen = least_seen_percent < 1.2 * scale.bound;
      scale.ok = scale.skipped || scale.is_within_bound();
      scale.worst = scale.skipped ? fmt::format("too few steps: 0.1 % would look like {:.3f} %",
                                                std::max(least_seen_percent, 0.0))
                                  : fmt::format("{:+.4f} %", scale_percent);
      scale.summary = fmt::format(
          "The factor between stored disparities and f b / depth in steps of 1/256 px that fits "
          "all "
          "pixels best (least squares), less 1. 0.1 % would show as {:.3f} %.",
          std::max(least_seen_percent, 0.0));
      scale.reason = "Half the smallest error that must be found.";
      scale.detects = "0.1 % of baseline, focal length or depth";
      results.push_back(std::move(scale));
    }
    constexpr std::size_t kEnough = 100;
    if (shift_x_.size() < kEnough) {
      for (const char* name : {"stereo_shift", "stereo_vertical"})
        results.push_back(
            unseen_result(name, "fewer than 100 patches have contrast: colours were not checked"));
      return results;
    }
    const double scatter = [&] {
      std::vector<double> sizes;
      for (const double value : shift_x_) sizes.push_back(std::abs(value));
      return median(sizes);
    }();
    const auto result_of = [&](const char* name, std::vector<double>& shifts, const char* summary,
                               const char* detects) {
      CheckResult result;
      result.name = name;
      const MedianEstimate shift = estimate_median(shifts);
      result.bound = 0.1;
      result.value = shift.judged();
      result.unit = "px";
      result.ok = result.is_within_bound();
      result.skipped = result.is_unseen = result.ok && !shift.tells(result.bound);
      result.worst = result.skipped ? "patches scatter too much for their number: " : std::string();
      result.worst += fmt::format("median {:+.4f} ± {:.2f} px of {} patches", shift.median,
                                  shift.unsure, shifts.size());
      result.summary =
          fmt::format("{} Median of {} patches of 7 x 7 pixels; one patch scatters by {:.3f} px.",
                      summary, shifts.size(), scatter);
      result.reason =
          "Medians of hundreds of patches are known to about 0.01 px. Where five standard errors "
          "exceed the bound, only what is beyond them counts.";
      result.detects = detects;
      return result;
    };
    results.push_back(result_of("stereo_shift", shift_x_,
                                "Left patches against the right image at x - disparity, along x.",
                                "0.2 px between the images along x"));
    results.push_back(result_of("stereo_vertical", shift_y_,
                                "The same along y: rectified pairs have none.",
                                "0.2 px between rows: a pair that is not rectified"));
    return results;
  }

 private:
  void compare_disparity(const View& left, double product, double offset_px) {
    const core::ImageF& depth = left.image->depth;
    const core::ImageF& disparity = left.image->disparity;
    const int step = options_.is_trial ? 8 : 1;
    for (int y = step / 2; y < depth.height(); y += step)
      for (int x = step / 2; x < depth.width(); x += step) {
        const auto depth_m = static_cast<double>(left.image->depth_at(x, y));
        const auto stored = static_cast<double>(disparity(x, y));
        if (!std::isfinite(depth_m) && !std::isfinite(stored)) continue;
        const double expected = product / depth_m + offset_px;
        // An exporter may leave out what 1/256 px is too coarse for, or what 16 bits cannot hold:
        // below one limit all, above it none.
        constexpr double kMost_px = 65535.0 / 256.0;
        if (!std::isfinite(stored)) {
          ++num_left_out_;
          if (expected < kMost_px && expected > greatest_left_out_px_) {
            greatest_left_out_px_ = expected;
            left_out_place_ = place_of(left, x, y);
          }
          continue;
        }
        least_stored_px_ = std::min(least_stored_px_, stored);
        ++num_pixels_;
        double size = std::abs(stored - expected);
        if (!std::isfinite(size)) size = stored;  // a disparity where there is no depth
        if (size > worst_px_) {
          worst_px_ = size;
          worst_place_ = fmt::format("{}: {:.5f} px stored, {:.5f} px by the depth {:.6g} m",
                                     place_of(left, x, y), stored, expected, depth_m);
        }
        if (!std::isfinite(depth_m)) continue;
        const double base = expected - offset_px;
        // Rounding leans where the disparities of a scene are spread unevenly over a step, so both
        // sides are rounded.
        const auto in_steps = [&](double px) {
          return std::round(256.0 * (px + offset_px)) / 256.0;
        };
        const double rounded = in_steps(base);
        sum_product_ += base * (stored - rounded);
        sum_when_larger_ += base * (in_steps(base * (1.0 + kLeastFactor)) - rounded);
        sum_when_smaller_ += base * (in_steps(base * (1.0 - kLeastFactor)) - rounded);
        sum_square_ += base * base;
      }
  }

  ValidateOptions options_;
  std::int64_t num_frames_ = 0;
  std::int64_t num_stored_ = 0;  ///< of those, with a disparity image
  std::int64_t num_pixels_ = 0;
  double worst_px_ = 0.0;
  std::string worst_place_;
  std::int64_t num_left_out_ = 0;
  double greatest_left_out_px_ = 0.0;
  std::string left_out_place_;
  double least_stored_px_ = std::numeric_limits<double>::infinity();
  static constexpr double kLeastFactor = 1e-3;  ///< the smallest that must be found
  double sum_product_ = 0.0;
  double sum_when_larger_ = 0.0, sum_when_smaller_ = 0.0;
  double sum_square_ = 0.0;
  std::vector<double> shift_x_, shift_y_;
};

}  // namespace

std::unique_ptr<Checker> make_stereo_check(const ValidateOptions& options) {
  return std::make_unique<StereoChecker>(options);
}

}  // namespace terracast::validate
