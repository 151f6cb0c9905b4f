#include <fmt/format.h>

#include <algorithm>
#include <map>

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
      const double from_centre = match->place.pixel[axis] - (axis == 0 ? k_b.cx_px : k_b.cy_px);
      set_slopes(residual, pair, transfer, match->place, -jacobian.row(axis),
                 axis == 0 ? Eigen::Vector2d(-1.0, 0.0) : Eigen::Vector2d(0.0, -1.0), -from_centre,
                 0.0);
      residuals.push_back(residual);
    }
  }
  const Intrinsics& k_a = pair.a.camera->intrinsics;
  matches.part = Evidence::sum(
      pair, residuals, patches_per_fact(matches.shift_x.size(), k_a.width_px, k_a.height_px));
  return matches;
}

class PhotometricChecker : public Checker {
 public:
  explicit PhotometricChecker(const ValidateOptions& options) : options_(options) {}

  void frame(const FrameWindow&, const std::vector<ViewPair>& pairs) override {
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
      pool.color_difference += matches[i].color_difference;
      pool.swapped_difference += matches[i].swapped_difference;
      pool.is_of_one_white = matches[i].is_of_one_white;
      note_pair(kind, fmt::format("{} in {}", place_of(pair.a), place_of(pair.b)), matches[i]);
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
    correlation.bound = 0.6;
    correlation.is_lower_bound = true;
    correlation.unit = "(at least)";
    correlation.value = 1.0;
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
      const double typical = median(pool.correlation);
      if (typical < correlation.value) {
        correlation.value = typical;
        correlation.worst = kind;
      }
      if (pool.shift_x.size() < enough) continue;
      const MedianEstimate x = estimate_median(pool.shift_x);
      const MedianEstimate y = estimate_median(pool.shift_y);
      const bool is_told = x.tells(shift.bound) && y.tells(shift.bound);
      ++(is_told ? num_told : num_untold);
      const double size = std::hypot(x.judged(shift.bound), y.judged(shift.bound));
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
        "them, worst "
        "of {} kinds of pairs. Of {} kinds five standard errors exceed the bound: there only what "
        "is beyond them counts.",
        num_patches_ - num_unresolved_, num_kinds, num_untold);
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
        "Median zero-mean normalised correlation of the same {} patches. Of {} their images do not "
        "resolve what they show: it counts twice, and their shifts do not.",
        num_patches_, num_unresolved_);
    correlation.reason =
        "The same ground from a place nearby looks the same but for sampling noise and haze; other "
        "ground "
        "correlates by less than 0.3, leaves finer than pixels by 0.5, and other leaves by 0.05.";
    correlation.detects = "images of another camera, frame or orientation than the geometry";
    std::vector<CheckResult> results{shift, correlation};
    add_single_pairs(results);
    add_channels(results);
    const Evidence::Bounds bounds{
        .principal_px = 0.1, .time_frames = 0.5, .time_residual = 0.01, .rotation_deg = 0.01};
    for (CheckResult& result :
         evidence_.results("photometric", sequence, bounds, "the shifts of patches between images",
                           "0.2 px of principal point, 0.02 deg of rotation; time only where a "
                           "frame of it moves patches by less than 3 px"))
      results.push_back(std::move(result));
    return results;
  }

 private:
  /// What a single pair of images says, beside the others of its kind.
  struct PairMedians {
    std::string kind, name;
    double correlation = 0.0;
    double shift_px = 0.0;
    bool has_shift = false;
  };

  void note_pair(const std::string& kind, const std::string& name, const PairMatches& matches) {
    const std::size_t enough = options_.is_trial ? 10 : 20;
    if (matches.correlation.size() < enough) return;
    const auto median_of = [](std::vector<double> values) { return median(values); };
    PairMedians medians{kind, name, median_of(matches.correlation), 0.0,
                        matches.shift_x.size() >= enough};
    if (medians.has_shift) {
      std::vector<double> x = matches.shift_x, y = matches.shift_y;
      medians.shift_px = std::hypot(estimate_median(x).judged(kMostFrameShift_px),
                                    estimate_median(y).judged(kMostFrameShift_px));
    }
    pairs_.push_back(std::move(medians));
  }

  /// One image that is not what the others are is lost in the medians of all.
  void add_single_pairs(std::vector<CheckResult>& results) {
    CheckResult least;
    least.name = "photometric_frames";
    least.value = 1.0;
    least.bound = 0.6;
    least.is_lower_bound = true;
    least.unit = "of its kind's";
    CheckResult farthest;
    farthest.name = "photometric_frame_shift";
    farthest.bound = kMostFrameShift_px;
    farthest.unit = "px";
    bool is_any_clear = false;
    for (const PairMedians& pair : pairs_) {
      std::vector<double> pooled = pools_.at(pair.kind).correlation;
      const double typical = median(pooled);
      // Of images that hardly correlate as such (noise at night) nothing follows for one of them. One that
      // shows more sea than the others, which mirrors another part of the sky in each, has been seen to
      // correlate by 0.53 of what they do; other ground does by less than 0.3 whatever they do.
      constexpr double kClear = 0.5, kMostAsked = 0.65;
      const double asked = std::min(typical, kMostAsked);
      is_any_clear |= typical > kClear;
      if (typical > kClear && pair.correlation / asked < least.value) {
        least.value = pair.correlation / asked;
        least.worst = pair.name;
      }
      if (pair.has_shift && pair.correlation > kClear && pair.shift_px >= farthest.value) {
        farthest.value = pair.shift_px;
        farthest.worst = pair.name;
      }
    }
    least.ok = least.is_within_bound();
    least.summary =
        "Least median correlation of a single pair of images, by the median of all pairs of its "
        "kind or 0.65, whichever is less.";
    least.reason =
        "Neighbouring frames see the ground alike; another image correlates by less than 0.3.";
    least.detects = "one image of another frame or sequence";
    farthest.ok = farthest.is_within_bound();
    farthest.summary = "Largest median shift of the patches of a single pair of images.";
    farthest.reason =
        "Medians of hundreds of patches are known to 0.01 px; of fewer only what is beyond five "
        "standard errors counts.";
    farthest.detects = "one image that stands twice where a frame moves by 0.5 px";
    results.push_back(is_any_clear ? std::move(least)
                                   : unseen_result(least.name, "no images correlate clearly"));
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
  std::vector<PairMedians> pairs_;
  std::map<std::string, PairMatches> pools_;
  std::int64_t num_patches_ = 0;
  std::int64_t num_unresolved_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_photometric_check(const ValidateOptions& options) {
  return std::make_unique<PhotometricChecker>(options);
}

}  // namespace terracast::validate
