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
/// Rails that meet a road at less than this, 5 degrees, run along it.
constexpr double kLeastCrossing_rad = 0.087;

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

SegmentBoxes segments_of(const Deck& deck) {
  std::vector<Vector2d> points;
  for (const DeckPoint& point : deck.points) points.push_back(point.at_world);
  return SegmentBoxes(points);
}

Vector2d direction_of(const Deck& deck, std::size_t segment) {
  return (deck.points[segment + 1].at_world - deck.points[segment].at_world).normalized();
}

/// Of a deck's top.
struct Place {
  Vector2d at_world;
  double level_m;
};

/// Whether a place is within the width of a deck's segment and what lies beside it, at its level.
/// one_level_m   tops nearer to each other than this
bool lies_on_segment(const Deck& deck, std::size_t segment, const Place& place, double beside_m,
                     double one_level_m) {
  const DeckPoint& a = deck.points[segment];
  const DeckPoint& b = deck.points[segment + 1];
  const Vector2d along = b.at_world - a.at_world;
  const double t =
      std::clamp(along.dot(place.at_world - a.at_world) / along.squaredNorm(), 0.0, 1.0);
  return (a.at_world + t * along - place.at_world).norm() <= deck.style.half_width_m + beside_m &&
         std::abs(a.level_m + t * (b.level_m - a.level_m) - place.level_m) < one_level_m;
}

/// As far as a deck's segments are looked for: as far as places may lie on them, and roundings.
double reach_m(const Deck& deck, double beside_m) {
  return deck.style.half_width_m + beside_m + 1e-6;
}

/// A deck and where its segments are.
struct Placed {
  const Deck& deck;
  const SegmentBoxes& segments;
};

/// What a pair of decks took.
struct Looks {
  std::int64_t num_segments = 0;  ///< of the one that were held against places of the other
  bool are_too_many = false;      ///< SegmentBoxes::Found::TooMany
};

/// Where any of a deck, its middle or its sides, lies on another: whether any such place is it; so
/// it is taken to be where too many segments are near.
/// is_it   of the segments of the one and of the other
template <class IsIt>
bool touches(const Deck& deck, const Placed& other, double one_level_m, Looks& looks,
             const IsIt& is_it) {
  constexpr double kStep_m = 1.0;
  for (std::size_t k = 0; k + 1 < deck.points.size(); ++k) {
    const DeckPoint& a = deck.points[k];
    const DeckPoint& b = deck.points[k + 1];
    const Vector2d along = b.at_world - a.at_world;
    const Vector2d left = Vector2d(-along.y(), along.x()).normalized();
    const int num_steps = 1 + static_cast<int>(along.norm() / kStep_m);
    for (int i = 0; i <= num_steps; ++i)
      for (const double side : {-1.0, 0.0, 1.0}) {
        const double t = static_cast<double>(i) / num_steps;
        const Place place{a.at_world + t * along + side * deck.style.half_width_m * left,
                          a.level_m + t * (b.level_m - a.level_m)};
        const auto is_there = [&](std::size_t segment) {
          ++looks.num_segments;
          return lies_on_segment(other.deck, segment, place, kBesideParapets_m, one_level_m) &&
                 is_it(k, segment);
        };
        const SegmentBoxes::Found found =
            other.segments.any(place.at_world, reach_m(other.deck, kBesideParapets_m), is_there);
        looks.are_too_many |= found == SegmentBoxes::Found::TooMany;
        if (found != SegmentBoxes::Found::No) return true;
      }
  }
  return false;
}

bool meet(const Placed& one, const Placed& other, double one_level_m, Looks& looks) {
  const auto anywhere = [](std::size_t, std::size_t) { return true; };
  return touches(one.deck, other, one_level_m, looks, anywhere) ||
         touches(other.deck, one, one_level_m, looks, anywhere);
}

/// Of decks that meet at one level: rails cross a road, at an angle wherever they meet. Along a
/// road's bridge rails may run, as trams do.
bool is_level_crossing(const Placed& one, const Placed& other, Looks& looks) {
  if ((one.deck.style.use == WayUse::Railway) == (other.deck.style.use == WayUse::Railway))
    return false;
  const double along_cosine = std::cos(kLeastCrossing_rad);
  const auto runs_along = [&](const Deck& deck, const Placed& on) {
    return touches(deck, on, kOneLevel_m, looks, [&](std::size_t own, std::size_t others) {
      return std::abs(direction_of(deck, own).dot(direction_of(on.deck, others))) > along_cosine;
    });
  };
  return !runs_along(one.deck, other) && !runs_along(other.deck, one);
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
    : decks_(decks), lies_on_(decks.size()), crossed_by_(decks.size()) {
  for (const Deck& deck : decks) segments_.push_back(segments_of(deck));
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
    const auto& lowest = boxes[place].first;
    const auto& highest = boxes[place].second;
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
      const Placed own{deck, segments_[rows[place]]};
      const Placed others{decks[other], segments_[other]};
      Looks looks;
      if (meet(own, others, kAnyLevel_m, looks)) {
        taken_by_feet.take(feet_ranks_[other]);
        if (meet(own, others, kOneLevel_m, looks)) {
          lies_on_[rows[place]].push_back(static_cast<std::uint32_t>(other));
          if (crossed_by_[other].size() < kMostMet && is_level_crossing(own, others, looks)) {
            crossed_by_[other].push_back(static_cast<std::uint32_t>(rows[place]));
            crossed_by_[rows[place]].push_back(static_cast<std::uint32_t>(other));
          }
          taken.take(ranks_[other]);
        }
      }
      num_segments_ += looks.num_segments;
      num_tangled_ += looks.are_too_many ? 1 : 0;
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

bool JoinedDecks::is_without_marks(std::size_t row, const Vector2d& at_world,
                                   double level_m) const {
  const auto lies_on_any = [&](const std::vector<std::uint32_t>& others, double beside_m) {
    return std::any_of(others.begin(), others.end(), [&](std::uint32_t other) {
      const Deck& deck = decks_[other];
      const auto is_there = [&](std::size_t segment) {
        return lies_on_segment(deck, segment, {at_world, level_m}, beside_m, kOneLevel_m);
      };
      return segments_[other].any(at_world, reach_m(deck, beside_m), is_there) !=
             SegmentBoxes::Found::No;
    });
  };
  // Where decks cross whose slopes differ, lines keep off what bears the parapets, too.
  return lies_on_any(lies_on_[row], kBesideLines_m) ||
         lies_on_any(crossed_by_[row], kBesideParapets_m);
}

}  // namespace terracast::tiler
