#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/checks/photometric_frames.h"
#include "validate/checks/photometric_pairs.h"

/// Colours of one image, carried by its depth and by poses into another, against the colours there:
/// their correlation, and the sub-pixel shift that remains. This ties the images to the geometry.
namespace terracast::validate {

namespace {

class PhotometricChecker : public Checker {
 public:
  explicit PhotometricChecker(const ValidateOptions& options)
      : options_(options), images_(options.is_trial) {}

  void frame(const FrameWindow& window, const std::vector<ViewPair>& pairs) override {
    images_.finish_before(window.frame() - *std::max_element(std::begin(FrameWindow::kOffsets),
                                                             std::end(FrameWindow::kOffsets)));
    std::vector<PairMatches> matches(pairs.size());
    ValidateOptions options = options_;
    // Of few pairs more patches, so that a trial's few frames have enough of each kind.
    if (options.is_trial) options.samples_per_image = pairs.size() <= 8 ? 1600 : 600;
    core::parallel_for(static_cast<std::int64_t>(pairs.size()), [&](std::int64_t i) {
      matches[static_cast<std::size_t>(i)] =
          compare_patches(pairs[static_cast<std::size_t>(i)], options);
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
      cameras_of_kind_[kind] = {pair.a.camera->name, pair.b.camera->name};
      const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
        to.insert(to.end(), from.begin(), from.end());
      };
      append(pool.shift_x, matches[i].shift_x);
      append(pool.shift_y, matches[i].shift_y);
      append(pool.correlation, matches[i].correlation);
      append(pool.own, matches[i].own);
      pool.patches_per_fact = std::max(pool.patches_per_fact, matches[i].patches_per_fact);
      num_level_ += matches[i].num_level;
      pool.colors += matches[i].colors;
      pool.is_of_one_white = matches[i].is_of_one_white;
      images_.add(pair, matches[i]);
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
    std::set<std::string> cameras_told;
    std::string unsure;  // a kind of pairs that may be beyond its bound, and may not
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
      if (likeness.tells)
        cameras_told.insert(cameras_of_kind_[kind].begin(), cameras_of_kind_[kind].end());
      if (likeness.tells && likeness.median < likeness.bound && likeness.most >= likeness.bound)
        unsure = fmt::format("{}: median {:.3f}, which may be {:.3f} by the scatter of {} patches",
                             kind, likeness.median, likeness.most, pool.correlation.size());
      if (pool.shift_x.size() < enough) continue;
      const MedianEstimate x = estimate_median(pool.shift_x, pool.patches_per_fact);
      const MedianEstimate y = estimate_median(pool.shift_y, pool.patches_per_fact);
      const bool is_told = x.tells(shift.bound) && y.tells(shift.bound);
      ++(is_told ? num_told : num_untold);
      const double size = std::hypot(size_of(x, options_.is_trial), size_of(y, options_.is_trial));
      if (size > shift.value || (is_told && size == shift.value)) {
        shift.value = size;
        shift.worst = fmt::format("{}: ({:.3f} ± {:.2f}, {:.3f} ± {:.2f}) px of {} patches", kind,
                                  x.median, x.unsure, y.median, y.unsure, pool.shift_x.size());
      }
    }
    if (num_kinds == 0) {
      const char* reason =
          "fewer than 100 patches with contrast are seen twice: colours were not checked";
      return {unseen_result(shift.name, reason),
              unseen_result(correlation.name, reason),
              unseen_result("photometric_cameras", reason),
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
    correlation.is_unseen = correlation.skipped =
        std::isinf(least_likeness) || (correlation.ok && !unsure.empty());
    if (correlation.skipped)
      correlation.worst = !unsure.empty() ? unsure
                                          : "what the images show is not coarser than their noise, "
                                            "or too few patches are seen twice";
    correlation.detects = "images of another camera, frame or orientation than the geometry";
    std::vector<CheckResult> results{shift, correlation, cameras_result(sequence, cameras_told)};
    for (CheckResult& result : images_.results(sequence)) results.push_back(std::move(result));
    results.push_back(channels_result(sequence));
    const Evidence::Bounds bounds{.principal_px = 0.2,
                                  .time_frames = 1,
                                  .pattern = 0.003,
                                  .shared = 2.5,
                                  .rotation_deg = 0.02};
    for (CheckResult& result :
         evidence_.results("photometric", sequence, bounds, &FrameFiles::color,
                           "the shifts of patches between images",
                           "0.2 px of principal point, 0.02 deg of rotation; time only where a "
                           "frame of it moves patches by less than 3 px"))
      results.push_back(std::move(result));
    return results;
  }

 private:
  static bool has_color(const Camera& camera) {
    return std::any_of(camera.files.begin(), camera.files.end(),
                       [](const FrameFiles& files) { return !files.color.empty(); });
  }

  /// A camera that shows what no other image does, as the sky, may hold anything.
  static CheckResult cameras_result(const Sequence& sequence, const std::set<std::string>& told) {
    CheckResult cameras;
    cameras.name = "photometric_cameras";
    std::vector<std::string> untold;
    std::size_t num_colored = 0;
    for (const Camera& camera : sequence.cameras) {
      if (!has_color(camera)) continue;
      ++num_colored;
      if (!told.contains(camera.name)) untold.push_back(camera.name);
    }
    if (num_colored == 0) return skipped_result(cameras.name, "the dataset holds no images");
    cameras.value = static_cast<double>(untold.size());
    cameras.unit = "cameras";
    cameras.ok = true;
    cameras.is_of_all = true;
    cameras.is_unseen = cameras.skipped = !untold.empty();
    if (cameras.is_unseen)
      cameras.worst = fmt::format(
          "no other image could be compared with those of {}: they share fewer than 100 patches "
          "with contrast, or what these show is no coarser than noise",
          fmt::join(untold, ", "));
    cameras.summary =
        fmt::format("Cameras, of {}, whose images could not be compared with others.", num_colored);
    cameras.reason = "What no other image shows may be anything.";
    cameras.detects = "nothing by itself: it says whose images were not looked at";
    return cameras;
  }

  /// Whether red and blue stand for what they are in all cameras alike. A camera that has only itself for company, or
  /// sees grey ground, could have them swapped.
  CheckResult channels_result(const Sequence& sequence) const {
    CheckResult channels;
    channels.name = "photometric_channels";
    constexpr double kWorthFinding = 1.0;  // in colour, swapped channels make 1.8 to 3.8
    Estimates estimates(kWorthFinding);
    std::size_t num_unlike = 0;
    std::set<std::string> told;
    double most = 0.0;
    for (const auto& [kind, pool] : pools_) {
      if (!pool.is_of_one_white) ++num_unlike;
      if (!(pool.colors.swapped > 0.0)) continue;
      Estimate estimate = pool.colors.swapped_fits_better(pool.patches_per_fact);
      estimate.where = kind;
      if (estimate.degrees > 0.0) most = std::max(most, estimate.value);
      const auto& cameras = cameras_of_kind_.at(kind);
      // What fits worse swapped by as much would have been found.
      Estimates as_swapped(kWorthFinding);
      Estimate swapped = estimate;
      swapped.value = pool.colors.right_fits_better();
      as_swapped.add(swapped);
      CheckResult if_swapped;
      as_swapped.judge(if_swapped);
      if (cameras.front() != cameras.back() && !if_swapped.ok)
        told.insert(cameras.begin(), cameras.end());
      estimates.add(std::move(estimate));
    }
    if (estimates.num_all() == 0)
      return unseen_result(channels.name, num_unlike == 0
                                              ? "no two images share colours"
                                              : "no two images share colours of one white balance");
    estimates.judge(channels);
    channels.unit = "(logarithm)";
    std::vector<std::string> untold;
    for (const Camera& camera : sequence.cameras)
      if (has_color(camera) && !told.contains(camera.name)) untold.push_back(camera.name);
    if (options_.is_trial) {  // of few patches, which call nothing wrong
      channels.value = most;
      channels.bound = kWorthFinding;
      channels.is_unseen = channels.skipped = false;
      channels.ok = channels.is_within_bound();
    } else if (channels.ok && !channels.is_unseen && !untold.empty()) {
      channels.is_unseen = channels.skipped = channels.is_of_all = true;
      channels.worst = fmt::format(
          "{}: no other camera shows the same ground, or the ground is so grey that swapped "
          "channels fit as well",
          fmt::join(untold, ", "));
    }
    channels.summary =
        "By what factor, as a natural logarithm, the colours of patches in two images fit better "
        "with red and blue swapped in one of them; worst kind of pairs.";
    if (num_unlike > 0)
      channels.summary += fmt::format(
          " {} kinds are left out: imaging.json states that the two cameras balance white "
          "otherwise, so that one place has two colours.",
          num_unlike);
    channels.reason =
        "On grey ground both fit alike; in colour the right order fits better, but for the haze "
        "between two cameras and what the patches scatter by.";
    channels.detects = "blue, green, red in one camera; grey that is not the luma of its colours";
    return channels;
  }

  ValidateOptions options_;
  Evidence evidence_;
  SingleImages images_;
  std::map<std::string, PairMatches> pools_;
  std::map<std::string, std::vector<std::string>> cameras_of_kind_;
  std::int64_t num_patches_ = 0;
  std::int64_t num_unresolved_ = 0;
  std::int64_t num_level_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_photometric_check(const ValidateOptions& options) {
  return std::make_unique<PhotometricChecker>(options);
}

}  // namespace terracast::validate
