#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "validate/checks/checker.h"
#include "validate/null_distribution.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// What bounds.csv says that depth and flow may err by, against the depths that are there.
namespace terracast::validate {

namespace {

/// Half a step of double, at most, and of float32, at least; relative.
constexpr double kDoubleRounding = 0x1.0p-53;
constexpr double kFloatRounding = 0x1.0p-25;
/// What the error analysis (capture/label_bounds.h) counts of every depth at least: 8.5 roundings from the
/// plane to the range, 6.5 from pixel and range to the depth. Slanted ground adds to them.
constexpr double kDepthRoundings = 15.0;
/// Of every flow: the projection's product and sum, at the size of the image.
constexpr double kFlowRoundings = 2.0;

/// The most of the values that is sure to be bounded, where any so many of them may be left out; 0 where
/// all may be.
double largest_but(std::vector<double>& values, std::int64_t num_left_out) {
  if (static_cast<std::int64_t>(values.size()) <= num_left_out) return 0.0;
  const auto at = values.begin() + num_left_out;
  std::nth_element(values.begin(), at, values.end(), std::greater<>());
  return *at;
}

/// Lengths of the flow of all pixels, or of each `step`-th both ways, that come to lie in the other image, px;
/// less what depths and poses of the files leave unsure.
std::vector<double> flow_lengths_px(const View& from, const View& to, int step) {
  constexpr double kUnsure_px = 0.01;
  std::vector<double> lengths;
  const Intrinsics& k_from = from.camera->intrinsics;
  const Intrinsics& k_to = to.camera->intrinsics;
  const Transfer transfer(from, to);
  for (int y = step / 2; y < k_from.height_px; y += step)
    for (int x = step / 2; x < k_from.width_px; x += step) {
      const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
      const auto depth_m = static_cast<double>(from.image->depth(x, y));
      const bool is_sky = !std::isfinite(depth_m);
      const auto place = is_sky ? transfer.direction(pixel) : transfer.point(pixel, depth_m);
      // So near the other camera float32 depth tells no flow.
      if (!place || !(place->distance_b_m > 0.05 * (is_sky ? 1.0 : depth_m))) continue;
      const Eigen::Vector2d& target = place->pixel;
      if (k_to.contains(target, kUnsure_px))
        lengths.push_back(std::max(0.0, (target - pixel).norm() - kUnsure_px));
    }
  return lengths;
}

const StatedBounds* stated_of(const View& view) {
  const auto frame = static_cast<std::size_t>(view.frame);
  const auto& bounds = view.camera->bounds;
  return frame < bounds.size() && bounds[frame] ? &*bounds[frame] : nullptr;
}

bool is_empty(double error, double rounding) { return std::isnan(error) && std::isnan(rounding); }

/// Most that edges take of ground alone, and of thickets: fifteen silhouettes through each pixel, each met by a
/// shift of 0.001 px in four directions.
constexpr double kMostEdges = 1e-3;
constexpr double kMostEdgesOfThickets = 0.06;

/// Pixels in thickets: there depth zigzags from pixel to pixel, and so it does at six and more of the eight around.
/// Inverse depth, linear on a plane, departs from the line through the two pixels beside (one above the other) by
/// more than what an image resolves, to one side at a pixel and to the other side at the next. A smooth hill bends
/// to one side; a silhouette, which is a line, takes six of nine pixels at most.
std::int64_t num_thicket_pixels(const core::ImageF& depth) {
  constexpr double kMostBend = 4.0 * kResolvedRoughness;  // roughness is a quarter of it
  constexpr int kLeast = 7;
  const int width = depth.width(), height = depth.height();
  core::Image8 is_broken(width, height, 1, 0);
  /// Marks the zigzags of one row or column.
  const auto mark = [&](int count, const auto& x_of, const auto& y_of) {
    const auto inverse = [&](int i) {
      const float depth_m = depth(x_of(i), y_of(i));
      return std::isnan(depth_m) ? 0.0 : 1.0 / static_cast<double>(depth_m);
    };
    int last = 0;  // to which side it bent at the pixel before
    for (int i = 1; i + 1 < count; ++i) {
      const double bend = inverse(i - 1) - 2.0 * inverse(i) + inverse(i + 1);
      const int side = std::abs(bend) <= kMostBend * inverse(i) ? 0 : bend > 0.0 ? 1 : -1;
      if (side * last < 0) is_broken(x_of(i), y_of(i)) = is_broken(x_of(i - 1), y_of(i - 1)) = 1;
      last = side;
    }
  };
  for (int y = 0; y < height; ++y)
    mark(
        width, [](int i) { return i; }, [y](int) { return y; });
  for (int x = 0; x < width; ++x)
    mark(
        height, [x](int) { return x; }, [](int i) { return i; });
  std::int64_t count = 0;
  for (int y = 1; y + 1 < height; ++y)
    for (int x = 1; x + 1 < width; ++x) {
      int around = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) around += is_broken(x + dx, y + dy);
      if (is_broken(x, y) != 0 && around >= kLeast) ++count;
    }
  return count;
}

class BoundsChecker : public Checker {
 public:
  BoundsChecker() {
    depth_.name = "bounds_depth";
    depth_.bound = 1e-6;
    depth_.unit = "of depth";
    arithmetic_.name = "bounds_arithmetic";
    arithmetic_.bound = 1.0;
    arithmetic_.unit = "of stated";
    rounding_.name = "bounds_rounding";
    rounding_.bound = 1.0;
    rounding_.unit = "of stated";
    flow_.name = "bounds_flow";
    flow_.bound = 1e-3;
    flow_.unit = "px";
    left_out_.name = "bounds_left_out";
    left_out_.bound = kMostEdges;
    left_out_.unit = "share";
  }

  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    const Sequence& sequence = window.sequence();
    for (int i = 0; i < static_cast<int>(sequence.cameras.size()); ++i) {
      const Camera& camera = sequence.cameras[static_cast<std::size_t>(i)];
      const auto frame = static_cast<std::size_t>(window.frame());
      if (frame < camera.bounds.size() && camera.bounds[frame])
        add_image(camera, *camera.bounds[frame],
                  fmt::format("{}, frame {}", camera.name, window.frame()));
      const std::optional<View> now = window.view(i, window.frame());
      const std::optional<View> before = window.view(i, window.frame() - 1);
      if (now) compare_depth(*now);
      if (!now || !before) continue;
      compare_flow(*now, *before);
      compare_flow(*before, *now);
    }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence&) override {
    if (num_images_ == 0) {
      std::vector<CheckResult> skipped;
      for (const CheckResult* result : {&depth_, &arithmetic_, &rounding_, &flow_, &left_out_})
        skipped.push_back(skipped_result(result->name, "the dataset states no bounds"));
      return skipped;
    }
    depth_.summary = fmt::format(
        "Running error analysis bounds what arithmetic makes wrong in the depths of {} images: "
        "{:.2g} mm; "
        "keeping them as float32 adds {:.2g} mm. The worst image's sum, over its largest depth.",
        num_depths_, depth_error_mm_, depth_rounding_mm_);
    depth_.reason =
        "Twice half a step of float32 is 1.2e-7; rays that graze the ground may err by as much "
        "again.";
    depth_.detects = "a figure ten times too large, images whose depths have none";
    arithmetic_.summary = fmt::format(
        "The least that arithmetic in doubles may leave, over the error that is stated: {:.0f} "
        "roundings of the largest depth of {} images, {:.0f} of the image's size in {} flows.",
        kDepthRoundings, num_depths_, kFlowRoundings, num_flows_);
    arithmetic_.reason = "Every depth and every flow comes by so many roundings at least.";
    arithmetic_.detects = "an error of 0, of another unit";
    rounding_.summary = fmt::format(
        "Half a step of float32 at the largest depth of {} images and at the longest of {} flows, "
        "and half a step of flow that is kept in steps, over the rounding that is stated.",
        num_depths_, num_flows_);
    rounding_.reason = "Less cannot be stated of what is kept so.";
    rounding_.detects =
        "bounds of another dataset, of other units; flow in steps that is called float32";
    flow_.summary = fmt::format(
        "Bounds on the flow from and to the frames beside, where a point is in both images: {:.2g} "
        "px by "
        "arithmetic, {:.2g} px by keeping ranges and flow; their sum, less half a step both ways "
        "of "
        "flow that is kept in steps.",
        flow_error_px_, flow_rounding_px_);
    flow_.reason = "A fifth of what the check of flow allows.";
    flow_.detects = "images whose flow has no bound";
    const double thickets = static_cast<double>(num_in_thickets_) /
                            static_cast<double>(std::max<std::int64_t>(num_looked_at_, 1));
    left_out_.summary = fmt::format(
        "Of {} pixels {} are at an edge, and bounds say nothing of them. {:.2g} of the "
        "pixels stand in thickets, where depth zigzags from pixel to pixel.",
        num_pixels_, num_left_out_, thickets);
    judge_left_out();
    left_out_.reason =
        "Edges are lines, and count when they pass within 1e-3 px of a pixel's centre. On ground "
        "they "
        "are few: 0.1 %; in thickets, leaves may cross a pixel fifteen times: 6 %. The bound is "
        "what such shares leave of "
        "as many pixels with a probability of 1e-9.";
    for (CheckResult* result : {&depth_, &arithmetic_, &rounding_, &flow_, &left_out_})
      result->ok = result->is_within_bound();
    if (num_depths_ == 0)
      depth_ = unseen_result(depth_.name, "no ground is seen, or there are no depths");
    if (num_depths_ + num_flows_ == 0)
      for (CheckResult* result : {&arithmetic_, &rounding_})
        *result = unseen_result(result->name, "no ground is seen, or there are no depths");
    if (num_stated_flows_ + num_flows_ == 0)
      flow_ = unseen_result(flow_.name, "no point is seen in two frames");
    return {depth_, arithmetic_, rounding_, flow_, left_out_};
  }

 private:
  /// Formats without depth do not tell where thickets are: what only they explain is not judged there.
  void judge_left_out() {
    const double of_looked_at = static_cast<double>(std::max<std::int64_t>(num_looked_at_, 1));
    const double thickets =
        num_looked_at_ > 0 ? static_cast<double>(num_in_thickets_) / of_looked_at : 1.0;
    const double share = std::min(kMostEdges + kMostEdgesOfThickets * thickets, 1.0);
    const std::int64_t total = std::max<std::int64_t>(num_pixels_, 1);
    const auto of_all = [&](std::int64_t count) {
      return static_cast<double>(count) / static_cast<double>(total);
    };
    left_out_.value = of_all(num_left_out_);
    left_out_.bound = of_all(binomial_quantile(kFalseVerdict, total, share));
    left_out_.probability = binomial_tail(num_left_out_, total, share);
    left_out_.smallest = left_out_.bound;
    if (num_looked_at_ > 0 || !left_out_.is_within_bound()) return;
    if (binomial_tail(num_left_out_, total, kMostEdges) >= kFalseVerdict) return;
    left_out_.is_unseen = left_out_.skipped = true;
    left_out_.worst = "the format holds no depth: whether thickets have so many edges is not known";
  }

  void add_image(const Camera& camera, const StatedBounds& stated, const std::string& where) {
    ++num_images_;
    num_pixels_ += stated.num_pixels;
    num_left_out_ += stated.num_left_out;
    depth_error_mm_ = std::fmax(depth_error_mm_, stated.depth_error_mm);
    depth_rounding_mm_ = std::fmax(depth_rounding_mm_, stated.depth_rounding_mm);
    if (is_empty(stated.flow_error_px, stated.flow_rounding_px)) return;
    ++num_stated_flows_;
    flow_error_px_ = std::fmax(flow_error_px_, stated.flow_error_px);
    flow_rounding_px_ = std::fmax(flow_rounding_px_, stated.flow_rounding_px);
    const double beyond_steps_px = stated.flow_rounding_px - camera.flow_rounding_px();
    note_worst(flow_, stated.flow_error_px + (beyond_steps_px < 0.0 ? 0.0 : beyond_steps_px),
               where);
  }

  /// A stated figure may not be below the least that is possible. Of one that is missing the checks of depth
  /// and flow tell.
  static void note_least(CheckResult& result, double least, double stated,
                         const std::string& where) {
    if (least > 0.0 && !std::isnan(stated)) note_worst(result, least / stated, where);
  }

  void compare_depth(const View& view) {
    const StatedBounds* stated = stated_of(view);
    if (stated == nullptr) return;
    if (stated->num_left_out > 0) num_in_thickets_ += num_thicket_pixels(view.image->depth);
    num_looked_at_ += static_cast<std::int64_t>(view.image->depth.data().size());
    std::vector<double> depths_mm;
    const core::ImageF& depth = view.image->depth;
    const Intrinsics& camera = view.camera->intrinsics;
    for (int y = 0; y < depth.height(); ++y)
      for (int x = 0; x < depth.width(); ++x) {
        if (std::isnan(depth(x, y))) continue;
        // Bounds are of depth along the optical axis, whatever the images hold.
        const double along =
            camera.plane ? std::abs(camera.ray_from_pixel({x + 0.5, y + 0.5}).z()) : 1.0;
        depths_mm.push_back(1e3 * along * static_cast<double>(depth(x, y)));
      }
    if (depths_mm.empty()) return;
    const double largest_mm = *std::max_element(depths_mm.begin(), depths_mm.end());
    const double bounded_mm = largest_but(depths_mm, stated->num_left_out);
    // All ground that is seen may be among the pixels left out.
    if (bounded_mm == 0.0 && is_empty(stated->depth_error_mm, stated->depth_rounding_mm)) return;
    ++num_depths_;
    // NaN, where an image with depths has no bound, counts as the worst.
    note_worst(depth_, (stated->depth_error_mm + stated->depth_rounding_mm) / largest_mm,
               place_of(view));
    note_least(arithmetic_, kDepthRoundings * kDoubleRounding * bounded_mm, stated->depth_error_mm,
               place_of(view));
    note_least(rounding_, kFloatRounding * bounded_mm, stated->depth_rounding_mm, place_of(view));
  }

  void compare_flow(const View& from, const View& to) {
    const StatedBounds* stated = stated_of(from);
    if (stated == nullptr || from.image->depth.empty()) return;
    const bool is_missing = std::isnan(stated->flow_error_px + stated->flow_rounding_px);
    std::vector<double> lengths_px = flow_lengths_px(from, to, is_missing ? 1 : kFlowStep);
    if (static_cast<std::int64_t>(lengths_px.size()) <= stated->num_left_out) return;
    ++num_flows_;
    if (is_missing)
      note_worst(flow_, stated->flow_error_px + stated->flow_rounding_px, place_of(from));
    const Camera& camera = *from.camera;
    note_least(arithmetic_,
               kFlowRoundings * kDoubleRounding *
                   std::hypot(to.camera->intrinsics.width_px, to.camera->intrinsics.height_px),
               stated->flow_error_px, place_of(from));
    const bool is_in_steps = !camera.files[static_cast<std::size_t>(from.frame)].flow.empty();
    note_least(rounding_,
               kFloatRounding * largest_but(lengths_px, stated->num_left_out) +
                   (is_in_steps ? camera.flow_rounding_px() : 0.0),
               stated->flow_rounding_px, place_of(from));
  }

  /// Where flow has bounds, a share of the pixels tells its length.
  static constexpr int kFlowStep = 4;
  CheckResult depth_, arithmetic_, rounding_, flow_, left_out_;
  std::int64_t num_in_thickets_ = 0, num_looked_at_ = 0;  ///< pixels of depth
  std::int64_t num_images_ = 0, num_pixels_ = 0, num_left_out_ = 0;
  std::int64_t num_depths_ = 0, num_flows_ = 0, num_stated_flows_ = 0;
  double depth_error_mm_ = 0.0, depth_rounding_mm_ = 0.0;
  double flow_error_px_ = 0.0, flow_rounding_px_ = 0.0;
};

}  // namespace

std::unique_ptr<Checker> make_bounds_check(const ValidateOptions&) {
  return std::make_unique<BoundsChecker>();
}

}  // namespace terracast::validate
