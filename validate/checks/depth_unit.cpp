#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/sampling.h"

/// Neighbouring frames that share no place by their depth, although their colours do. Where depth is
/// wrong by so much that every point leaves the other image, no residual is left to show it. So the
/// distance between the two cameras is swept (as planes are swept in stereo): where the colours agree
/// at another one, and nowhere else, depth has another unit than the poses. Images of rolling shutters are swept by
/// their frames' poses: what a shutter moves is a small part of what lies between frames that share nothing, and
/// alike in both.
namespace terracast::validate {

namespace {

/// So many patches say whether two images agree.
constexpr std::size_t kEnough = 64;

/// The least prominence of a match.
constexpr double kPeak = 0.3;

/// The distance at which the colours of two images agree best, by the one that poses state.
struct Match {
  /// Where they do (0 where not): by how much their median correlation is higher there than at any
  /// distance that puts them more than a few pixels elsewhere. What looks alike wherever it is laid
  /// (a gradient, the glitter of the sun) has no such peak.
  double prominence = 0.0;
  double factor = 1.0;      ///< 1000: depth is a thousandth of what it should be
  bool is_inverse = false;  ///< by 1 / depth
};

/// Where a place of `a` falls in `b` when the cameras stand `distance` times as far apart.
std::optional<Eigen::Vector2d> pixel_in_b(const View& a, const View& b, const Pose& b_from_a,
                                          const Eigen::Vector2i& at, double distance) {
  const auto depth_m = static_cast<double>(a.image->depth(at.x(), at.y()));
  const Eigen::Vector3d point = b_from_a.rotation * a.camera->intrinsics.point_from_pixel(
                                                        {at.x() + 0.5, at.y() + 0.5}, depth_m) +
                                distance * b_from_a.translation;
  const Eigen::Vector2d pixel = b.camera->intrinsics.pixel_from_point(point);
  if (!(b.camera->intrinsics.distance_m(point, pixel) > 1e-3 * depth_m)) return std::nullopt;
  return pixel;
}

/// Places of `a` with depth.
std::vector<Eigen::Vector2i> draw_places(const ViewPair& pair, const ValidateOptions& options) {
  constexpr std::int64_t kDrawn = 800;
  constexpr std::size_t kMost = 192;
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
    return pixel && pair.b.camera->intrinsics.contains(*pixel);
  });
  constexpr double kShared = 0.02;
  return places.size() >= kEnough &&
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
    a_.lines.reset();
    b_.lines.reset();
    if (!is_inverse) return;
    inverse_.grey = pair.a.image->grey;
    inverse_.depth = pair.a.image->depth;
    for (float& value : inverse_.depth.data()) value = 1.0F / value;
    a_.image = &inverse_;
  }
  Sweep(const Sweep&) = delete;
  Sweep& operator=(const Sweep&) = delete;

  /// Distances, each so near the last that half of the places move by less than a pixel.
  std::vector<double> distances() const {
    constexpr double kLeast = 1e-4, kMost = 1e4, kStep_px = 0.7;
    constexpr double kFinest = 1e-5, kCoarsest = 0.03, kProbe = 1e-4;
    std::vector<double> list;
    for (double distance = kLeast; distance < kMost;) {
      list.push_back(distance);
      const double speed_px = motion_px(distance, (1.0 + kProbe) * distance) / kProbe;
      distance *= 1.0 + std::clamp(kStep_px / std::max(speed_px, 1e-9), kFinest, kCoarsest);
    }
    return list;
  }

  /// Median correlation of the patches at a distance; nothing where few are seen.
  std::optional<double> correlation(double distance) const {
    View b = b_;
    b.local_from_camera = Pose{b_from_a_.rotation, distance * b_from_a_.translation}.inverse();
    std::vector<double> correlations;
    for (const Eigen::Vector2i& at : places_)
      if (const auto match = match_patch(a_, b, at.x(), at.y()))
        correlations.push_back(match->correlation);
    if (correlations.size() < kEnough) return std::nullopt;
    return median(correlations);
  }

  /// How far places in view move between two distances, median; 0 where there are none.
  double motion_px(double from, double to) const {
    std::vector<double> lengths;
    for (const Eigen::Vector2i& at : places_) {
      const auto first = pixel_in_b(a_, b_, b_from_a_, at, from);
      const auto second = pixel_in_b(a_, b_, b_from_a_, at, to);
      if (first && b_.camera->intrinsics.contains(*first))
        lengths.push_back(second ? (*second - *first).norm()
                                 : std::numeric_limits<double>::infinity());
    }
    return median(lengths);
  }

 private:
  View a_, b_;
  Pose b_from_a_;
  LoadedImage grey_, inverse_;
  std::vector<Eigen::Vector2i> places_;
};

/// The best match of all distances but those near the stated one, at which images that share a rim
/// agree; nothing where the two images do not tell.
std::optional<Match> best_match(const ViewPair& pair, const ValidateOptions& options) {
  std::optional<Match> best;
  for (const bool is_inverse : {false, true}) {
    const Sweep sweep(pair, options, is_inverse);
    const std::vector<double> distances = sweep.distances();
    std::vector<std::optional<double>> correlations(distances.size());
    core::parallel_for(static_cast<std::int64_t>(distances.size()), [&](std::int64_t i) {
      correlations[static_cast<std::size_t>(i)] =
          sweep.correlation(distances[static_cast<std::size_t>(i)]);
    });
    const auto highest = std::max_element(correlations.begin(), correlations.end());
    if (highest == correlations.end() || !*highest) continue;
    const double distance = distances[static_cast<std::size_t>(highest - correlations.begin())];
    // As far as patches reach and alignment would bring them.
    constexpr double kElsewhere_px = 6.0;
    std::optional<double> elsewhere;
    for (std::size_t i = 0; i < distances.size(); ++i)
      if (correlations[i] && (!elsewhere || *correlations[i] > *elsewhere) &&
          sweep.motion_px(distance, distances[i]) > kElsewhere_px)
        elsewhere = correlations[i];
    if (!elsewhere) continue;
    constexpr double kNear = 1.5, kStill_px = 1.5, kAgree = 0.8;
    const bool is_stated = !is_inverse && distance < kNear && distance > 1.0 / kNear;
    const bool is_still = sweep.motion_px(distance, 0.0) < kStill_px;
    const double prominence = **highest - *elsewhere;
    const bool does_agree = **highest > kAgree;
    // What goes along with the camera, or looks alike wherever it is laid, says nothing.
    if (does_agree && (is_still || prominence <= kPeak)) continue;
    if (!best) best.emplace();
    if (does_agree && !is_stated && prominence > best->prominence)
      *best = {prominence, 1.0 / distance, is_inverse};
  }
  return best;
}

class DepthUnitChecker : public Checker {
 public:
  explicit DepthUnitChecker(const ValidateOptions& options) : options_(options) {
    agreement_.name = "depth_unit";
    agreement_.bound = kPeak;
    agreement_.unit = "of correlation";
  }

  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    // Not the window's pairs: those share what their depth says that they share.
    cameras_.resize(window.sequence().cameras.size());
    for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
      const auto newest = window.view(static_cast<int>(camera), window.frame());
      const auto earlier = window.view(static_cast<int>(camera), window.frame() - 1);
      if (!newest || !earlier) continue;
      look_at({ViewPair{*newest, *earlier}, ViewPair{*earlier, *newest}}, cameras_[camera]);
    }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence&) override {
    if (num_pairs_ == 0)
      return {skipped_result(agreement_.name, "no camera has depth and colours in two frames")};
    // In a trial, images that agree nowhere bear out no cause: with a wrong one undone they do not
    // either.
    const bool has_told = num_matched_ > 0 && (!options_.is_trial || agreement_.value > 0.0);
    if (2 * num_apart_ > num_pairs_ && !has_told)
      return {unseen_result(
          agreement_.name,
          fmt::format("most neighbouring frames share no place by their depth, nor {} "
                      "patches that would tell another unit",
                      kEnough))};
    agreement_.ok = agreement_.is_within_bound();
    agreement_.summary = fmt::format(
        "{} of {} pairs of neighbouring frames share no place by their depth. How much better the "
        "colours of {} of them agree with depth, or its inverse, 1e-4 to 1e4 times as large: "
        "median correlation of patches at the best factor, less that of any other that puts them "
        "elsewhere.",
        num_apart_, num_pairs_, num_matched_);
    agreement_.reason =
        "A factor that brings correlation to 0.8 or less counts as 0; other ground is brought to "
        "0.4. In the tests the right one brings it to 0.99 and stands out by over 0.5; what looks "
        "alike wherever it is laid (glitter: 0.02) says nothing.";
    agreement_.detects =
        "depth in a unit so much smaller than that of poses that no pair of images shares a place";
    return {agreement_};
  }

 private:
  struct OfCamera {
    std::uint64_t num_apart = 0;
    int num_matched = 0;
  };

  /// Two frames, one in the other both ways.
  void look_at(const std::array<ViewPair, 2>& pairs, OfCamera& camera) {
    std::vector<const ViewPair*> apart;
    for (const ViewPair& pair : pairs) {
      if (pair.a.image->depth.empty() || pair.a.image->grey.empty() || pair.b.image->grey.empty())
        continue;
      ++num_pairs_;
      if (is_apart(pair, options_)) apart.push_back(&pair);
    }
    num_apart_ += apart.size();
    // A sweep tries hundreds of distances. A unit is the same in all frames, but some tell nothing:
    // of those that are apart the 1st, 2nd, 4th, 8th, …, until enough have told.
    if (apart.empty() || !std::has_single_bit(++camera.num_apart)) return;
    const int most = options_.is_trial ? 2 : 4;
    for (const ViewPair* pair : apart)
      if (camera.num_matched < most) sweep(*pair, camera);
  }

  void sweep(const ViewPair& pair, OfCamera& camera) {
    const std::optional<Match> match = best_match(pair, options_);
    if (!match) return;
    ++camera.num_matched;
    ++num_matched_;
    std::string where = fmt::format("{} in {}", place_of(pair.a), place_of(pair.b));
    if (match->prominence > 0.0)
      where += fmt::format("{}{:.3g} times as large",
                           match->is_inverse ? ": with 1 / depth " : kDepthFactor, match->factor);
    note_worst(agreement_, match->prominence, where);
  }

  ValidateOptions options_;
  CheckResult agreement_;
  std::vector<OfCamera> cameras_;
  std::size_t num_pairs_ = 0, num_apart_ = 0, num_matched_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_depth_unit_check(const ValidateOptions& options) {
  return std::make_unique<DepthUnitChecker>(options);
}

}  // namespace terracast::validate
