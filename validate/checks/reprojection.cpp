#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/evidence.h"
#include "validate/judged_images.h"
#include "validate/null_distribution.h"
#include "validate/pictures.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// Depth of one image, carried by intrinsics and poses into another, against the depth there.
/// Residual r = z_predicted / z_measured - 1, the measured one interpolated in inverse depth
/// (linear on planes).
namespace terracast::validate {

namespace {

/// The largest median |r| of a pair.
constexpr double kAgreementBound = 2e-3;

/// What one pair of images says.
struct PairSummary {
  std::vector<float> sizes;  ///< |r| where nothing hides the point and the depth is smooth
  std::int64_t num_compared = 0;
  std::int64_t num_surface = 0;  ///< of these, where the point's own image resolves a surface
  std::int64_t num_seen_through = 0;
  Evidence::Part part;
  /// Which shift of the poses, in frames, brings the depths together best: -1, 0, 1; 0 also where
  /// there is nothing to tell.
  int best_shift = 0;
};

/// Median |r| of some pixels.
double median_residual(const ViewPair& pair, const std::vector<Eigen::Vector2i>& pixels) {
  const Transfer transfer(pair.a, pair.b);
  std::vector<double> sizes;
  for (const Eigen::Vector2i& at : pixels) {
    const auto depth_m = static_cast<double>(pair.a.image->depth(at.x(), at.y()));
    if (!std::isfinite(depth_m)) continue;
    const auto place = transfer.point({at.x() + 0.5, at.y() + 0.5}, depth_m);
    if (!place || !(place->distance_b_m > 1e-3 * depth_m)) continue;
    const auto seen = sample_inverse_depth(pair.b.image->depth, place->pixel);
    if (seen) sizes.push_back(std::abs(seen->inverse_depth.value * place->distance_b_m - 1.0));
  }
  constexpr std::size_t kEnough = 50;
  return sizes.size() < kEnough ? std::numeric_limits<double>::infinity() : median(sizes);
}

/// A whole frame of time is too much for a linear estimate where the motion changes fast: the
/// neighbours' poses are tried.
int best_time_shift(const ViewPair& pair, const std::vector<Eigen::Vector2i>& all_pixels) {
  if (pair.is_same_time()) return 0;
  const std::vector<Eigen::Vector2i> pixels(
      all_pixels.begin(), all_pixels.begin() + static_cast<std::ptrdiff_t>(all_pixels.size() / 4));
  const auto posed_at = [](const View& view, int shift) {
    return view_at(*view.sequence, view.camera_index, view.frame + shift, view.image);
  };
  int best = 0;
  // A neighbour must be better by a clear factor: in steady flight all shifts agree alike.
  double least = 0.5 * median_residual(pair, pixels);
  for (const int shift : {-1, 1}) {
    const std::optional<View> a = posed_at(pair.a, shift);
    const std::optional<View> b = posed_at(pair.b, shift);
    if (!a || !b) continue;
    const double size = median_residual({*a, *b}, pixels);
    if (size < least) {
      least = size;
      best = shift;
    }
  }
  return best;
}

PairSummary compare(const ViewPair& pair, const ValidateOptions& options) {
  PairSummary summary;
  const Intrinsics& k_a = pair.a.camera->intrinsics;
  const Intrinsics& k_b = pair.b.camera->intrinsics;
  const Transfer transfer(pair.a, pair.b);
  const std::uint64_t salt = static_cast<std::uint64_t>(pair.b.frame) * 1000 +
                             static_cast<std::uint64_t>(pair.b.camera_index);
  std::vector<Residual> residuals;
  std::vector<double> roughness;
  std::vector<float> depths;
  const std::vector<Eigen::Vector2i> pixels =
      draw_pixels(k_a, options.samples_per_image, options, pair.a, salt);
  summary.best_shift = best_time_shift(pair, pixels);
  for (const Eigen::Vector2i& at : pixels) {
    const auto depth_m = static_cast<double>(pair.a.image->depth(at.x(), at.y()));
    if (!std::isfinite(depth_m)) continue;
    const auto place = transfer.point({at.x() + 0.5, at.y() + 0.5}, depth_m);
    if (!place || !(place->distance_b_m > 1e-3 * depth_m)) continue;
    const Eigen::Vector3d& point_b = place->point_b;
    const double predicted_m = place->distance_b_m;
    const Eigen::Vector2d& pixel = place->pixel;
    const std::optional<InverseDepthSample> seen = sample_inverse_depth(pair.b.image->depth, pixel);
    if (!seen) continue;
    ++summary.num_compared;
    // Farther than predicted in all 16 pixels around: an opaque surface cannot be seen through.
    constexpr double kClear = 0.01;
    // A leaf or a wire is thinner than the gaps between their centres.
    if (is_resolved(pair.a.image->depth, at.x(), at.y())) {
      ++summary.num_surface;
      if (seen->nearest_m > predicted_m * (1.0 + kClear)) ++summary.num_seen_through;
    }
    const double r = seen->inverse_depth.value * predicted_m - 1.0;
    // Nearer in all 16: something hides the point. A mistake of this size shows on the other side
    // too.
    if (seen->farthest_m < predicted_m * (1.0 - kClear)) continue;
    if (seen->nearest_m > predicted_m * (1.0 + kClear)) continue;
    // Seen from afar or at a grazing angle one pixel spans what near pixels resolve: there the
    // cubic errs by the roughness itself, and a difference says nothing of poses and depth.
    // Where leaves are finer than pixels, gaps that show what is behind outweigh it one-sidedly.
    if (seen->roughness >= kResolvedRoughness) continue;
    summary.sizes.push_back(static_cast<float>(std::abs(r)));
    Residual residual;
    residual.value = r;
    residual.block = block_of(k_a, {at.x() + 0.5, at.y() + 0.5});
    const Eigen::RowVector2d by_pixel = predicted_m * seen->inverse_depth.gradient.transpose();
    Eigen::RowVector3d by_point = by_pixel * projection_jacobian(k_b, point_b);
    by_point += seen->inverse_depth.value * k_b.distance_gradient(point_b);
    set_slopes(residual, pair, transfer, *place, by_point, by_pixel.transpose(),
               by_pixel.x() * (pixel.x() - k_b.cx_px) + by_pixel.y() * (pixel.y() - k_b.cy_px),
               -(1.0 + r));
    residuals.push_back(residual);
    roughness.push_back(seen->roughness);
    depths.push_back(static_cast<float>(depth_m));
  }
  // Where the 4 x 4 pixels lie on one plane the interpolation is exact, elsewhere it errs by about
  // the roughness. The floor keeps a few perfect pixels from outweighing all others.
  std::vector<double> ordered = roughness;
  const double typical = median(ordered);
  for (std::size_t i = 0; i < residuals.size(); ++i)
    residuals[i].sigma = std::sqrt(roughness[i] * roughness[i] + 0.01 * typical * typical + 1e-12);
  const double typical_m = median(depths);
  std::array<double, 2> scales{};
  if (typical_m > 0.0)
    scales = {pixels_per_metre(k_a, typical_m), pixels_per_metre(k_b, typical_m)};
  // Where many pixels fall on a single pixel of the other image, all of them share the error of that pixel.
  constexpr double kMuchCoarser = 0.25;
  if (scales[1] < kMuchCoarser * scales[0]) residuals.clear();
  summary.part = Evidence::sum(pair, residuals);
  summary.part.pixels_per_metre = scales;
  return summary;
}

class ReprojectionChecker : public Checker {
 public:
  explicit ReprojectionChecker(const ValidateOptions& options) : options_(options) {}

  void frame(const FrameWindow& window, const std::vector<ViewPair>& all_pairs) override {
    std::vector<ViewPair> pairs;
    for (const ViewPair& pair : all_pairs)
      if (!pair.b.image->depth.empty()) pairs.push_back(pair);
    std::vector<PairSummary> summaries(pairs.size());
    core::parallel_for(static_cast<std::int64_t>(pairs.size()), [&](std::int64_t i) {
      summaries[static_cast<std::size_t>(i)] =
          compare(pairs[static_cast<std::size_t>(i)], options_);
    });
    for (std::size_t i = 0; i < pairs.size(); ++i) add(pairs[i], summaries[i]);
    // One map of residuals for each kind of pair, in the middle of the sequence.
    if (!options_.is_trial && window.frame() == (window.sequence().num_frames + 1) / 2)
      for (const ViewPair& pair : pairs)
        if (pictures_.size() < kMostPictures &&
            (pair.is_same_time() || pair.a.frame + 1 == pair.b.frame))
          pictures_.push_back(residual_map(pair));
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    if (num_compared_ == 0)
      return {unseen_result("reprojection", "no two images with depth see the same ground")};
    std::vector<CheckResult> results;
    CheckResult agreement;
    agreement.name = "reprojection";
    agreement.value = worst_median_;
    agreement.bound = kAgreementBound;
    agreement.unit = "of the depth";
    agreement.ok = agreement.is_within_bound();
    agreement.skipped = agreement.is_unseen = pair_median_.empty();
    agreement.worst =
        agreement.skipped ? "no two images share smooth ground enough to compare" : worst_pair_;
    agreement.summary = fmt::format(
        "Median |z predicted / z measured - 1| of the worst of {} image pairs that share enough "
        "ground whose depth is smooth to half the bound; {} points compared.",
        pair_median_.size(), num_compared_);
    agreement.reason =
        "Places are taken where depth departs from a plane by less than 1e-3 between pixel "
        "centres: interpolating it errs by no more than twice that. Rough ground makes 1e-4.";
    agreement.detects =
        "a frame paired with another's pose; wrong axes, order or sign in poses and depth";
    agreement.plots.push_back(
        {"median residual of each pair", "pair", "of the depth", pair_index_, pair_median_});
    agreement.pictures = pictures_;
    agreement.unseen_parts = judged_.unseen_parts(sequence, &FrameFiles::depth);
    results.push_back(std::move(agreement));

    CheckResult through;
    through.name = "reprojection_see_through";
    constexpr double kThinRidges = 1e-3, kWorthFinding = 0.02;
    PointShares shares(kThinRidges, kWorthFinding);
    shares.add({num_seen_through_, num_surface_,
                fmt::format("{}, {:.2g} of its points; of all pairs", worst_through_pair_,
                            worst_through_)});
    shares.judge(through);
    through.summary = fmt::format(
        "Share of {} points that the other image sees through: all 16 pixels around are over 1 % "
        "farther than the point. {} more lie on what their own image does not resolve: leaves and "
        "wires that are finer than its pixels.",
        num_surface_, num_compared_ - num_surface_);
    through.reason =
        "Ground is opaque. Only ridges thinner than a pixel can slip between the centres of 16 "
        "pixels: one point in 1000, and what few points may be more by chance.";
    through.detects =
        "ground that one frame shows 2 % nearer (levels of detail, moving ground), gross errors "
        "of pose";
    if (num_surface_ == 0)
      through = unseen_result(through.name, "no image resolves a surface that another one sees");
    results.push_back(std::move(through));

    // Each two images are a pair both ways, of the same errors. A trial of few frames calls nothing wrong.
    const double both_ways = options_.is_trial ? 1.0 : 2.0;
    // float32 leaves 6e-8 of each of two depths, decimals of poses half a micrometre, from 2 m above the ground 3e-7 of
    // it; over a plane that is all that there is.
    constexpr double kRounding = 5e-7;
    const Evidence::Bounds bounds{.principal_px = 0.1,
                                  .focal_percent = 0.1,
                                  .scale_percent = 0.1,
                                  .time_frames = 0.5,
                                  .line_time_percent = 4,
                                  .time_pattern = 1e-4,
                                  .shared = both_ways,
                                  .rounding = kRounding,
                                  .rotation_deg = 0.01,
                                  .position_px = 0.1};
    for (CheckResult& result : evidence_.results(
             "reprojection", sequence, bounds, &FrameFiles::depth,
             "the differences of depth between images",
             "0.1 px of principal point, 0.1 % of focal length or scale, 0.01 deg of rotation (a "
             "camera's in all "
             "frames, or one image's), a shift of one image's position by 0.1 px, one frame of "
             "time"))
      results.push_back(std::move(result));
    for (CheckResult& result : results)
      if (result.name == "reprojection_time") add_whole_frames(result);
    return results;
  }

 private:
  /// Most pairs with a neighbour's pose at hand agree by it far better than by their own: one frame
  /// of time.
  void add_whole_frames(CheckResult& result) const {
    result.summary += fmt::format(
        " Tried as well: the poses of the frames before and after; {} and {} of {} pairs agree "
        "twice as well by them.",
        num_shifted_[0], num_shifted_[1], num_tried_);
    const std::int64_t most = std::max(num_shifted_[0], num_shifted_[1]);
    if (num_tried_ == 0 || 2 * most <= num_tried_) return;
    result.value = 1.0;
    result.ok = false;
    result.skipped = result.is_unseen = false;
    result.worst = fmt::format("{} of {} pairs agree with the poses of the frame {}", most,
                               num_tried_, num_shifted_[0] > num_shifted_[1] ? "before" : "after");
  }

  static constexpr std::size_t kMostPictures = 4;

  void add(const ViewPair& pair, PairSummary& summary) {
    evidence_.add(summary.part);
    num_compared_ += summary.num_compared;
    num_seen_through_ += summary.num_seen_through;
    if (!pair.is_same_time()) {
      ++num_tried_;
      if (summary.best_shift != 0) ++num_shifted_[summary.best_shift < 0 ? 0 : 1];
    }
    num_surface_ += summary.num_surface;
    constexpr std::int64_t kEnough = 200;
    if (summary.num_compared < kEnough) return;
    const std::string name = fmt::format("{} in {}", place_of(pair.a), place_of(pair.b));
    const double share = static_cast<double>(summary.num_seen_through) /
                         static_cast<double>(std::max<std::int64_t>(summary.num_surface, 1));
    if (share > worst_through_ || worst_through_pair_.empty()) {
      worst_through_ = share;
      worst_through_pair_ = name;
    }
    if (summary.sizes.size() < kEnough / 2) return;
    for (const View* view : {&pair.a, &pair.b}) judged_.add(view->camera_index, view->frame);
    const double middle = median(summary.sizes);
    pair_index_.push_back(static_cast<double>(pair_index_.size()));
    pair_median_.push_back(middle);
    if (middle > worst_median_ || worst_pair_.empty()) {
      worst_median_ = middle;
      worst_pair_ = name;
    }
  }

  /// r of every second pixel of `a` in `b`: blue nearer than predicted (hidden), red farther, white
  /// equal; grey: not seen.
  static CheckResult::Picture residual_map(const ViewPair& pair) {
    const Intrinsics& k_a = pair.a.camera->intrinsics;
    const Transfer transfer(pair.a, pair.b);
    core::ImageF map((k_a.width_px + 1) / 2, (k_a.height_px + 1) / 2, 1,
                     std::numeric_limits<float>::quiet_NaN());
    for (int y = 0; y < map.height(); ++y)
      for (int x = 0; x < map.width(); ++x) {
        const auto depth_m = static_cast<double>(pair.a.image->depth(2 * x, 2 * y));
        if (!std::isfinite(depth_m)) continue;
        const auto place = transfer.point({2 * x + 0.5, 2 * y + 0.5}, depth_m);
        if (!place || !(place->distance_b_m > 1e-3 * depth_m)) continue;
        const auto seen = sample_inverse_depth(pair.b.image->depth, place->pixel);
        if (seen)
          map(x, y) = static_cast<float>(seen->inverse_depth.value * place->distance_b_m - 1.0);
      }
    constexpr float kFull = 2e-3F;
    return {fmt::format("{} in {}: blue to red is -0.2 % to +0.2 % of the depth", place_of(pair.a),
                        place_of(pair.b)),
            diverging_picture(map, kFull)};
  }

  ValidateOptions options_;
  Evidence evidence_;
  JudgedImages judged_;
  std::int64_t num_compared_ = 0;
  std::int64_t num_surface_ = 0;
  std::int64_t num_seen_through_ = 0;
  std::int64_t num_tried_ = 0;
  std::array<std::int64_t, 2> num_shifted_{};  ///< pairs that agree by the poses before, and after
  double worst_median_ = 0.0;
  std::string worst_pair_;
  double worst_through_ = 0.0;
  std::string worst_through_pair_;
  std::vector<double> pair_index_, pair_median_;
  std::vector<CheckResult::Picture> pictures_;
};

}  // namespace

std::unique_ptr<Checker> make_reprojection_check(const ValidateOptions& options) {
  return std::make_unique<ReprojectionChecker>(options);
}

}  // namespace terracast::validate
