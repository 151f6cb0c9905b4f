#include "validate/checks/photometric_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "validate/checks/checker.h"
#include "validate/judged_images.h"
#include "validate/null_distribution.h"

namespace terracast::validate {

namespace {

/// What other ground mostly correlates by less than.
constexpr double kUnlike = 0.4;
/// Of images that hardly correlate as such (noise at night) nothing follows for one of them.
constexpr double kClear = 0.5, kClearOfItself = 0.35, kMostTypical = 0.5;
/// An image has been seen to have so many more unlike patches than others, that saw less of what moves in the wind.
constexpr double kMoreAtLeast = 0.15, kTimes = 1.5;

std::ptrdiff_t num_unlike(const std::vector<double>& correlations) {
  return std::count_if(correlations.begin(), correlations.end(),
                       [](double value) { return value < kUnlike; });
}

void append(std::vector<double>& to, const std::vector<double>& from, double factor = 1.0) {
  for (const double value : from) to.push_back(factor * value);
}

}  // namespace

void SingleImages::add(const ViewPair& pair, const PairMatches& matches) {
  const int is_same_time = pair.is_same_time() ? 1 : 0;
  const auto key_of = [&](const View& view) {
    return Key{view.frame, view.camera_index, is_same_time};
  };
  const Count count{.unlike = num_unlike(matches.correlation),
                    .all = static_cast<std::int64_t>(matches.correlation.size())};
  for (const View* view : {&pair.a, &pair.b}) {
    Count& link = links_[key_of(*view)][key_of(view == &pair.a ? pair.b : pair.a)];
    link.unlike += count.unlike;
    link.all += count.all;
    Pool& pool = pools_[key_of(*view)];
    pool.name = place_of(*view);
    PairMatches& all = pool.matches;
    append(all.correlation, matches.correlation);
    append(all.own, matches.own);
    all.patches_per_fact =
        patches_per_fact(all.correlation.size(), view->camera->intrinsics.width_px,
                         view->camera->intrinsics.height_px);
    if (pair.a.camera_index != pair.b.camera_index) continue;
    // What an image shows elsewhere than its geometry has it stands off by as much, the other way, in the pairs whose
    // second it is.
    const double sign = view == &pair.a ? 1.0 : -1.0;
    append(all.shift_x, matches.shift_x, sign);
    append(all.shift_y, matches.shift_y, sign);
  }
}

void SingleImages::set_shift(PairMatches& matches, Image& image) const {
  const MedianEstimate x = estimate_median(matches.shift_x, matches.patches_per_fact);
  const MedianEstimate y = estimate_median(matches.shift_y, matches.patches_per_fact);
  image.has_shift = true;
  image.shift_px = std::hypot(size_of(x, is_trial_), size_of(y, is_trial_));
  image.unsure_px = std::max(x.unsure, y.unsure);
}

void SingleImages::finish_before(int frame) {
  const std::size_t enough = is_trial_ ? 10 : 20;
  while (!pools_.empty() && pools_.begin()->first[0] < frame) {
    Pool& pool = pools_.begin()->second;
    PairMatches& all = pool.matches;
    if (all.correlation.size() >= enough) {
      const double num_facts = static_cast<double>(all.correlation.size()) / all.patches_per_fact;
      Image image{.key = pools_.begin()->first,
                  .name = pool.name,
                  .likeness = likeness_of(all, !is_trial_),
                  .patches = {.unlike = num_unlike(all.correlation),
                              .all = static_cast<std::int64_t>(all.correlation.size())},
                  .num_facts = std::max<std::int64_t>(std::llround(num_facts), 1)};
      if (all.shift_x.size() >= enough) set_shift(all, image);
      images_.push_back(std::move(image));
    }
    pools_.erase(pools_.begin());
  }
}

void SingleImages::sort_images() {
  finish_before(std::numeric_limits<int>::max());
  for (const Image& image : images_) {
    by_key_[image.key] = &image;
    shares_[{image.key[1], image.key[2]}].push_back(image.patches.share());
  }
  for (auto& [camera, shares] : shares_) std::sort(shares.begin(), shares.end());
}

/// The share of unlike patches of that quarter of the camera's other images which is most like its own others. An image
/// that is wrong spoils the pairs of its neighbours, so that theirs with it are left out.
/// returns  1 where there is no other
/// cost     linear in the camera's images
double SingleImages::typical_share(const Image& image) const {
  std::vector<double> left_out{image.patches.share()}, instead;
  for (const auto& [key, shared] : links_.at(image.key)) {
    const auto other = by_key_.find(key);
    if (other == by_key_.end() || key[1] != image.key[1]) continue;
    left_out.push_back(other->second->patches.share());
    const Count rest{.unlike = other->second->patches.unlike - shared.unlike,
                     .all = other->second->patches.all - shared.all};
    if (rest.all > 0) instead.push_back(rest.share());
  }
  std::sort(left_out.begin(), left_out.end());
  const std::vector<double>& all = shares_.at({image.key[1], image.key[2]});
  std::vector<double> shares;
  std::set_difference(all.begin(), all.end(), left_out.begin(), left_out.end(),
                      std::back_inserter(shares));
  shares.insert(shares.end(), instead.begin(), instead.end());
  return shares.empty() ? 1.0 : quantile(shares, 0.25);
}

/// The share of unlike patches up to which an image is not called another.
/// returns  nothing where the others hardly correlate either
std::optional<double> SingleImages::bound_of(const Image& image) const {
  const double typical = typical_share(image);
  if (typical > kMostTypical) return std::nullopt;
  const double expected = std::min(kMoreAtLeast + kTimes * typical, 1.0);
  if (is_trial_) return expected;
  const double probability = kFalseVerdict / static_cast<double>(images_.size());
  return static_cast<double>(binomial_quantile(probability, image.num_facts, expected)) /
         static_cast<double>(image.num_facts);
}

/// Unlike patches of all pairs with an image, of its own time and of others: one that is of another place has part in
/// all that it spoils, and what it spoils in less.
std::int64_t SingleImages::num_unlike_of_all(const Image& image) const {
  std::int64_t num = 0;
  for (const int is_same_time : {0, 1})
    if (const auto links = links_.find({image.key[0], image.key[1], is_same_time});
        links != links_.end())
      for (const auto& [other, count] : links->second) num += count.unlike;
  return num;
}

/// Whether one in its place, of which half of the patches are unlike, would be called another.
bool SingleImages::tells_another(const Image& image) const {
  if (image.likeness.own <= kClearOfItself) return false;
  const std::vector<double>& shares = shares_.at({image.key[1], image.key[2]});
  const double typical = shares[(shares.size() - 1) / 4];
  const double probability = kFalseVerdict / static_cast<double>(images_.size());
  const std::int64_t bound = binomial_quantile(probability, image.num_facts,
                                               std::min(kMoreAtLeast + kTimes * typical, 1.0));
  return 2 * bound < image.num_facts;
}

CheckResult SingleImages::unlike_result(const Sequence& sequence) const {
  CheckResult result;
  result.name = "photometric_frames";
  result.unit = "share";
  // Those of most unlike patches first: the others are within every bound.
  std::vector<const Image*> images;
  for (const Image& image : images_)
    if (image.likeness.own > kClearOfItself) images.push_back(&image);
  std::stable_sort(images.begin(), images.end(), [](const Image* a, const Image* b) {
    return a->patches.share() > b->patches.share();
  });
  double most_used = -1.0;
  std::int64_t most_blamed = 0;
  for (const Image* image : images) {
    const double share = image->patches.share();
    if (most_used >= 0.0 && share <= kMoreAtLeast) break;
    const std::optional<double> bound = bound_of(*image);
    if (!bound) continue;
    const double used = share / *bound;
    const std::int64_t blamed = used > 1.0 ? num_unlike_of_all(*image) : 0;
    if (std::pair(blamed, used) <= std::pair(most_blamed, most_used)) continue;
    most_used = used;
    most_blamed = blamed;
    result.value = share;
    result.bound = *bound;
    result.worst = fmt::format("{}: median {:.3f}", image->name, image->likeness.median);
  }
  if (most_used < 0.0) return unseen_result(result.name, "no images correlate clearly");
  result.ok = result.is_within_bound();
  result.summary = fmt::format(
      "Largest share of the patches of a single image that correlate by less than {} with the "
      "other images that see them.",
      kUnlike);
  result.reason = fmt::format(
      "Neighbouring frames see the ground alike; half and more of the patches of another image "
      "correlate by less. The bound is what {} times the share of a quarter of the camera's other "
      "images, and {}, leave with a probability of 1e-9.",
      kTimes, kMoreAtLeast);
  result.detects = "one image of another frame or sequence";
  if (is_trial_ || !result.ok) return result;
  JudgedImages judged;
  for (const Image& image : images_)
    if (tells_another(image)) judged.add(image.key[1], image.key[0]);
  result.unseen_parts = judged.unseen_parts(sequence, &FrameFiles::color);
  return result;
}

CheckResult SingleImages::shift_result() const {
  CheckResult result;
  result.name = "photometric_frame_shift";
  result.bound = 0.3;
  result.unit = "px";
  std::size_t num_told = 0;
  double most_unsure_px = 0.0;
  for (const Image& image : images_) {
    if (!image.has_shift || image.likeness.median <= kClear) continue;
    if (image.unsure_px < result.bound) {
      ++num_told;
      most_unsure_px = std::max(most_unsure_px, image.unsure_px);
    }
    if (image.shift_px < result.value) continue;
    result.value = image.shift_px;
    result.worst = image.name;
  }
  if (result.worst.empty())
    return unseen_result(result.name, "no two images resolve enough of what both show");
  result.ok = result.is_within_bound();
  if (!is_trial_ && result.ok && num_told == 0)
    return unseen_result(result.name, "the patches of no image are enough to tell its shift");
  if (num_told > 0) result.smallest = result.bound + 2.0 * most_unsure_px;
  result.summary =
      "Largest median shift of the patches of a single image against the other frames: the part "
      "of it that is sure.";
  result.reason =
      "Medians of hundreds of patches are known to 0.01 px; only what is sure of them counts.";
  result.detects = "one image that stands twice where a frame moves by 0.5 px";
  return result;
}

std::vector<CheckResult> SingleImages::results(const Sequence& sequence) {
  sort_images();
  return {unlike_result(sequence), shift_result()};
}

}  // namespace terracast::validate
