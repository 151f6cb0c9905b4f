#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "batch/dataset/ground_cells.h"
#include "core/schema.h"

namespace terracast::batch {

enum class Split { Train, Val, Test };
inline constexpr std::array<std::string_view, 3> kSplitNames = {"train", "val", "test"};
inline std::string_view split_name(Split split) {
  return kSplitNames[static_cast<std::size_t>(split)];
}

/// How sequences are divided among train, val and test.
struct SplitOptions {
  double train = 0.8;  ///< share of the frames
  double val = 0.1;
  double test = 0.1;
  double margin_m = 1000.0;
  std::int64_t seed = 1;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("train", train, "Share of the frames for training.", core::between(0.0, 1.0));
    visit.key("val", val, "Share of the frames for validation while training.",
              core::between(0.0, 1.0));
    visit.key("test", test, "Share of the frames for the last test. The three add up to 1.",
              core::between(0.0, 1.0));
    visit.key("margin_m", margin_m,
              "Least distance between grounds that are seen in different splits.",
              core::between(0.0, 1e6));
    visit.key("seed", seed, "Which of equally good divisions is taken.");
  }
  /// throws   Config: shares that do not add up to 1, or a value out of range
  void validate() const;
  double share(Split split) const {
    return std::array{train, val, test}[static_cast<std::size_t>(split)];
  }
};

/// What the division needs to know of a sequence.
struct SplitSequence {
  std::string name;  ///< "run/sequence", of this one alone
  std::int64_t num_frames = 0;
  const GroundSeen* ground = nullptr;
};

struct SplitAssignment {
  std::vector<Split> splits;  ///< of each sequence, as they were given
  std::vector<int> groups;  ///< of each: those of one number hang together; numbered by least name
  int num_groups = 0;
  std::array<std::int64_t, 3> num_sequences = {};
  std::array<std::int64_t, 3> num_frames = {};
  /// What was done, in sentences: how many groups, shares wanted and met, and where a split got
  /// nothing, why and what would help. Names are as they were given.
  std::string words;
};

/// Divides sequences so that no ground is seen in two splits, and a gap of margin_m lies between
/// (tie_grounds): what hangs together goes whole into one. Groups are dealt so that the sum of the
/// squares of what the splits' frames are off by is least: tried out for up to 12 groups; beyond, no
/// move of a group and no exchange of two makes it less. If all hangs together, all is for training.
///
/// returns   the same for any order of the sequences
/// cost      as tie_grounds
/// throws    Config: as SplitOptions::validate; Input: two sequences of one name
SplitAssignment assign_splits(const std::vector<SplitSequence>& sequences,
                              const SplitOptions& options);

}  // namespace terracast::batch
