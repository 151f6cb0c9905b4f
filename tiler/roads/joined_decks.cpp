#include "tiler/roads/joined_decks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "tiler/box_index.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// Tops nearer to each other than this are one carriageway: less than any clearance under a bridge.
constexpr double kOneLevel_m = 0.5;
/// Lines keep so far from another deck's paving: half their width, and bends that decks are thinned
/// by.
constexpr double kBesideLines_m = 0.3;
/// Parapets of two decks beside each other stand on so much beside their paving.
constexpr double kBesideParapets_m = 1.2;

std::pair<Vector2d, Vector2d> box_of(const Deck& deck) {
  Vector2d lowest = deck.points.front().at_world, highest = lowest;
  for (const DeckPoint& point : deck.points) {
    lowest = lowest.cwiseMin(point.at_world);
    highest = highest.cwiseMax(point.at_world);
  }
  const double reach_m = deck.style.half_width_m + kBesideParapets_m;
  return {lowest.array() - reach_m, highest.array() + reach_m};
}

bool goes_before(const Deck& one, const Deck& other) {
  return std::pair(-one.style.half_width_m, one.key) <
         std::pair(-other.style.half_width_m, other.key);
}

/// one_level_m   tops nearer to each other than this
bool lies_on(const Deck& deck, const Vector2d& at_world, double level_m, double beside_m,
             double one_level_m = kOneLevel_m) {
  for (std::size_t k = 1; k < deck.points.size(); ++k) {
    const DeckPoint& a = deck.points[k - 1];
    const DeckPoint& b = deck.points[k];
    const Vector2d along = b.at_world - a.at_world;
    const double t = std::clamp(along.dot(at_world - a.at_world) / along.squaredNorm(), 0.0, 1.0);
    if ((a.at_world + t * along - at_world).norm() <= deck.style.half_width_m + beside_m &&
        std::abs(a.level_m + t * (b.level_m - a.level_m) - level_m) < one_level_m)
      return true;
  }
  return false;
}

/// Whether any of a deck, its middle or its sides, lies on another.
bool touches(const Deck& deck, const Deck& other, double one_level_m) {
  constexpr double kStep_m = 1.0;
  for (std::size_t k = 1; k < deck.points.size(); ++k) {
    const DeckPoint& a = deck.points[k - 1];
    const DeckPoint& b = deck.points[k];
    const Vector2d along = b.at_world - a.at_world;
    const Vector2d left = Vector2d(-along.y(), along.x()).normalized();
    const int num = 1 + static_cast<int>(along.norm() / kStep_m);
    for (int i = 0; i <= num; ++i)
      for (const double side : {-1.0, 0.0, 1.0}) {
        const double t = static_cast<double>(i) / num;
        if (lies_on(other, a.at_world + t * along + side * deck.style.half_width_m * left,
                    a.level_m + t * (b.level_m - a.level_m), kBesideParapets_m, one_level_m))
          return true;
      }
  }
  return false;
}

bool meet(const Deck& one, const Deck& other, double one_level_m) {
  return touches(one, other, one_level_m) || touches(other, one, one_level_m);
}

/// Rails cross a road: on neither lie the marks of the other.
bool is_level_crossing(const Deck& one, const Deck& other) {
  return (one.style.use == WayUse::Railway) != (other.style.use == WayUse::Railway);
}

/// Ranks that others have.
class TakenRanks {
 public:
  void take(int rank) {
    if (rank < JoinedDecks::kMostRank) is_taken_[static_cast<std::size_t>(rank)] = true;
  }
  int least_free() const {
    return static_cast<int>(std::find(is_taken_.begin(), is_taken_.end(), false) -
                            is_taken_.begin());
  }

 private:
  std::array<bool, JoinedDecks::kMostRank> is_taken_ = {};
};

}  // namespace

JoinedDecks::JoinedDecks(const std::vector<Deck>& decks)
    : decks_(decks), bearing_marks_(decks.size()) {
  // Those that go before others first, so that a deck meets no others.
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < decks.size(); ++row)
    if (!decks[row].points.empty()) rows.push_back(row);
  std::stable_sort(rows.begin(), rows.end(),
                   [&](std::size_t a, std::size_t b) { return goes_before(decks[a], decks[b]); });
  BoxIndex index;
  std::vector<std::pair<Vector2d, Vector2d>> boxes;
  for (const std::size_t row : rows) {
    boxes.push_back(box_of(decks[row]));
    index.add(static_cast<std::uint32_t>(boxes.size() - 1), boxes.back().first,
              boxes.back().second);
  }
  index.finish();
  ranks_.resize(decks.size(), 0);
  feet_ranks_.resize(decks.size(), 0);
  for (std::uint32_t place = 0; place < rows.size(); ++place) {
    const Deck& deck = decks[rows[place]];
    const auto& [lowest, highest] = boxes[place];
    TakenRanks taken, taken_by_feet;
    int num_met = 0;
    const auto look_at = [&](std::uint32_t earlier) {
      ++num_pairs_;
      const std::size_t other = rows[earlier];
      if (!goes_before(decks[other], deck) ||
          (boxes[earlier].first.array() > highest.array()).any() ||
          (boxes[earlier].second.array() < lowest.array()).any())
        return true;
      if (num_met++ == kMostMet) return false;
      constexpr double kAnyLevel_m = std::numeric_limits<double>::infinity();
      if (!meet(deck, decks[other], kAnyLevel_m)) return true;
      taken_by_feet.take(feet_ranks_[other]);
      if (!meet(deck, decks[other], kOneLevel_m)) return true;
      bearing_marks_[rows[place]].push_back(static_cast<std::uint32_t>(other));
      if (is_level_crossing(deck, decks[other]))
        bearing_marks_[other].push_back(static_cast<std::uint32_t>(rows[place]));
      taken.take(ranks_[other]);
      return true;
    };
    index.visit(lowest, highest, place, look_at);
    ranks_[rows[place]] = taken.least_free();
    feet_ranks_[rows[place]] = taken_by_feet.least_free();
  }
}

Deck JoinedDecks::lowered(std::size_t row) const {
  Deck deck = decks_[row];
  for (DeckPoint& point : deck.points) point.level_m -= kLower_m * ranks_[row];
  deck.feet_lowered_m = kLower_m * feet_ranks_[row];
  return deck;
}

bool JoinedDecks::other_bears_lines(std::size_t row, const Vector2d& at_world,
                                    double level_m) const {
  return std::any_of(bearing_marks_[row].begin(), bearing_marks_[row].end(),
                     [&](std::uint32_t other) {
                       return lies_on(decks_[other], at_world, level_m, kBesideLines_m);
                     });
}

}  // namespace terracast::tiler
