#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "validate/checks/checker.h"

/// What bounds.csv says that depth and flow may err by, against the depths that are there.
namespace terracast::validate {

namespace {

/// Half a step of float32, relative.
constexpr double kHalfStep = 0x1.0p-24;

class BoundsChecker : public Checker {
 public:
  BoundsChecker() {
    depth_.name = "bounds_depth";
    depth_.bound = 1e-6;
    depth_.unit = "of depth";
    rounding_.name = "bounds_rounding";
    rounding_.bound = 1.0;
    rounding_.unit = "of stated";
    flow_.name = "bounds_flow";
    flow_.bound = 1e-3;
    flow_.unit = "px";
    left_out_.name = "bounds_left_out";
    left_out_.bound = 1e-3;
    left_out_.unit = "share";
  }

  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    const Sequence& sequence = window.sequence();
    for (int i = 0; i < static_cast<int>(sequence.cameras.size()); ++i) {
      const Camera& camera = sequence.cameras[static_cast<std::size_t>(i)];
      const auto frame = static_cast<std::size_t>(window.frame());
      if (frame >= camera.bounds.size() || !camera.bounds[frame]) continue;
      const StatedBounds& stated = *camera.bounds[frame];
      add_image(stated, fmt::format("{}, frame {}", camera.name, window.frame()));
      const std::optional<View> view = window.view(i, window.frame());
      if (view && !view->image->depth.empty()) compare_depth(stated, *view);
    }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence&) override {
    if (num_images_ == 0) {
      std::vector<CheckResult> skipped;
      for (const CheckResult* result : {&depth_, &rounding_, &flow_, &left_out_})
        skipped.push_back(skipped_result(result->name, "the dataset states no bounds"));
      return skipped;
    }
    depth_.summary = fmt::format(
        "Running error analysis bounds what arithmetic makes wrong in the depths of {} images: "
        "{:.2g} mm; "
        "keeping them as float32 adds {:.2g} mm. The worst image's sum, over its largest depth.",
        num_images_, depth_error_mm_, depth_rounding_mm_);
    depth_.reason =
        "Twice half a step of float32 is 1.2e-7; rays that graze the ground may err by as much "
        "again.";
    rounding_.summary =
        "Half a step of float32 at the largest depth of each image, over the rounding that is "
        "stated.";
    rounding_.reason = "Less cannot be stated of what is kept as float32.";
    rounding_.detects = "bounds of another dataset, of other units";
    flow_.summary = fmt::format(
        "Bounds on the flow from and to the frames beside, where a point is in both images: {:.2g} "
        "px by "
        "arithmetic, {:.2g} px by keeping ranges and flow as float32.",
        flow_error_px_, flow_rounding_px_);
    flow_.reason = "A fifth of what the check of flow allows.";
    left_out_.summary =
        fmt::format("Of {} pixels {} are at an edge, and bounds say nothing of them.", num_pixels_,
                    num_left_out_);
    left_out_.value = static_cast<double>(num_left_out_) /
                      static_cast<double>(std::max<std::int64_t>(num_pixels_, 1));
    left_out_.reason =
        "Edges are lines, and count when they pass within 1e-3 px of a pixel's centre.";
    std::vector<CheckResult> results{depth_, rounding_, flow_, left_out_};
    if (!has_depth_)
      for (const std::size_t i : {0, 1})
        results[i] = unseen_result(results[i].name, "no ground is seen, or there are no depths");
    if (!has_flow_) results[2] = unseen_result(flow_.name, "no point is seen in two frames");
    for (CheckResult& result : results)
      if (!result.skipped) result.ok = result.is_within_bound();
    return results;
  }

 private:
  void add_image(const StatedBounds& stated, const std::string& where) {
    ++num_images_;
    num_pixels_ += stated.num_pixels;
    num_left_out_ += stated.num_left_out;
    if (!std::isnan(stated.depth_error_mm)) {
      depth_error_mm_ = std::max(depth_error_mm_, stated.depth_error_mm);
      depth_rounding_mm_ = std::max(depth_rounding_mm_, stated.depth_rounding_mm);
    }
    if (std::isnan(stated.flow_error_px)) return;
    has_flow_ = true;
    flow_error_px_ = std::max(flow_error_px_, stated.flow_error_px);
    flow_rounding_px_ = std::max(flow_rounding_px_, stated.flow_rounding_px);
    note_worst(flow_, stated.flow_error_px + stated.flow_rounding_px, where);
  }

  void compare_depth(const StatedBounds& stated, const View& view) {
    double largest_m = 0.0;
    for (const float depth_m : view.image->depth.data())
      if (!std::isnan(depth_m)) largest_m = std::max(largest_m, static_cast<double>(depth_m));
    if (largest_m == 0.0) return;
    has_depth_ = true;
    const double largest_mm = 1e3 * largest_m;
    // NaN, where an image with depths has no bound, counts as the worst.
    note_worst(depth_, (stated.depth_error_mm + stated.depth_rounding_mm) / largest_mm,
               place_of(view));
    // A step is between 1 and 2 times 2^-23 of the value.
    note_worst(rounding_, 0.5 * kHalfStep * largest_mm / stated.depth_rounding_mm, place_of(view));
  }

  CheckResult depth_, rounding_, flow_, left_out_;
  std::int64_t num_images_ = 0, num_pixels_ = 0, num_left_out_ = 0;
  double depth_error_mm_ = 0.0, depth_rounding_mm_ = 0.0;
  double flow_error_px_ = 0.0, flow_rounding_px_ = 0.0;
  bool has_depth_ = false, has_flow_ = false;
};

}  // namespace

std::unique_ptr<Checker> make_bounds_check(const ValidateOptions&) {
  return std::make_unique<BoundsChecker>();
}

}  // namespace terracast::validate
