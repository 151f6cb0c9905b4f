#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <set>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/evidence.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// Colours of one image, carried by its depth and by poses into another, against the colours there:
/// their correlation, and the sub-pixel shift that remains. This ties the images to the geometry.
namespace terracast::validate {

namespace {

/// What a correlation counts as. Leaves that are finer than a pixel fall on others in each image: a forest correlates
/// by 0.5 to 0.65 where other ground does by 0.05; so there it counts twice.
double worth_of(const PatchMatch& match) {
  return match.is_resolved ? match.correlation : std::min(1.0, 2.0 * match.correlation);
}

constexpr double kMostFrameShift_px = 0.3;

struct PairMatches {
  std::vector<double> shift_x, shift_y;
  std::vector<double> correlation;  ///< what each counts as
  std::vector<double> own;          ///< PatchMatch::own_correlation
  std::int64_t num_level = 0;       ///< left out
  double patches_per_fact = 1.0;
  std::int64_t num_unresolved = 0;
  /// Sums of what the colours of patches differ by: as they stand, and with red and blue swapped in
  /// one of the two.
  double color_difference = 0.0, swapped_difference = 0.0;
  bool is_of_one_white = true;  ///< whether both cameras' colours are balanced alike
  Evidence::Part part;
};

/// Mean colour of 3 x 3 pixels.
Eigen::Vector3d color_around(const core::Image8& color, int x, int y) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      for (int k = 0; k < 3; ++k) sum[k] += color(x + dx, y + dy, k);
  return sum / 9.0;
}

/// Compares two colours of one place; an image that is grey is held against the other's luma.
void compare_colors(const Eigen::Vector3d& a, const Eigen::Vector3d& b, PairMatches& matches) {
  const auto is_grey = [](const Eigen::Vector3d& c) { return c[0] == c[1] && c[1] == c[2]; };
  const auto luma = [](const Eigen::Vector3d& c) {
    return 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2];
  };
  if (is_grey(a) && is_grey(b)) return;
  const auto difference = [&](const Eigen::Vector3d& of_a) {
    if (is_grey(b)) return std::abs(luma(of_a) - b[0]);
    if (is_grey(a)) return std::abs(luma(b) - a[0]);
    return (of_a - b).cwiseAbs().sum() / 3.0;
  };
  const auto swapped = [](const Eigen::Vector3d& c) { return Eigen::Vector3d(c[2], c[1], c[0]); };
  matches.color_difference += difference(a);
  matches.swapped_difference +=
      is_grey(a) ? std::abs(luma(swapped(b)) - a[0]) : difference(swapped(a));
}

/// The least median correlation of images of one place that are all texture.
constexpr double kLeastCorrelation = 0.6;

/// How alike two images, or all pairs of a kind, show one place.
struct Likeness {
  double median = 0.0;
  double most = 0.0;  ///< it, and what it may be more
  double own = 0.0;   ///< median of what patches correlate with their own image beside
  double bound = kLeastCorrelation;
  /// Whether another place would look otherwise: patches are enough, and most of what they show is coarser than noise.
  bool tells = false;
  double share() const { return most / bound; }
};
/// is_sure   whether what the median may be more counts; in a trial, of few patches, it is what it is
Likeness likeness_of(const PairMatches& matches, bool is_sure) {
  // Other ground has been seen to correlate by 0.3.
  constexpr double kLeastTold = 0.3;
  std::vector<double> correlation = matches.correlation, own = matches.own;
  const MedianEstimate estimate = estimate_median(correlation, matches.patches_per_fact);
  Likeness likeness;
  likeness.median = estimate.median;
  likeness.most = estimate.median + (is_sure ? estimate.unsure : 0.0);
  likeness.own = median(own);
  likeness.bound = std::min(kLeastCorrelation, likeness.own);
  likeness.tells = (!is_sure || std::isfinite(estimate.unsure)) && likeness.bound > kLeastTold;
  return likeness;
}

/// What other ground mostly correlates by less than.
constexpr double kUnlike = 0.4;
std::ptrdiff_t num_unlike(const std::vector<double>& correlations) {
  return std::count_if(correlations.begin(), correlations.end(),
                       [](double value) { return value < kUnlike; });
}

/// What shifts of patches between two images may all be off by alike: where the images move by the same part of a pixel
/// all over, matching pulls towards whole pixels, and by the more the less sure it is. Measured on pairs of right
/// datasets (docs/validate.md, Verdicts), it is up to the median deviation where that is small, and a quarter of it beyond.
double locking_px(std::vector<double> shifts) {
  const double middle = median(shifts);
  for (double& shift : shifts) shift = std::abs(shift - middle);
  const double deviation = median(shifts);
  return std::min(1.2 * deviation, 0.02 + 0.25 * deviation);
}

PairMatches compare(const ViewPair& pair, const ValidateOptions& options) {
  PairMatches matches;
  // A patch has 49 pixels: a tenth of the samples cost as much as all of a check of single pixels.
  const std::int64_t count = std::max<std::int64_t>(options.samples_per_image / 10, 1);
  const std::uint64_t salt = (static_cast<std::uint64_t>(pair.b.frame) * 1000 +
                              static_cast<std::uint64_t>(pair.b.camera_index)) |
                             1ULL << 40;
  std::vector<Residual> residuals;
  const Transfer transfer(pair.a, pair.b);
  // What makes a rig's world grey is another gain in each rig.
  const std::string& white = pair.a.camera->imaging.white_balance;
  matches.is_of_one_white =
      pair.a.camera_index == pair.b.camera_index ||
      (white == pair.b.camera->imaging.white_balance && white != "grey_world");
  for (const Eigen::Vector2i& at :
       draw_pixels(pair.a.camera->intrinsics, count, options, pair.a, salt)) {
    const std::optional<PatchMatch> match = match_patch(pair.a, pair.b, at.x(), at.y());
    if (!match) continue;
    if (match->is_level) {
      ++matches.num_level;
      continue;
    }
    matches.own.push_back(match->own_correlation);
    matches.correlation.push_back(worth_of(*match));
    if (!match->is_resolved) ++matches.num_unresolved;
    if (matches.is_of_one_white)
      compare_colors(color_around(pair.a.image->color, at.x(), at.y()),
                     color_around(pair.b.image->color, static_cast<int>(match->place.pixel.x()),
                                  static_cast<int>(match->place.pixel.y())),
                     matches);
    // Leaves finer than pixels, others in each image, shift patches as they like: of woods and gardens in
    // hundreds of patches by enough to look like a turn of all cameras by 0.012 degrees.
    if (!match->has_converged || !match->is_resolved) continue;
    matches.shift_x.push_back(match->shift_px.x());
    matches.shift_y.push_back(match->shift_px.y());
    const Intrinsics& k_b = pair.b.camera->intrinsics;
    const Eigen::Matrix<double, 2, 3> jacobian = projection_jacobian(k_b, match->place.point_b);
    for (int axis = 0; axis < 2; ++axis) {
      Residual residual;  // seen minus predicted: a correction that moves the prediction lowers it
      residual.value = match->shift_px[axis];
      residual.axis = axis;
      residual.block = block_of(pair.a.camera->intrinsics, {at.x() + 0.5, at.y() + 0.5});
      const double from_centre = match->place.pixel[axis] - (axis == 0 ? k_b.cx_px : k_b.cy_px);
      set_slopes(residual, pair, transfer, match->place, -jacobian.row(axis),
                 axis == 0 ? Eigen::Vector2d(-1.0, 0.0) : Eigen::Vector2d(0.0, -1.0), -from_centre,
                 0.0);
      residuals.push_back(residual);
    }
  }
  matches.patches_per_fact =
      patches_per_fact(matches.correlation.size(), pair.a.camera->intrinsics.width_px,
                       pair.a.camera->intrinsics.height_px);
  matches.part =
      Evidence::sum(pair, residuals, {locking_px(matches.shift_x), locking_px(matches.shift_y)});
  return matches;
}

class PhotometricChecker : public Checker {
 public:
  explicit PhotometricChecker(const ValidateOptions& options) : options_(options) {}

  void frame(const FrameWindow& window, const std::vector<ViewPair>& pairs) override {
    finish_images(window.frame() - *std::max_element(std::begin(FrameWindow::kOffsets),
                                                     std::end(FrameWindow::kOffsets)));
    std::vector<PairMatches> matches(pairs.size());
    ValidateOptions options = options_;
    // Of few pairs more patches, so that a trial's few frames have enough of each kind.
    if (options.is_trial) options.samples_per_image = pairs.size() <= 8 ? 1600 : 600;
    core::parallel_for(static_cast<std::int64_t>(pairs.size()), [&](std::int64_t i) {
      matches[static_cast<std::size_t>(i)] = compare(pairs[static_cast<std::size_t>(i)], options);
    });
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const ViewPair& pair = pairs[i];
      evidence_.add(matches[i].part);
      // Pairs of one kind are pooled: a shift of the images against the geometry is common to all
      // of them.
      const std::string kind =
          pair.is_same_time()
              ? fmt::format("{} in {}", pair.a.camera->name, pair.b.camera->name)
              : fmt::format("{}, {:+} frames", pair.a.camera->name, pair.b.frame - pair.a.frame);
      PairMatches& pool = pools_[kind];
      const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
        to.insert(to.end(), from.begin(), from.end());
      };
      append(pool.shift_x, matches[i].shift_x);
      append(pool.shift_y, matches[i].shift_y);
      append(pool.correlation, matches[i].correlation);
      append(pool.own, matches[i].own);
      pool.patches_per_fact = std::max(pool.patches_per_fact, matches[i].patches_per_fact);
      num_level_ += matches[i].num_level;
      pool.color_difference += matches[i].color_difference;
      pool.swapped_difference += matches[i].swapped_difference;
      pool.is_of_one_white = matches[i].is_of_one_white;
      note_images(kind, pair, matches[i]);
      num_patches_ += static_cast<std::int64_t>(matches[i].correlation.size());
      num_unresolved_ += matches[i].num_unresolved;
    }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    CheckResult shift;
    shift.name = "photometric_shift";
    shift.bound = 0.1;
    shift.unit = "px";
    CheckResult correlation;
    correlation.name = "photometric_correlation";
    correlation.bound = kLeastCorrelation;
    correlation.is_lower_bound = true;
    correlation.unit = "(at least)";
    correlation.value = 1.0;
    double least_likeness = std::numeric_limits<double>::infinity();
    CheckResult::Plot histogram{"shifts in x of all kinds of pairs", "px", "patches", {}, {}};
    constexpr int kBins = 81;
    for (int bin = 0; bin < kBins; ++bin) {
      histogram.x.push_back(0.025 * (bin - kBins / 2));
      histogram.y.push_back(0.0);
    }
    std::size_t num_kinds = 0, num_told = 0, num_untold = 0;
    // A trial's few frames must not hide a kind of pairs behind the others.
    const std::size_t enough = options_.is_trial ? 50 : 100;
    for (auto& [kind, pool] : pools_) {
      if (pool.correlation.size() < enough) continue;
      ++num_kinds;
      for (const double value : pool.shift_x) {
        const auto bin = static_cast<std::ptrdiff_t>(std::lround(value / 0.025)) + kBins / 2;
        if (bin >= 0 && bin < kBins) histogram.y[static_cast<std::size_t>(bin)] += 1.0;
      }
      const Likeness likeness = likeness_of(pool, !options_.is_trial);
      if (likeness.tells && likeness.share() < least_likeness) {
        least_likeness = likeness.share();
        correlation.value = likeness.most;
        correlation.bound = likeness.bound;
        correlation.worst = fmt::format("{}: median {:.3f}, of what is coarser than noise {:.3f}",
                                        kind, likeness.median, likeness.own);
      }
      if (pool.shift_x.size() < enough) continue;
      const MedianEstimate x = estimate_median(pool.shift_x, pool.patches_per_fact);
      const MedianEstimate y = estimate_median(pool.shift_y, pool.patches_per_fact);
      const bool is_told = x.tells(shift.bound) && y.tells(shift.bound);
      ++(is_told ? num_told : num_untold);
      const double size = std::hypot(size_of(x), size_of(y));
      if (size > shift.value || (is_told && size == shift.value)) {
        shift.value = size;
        shift.worst = fmt::format("{}: ({:.3f} ± {:.2f}, {:.3f} ± {:.2f}) px of {} patches", kind,
                                  x.median, x.unsure, y.median, y.unsure, pool.shift_x.size());
      }
    }
    if (num_kinds == 0) {
      const char* reason =
          "fewer than 100 patches with contrast are seen twice: colours were not checked";
      return {unseen_result(shift.name, reason), unseen_result(correlation.name, reason),
              unseen_result("photometric_frames", reason),
              unseen_result("photometric_frame_shift", reason),
              unseen_result("photometric_channels", reason)};
    }
    shift.ok = shift.is_within_bound();
    shift.summary = fmt::format(
        "Median shift of {} resolved patches of 7 x 7 pixels against where depth and poses put "
        "them, worst of {} kinds of pairs: the part of it that is sure. Of {} kinds what is not "
        "sure exceeds "
        "the bound. {} level patches are left out: water shows what it mirrors, or its bed.",
        num_patches_ - num_unresolved_, num_kinds, num_untold, num_level_);
    shift.reason =
        "Single patches scatter by 0.02 px to 0.1 px (four samples a pixel, 8 bits), of towns with "
        "one sample by 0.2 px; medians of hundreds by 0.01 px.";
    shift.skipped = shift.is_unseen = num_told == 0 && shift.ok;
    if (shift.skipped)
      shift.worst = num_untold == 0 ? "the images resolve too few patches of what both show"
                                    : "patches scatter too much for their number";
    shift.detects =
        "0.2 px between the images of two cameras; colours that come from another place than the "
        "depth";
    shift.plots.push_back(std::move(histogram));
    correlation.ok = correlation.is_within_bound();
    correlation.summary = fmt::format(
        "Median zero-mean normalised correlation of the same {} patches, and what it may be more "
        "by the scatter of "
        "as many; of the kind of pairs that is nearest to its bound. Of {} patches their images do "
        "not resolve what they "
        "show: it counts twice, and their shifts do not.",
        num_patches_, num_unresolved_);
    correlation.reason =
        "The same ground from a place nearby looks the same but for noise and what is finer than "
        "pixels: it correlates by 0.6, "
        "or by what each patch does with itself one pixel beside, where that is less; other "
        "ground by less than "
        "0.3, leaves finer than pixels by 0.5, and other leaves by 0.05.";
    correlation.is_unseen = correlation.skipped = std::isinf(least_likeness);
    if (correlation.skipped)
      correlation.worst =
          "what the images show is not coarser than their noise, or too few patches are seen twice";
    correlation.detects = "images of another camera, frame or orientation than the geometry";
    std::vector<CheckResult> results{shift, correlation};
    add_single_images(results);
    add_channels(results);
    const Evidence::Bounds bounds{.principal_px = 0.2,
                                  .time_frames = 1,
                                  .pattern = 0.003,
                                  .shared = 2.5,
                                  .rotation_deg = 0.02};
    for (CheckResult& result :
         evidence_.results("photometric", sequence, bounds, "the shifts of patches between images",
                           "0.2 px of principal point, 0.02 deg of rotation; time only where a "
                           "frame of it moves patches by less than 3 px"))
      results.push_back(std::move(result));
    return results;
  }

 private:
  /// The part of a median shift that is sure; in a trial, of few patches, all of it.
  double size_of(const MedianEstimate& shift) const {
    return options_.is_trial ? std::abs(shift.median) : shift.judged();
  }

  /// What all pairs with one image say, beside the others of their kinds.
  struct ImageMedians {
    std::string name = {};
    std::set<std::string> kinds = {};
    std::array<int, 2> group = {};  ///< camera, and whether at its own time
    double correlation = 0.0;
    Likeness likeness;
    double share_unlike = 0.0;   ///< of the patches
    std::int64_t num_facts = 1;  ///< as many as are independent of each other
    double shift_px = 0.0;
    bool has_shift = false;
  };
  struct ImagePool {
    std::string name;
    std::set<std::string> kinds;
    PairMatches matches;
  };

  /// Pools the patches of a pair with those of each of its images: those of other frames, and those of the same frame,
  /// which may be foreign together. What an image shows elsewhere than its geometry has it
  /// stands off by as much, the other way, in the pairs whose second it is.
  void note_images(const std::string& kind, const ViewPair& pair, const PairMatches& matches) {
    for (const View* view : {&pair.a, &pair.b}) {
      ImagePool& pool = images_[{view->frame, view->camera_index, pair.is_same_time() ? 1 : 0}];
      pool.name = place_of(*view);
      pool.kinds.insert(kind);
      const double sign = view == &pair.a ? 1.0 : -1.0;
      PairMatches& all = pool.matches;
      all.patches_per_fact =
          patches_per_fact(all.correlation.size() + matches.correlation.size(),
                           view->camera->intrinsics.width_px, view->camera->intrinsics.height_px);
      all.correlation.insert(all.correlation.end(), matches.correlation.begin(),
                             matches.correlation.end());
      all.own.insert(all.own.end(), matches.own.begin(), matches.own.end());
      if (pair.a.camera_index != pair.b.camera_index) continue;
      for (const double shift : matches.shift_x) all.shift_x.push_back(sign * shift);
      for (const double shift : matches.shift_y) all.shift_y.push_back(sign * shift);
    }
  }

  /// Takes the images to which no more pairs come: those before a frame.
  void finish_images(int frame) {
    const std::size_t enough = options_.is_trial ? 10 : 20;
    while (!images_.empty() && images_.begin()->first[0] < frame) {
      ImagePool& pool = images_.begin()->second;
      PairMatches& all = pool.matches;
      if (all.correlation.size() >= enough) {
        ImageMedians medians;
        medians.name = pool.name;
        medians.kinds = std::move(pool.kinds);
        medians.group = {images_.begin()->first[1], images_.begin()->first[2]};
        medians.likeness = likeness_of(all, !options_.is_trial);
        medians.correlation = medians.likeness.median;
        const auto count = static_cast<double>(all.correlation.size());
        medians.share_unlike = static_cast<double>(num_unlike(all.correlation)) / count;
        medians.num_facts = std::max<std::int64_t>(std::llround(count / all.patches_per_fact), 1);
        medians.has_shift = all.shift_x.size() >= enough;
        if (medians.has_shift)
          medians.shift_px =
              std::hypot(size_of(estimate_median(all.shift_x, all.patches_per_fact)),
                         size_of(estimate_median(all.shift_y, all.patches_per_fact)));
        medians_.push_back(std::move(medians));
      }
      images_.erase(images_.begin());
    }
  }

  /// One image that is not what the others are is lost in the medians of all.
  void add_single_images(std::vector<CheckResult>& results) {
    finish_images(std::numeric_limits<int>::max());
    CheckResult unlike;
    unlike.name = "photometric_frames";
    unlike.unit = "share";
    CheckResult farthest;
    farthest.name = "photometric_frame_shift";
    farthest.bound = kMostFrameShift_px;
    farthest.unit = "px";
    std::map<std::string, double> typical_of_kind;
    for (auto& [kind, pool] : pools_) typical_of_kind[kind] = median(pool.correlation);
    // Of a camera's images, the quarter that is most like its others: one that is wrong spoils its neighbours' pairs.
    std::map<std::array<int, 2>, std::vector<double>> shares_of_group;
    for (const ImageMedians& image : medians_)
      shares_of_group[image.group].push_back(image.share_unlike);
    std::map<std::array<int, 2>, double> typical_share;
    for (auto& [group, shares] : shares_of_group) typical_share[group] = quantile(shares, 0.25);
    bool is_any_clear = false;
    double worst_share = -1.0;
    for (const ImageMedians& image : medians_) {
      double typical = 1.0;
      for (const std::string& kind : image.kinds)
        typical = std::min(typical, typical_of_kind[kind]);
      // Of images that hardly correlate as such (noise at night) nothing follows for one of them.
      constexpr double kClear = 0.5, kClearOfItself = 0.35;
      if (typical > kClear && image.likeness.own > kClearOfItself) {
        is_any_clear = true;
        // An image has been seen to have so many more of them than others, that saw less of what moves in the wind.
        constexpr double kMoreAtLeast = 0.15, kTimes = 1.5;
        const double expected = std::min(kMoreAtLeast + kTimes * typical_share[image.group], 1.0);
        const double bound = options_.is_trial
                                 ? expected
                                 : static_cast<double>(binomial_quantile(
                                       kFalseVerdict / static_cast<double>(medians_.size()),
                                       image.num_facts, expected)) /
                                       static_cast<double>(image.num_facts);
        const double share = image.share_unlike / bound;
        if (share > worst_share) {
          worst_share = share;
          unlike.value = image.share_unlike;
          unlike.bound = bound;
          unlike.worst = fmt::format("{}: median {:.3f}, of all {:.3f}", image.name,
                                     image.correlation, typical);
        }
      }
      if (image.has_shift && image.correlation > kClear && image.shift_px >= farthest.value) {
        farthest.value = image.shift_px;
        farthest.worst = image.name;
      }
    }
    unlike.ok = unlike.is_within_bound();
    unlike.summary = fmt::format(
        "Largest share of the patches of a single image that correlate by less than {} with the "
        "other images that see "
        "them.",
        kUnlike);
    unlike.reason =
        "Neighbouring frames see the ground alike; half and more of the patches of another image "
        "correlate by less. The "
        "bound is what one and a half times the share of a quarter of the camera's images, and "
        "0.15, leave with a "
        "probability of 1e-9.";
    unlike.detects = "one image of another frame or sequence";
    farthest.ok = farthest.is_within_bound();
    farthest.summary =
        "Largest median shift of the patches of a single image against the other frames: the part "
        "of it that is sure.";
    farthest.reason =
        "Medians of hundreds of patches are known to 0.01 px; only what is sure of them counts.";
    farthest.detects = "one image that stands twice where a frame moves by 0.5 px";
    results.push_back(is_any_clear ? std::move(unlike)
                                   : unseen_result(unlike.name, "no images correlate clearly"));
    results.push_back(
        !farthest.worst.empty()
            ? std::move(farthest)
            : unseen_result(farthest.name, "no two images resolve enough of what both show"));
  }

  void add_channels(std::vector<CheckResult>& results) {
    CheckResult channels;
    channels.name = "photometric_channels";
    channels.bound = 1.5;
    channels.unit = "times";
    std::size_t num_unlike = 0;
    for (const auto& [kind, pool] : pools_) {
      if (!pool.is_of_one_white) ++num_unlike;
      if (pool.swapped_difference > 0.0 && pool.correlation.size() >= 20)
        note_worst(channels, pool.color_difference / pool.swapped_difference, kind);
    }
    if (channels.worst.empty()) {
      results.push_back(unseen_result(
          channels.name, num_unlike == 0 ? "no two images share colours"
                                         : "no two images share colours of one white balance"));
      return;
    }
    channels.ok = channels.is_within_bound();
    channels.summary =
        "Differences of colour between the patches of two images, by what they are with red and "
        "blue swapped in one of them; worst kind of pairs.";
    if (num_unlike > 0)
      channels.summary += fmt::format(
          " {} kinds are left out: imaging.json states that the two cameras balance white "
          "otherwise, so that one place has two colours.",
          num_unlike);
    channels.reason =
        "On grey ground both are alike; in colour the right order fits better, and a wrong one "
        "worse by the same factor.";
    channels.detects = "blue, green, red in one camera; grey that is not the luma of its colours";
    results.push_back(std::move(channels));
  }

  ValidateOptions options_;
  Evidence evidence_;
  std::map<std::array<int, 3>, ImagePool>
      images_;  ///< by frame, camera, and whether at its own time: those that still meet others
  std::vector<ImageMedians> medians_;
  std::map<std::string, PairMatches> pools_;
  std::int64_t num_patches_ = 0;
  std::int64_t num_unresolved_ = 0;
  std::int64_t num_level_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_photometric_check(const ValidateOptions& options) {
  return std::make_unique<PhotometricChecker>(options);
}

}  // namespace terracast::validate
