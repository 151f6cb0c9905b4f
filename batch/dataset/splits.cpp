#include "batch/dataset/splits.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "batch/dataset/deal.h"
#include "batch/dataset/ground_ties.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"

namespace terracast::batch {

namespace {

using core::ErrorKind;
using core::fail;

/// How many frames of all a split is meant to have.
std::int64_t target_of(const SplitOptions& options, Split split, std::int64_t num_frames) {
  const double share = options.share(split);
  return share > 0.0
             ? std::max<std::int64_t>(1, std::llround(share * static_cast<double>(num_frames)))
             : 0;
}

std::uint64_t draw(const SplitOptions& options, const std::string& name) {
  return core::random_bits(static_cast<std::uint64_t>(options.seed), 0,
                           core::content_hash64(std::as_bytes(std::span(name))));
}

/// What sequences hang together, and their names sorted.
struct Groups {
  std::vector<const SplitSequence*> sequences;  ///< by name
  GroundTies ties;                              ///< of these
};

Groups group(const std::vector<SplitSequence>& sequences, double margin_m) {
  Groups groups;
  for (const SplitSequence& sequence : sequences) groups.sequences.push_back(&sequence);
  std::sort(groups.sequences.begin(), groups.sequences.end(),
            [](const SplitSequence* a, const SplitSequence* b) { return a->name < b->name; });
  std::vector<const GroundSeen*> grounds;
  for (std::size_t i = 0; i < groups.sequences.size(); ++i) {
    if (i > 0 && groups.sequences[i]->name == groups.sequences[i - 1]->name)
      fail(ErrorKind::Input, "two sequences are called {}", groups.sequences[i]->name);
    grounds.push_back(groups.sequences[i]->ground);
  }
  groups.ties = tie_grounds(grounds, margin_m);
  return groups;
}

std::vector<Split> deal_groups(const Groups& groups, const SplitOptions& options) {
  struct Group {
    std::int64_t num_frames = 0;
    std::uint64_t draw = 0;
    int number = 0;
  };
  std::vector<Group> deck(static_cast<std::size_t>(groups.ties.num_components));
  std::int64_t num_frames = 0;
  for (std::size_t i = groups.sequences.size(); i-- > 0;) {
    const int number = groups.ties.components[i];
    Group& entry = deck[static_cast<std::size_t>(number)];
    entry = {entry.num_frames + groups.sequences[i]->num_frames,
             draw(options, groups.sequences[i]->name), number};
    num_frames += groups.sequences[i]->num_frames;
  }
  std::vector<Split> splits(deck.size(), Split::Train);
  if (deck.size() < 2) return splits;
  std::sort(deck.begin(), deck.end(), [](const Group& a, const Group& b) {
    return std::tie(a.draw, a.number) < std::tie(b.draw, b.number);
  });
  std::vector<std::int64_t> sizes;
  for (const Group& entry : deck) sizes.push_back(entry.num_frames);
  std::array<std::int64_t, 3> targets{};
  for (std::size_t k = 0; k < targets.size(); ++k)
    targets[k] = target_of(options, static_cast<Split>(k), num_frames);
  const std::vector<int> parts = deal(sizes, targets);
  for (std::size_t i = 0; i < deck.size(); ++i)
    splits[static_cast<std::size_t>(deck[i].number)] = static_cast<Split>(parts[i]);
  return splits;
}

std::string metres(double distance_m) { return fmt::format("{:g} m", distance_m); }

/// What ties the sequences of the largest group, by some examples.
std::string describe_ties(const Groups& groups, int number, const SplitOptions& options) {
  constexpr std::size_t kMostExamples = 3;
  std::vector<std::string> examples;
  std::size_t num_ties = 0;
  std::size_t num_shared = 0;
  const auto name = [&](int index) -> const std::string& {
    return groups.sequences[static_cast<std::size_t>(index)]->name;
  };
  for (const GroundTie& tie : groups.ties.ties) {
    if (groups.ties.components[static_cast<std::size_t>(tie.first)] != number) continue;
    ++num_ties;
    num_shared += tie.is_shared ? 1 : 0;
    if (examples.size() < kMostExamples)
      examples.push_back(
          tie.is_shared
              ? fmt::format("{} and {} show the same ground", name(tie.first), name(tie.second))
              : fmt::format("ground of {} and {} is less than {} apart", name(tie.first),
                            name(tie.second), metres(options.margin_m)));
  }
  return fmt::format("{}{} (ties: {}, of shared ground: {})", fmt::join(examples, "; "),
                     num_ties > examples.size() ? "; …" : "", num_ties, num_shared);
}

std::string describe_remedies(const Groups& groups, const SplitOptions& options) {
  const double within_m = groups.sequences.front()->ground->within_m;
  return fmt::format(
      "More groups come from sequences over other places, from counting ground only when it is "
      "nearer to the camera (within_m, now {}), or from a smaller margin_m (now {}).",
      std::isfinite(within_m) ? metres(within_m) : "any distance", metres(options.margin_m));
}

/// The group with most frames.
int largest_group(const Groups& groups) {
  std::vector<std::int64_t> frames(static_cast<std::size_t>(groups.ties.num_components));
  for (std::size_t i = 0; i < groups.sequences.size(); ++i)
    frames[static_cast<std::size_t>(groups.ties.components[i])] += groups.sequences[i]->num_frames;
  return static_cast<int>(std::max_element(frames.begin(), frames.end()) - frames.begin());
}

std::string describe(const SplitAssignment& assignment, const Groups& groups,
                     const SplitOptions& options) {
  if (groups.sequences.empty()) return "There are no sequences.";
  const bool is_one = assignment.num_groups == 1;
  if (is_one && groups.sequences.size() == 1)
    return fmt::format(
        "There is one sequence, {}, and it is for training: one sequence shows the same ground "
        "throughout. Splits need sequences over other places.",
        groups.sequences.front()->name);
  if (is_one)
    return fmt::format(
        "All {} sequences hang together and are for training: {}. No part can be held back without "
        "showing its ground, or ground less than {} from it, in two splits. {}",
        groups.sequences.size(), describe_ties(groups, 0, options), metres(options.margin_m),
        describe_remedies(groups, options));

  const auto num_frames = static_cast<double>(
      std::accumulate(assignment.num_frames.begin(), assignment.num_frames.end(), std::int64_t{0}));
  std::vector<std::string> shares;
  std::vector<std::string> empty;
  for (std::size_t k = 0; k < kSplitNames.size(); ++k) {
    const double share =
        num_frames > 0.0 ? static_cast<double>(assignment.num_frames[k]) / num_frames : 0.0;
    const double wanted = options.share(static_cast<Split>(k));
    shares.push_back(fmt::format("{} {:.1f} % of the frames ({:g} % wanted)", kSplitNames[k],
                                 100.0 * share, 100.0 * wanted));
    if (wanted > 0.0 && assignment.num_sequences[k] == 0) empty.emplace_back(kSplitNames[k]);
  }
  std::string words = fmt::format(
      "The {} sequences fall into {} groups; ground of different groups is {} or more apart. {}.",
      groups.sequences.size(), assignment.num_groups, metres(options.margin_m),
      fmt::join(shares, ", "));
  if (!empty.empty()) {
    const int largest = largest_group(groups);
    const auto size =
        std::count(groups.ties.components.begin(), groups.ties.components.end(), largest);
    words += fmt::format(" Nothing is left for {}", fmt::join(empty, " and "));
    if (size > 1)
      words += fmt::format(": {} sequences hang together: {}", size,
                           describe_ties(groups, largest, options));
    words += fmt::format(". {}", describe_remedies(groups, options));
  }
  return words;
}

}  // namespace

void SplitOptions::validate() const {
  for (std::size_t k = 0; k < kSplitNames.size(); ++k)
    if (const double wanted = share(static_cast<Split>(k)); !(wanted >= 0.0 && wanted <= 1.0))
      fail(ErrorKind::Config, "{} = {}; a share is between 0 and 1", kSplitNames[k], wanted);
  // Shares as people write them, thirds included.
  if (const double sum = train + val + test; !(std::abs(sum - 1.0) < 1e-3))
    fail(ErrorKind::Config, "train + val + test = {}; shares add up to 1", sum);
  if (!(margin_m >= 0.0 && std::isfinite(margin_m)))
    fail(ErrorKind::Config, "margin_m = {}; a distance of 0 or more is wanted", margin_m);
}

SplitAssignment assign_splits(const std::vector<SplitSequence>& sequences,
                              const SplitOptions& options) {
  options.validate();
  const Groups groups = group(sequences, options.margin_m);
  const std::vector<Split> splits = deal_groups(groups, options);
  SplitAssignment assignment;
  assignment.splits.resize(sequences.size());
  assignment.groups.resize(sequences.size());
  assignment.num_groups = groups.ties.num_components;
  for (std::size_t i = 0; i < groups.sequences.size(); ++i) {
    const auto given = static_cast<std::size_t>(groups.sequences[i] - sequences.data());
    const int number = groups.ties.components[i];
    const Split split = splits[static_cast<std::size_t>(number)];
    assignment.splits[given] = split;
    assignment.groups[given] = number;
    ++assignment.num_sequences[static_cast<std::size_t>(split)];
    assignment.num_frames[static_cast<std::size_t>(split)] += groups.sequences[i]->num_frames;
  }
  assignment.words = describe(assignment, groups, options);
  return assignment;
}

}  // namespace terracast::batch
