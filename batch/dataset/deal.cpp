#include "batch/dataset/deal.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace terracast::batch {

namespace {

using Frames = std::array<std::int64_t, 3>;

class Dealing {
 public:
  Dealing(const std::vector<std::int64_t>& groups, const Frames& targets)
      : groups_(groups), targets_(targets), parts_(groups.size()), order_(groups.size()) {
    for (int part = 0; part < 3; ++part)
      if (targets[static_cast<std::size_t>(part)] > 0) allowed_.push_back(part);
    if (allowed_.empty()) allowed_.push_back(0);
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::stable_sort(order_.begin(), order_.end(),
                     [&](std::size_t a, std::size_t b) { return groups[a] > groups[b]; });
  }

  std::vector<int> run() {
    if (groups_.size() <= kMostTriedOut) {
      std::vector<int> parts = parts_;
      try_out(0, Frames{}, parts);
      return parts_;
    }
    give_to_the_neediest();
    while (exchange_best()) continue;
    return parts_;
  }

 private:
  double off_by(int part, std::int64_t frames) const {
    return static_cast<double>(frames - targets_[static_cast<std::size_t>(part)]);
  }
  double cost_of(const Frames& frames) const {
    double sum = 0.0;
    for (int part = 0; part < 3; ++part) {
      const double off = off_by(part, frames[static_cast<std::size_t>(part)]);
      sum += off * off;
    }
    return sum;
  }

  void try_out(std::size_t num_dealt, const Frames& frames, std::vector<int>& parts) {
    if (num_dealt == order_.size()) {
      const double cost = cost_of(frames);
      if (best_cost_ >= 0.0 && cost >= best_cost_) return;
      best_cost_ = cost;
      parts_ = parts;
      return;
    }
    const std::size_t group = order_[num_dealt];
    for (const int part : allowed_) {
      Frames with = frames;
      with[static_cast<std::size_t>(part)] += groups_[group];
      parts[group] = part;
      try_out(num_dealt + 1, with, parts);
    }
  }

  void give_to_the_neediest() {
    for (const std::size_t group : order_) {
      const int part = *std::min_element(allowed_.begin(), allowed_.end(), [&](int a, int b) {
        return off_by(a, frames_[static_cast<std::size_t>(a)]) <
               off_by(b, frames_[static_cast<std::size_t>(b)]);
      });
      parts_[group] = part;
      frames_[static_cast<std::size_t>(part)] += groups_[group];
    }
  }

  /// What two parts may give each other: a group, or nothing.
  struct Gift {
    std::int64_t frames = 0;
    std::ptrdiff_t group = -1;
  };

  std::vector<Gift> gifts_of(int part) const {
    std::vector<Gift> gifts;
    for (auto at = order_.rbegin(); at != order_.rend(); ++at)
      if (parts_[*at] == part) gifts.push_back({groups_[*at], static_cast<std::ptrdiff_t>(*at)});
    gifts.insert(gifts.begin(), Gift{});  // no group has fewer frames than none
    return gifts;
  }

  /// The move or exchange that makes the cost least, if any makes it less.
  bool exchange_best() {
    double best_gain = 0.0;
    std::pair<Gift, Gift> best;
    std::pair<int, int> between;
    for (std::size_t i = 0; i < allowed_.size(); ++i)
      for (std::size_t k = i + 1; k < allowed_.size(); ++k) {
        const int a = allowed_[i];
        const int b = allowed_[k];
        const double off_a = off_by(a, frames_[static_cast<std::size_t>(a)]);
        const double off_b = off_by(b, frames_[static_cast<std::size_t>(b)]);
        // With d frames more given than taken: (off_a - d)^2 + (off_b + d)^2, least half way between.
        const double best_difference = 0.5 * (off_a - off_b);
        const std::vector<Gift> from_a = gifts_of(a);
        const std::vector<Gift> from_b = gifts_of(b);
        std::size_t at = 0;
        for (const Gift& given : from_a) {
          const double wanted = static_cast<double>(given.frames) - best_difference;
          while (at + 1 < from_b.size() && static_cast<double>(from_b[at + 1].frames) <= wanted)
            ++at;
          for (std::size_t n = at; n < std::min(at + 2, from_b.size()); ++n) {
            const auto d = static_cast<double>(given.frames - from_b[n].frames);
            const double gain = 2.0 * d * (off_a - off_b - d);
            if (gain <= best_gain) continue;
            best_gain = gain;
            best = {given, from_b[n]};
            between = {a, b};
          }
        }
      }
    if (best_gain <= 0.0) return false;
    give(best.first, between.first, between.second);
    give(best.second, between.second, between.first);
    return true;
  }

  void give(const Gift& gift, int from, int to) {
    if (gift.group < 0) return;
    parts_[static_cast<std::size_t>(gift.group)] = to;
    frames_[static_cast<std::size_t>(from)] -= gift.frames;
    frames_[static_cast<std::size_t>(to)] += gift.frames;
  }

  const std::vector<std::int64_t>& groups_;
  Frames targets_;
  std::vector<int> parts_;
  std::vector<int> allowed_;
  std::vector<std::size_t> order_;  ///< groups with most frames first
  Frames frames_ = {};
  double best_cost_ = -1.0;
};

}  // namespace

std::vector<int> deal(const std::vector<std::int64_t>& groups,
                      const std::array<std::int64_t, 3>& targets) {
  return Dealing(groups, targets).run();
}

}  // namespace terracast::batch
