#include "geo/fixes/cleaning.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace terracast::geo {
namespace {

/// Times nearer than that are the same.
constexpr double kLeastStep_s = 1e-6;

std::vector<PlacedFix> with_time(const std::vector<PlacedFix>& fixes, CleaningCounts& counts) {
  std::vector<PlacedFix> timed;
  bool starts_part = false;
  for (const PlacedFix& fix : fixes) {
    starts_part |= fix.starts_part;
    if (!std::isfinite(fix.time_s)) {
      ++counts.num_without_time;
      continue;
    }
    timed.push_back(fix);
    timed.back().starts_part = starts_part;
    starts_part = false;
  }
  return timed;
}

using IsSame = bool (*)(const PlacedFix&, const PlacedFix&);

bool is_same_place(const PlacedFix& a, const PlacedFix& b) { return a.recorded == b.recorded; }
bool is_same_but_for_height(const PlacedFix& a, const PlacedFix& b) { return a.held == b.held; }

double median_of(std::vector<double> values) {
  constexpr std::size_t kFewest = 2;
  if (values.size() < kFewest) return 0.0;
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median time between fixes at which the place changes; 0 where it changes less than twice.
double median_change_s(const std::vector<PlacedFix>& fixes, IsSame is_same) {
  std::vector<double> between_s;
  std::size_t last_change = 0;
  for (std::size_t i = 1; i < fixes.size(); ++i) {
    if (is_same(fixes[i], fixes[i - 1])) continue;
    const double since_s = fixes[i].time_s - fixes[last_change].time_s;
    if (since_s > kLeastStep_s) between_s.push_back(since_s);
    last_change = i;
  }
  return median_of(std::move(between_s));
}

/// Whether the receiver is slower than the recorder: then a barometer may change the height of a place that is held.
bool is_receiver_slower(const std::vector<PlacedFix>& fixes) {
  constexpr double kSlower = 1.5;
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < fixes.size(); ++i)
    if (fixes[i].time_s - fixes[i - 1].time_s > kLeastStep_s)
      steps_s.push_back(fixes[i].time_s - fixes[i - 1].time_s);
  return median_change_s(fixes, is_same_but_for_height) > kSlower * median_of(std::move(steps_s));
}

// A recorder that is faster than its receiver writes each place again until the next comes; only its
// first is a fix. What stands still longer than hold_s is taken to stand still.
std::vector<std::size_t> without_repeats(const std::vector<PlacedFix>& fixes,
                                         const CleaningOptions& options, CleaningCounts& counts) {
  const IsSame is_same = is_receiver_slower(fixes) ? is_same_but_for_height : is_same_place;
  const double hold_s =
      std::min(options.hold_s > 0.0 ? options.hold_s : 3.0 * median_change_s(fixes, is_same),
               0.5 * options.max_gap_s);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const auto is_repeat = [&](std::size_t before) {
      const double since_s = fixes[i].time_s - fixes[before].time_s;
      // A row that was written twice is a repeat, whatever hold_s is.
      return !fixes[i].starts_part && is_same(fixes[i], fixes[before]) &&
             (since_s < hold_s || std::abs(since_s) < kLeastStep_s);
    };
    if (!kept.empty() && is_repeat(kept.back()))
      ++counts.num_repeated;
    else
      kept.push_back(i);
  }
  return kept;
}

/// The longest chain of fixes in which each can be reached from the one before.
class LongestChain {
 public:
  LongestChain(const std::vector<PlacedFix>& fixes, std::vector<std::size_t> candidates,
               const CleaningOptions& options)
      : fixes_(fixes), candidates_(std::move(candidates)), options_(options) {}

  std::vector<std::size_t> find() {
    const std::size_t count = candidates_.size();
    std::vector<std::size_t> length(count, 1), before(count, kNone), longest_up_to(count, 1);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = i; j-- > 0 && i - j <= kLongestWrongRun;) {
        if (longest_up_to[j] + 1 <= length[i]) break;
        if (length[j] + 1 > length[i] && is_reachable(candidates_[j], candidates_[i])) {
          length[i] = length[j] + 1;
          before[i] = j;
        }
      }
      longest_up_to[i] = std::max(length[i], i > 0 ? longest_up_to[i - 1] : 1);
    }
    std::vector<std::size_t> chain;
    if (count == 0) return chain;
    const auto end = std::max_element(length.begin(), length.end());
    for (auto i = static_cast<std::size_t>(end - length.begin()); i != kNone; i = before[i])
      chain.push_back(candidates_[i]);
    std::reverse(chain.begin(), chain.end());
    return chain;
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  bool is_reachable(std::size_t from, std::size_t to) const {
    const double time_s = fixes_[to].time_s - fixes_[from].time_s;
    if (time_s < kLeastStep_s) return false;
    const double distance_m = (fixes_[to].position_world - fixes_[from].position_world).norm();
    return distance_m <= options_.max_speed_mps * time_s + options_.slack_m;
  }

  const std::vector<PlacedFix>& fixes_;
  std::vector<std::size_t> candidates_;
  const CleaningOptions& options_;
};

bool is_at_once(const PlacedFix& a, const PlacedFix& b) {
  return std::abs(a.time_s - b.time_s) < kLeastStep_s;
}

void count_dropped(const std::vector<PlacedFix>& fixes, const std::vector<std::size_t>& candidates,
                   const std::vector<std::size_t>& chain, CleaningCounts& counts) {
  std::size_t next = 0;
  for (const std::size_t i : candidates) {
    if (next < chain.size() && chain[next] == i) {
      ++next;
      continue;
    }
    const bool is_late = next > 0 && fixes[i].time_s < fixes[chain[next - 1]].time_s + kLeastStep_s;
    const bool is_early =
        next < chain.size() && fixes[i].time_s > fixes[chain[next]].time_s - kLeastStep_s;
    const bool is_of_same_time = (next > 0 && is_at_once(fixes[i], fixes[chain[next - 1]])) ||
                                 (next < chain.size() && is_at_once(fixes[i], fixes[chain[next]]));
    ++(is_of_same_time       ? counts.num_of_same_time
       : is_late || is_early ? counts.num_out_of_order
                             : counts.num_impossible);
  }
}

/// Attitudes of a part, in order of time: also of fixes whose place was dropped, where their time lies
/// between those of the kept ones before and after them.
std::vector<PlacedFix> orientations_in(const std::vector<PlacedFix>& fixes,
                                       std::span<const std::size_t> kept) {
  std::vector<PlacedFix> result;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const std::size_t end = k + 1 < kept.size() ? kept[k + 1] : kept[k] + 1;
    const double latest_s = fixes[k + 1 < kept.size() ? kept[k + 1] : kept[k]].time_s;
    for (std::size_t i = kept[k]; i < end; ++i) {
      const bool is_later = result.empty() || fixes[i].time_s > result.back().time_s + kLeastStep_s;
      if (fixes[i].world_from_body && is_later && fixes[i].time_s >= fixes[kept[k]].time_s &&
          fixes[i].time_s <= latest_s)
        result.push_back(fixes[i]);
    }
  }
  return result;
}

}  // namespace

std::vector<FixPart> clean_fixes(const std::vector<PlacedFix>& recorded,
                                 const CleaningOptions& options, CleaningCounts& counts) {
  const std::vector<PlacedFix> fixes = with_time(recorded, counts);
  const std::vector<std::size_t> candidates = without_repeats(fixes, options, counts);
  const std::vector<std::size_t> chain = LongestChain(fixes, candidates, options).find();
  count_dropped(fixes, candidates, chain, counts);
  // A part begins where the file says so, be the fix that says it kept or dropped.
  std::vector<std::size_t> num_starts(fixes.size() + 1, 0);
  for (std::size_t i = 0; i < fixes.size(); ++i)
    num_starts[i + 1] = num_starts[i] + (fixes[i].starts_part ? 1 : 0);
  std::vector<FixPart> parts;
  for (std::size_t begin = 0, end = 0; begin < chain.size(); begin = end) {
    for (end = begin + 1; end < chain.size(); ++end) {
      const bool is_gap =
          fixes[chain[end]].time_s - fixes[chain[end - 1]].time_s > options.max_gap_s;
      if (is_gap || num_starts[chain[end] + 1] > num_starts[chain[end - 1] + 1]) break;
    }
    if (end - begin < kFewestFixes) {
      counts.num_in_short_parts += end - begin;
      continue;
    }
    FixPart part;
    for (std::size_t i = begin; i < end; ++i) part.positions.push_back(fixes[chain[i]]);
    part.orientations = orientations_in(fixes, std::span(chain).subspan(begin, end - begin));
    parts.push_back(std::move(part));
  }
  return parts;
}

void take_attitudes(const std::vector<PlacedFix>& attitudes, std::vector<FixPart>& parts) {
  for (FixPart& part : parts) {
    const auto begin = std::lower_bound(
        attitudes.begin(), attitudes.end(), part.positions.front().time_s,
        [](const PlacedFix& attitude, double time_s) { return attitude.time_s < time_s; });
    const auto end = std::upper_bound(
        begin, attitudes.end(), part.positions.back().time_s,
        [](double time_s, const PlacedFix& attitude) { return time_s < attitude.time_s; });
    part.orientations.assign(begin, end);
  }
}

}  // namespace terracast::geo
