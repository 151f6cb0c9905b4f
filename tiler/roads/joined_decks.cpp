#include "tiler/roads/joined_decks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tiler/box_index.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// Tops nearer to each other than this are one carriageway: less than any clearance under a bridge.
constexpr double kOneLevel_m = 0.5;
/// Lines keep so far from where another deck's begin: half their width, and bends that decks are thinned by.
constexpr double kBeside_m = 0.3;

std::pair<Vector2d, Vector2d> box_of(const Deck& deck) {
  Vector2d lowest = deck.points.front().at_world, highest = lowest;
  for (const DeckPoint& point : deck.points) {
    lowest = lowest.cwiseMin(point.at_world);
    highest = highest.cwiseMax(point.at_world);
  }
  const double reach_m = deck.style.half_width_m + kBeside_m;
  return {lowest.array() - reach_m, highest.array() + reach_m};
}

bool goes_before(const Deck& one, const Deck& other) {
  return std::pair(-one.style.half_width_m, one.key) <
         std::pair(-other.style.half_width_m, other.key);
}

bool lies_on(const Deck& deck, const Vector2d& at_world, double level_m) {
  for (std::size_t k = 1; k < deck.points.size(); ++k) {
    const DeckPoint& a = deck.points[k - 1];
    const DeckPoint& b = deck.points[k];
    const Vector2d along = b.at_world - a.at_world;
    const double t = std::clamp(along.dot(at_world - a.at_world) / along.squaredNorm(), 0.0, 1.0);
    if ((a.at_world + t * along - at_world).norm() <= deck.style.half_width_m + kBeside_m &&
        std::abs(a.level_m + t * (b.level_m - a.level_m) - level_m) < kOneLevel_m)
      return true;
  }
  return false;
}

}  // namespace

JoinedDecks::JoinedDecks(const std::vector<Deck>& decks)
    : decks_(decks), going_before_(decks.size()) {
  BoxIndex index;
  std::vector<std::pair<Vector2d, Vector2d>> boxes;
  for (const Deck& deck : decks) {
    boxes.push_back(deck.points.empty() ? std::pair<Vector2d, Vector2d>() : box_of(deck));
    if (!deck.points.empty())
      index.add(static_cast<std::uint32_t>(boxes.size() - 1), boxes.back().first,
                boxes.back().second);
  }
  index.finish();
  for (std::size_t row = 0; row < decks.size(); ++row) {
    if (decks[row].points.empty()) continue;
    const auto& [lowest, highest] = boxes[row];
    for (const std::uint32_t other : index.rows_in(lowest, highest))
      if (other != row && goes_before(decks[other], decks[row]) &&
          (boxes[other].first.array() <= highest.array()).all() &&
          (boxes[other].second.array() >= lowest.array()).all())
        going_before_[row].push_back(other);
  }
}

bool JoinedDecks::other_bears_lines(std::size_t row, const Vector2d& at_world,
                                    double level_m) const {
  return std::any_of(
      going_before_[row].begin(), going_before_[row].end(),
      [&](std::uint32_t other) { return lies_on(decks_[other], at_world, level_m); });
}

}  // namespace terracast::tiler
