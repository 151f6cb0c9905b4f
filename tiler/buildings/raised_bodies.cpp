#include "tiler/buildings/raised_bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/parallel.h"
#include "tiler/buildings/roof_measures.h"
#include "world/tile.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::kHeightStep_m;

/// A corner so near to another body stands at it: of buildings, and of parts, which lean on their
/// own.
constexpr double kSeam_m = 0.15;
constexpr double kPartsSeam_m = 0.9;
/// Heights that are nearer to each other are one: they are stated in centimetres.
constexpr double kSameHeight_m = 0.005;
/// Of a footprint over others from which on it stands in their pitched roofs, and does not jut out
/// of them.
constexpr double kStandsIn = 0.9;
/// What juts out of others goes so much deeper at most: as deep as parapets are high.
constexpr double kMostJutting_m = 1.0;
/// Ground whose heights differ by less is one.
constexpr double kSameGround_m = 0.01;
/// Other ground is known about so well: between its samples, and before ways are cut into it.
constexpr double kGroundUnsure_m = 0.5;
/// Corners at which the ground is looked at.
constexpr std::size_t kMostCorners = 48;

/// What of a building is asked often.
struct Facts {
  double lowest_m = std::numeric_limits<double>::infinity();  ///< of its ground, ellipsoidal
  double highest_m = -std::numeric_limits<double>::infinity();
  double top_m = 0.0;    ///< above its lowest ground
  double floor_m = 0.0;  ///< as low as its roof may lie
};

Facts facts_of(const Building& building, const std::function<double(const Vector2d&)>& height_m) {
  Facts facts;
  const auto& corners = ground_corners(building);
  for (std::size_t i = 0; i < corners.size(); i += corners.size() / kMostCorners + 1) {
    const double height = height_m(building.footprint.place_m.cast<double>() +
                                   kHeightStep_m * corners[i].cast<double>());
    facts.lowest_m = std::min(facts.lowest_m, height);
    facts.highest_m = std::max(facts.highest_m, height);
  }
  const BuildingDesign& design = building.design;
  facts.top_m = design.top_m;
  if (design.bottom_m <= 0.0)
    facts.top_m = std::max(facts.top_m, facts.highest_m - facts.lowest_m + kClearOfGround_m);
  facts.floor_m = facts.top_m - roof_depth_m(design, building.footprint.rings, building.own);
  return facts;
}

/// A body near a raised one. Heights above the raised one's lowest ground.
struct Other {
  const Building* building;
  double bottom_m;
  double top_m;
  double floor_m;
  double share;  ///< of the raised one's footprint over it
  bool has_same_ground;
};

/// Whether a place lies between others: no line through it has all of them on one side.
bool is_between(const Vector2d& place, const std::vector<Vector2d>& others) {
  if (others.empty()) return false;
  std::vector<double> bearings;
  for (const Vector2d& other : others)
    bearings.push_back(std::atan2((other - place).y(), (other - place).x()));
  std::sort(bearings.begin(), bearings.end());
  double widest = bearings.front() + 2.0 * std::numbers::pi - bearings.back();
  for (std::size_t i = 1; i < bearings.size(); ++i)
    widest = std::max(widest, bearings[i] - bearings[i - 1]);
  return widest <= std::numbers::pi + 1e-9;
}

/// What becomes of a raised body.
struct Verdict {
  enum class Change { None, Lowered, Grounded };
  Change change = Change::None;
  double bottom_m = 0.0;
  double footing_m = 0.0;
};

class RaisedBody {
 public:
  /// rows   of what is near it
  RaisedBody(std::size_t row, const std::vector<std::uint32_t>& rows,
             const std::vector<Building>& buildings, const std::vector<Facts>& facts)
      : body_(buildings[row]) {
    const std::vector<Vector2d> places = places_within(body_);
    const auto num_places = static_cast<double>(std::max<std::size_t>(places.size(), 1));
    for (const Vector2d& place : places) middle_ += place / num_places;
    for (const std::uint32_t j : rows) {
      if (j == row) continue;
      const double higher_m = facts[j].lowest_m - facts[row].lowest_m;
      const auto num_over = std::count_if(places.begin(), places.end(), [&](const Vector2d& place) {
        return contains_world(buildings[j], place);
      });
      others_.push_back(
          {.building = &buildings[j],
           .bottom_m = higher_m + buildings[j].design.bottom_m,
           .top_m = higher_m + facts[j].top_m,
           .floor_m = higher_m + facts[j].floor_m,
           .share = static_cast<double>(num_over) / num_places,
           .has_same_ground = std::abs(facts[j].lowest_m - facts[row].lowest_m) < kSameGround_m &&
                              std::abs(facts[j].highest_m - facts[row].highest_m) < kSameGround_m});
    }
  }

  Verdict verdict() const {
    Verdict verdict;
    verdict.bottom_m = body_.design.bottom_m;
    double highest_m = 0.0;
    for (const Other& other : others_)
      if (is_below(other)) highest_m = std::max(highest_m, other.top_m);
    if (highest_m < verdict.bottom_m - kSameHeight_m) {
      if (is_held_beside()) return verdict;
      verdict.change = highest_m > 0.0 ? Verdict::Change::Lowered : Verdict::Change::Grounded;
      verdict.bottom_m = highest_m;
    }
    verdict.footing_m = footing_m(verdict.bottom_m);
    return verdict;
  }

 private:
  bool is_below(const Other& other) const {
    return other.share > 0.0 && other.bottom_m < body_.design.bottom_m;
  }

  /// From a height down to the lowest roof of all that carry it there.
  double footing_m(double bottom_m) const {
    const auto carries = [&](const Other& other) {
      return is_below(other) && other.top_m >= bottom_m - kSameHeight_m;
    };
    double share = 0.0;
    for (const Other& other : others_)
      if (carries(other)) share += other.share;
    double deepest_m = 0.0;
    for (const Other& other : others_) {
      if (!carries(other)) continue;
      double deeper_m = std::max(bottom_m - other.floor_m, 0.0);
      if (!other.has_same_ground) deeper_m += kGroundUnsure_m;
      if (share < kStandsIn) deeper_m = std::min(deeper_m, kMostJutting_m);
      deepest_m = std::max(deepest_m, deeper_m);
    }
    return std::min(deepest_m, bottom_m);
  }

  bool is_held_beside() const {
    std::vector<Vector2d> held;
    for (const Eigen::Vector2i& corner : body_.footprint.rings.front()) {
      const Vector2d at =
          body_.footprint.place_m.cast<double>() + kHeightStep_m * corner.cast<double>();
      if (std::any_of(others_.begin(), others_.end(),
                      [&](const Other& other) { return is_at(at, other); }))
        held.push_back(at);
    }
    return body_.is_part ? held.size() >= 2 : is_between(middle_, held);
  }

  bool is_at(const Vector2d& corner, const Other& other) const {
    const double bottom_m = body_.design.bottom_m;
    if (other.bottom_m > bottom_m + kSameHeight_m || other.top_m < bottom_m) return false;
    for (const double seam_m : {kSeam_m, kPartsSeam_m})
      if (seam_m == kSeam_m || body_.is_part)
        for (const double dx : {-seam_m, seam_m})
          for (const double dy : {-seam_m, seam_m})
            if (contains_world(*other.building, corner + Vector2d(dx, dy))) return true;
    return false;
  }

  const Building& body_;
  std::vector<Other> others_;
  Vector2d middle_ = Vector2d::Zero();
};

std::vector<std::uint32_t> rows_near(const Building& body, const std::vector<Building>& buildings,
                                     const BoxIndex& index, std::int64_t& num_pairs) {
  const Vector2d lowest = body.lowest_world.array() - kPartsSeam_m;
  const Vector2d highest = body.highest_world.array() + kPartsSeam_m;
  std::vector<std::uint32_t> rows = index.rows_in(lowest, highest);
  num_pairs += static_cast<std::int64_t>(rows.size());
  std::erase_if(rows, [&](std::uint32_t row) {
    return (buildings[row].lowest_world.array() > highest.array()).any() ||
           (buildings[row].highest_world.array() < lowest.array()).any();
  });
  return rows;
}

}  // namespace

RaisedCounts settle_raised_bodies(std::vector<Building>& buildings, const BoxIndex& index,
                                  const std::function<double(const Vector2d&)>& height_m) {
  const auto for_each = [](std::size_t num, const auto& work) {
    core::parallel_for_blocks(static_cast<std::int64_t>(num), 16,
                              [&](std::int64_t begin, std::int64_t end) {
                                for (std::int64_t k = begin; k < end; ++k)
                                  work(static_cast<std::size_t>(k));
                              });
  };
  RaisedCounts counts;
  std::vector<std::size_t> raised;
  std::vector<char> is_asked(buildings.size(), 0);
  for (std::size_t row = 0; row < buildings.size(); ++row) {
    if (buildings[row].design.bottom_m <= 0.0) continue;
    raised.push_back(row);
    for (const std::uint32_t other : rows_near(buildings[row], buildings, index, counts.num_pairs))
      is_asked[other] = 1;
  }
  std::vector<Facts> facts(buildings.size());
  for_each(buildings.size(), [&](std::size_t row) {
    if (is_asked[row] != 0) facts[row] = facts_of(buildings[row], height_m);
  });
  // All verdicts before any is carried out, so that their order does not matter.
  std::vector<Verdict> verdicts(raised.size());
  for_each(raised.size(), [&](std::size_t k) {
    std::int64_t num_pairs = 0;  // counted above
    const auto rows = rows_near(buildings[raised[k]], buildings, index, num_pairs);
    verdicts[k] = RaisedBody(raised[k], rows, buildings, facts).verdict();
  });
  for (std::size_t k = 0; k < raised.size(); ++k) {
    BuildingDesign& design = buildings[raised[k]].design;
    design.bottom_m = verdicts[k].bottom_m;
    design.footing_m = verdicts[k].footing_m;
    counts.num_lowered += verdicts[k].change == Verdict::Change::Lowered ? 1 : 0;
    counts.num_grounded += verdicts[k].change == Verdict::Change::Grounded ? 1 : 0;
  }
  return counts;
}

}  // namespace terracast::tiler
