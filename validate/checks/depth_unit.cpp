#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/sampling.h"

/// Neighbouring frames that share no place by their depth, although their colours do. Where depth is
/// wrong by so much that every point leaves the other image, no residual is left to show it. So the
/// distance between the two cameras is swept (as planes are swept in stereo): where the colours agree
/// at another one, depth has another unit than the poses.
namespace terracast::validate {

namespace {

/// A distance at which the colours of two images agree, by the one that poses state.
struct Match {
  double correlation = 0.0;  ///< median of the patches
  double factor = 1.0;       ///< 1000: depth is a thousandth of what it should be
  bool is_inverse = false;   ///< by 1 / depth
};

bool has_pixel(const Intrinsics& camera, const Eigen::Vector2d& pixel) {
  return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < camera.width_px &&
         pixel.y() < camera.height_px;
}

/// Where a place of `a` falls in `b` when the cameras stand `distance` times as far apart.
std::optional<Eigen::Vector2d> pixel_in_b(const View& a, const View& b, const Pose& b_from_a,
                                          const Eigen::Vector2i& at, double distance) {
  const auto depth_m = static_cast<double>(a.image->depth(at.x(), at.y()));
  const Eigen::Vector3d point =
      b_from_a.rotation *
          (a.camera->intrinsics.ray_from_pixel({at.x() + 0.5, at.y() + 0.5}) * depth_m) +
      distance * b_from_a.translation;
  if (!(point.z() > 1e-3 * depth_m)) return std::nullopt;
  return b.camera->intrinsics.pixel_from_point(point);
}

/// Places of `a` with depth.
std::vector<Eigen::Vector2i> draw_places(const ViewPair& pair, const ValidateOptions& options) {
  constexpr std::int64_t kDrawn = 400;
  constexpr std::size_t kMost = 96;
  std::vector<Eigen::Vector2i> places;
  for (const Eigen::Vector2i& at :
       draw_pixels(pair.a.camera->intrinsics, kDrawn, options, pair.a,
                   1ULL << 41 | static_cast<std::uint64_t>(pair.b.frame)))
    if (places.size() < kMost && std::isfinite(pair.a.image->depth(at.x(), at.y())))
      places.push_back(at);
  return places;
}

/// Whether next to nothing of what `a` shows falls into `b`.
bool is_apart(const ViewPair& pair, const ValidateOptions& options) {
  const Pose b_from_a = pair.b.local_from_camera.inverse() * pair.a.local_from_camera;
  const std::vector<Eigen::Vector2i> places = draw_places(pair, options);
  const auto num_in_view = std::count_if(places.begin(), places.end(), [&](const auto& at) {
    const auto pixel = pixel_in_b(pair.a, pair.b, b_from_a, at, 1.0);
    return pixel && has_pixel(pair.b.camera->intrinsics, *pixel);
  });
  constexpr double kShared = 0.02;
  return !places.empty() &&
         static_cast<double>(num_in_view) < kShared * static_cast<double>(places.size());
}

/// Patches of `a`, carried into `b` with the two cameras at other distances.
class Sweep {
 public:
  Sweep(const ViewPair& pair, const ValidateOptions& options, bool is_inverse)
      : a_(pair.a),
        b_(pair.b),
        b_from_a_(pair.b.local_from_camera.inverse() * pair.a.local_from_camera),
        places_(draw_places(pair, options)) {
    // What hides what is unknown without a unit: colours alone are asked.
    grey_.grey = pair.b.image->grey;
    b_.image = &grey_;
    a_.local_from_camera = Pose{};
    if (!is_inverse) return;
    inverse_.grey = pair.a.image->grey;
    inverse_.depth = pair.a.image->depth;
    for (float& value : inverse_.depth.data()) value = 1.0F / value;
    a_.image = &inverse_;
  }
  Sweep(const Sweep&) = delete;
  Sweep& operator=(const Sweep&) = delete;

  /// Distances, each so near the last that places in view move by less than a pixel.
  std::vector<double> distances() const {
    constexpr double kLeast = 1e-4, kMost = 1e4, kStep_px = 0.7;
    constexpr double kFinest = 1e-3, kCoarsest = 0.03, kProbe = 1e-4;
    std::vector<double> list;
    for (double distance = kLeast; distance < kMost;) {
      list.push_back(distance);
      double fastest_px = 0.0;
      for (const Eigen::Vector2i& at : places_) {
        const auto here = pixel_in_b(a_, b_, b_from_a_, at, distance);
        const auto next = pixel_in_b(a_, b_, b_from_a_, at, (1.0 + kProbe) * distance);
        if (here && next && has_pixel(b_.camera->intrinsics, *here))
          fastest_px = std::max(fastest_px, (*next - *here).norm() / kProbe);
      }
      distance *= 1.0 + std::clamp(kStep_px / std::max(fastest_px, 1e-9), kFinest, kCoarsest);
    }
    return list;
  }

  /// Median correlation of the patches at a distance; 0 where few are seen.
  double correlation(double distance) const {
    View b = b_;
    b.local_from_camera = Pose{b_from_a_.rotation, distance * b_from_a_.translation}.inverse();
    std::vector<double> correlations;
    for (const Eigen::Vector2i& at : places_)
      if (const auto match = match_patch(a_, b, at.x(), at.y()))
        correlations.push_back(match->correlation);
    constexpr std::size_t kEnough = 40;
    return correlations.size() < kEnough ? 0.0 : median(correlations);
  }

 private:
  View a_, b_;
  Pose b_from_a_;
  LoadedImage grey_, inverse_;
  std::vector<Eigen::Vector2i> places_;
};

/// The distance at which two images agree best, but for those near the stated one: images that share
/// a rim do so there.
Match best_match(const ViewPair& pair, const ValidateOptions& options) {
  Match best;
  for (const bool is_inverse : {false, true}) {
    const Sweep sweep(pair, options, is_inverse);
    constexpr double kNear = 1.5;
    std::vector<double> distances = sweep.distances();
    if (!is_inverse)
      std::erase_if(distances, [](double d) { return d < kNear && d > 1.0 / kNear; });
    std::vector<double> correlations(distances.size());
    core::parallel_for(static_cast<std::int64_t>(distances.size()), [&](std::int64_t i) {
      correlations[static_cast<std::size_t>(i)] =
          sweep.correlation(distances[static_cast<std::size_t>(i)]);
    });
    for (std::size_t i = 0; i < distances.size(); ++i)
      if (correlations[i] > best.correlation)
        best = {correlations[i], 1.0 / distances[i], is_inverse};
  }
  return best;
}

class DepthUnitChecker : public Checker {
 public:
  explicit DepthUnitChecker(const ValidateOptions& options) : options_(options) {
    agreement_.name = "depth_unit";
    agreement_.bound = 0.8;
    agreement_.unit = "of correlation";
  }

  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    // Not the window's pairs: those share what their depth says that they share.
    for (std::size_t camera = 0; camera < window.sequence().cameras.size(); ++camera) {
      const auto newest = window.view(static_cast<int>(camera), window.frame());
      const auto earlier = window.view(static_cast<int>(camera), window.frame() - 1);
      if (!newest || !earlier) continue;
      compare({*newest, *earlier});
      compare({*earlier, *newest});
    }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence&) override {
    if (num_pairs_ == 0)
      return {skipped_result(agreement_.name, "no camera has depth and colours in two frames")};
    agreement_.ok = agreement_.is_within_bound();
    agreement_.summary = fmt::format(
        "{} of {} pairs of neighbouring frames share no place by their depth. Median correlation "
        "of "
        "patches of {} of them, with depth 1e-4 to 1e4 times as large, as it is or as its inverse.",
        num_apart_, num_pairs_, num_swept_);
    agreement_.reason =
        "Of other ground the best of a thousand distances brings 40 patches to 0.3; of the same "
        "ground the right one brings them to over 0.9.";
    agreement_.detects =
        "depth in another unit than poses, by so much that no pair of images shares a place";
    return {agreement_};
  }

 private:
  void compare(const ViewPair& pair) {
    if (pair.a.image->depth.empty() || pair.a.image->grey.empty() || pair.b.image->grey.empty())
      return;
    ++num_pairs_;
    if (!is_apart(pair, options_)) return;
    ++num_apart_;
    // A sweep costs as much as a thousand pairs, and a unit is the same in all frames.
    const int most = options_.is_trial ? 2 : 4;
    if (num_swept_ == most) return;
    ++num_swept_;
    const Match match = best_match(pair, options_);
    std::string where = fmt::format("{} in {}", place_of(pair.a), place_of(pair.b));
    if (match.correlation > 0.0)
      where += fmt::format(": with {} {:.3g} times as large",
                           match.is_inverse ? "1 / depth" : "depth", match.factor);
    note_worst(agreement_, match.correlation, where);
  }

  ValidateOptions options_;
  CheckResult agreement_;
  std::size_t num_pairs_ = 0, num_apart_ = 0;
  int num_swept_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_depth_unit_check(const ValidateOptions& options) {
  return std::make_unique<DepthUnitChecker>(options);
}

}  // namespace terracast::validate
