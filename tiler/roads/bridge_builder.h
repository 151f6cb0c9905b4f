#pragma once

#include <functional>
#include <vector>

#include "geo/geodesy.h"
#include "tiler/roads/road_bed.h"
#include "tiler/roads/road_heights.h"
#include "tiler/roads/road_network.h"
#include "world/tile_objects.h"

namespace terracast::tiler {

/// A place on the middle of a deck.
struct DeckPoint {
  Eigen::Vector2d at_world;
  Eigen::Vector2d tangent;
  double along_m = 0.0;
  double level_m = 0.0;  ///< of its top
};

/// A bridge, or a pier on piles, along a line.
struct Deck {
  std::uint64_t feature = 0;
  std::uint64_t key = 0;  ///< for its id
  WayStyle style;
  std::vector<DeckPoint> points;
  double thickness_m = 1.1;
  double parapet_m = 0.9;       ///< 0: none
  double span_m = 28.0;         ///< between supports
  double feet_lowered_m = 0.0;  ///< by which the feet of its supports are lower than they need be
  bool has_abutments = true;
};

/// Bridges of a network: one for each stretch of spans that are bridges.
std::vector<Deck> bridge_decks(const RoadNetwork& network, const RoadHeights& heights);

/// What a deck stands on.
struct DeckSite {
  const geo::WorldFrame& frame;
  std::function<double(const Eigen::Vector2d&)> ground_level_m;  ///< finished
  std::function<bool(const Eigen::Vector2d&)> is_water;
  /// Whether no support may stand there.
  std::function<bool(const Eigen::Vector2d&, double radius_m)> is_taken;
  /// Whether the deck bears no marks (lines, sleepers) there, for another deck lies there at that
  /// level; none: it bears them everywhere.
  std::function<bool(const Eigen::Vector2d&, double level_m)> is_without_marks = nullptr;
};

/// The shape of a deck: closed bodies, each oriented outward: the deck with its parapets, supports, abutments,
/// marks or rails on it. Levels are shown to kFineDeck and kCoarseDeck.
/// returns   its id is not set; no levels: too short for a shape
world::Solid build_deck(const Deck& deck, const DeckSite& site);

constexpr int kFineDeckLevel = 3;
constexpr int kCoarseDeckLevel = 7;
/// So much a deck's top lies above the profile, so that it is not in the road's own plane where they meet.
constexpr double kDeckAbove_m = 0.01;

}  // namespace terracast::tiler
