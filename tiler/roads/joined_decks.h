#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tiler/roads/bridge_builder.h"

namespace terracast::tiler {

/// Decks that lie over each other at one level, as where bridges join at a small angle: there one of them bears its lines,
/// the wider one, or of equally wide ones that with the lower key. Both would be in one plane.
///
/// cost      segments of decks whose boxes meet
/// threads   safe
class JoinedDecks {
 public:
  /// decks   must outlive it
  explicit JoinedDecks(const std::vector<Deck>& decks);

  /// Whether another deck bears the lines at a place of a deck's top.
  /// row   of the deck
  bool other_bears_lines(std::size_t row, const Eigen::Vector2d& at_world, double level_m) const;

 private:
  const std::vector<Deck>& decks_;
  std::vector<std::vector<std::uint32_t>> going_before_;  ///< of each deck those near it that do
};

}  // namespace terracast::tiler
