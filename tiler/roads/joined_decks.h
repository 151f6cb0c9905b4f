#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tiler/roads/bridge_builder.h"
#include "tiler/roads/segment_boxes.h"

namespace terracast::tiler {

/// Decks that lie over each other at one level, as where bridges join. Both would be in one plane:
/// so each is lower than those that go before it there, the wider ones, or of equally wide ones
/// those with lower keys, and bears no marks (lines, sleepers) where it lies on them; where rails
/// cross a road, at an angle of 5 degrees and more wherever they meet, neither bears any. Supports
/// of decks that cross, at whatever levels, may meet in the ground: their feet are apart likewise.
///
/// limits    decks whose slopes differ cross each other all the same, along a line, about which
///           they are in one plane as far as roundings go (1.5 mm: 0.7 m for slopes 0.4 % apart);
///           the least lowered of more than kMostRank is as low as another; of those that go before
///           a deck the first kMostMet whose boxes meet its own are looked at, and of those after
///           it that are level crossings the first kMostMet: where decks crowd, faces in one plane
///           may stay; where more of a deck is near a place than SegmentBoxes looks at, as where it
///           is scribbled, it is taken to lie there
/// cost      the length of decks whose boxes meet, times segments that are near each other, and the
///           logarithm of all of a deck's: SegmentBoxes::kMostBoxes at most
/// threads   safe
class JoinedDecks {
 public:
  /// By so much for each rank: lines, from 30 mm below tops to 6 mm above them, are in no other
  /// deck's plane either.
  static constexpr double kLower_m = 0.020;
  static constexpr int kMostRank = 7;
  static constexpr int kMostMet = 256;

  /// decks   must outlive it
  explicit JoinedDecks(const std::vector<Deck>& decks);

  /// The deck as it is built.
  Deck lowered(std::size_t row) const;
  /// Whether a deck bears no marks at a place of its top: another bears them there, or they cross.
  bool is_without_marks(std::size_t row, const Eigen::Vector2d& at_world, double level_m) const;
  /// Pairs of decks in common cells of the index that were looked at.
  std::int64_t num_pairs() const { return num_pairs_; }
  /// Segments that were held against places of other decks.
  std::int64_t num_segments() const { return num_segments_; }
  /// Pairs of decks that were taken to lie on each other somewhere: too much of one was near.
  std::int64_t num_tangled() const { return num_tangled_; }

 private:
  const std::vector<Deck>& decks_;
  std::vector<SegmentBoxes> segments_;                  ///< of each deck
  std::vector<std::vector<std::uint32_t>> lies_on_;     ///< of each deck those before it
  std::vector<std::vector<std::uint32_t>> crossed_by_;  ///< rails by roads, roads by rails
  std::vector<int> ranks_;                              ///< among those that it lies on
  std::vector<int> feet_ranks_;  ///< among those that it lies on, over or under
  std::int64_t num_pairs_ = 0;
  std::int64_t num_segments_ = 0;
  std::int64_t num_tangled_ = 0;
};

}  // namespace terracast::tiler
