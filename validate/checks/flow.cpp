#include <fmt/format.h>

#include <limits>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/evidence.h"
#include "validate/flow_rules.h"
#include "validate/null_distribution.h"
#include "validate/pictures.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// Stored flow against flow from depth, poses and intrinsics, both ways; its masks against the
/// image's border and the depth.
namespace terracast::validate {

namespace {

/// Of flow, besides its steps: what float32 and poses of nine digits leave is less than a fifth of it.
constexpr double kFlowTolerance_px = 5e-3;

/// One direction of one flow file.
struct Direction {
  ViewPair pair;
  const core::ImageF* flow;
  const core::Image8* in_view;
  const core::Image8* covisible;
};

struct DirectionSummary {
  std::int64_t num_pixels = 0;          ///< whose flow was compared
  std::int64_t num_at_other_times = 0;  ///< seen by a rolling shutter at another of several times
  double worst_px = 0.0;
  std::string worst_place;
  std::int64_t num_masked = 0;  ///< whose masks were
  std::int64_t num_contradictions = 0;
  /// Pixels called co-visible that the other image's depths hide; no contradictions, since depths are of pixels' centres.
  std::int64_t num_hidden = 0;
  std::string first_hidden;
  std::string first_contradiction;
  std::int64_t num_unresolved = 0;  ///< where the other image does not resolve what it shows
  std::int64_t num_agreeing = 0;    ///< seen by both by their depths
  std::int64_t num_unclaimed = 0;   ///< of those, not co-visible by the mask
  Evidence::Part part;
};

class DirectionComparison {
 public:
  DirectionComparison(const Direction& direction, const ValidateOptions& options)
      : d_(direction), options_(options), transfer_(d_.pair.a, d_.pair.b) {}
  DirectionComparison(const DirectionComparison&) = delete;
  DirectionComparison& operator=(const DirectionComparison&) = delete;

  DirectionSummary run() {
    const Intrinsics& k = d_.pair.a.camera->intrinsics;
    // Residuals of every n-th pixel are enough for the estimates; the largest error and the masks
    // are taken of all.
    const std::int64_t num_all = static_cast<std::int64_t>(k.width_px) * k.height_px;
    stride_ = std::max<std::int64_t>(
        1, num_all / std::max<std::int64_t>(1, 4 * options_.samples_per_image));
    const int step = options_.is_trial ? 8 : 1;
    if (options_.is_trial) stride_ = 1;
    for (int y = step / 2; y < k.height_px; y += step)
      for (int x = step / 2; x < k.width_px; x += step) compare(x, y);
    summary_.part = Evidence::sum(d_.pair, residuals_);
    return std::move(summary_);
  }

 private:
  void contradict(int x, int y, const char* what) {
    if (++summary_.num_contradictions == 1)
      summary_.first_contradiction = fmt::format("{}: {}", place_of(d_.pair.a, x, y), what);
  }

  void contradict_by_depth(int x, int y, const char* what) {
    ++summary_.num_hidden;
    if (summary_.first_hidden.empty())
      summary_.first_hidden = fmt::format("{}: {}", place_of(d_.pair.a, x, y), what);
  }

  /// Whether the other image's camera sees a point, whatever roundings do. How far outside of an image its lines see
  /// one is not stated.
  bool is_surely_seen(const Transfer::Place& place) const {
    const ViewPair& pair = d_.pair;
    return !pair.a.lines && !pair.b.lines && is_told_by_depth(place) &&
           sees_surely(pair.b.camera->intrinsics, place.point_b);
  }
  /// So near the other camera float32 depth tells no flow.
  static bool is_told_by_depth(const Transfer::Place& place) {
    return place.distance_b_m >= 0.05 * place.distance_a_m;
  }

  /// Whether a rolling shutter sees a point at another of several times than ours.
  bool is_at_another_time(const Eigen::Vector2d& pixel, const Eigen::Vector2d& stored,
                          double depth_m, const std::optional<Transfer::Place>& place) const {
    if (!d_.pair.b.lines || !stored.allFinite()) return false;
    const Camera& camera = *d_.pair.b.camera;
    const double tolerance_px = kFlowTolerance_px + camera.flow_rounding_px();
    const Eigen::Vector2d target = pixel + stored;
    if (place && camera.intrinsics.way_px(place->pixel, target).norm() <= tolerance_px)
      return false;
    const bool is_sky = !std::isfinite(depth_m);
    return transfer_.is_seen_at(target, pixel, is_sky ? 1.0 : depth_m, is_sky, tolerance_px);
  }

  void compare(int x, int y) {
    const Intrinsics& k_a = d_.pair.a.camera->intrinsics;
    const Intrinsics& k_b = d_.pair.b.camera->intrinsics;
    const bool says_in_view = (*d_.in_view)(x, y) != 0;
    const bool says_covisible = (*d_.covisible)(x, y) != 0;
    const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
    const Eigen::Vector2d stored(static_cast<double>((*d_.flow)(x, y, 0)),
                                 static_cast<double>((*d_.flow)(x, y, 1)));
    const double reach_px = d_.pair.a.camera->flow_reach_px;
    const bool marks_missing = d_.pair.a.camera->marks_missing_flow;
    if (!stored.allFinite() && !marks_missing && std::isinf(reach_px)) {
      contradict(x, y, "flow is not finite");
      return;
    }
    if (d_.pair.a.image->body_at(x, y) != 0) return;  // `moving` tells of it
    const auto depth_m = static_cast<double>(d_.pair.a.image->depth(x, y));
    const bool is_sky = !std::isfinite(depth_m);
    const bool has_ray = !marks_missing || k_a.ray_from_pixel(pixel).allFinite();
    // What is infinitely far has no one image where rays start at many places.
    if (marks_missing && stored.allFinite() &&
        (!has_ray || (is_sky && k_b.plane && !k_b.plane->is_central()))) {
      contradict(x, y,
                 has_ray ? "flow of the sky of a camera that is not central"
                         : "flow where no ray comes in");
      return;
    }
    const std::optional<Transfer::Place> place =
        is_sky ? transfer_.direction(pixel) : transfer_.point(pixel, depth_m);
    if (is_at_another_time(pixel, stored, depth_m, place)) {
      ++summary_.num_at_other_times;
      return;
    }
    if (stored.allFinite()) ++summary_.num_masked;
    if (says_covisible && (is_sky || !says_in_view))
      contradict(x, y,
                 is_sky ? "sky is called co-visible" : "co-visible but not in the field of view");
    if (!place || !(place->distance_b_m > 0.0)) {
      // How far outside the image a line still sees a point is not stated.
      const bool is_wrong =
          marks_missing ? stored.allFinite() && !d_.pair.b.lines : !stored.allFinite();
      if (says_in_view || is_wrong)
        contradict(x, y,
                   d_.pair.b.lines
                       ? "seen by no line of the other image, but called in its field of "
                         "view or too long"
                       : "behind the other camera, but called in its field of view or too long");
      return;
    }
    const Eigen::Vector3d& point_b = place->point_b;
    const Eigen::Vector2d& target = place->pixel;
    if (!stored.allFinite() && marks_missing) {
      if (k_b.contains(target, kFlowBorder_px) || is_surely_seen(*place))
        contradict(x, y, "seen by the other camera, but its flow says that it is not");
      return;
    }
    if (!stored.allFinite()) {
      const double longest_px = (target - pixel).cwiseAbs().maxCoeff();
      if (!(longest_px > reach_px - d_.pair.a.camera->flow_step_px))
        contradict(x, y, "flow is called longer than the format can hold, but is not");
      return;
    }
    if (!is_sky && k_b.contains(target, kFlowBorder_px) && !says_in_view)
      contradict(x, y, "in the other's field of view, but masked out");
    if (!k_b.contains(target, -kFlowBorder_px) && says_in_view)
      contradict(x, y, "outside the other's image, but called in its field of view");
    // Ways are compared across seams, where flow has to end in the image all the same.
    if (is_beyond_seam(k_b, pixel + stored)) contradict(x, y, "flow that leads across the seam");
    if (!is_told_by_depth(*place)) return;
    if (!k_b.contains(target, -0.5 * k_b.width_px)) return;
    ++summary_.num_pixels;
    const Eigen::Vector2d difference = k_b.way_px(target, pixel + stored);
    const double size = difference.norm();
    if (size > summary_.worst_px || summary_.worst_place.empty()) {
      summary_.worst_px = size;
      summary_.worst_place = place_of(d_.pair.a, x, y);
    }
    if (is_sky) return;
    if (k_b.contains(target, 2.0))
      check_visibility(x, y, place->distance_b_m, target, says_covisible);
    const std::int64_t index = static_cast<std::int64_t>(y) * k_a.width_px + x;
    if (index % stride_ != 0) return;
    const Eigen::Matrix<double, 2, 3> jacobian = projection_jacobian(k_b, point_b);
    for (int axis = 0; axis < 2; ++axis) {
      Residual residual;
      residual.value = difference[axis];
      residual.axis = axis;
      residual.block = block_of(k_a, pixel);
      // A principal point moves the pixel's ray in a and the target in b, never the pixel itself.
      set_slopes(residual, d_.pair, transfer_, *place, -jacobian.row(axis),
                 axis == 0 ? Eigen::Vector2d(-1.0, 0.0) : Eigen::Vector2d(0.0, -1.0),
                 -(target[axis] - (axis == 0 ? k_b.cx_px : k_b.cy_px)), 0.0);
      residuals_.push_back(residual);
    }
  }

  void check_visibility(int x, int y, double predicted_m, const Eigen::Vector2d& target,
                        bool says_covisible) {
    const core::ImageF& depth_b = d_.pair.b.image->depth;
    if (depth_b.empty()) return;
    if (says_covisible &&
        d_.pair.b.image->hides_by_moving(target, predicted_m - (0.17 + 0.01 * predicted_m)))
      contradict_by_depth(x, y, "called co-visible, but something that moves is before it there");
    const std::optional<InverseDepthSample> seen = sample_inverse_depth(depth_b, target);
    if (!seen) return;
    // Between leaves that are finer than its pixels an image sees what its pixels' centres miss.
    const bool is_resolved = seen->roughness < kResolvedRoughness;
    if (!is_resolved) ++summary_.num_unresolved;
    // The format's own readers allow 0.169 m and 1 % between the ranges of what they call the same
    // point.
    if (is_resolved && says_covisible &&
        seen->farthest_m < predicted_m - (0.17 + 0.01 * predicted_m))
      contradict_by_depth(x, y,
                          "called co-visible, but the other image shows something nearer there");
    const double r = seen->inverse_depth.value * predicted_m - 1.0;
    if (std::abs(r) < 1e-3 && seen->roughness < kSmoothRoughness) {
      ++summary_.num_agreeing;
      if (!says_covisible) ++summary_.num_unclaimed;
    }
  }

  Direction d_;
  const ValidateOptions& options_;
  Transfer transfer_;  ///< of the pair above
  std::int64_t stride_ = 1;
  DirectionSummary summary_;
  std::vector<Residual> residuals_;
};

class FlowChecker : public Checker {
 public:
  explicit FlowChecker(const ValidateOptions& options) : options_(options) {}

  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    std::vector<Direction> directions;
    for (int camera = 0; camera < static_cast<int>(window.sequence().cameras.size()); ++camera) {
      const std::optional<View> now = window.view(camera, window.frame());
      const std::optional<View> before = window.view(camera, window.frame() - 1);
      if (!now || !before || !before->image->flow || before->image->depth.empty() ||
          now->image->depth.empty())
        continue;
      const FlowFields& flow = *before->image->flow;
      directions.push_back(
          {{*before, *now}, &flow.forward, &flow.in_view_forward, &flow.covisible_forward});
      if (flow.backward.empty()) continue;
      directions.push_back(
          {{*now, *before}, &flow.backward, &flow.in_view_backward, &flow.covisible_backward});
    }
    std::vector<DirectionSummary> summaries(directions.size());
    core::parallel_for(static_cast<std::int64_t>(directions.size()), [&](std::int64_t i) {
      summaries[static_cast<std::size_t>(i)] =
          DirectionComparison(directions[static_cast<std::size_t>(i)], options_).run();
    });
    for (const DirectionSummary& summary : summaries) {
      ++num_directions_;
      num_pixels_ += summary.num_pixels;
      num_at_other_times_ += summary.num_at_other_times;
      num_masked_ += summary.num_masked;
      if (summary.worst_px > worst_px_ || worst_place_.empty()) {
        worst_px_ = summary.worst_px;
        worst_place_ = summary.worst_place;
      }
      errors_.push_back(summary.worst_px);
      num_contradictions_ += summary.num_contradictions;
      if (first_contradiction_.empty()) first_contradiction_ = summary.first_contradiction;
      num_hidden_ += summary.num_hidden;
      if (first_hidden_.empty()) first_hidden_ = summary.first_hidden;
      num_unresolved_ += summary.num_unresolved;
      num_agreeing_ += summary.num_agreeing;
      num_unclaimed_ += summary.num_unclaimed;
      evidence_.add(summary.part);
    }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    if (num_directions_ == 0)
      return {skipped_result("flow", "the dataset holds no flow with depth at both its ends")};
    double rounding_px = 0.0, step_px = 0.0;
    for (const Camera& camera : sequence.cameras) {
      rounding_px = std::max(rounding_px, camera.flow_rounding_px());
      step_px = std::max(step_px, camera.flow_step_px);
    }
    CheckResult flow;
    flow.name = "flow";
    flow.value = worst_px_;
    flow.bound = kFlowTolerance_px + rounding_px;
    flow.unit = "px";
    flow.ok = flow.value <= flow.bound;
    flow.worst = worst_place_;
    flow.summary = fmt::format(
        "Largest difference between stored flow and flow from depth, poses and intrinsics, over {} "
        "pixels "
        "of {} fields, forward and backward; sky by rotation alone.",
        num_pixels_, num_directions_);
    if (num_at_other_times_ > 0)
      flow.summary += fmt::format(
          " {} more lead to where a rolling shutter that turns fast sees their points once more.",
          num_at_other_times_);
    flow.reason =
        "float32 depth (6e-8), float32 flow and poses of nine digits leave less than 1e-3 px.";
    if (step_px > 0.0)
      flow.reason += fmt::format(" Half a step of {:.4g} px both ways, {:.4g} px, is added.",
                                 step_px, rounding_px);
    flow.detects = "0.01 deg of rotation (0.056 px), a wrong sign, axis or frame";
    CheckResult::Plot plot{
        "largest error of each field", "field (forward and backward in turn)", "px", {}, errors_};
    for (std::size_t i = 0; i < errors_.size(); ++i) plot.x.push_back(static_cast<double>(i));
    flow.plots.push_back(std::move(plot));

    CheckResult masks;
    masks.name = "flow_masks";
    constexpr double kThin = 1e-5, kSwapped = 1e-2;
    PointShares hidden(kThin, kSwapped);
    hidden.add({num_hidden_, std::max(num_masked_, num_hidden_),
                first_hidden_.empty() ? "all masks" : first_hidden_});
    hidden.judge(masks);
    if (num_contradictions_ > 0) {
      masks.ok = masks.skipped = masks.is_unseen = false;
      masks.value = static_cast<double>(num_contradictions_ + num_hidden_) /
                    static_cast<double>(std::max(num_masked_, num_contradictions_ + num_hidden_));
      masks.bound = 0.0;
      masks.probability.reset();
      masks.worst = first_contradiction_;
    }
    masks.summary = fmt::format(
        "{} contradictions in the masks of {} pixels: field-of-view masks are exact, co-visible "
        "pixels lie in the field of view, are "
        "not sky, and nothing over 1 % nearer stands in all 16 pixels around their target. The "
        "last is not asked of {} pixels where the other image does not resolve what it shows.",
        num_contradictions_ + num_hidden_, num_masked_, num_unresolved_);
    masks.reason =
        "A mask that claims too much teaches false matches. What is seen is exact, what hides is "
        "known at the centres of pixels: of pixels that are hidden one in 100 000 is left for "
        "silhouettes thinner than a pixel, and what few pixels may be more by chance.";
    masks.detects = "masks of the other direction, swapped masks, sky called visible";

    CheckResult unclaimed;
    unclaimed.name = "flow_covisible";
    constexpr double kJustHidden = 0.02, kEmpty = 0.5;
    PointShares shares(kJustHidden, kEmpty);
    shares.add({num_unclaimed_, num_agreeing_, "all fields"});
    shares.judge(unclaimed);
    unclaimed.summary = fmt::format(
        "Share of {} pixels whose depth agrees in both images, yet are not called co-visible. "
        "Those are asked whose surroundings in the other image are smooth.",
        num_agreeing_);
    unclaimed.reason =
        "Visibility is decided by rays, agreement by interpolated depth: on smooth ground they "
        "differ at grazing angles, and behind what is so thin that all pixels around miss it.";
    unclaimed.detects = "an empty co-visible mask";
    std::vector<CheckResult> results{flow, masks, unclaimed};
    if (num_pixels_ == 0)
      results[0] =
          unseen_result(flow.name, "no point of a pair of frames comes near the other image");
    if (num_masked_ + num_contradictions_ + num_hidden_ == 0)
      results[1] = unseen_result(masks.name, "no pixel of a pair of frames has a mask");
    if (num_agreeing_ == 0)
      results[2] = unseen_result(unclaimed.name, "no depth agrees in both images of a pair");
    const Evidence::Bounds bounds{.principal_px = 0.1,
                                  .focal_percent = 0.1,
                                  .scale_percent = 0.1,
                                  .time_frames = 0.5,
                                  .line_time_percent = 1,
                                  .time_pattern = 1e-3,
                                  .rounding = 0.5 * step_px,
                                  .rotation_deg = 0.01};
    for (CheckResult& result : evidence_.results(
             "flow", sequence, bounds, &FrameFiles::flow, "the differences of flow",
             "0.1 px of principal point, 0.1 % of scale or focal length, 0.01 deg of rotation, "
             "one frame of time"))
      results.push_back(std::move(result));
    return results;
  }

 private:
  ValidateOptions options_;
  Evidence evidence_;
  std::int64_t num_directions_ = 0;
  std::int64_t num_pixels_ = 0;
  std::int64_t num_at_other_times_ = 0;
  std::int64_t num_masked_ = 0;
  double worst_px_ = 0.0;
  std::string worst_place_;
  std::vector<double> errors_;
  std::int64_t num_contradictions_ = 0;
  std::int64_t num_hidden_ = 0;
  std::string first_contradiction_, first_hidden_;
  std::int64_t num_unresolved_ = 0;
  std::int64_t num_agreeing_ = 0;
  std::int64_t num_unclaimed_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_flow_check(const ValidateOptions& options) {
  return std::make_unique<FlowChecker>(options);
}

}  // namespace terracast::validate
