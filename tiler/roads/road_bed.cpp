#include "tiler/roads/road_bed.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "core/random.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr double kCell_m = 16.0;
/// Banks rise 1 in 1.5; on steep ground they are steeper, as walls are, or they would not meet it.
constexpr double kBankSlope = 2.0 / 3.0;
constexpr double kSteepestBank = 3.0;
constexpr double kLeastReach_m = 6.0;
constexpr double kMostReach_m = 60.0;
/// A bank is straight as far as this share of its reach.
constexpr double kStraightShare = 0.7;
/// Steeper banks that are so high are walls. They begin a little beyond where they are met, so that what stands
/// above them stands on tiles of 4 m, too.
constexpr double kWallSlope = 1.0;
constexpr double kWall_m = 8.0;
constexpr double kWallTop_m = 4.0;
/// What a piece wants of places before and beyond it yields by more than any way's grade.
constexpr double kYield = 0.3;
/// The ground below a deck lies so much below its underside.
constexpr double kBelowDeck_m = 0.5;
/// Pads count so much less than ways, from their sides inward over so many metres.
constexpr double kPadBlend_m = 12.0;

std::uint64_t key_of(std::int32_t i, std::int32_t j) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32 |
         static_cast<std::uint32_t>(j);
}
std::int32_t cell_of(double at) { return static_cast<std::int32_t>(std::floor(at / kCell_m)); }

/// How far a bank may be from the level of its way's side, so far out.
double bank_m(double out_m, double slope, double reach_m) {
  if (out_m <= 0.0) return 0.0;
  if (out_m >= reach_m) return std::numeric_limits<double>::infinity();
  const double straight_m = kStraightShare * reach_m;
  if (out_m <= straight_m) return slope * out_m;
  const double t = (out_m - straight_m) / (reach_m - straight_m);
  return slope * out_m / (1.0 - t * t);
}

}  // namespace

RingSide side_of_rings(const std::vector<PointsWorld>& rings_world, const Vector2d& place_world) {
  RingSide side;
  double nearest = std::numeric_limits<double>::infinity();
  for (const PointsWorld& ring : rings_world)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vector2d& a = ring[i];
      const Vector2d& b = ring[(i + 1) % ring.size()];
      const Vector2d edge = b - a;
      const double squared = edge.squaredNorm();
      const double t =
          squared > 0.0 ? std::clamp((place_world - a).dot(edge) / squared, 0.0, 1.0) : 0.0;
      nearest = std::min(nearest, (a + t * edge - place_world).squaredNorm());
      if ((a.y() > place_world.y()) != (b.y() > place_world.y()) &&
          place_world.x() < a.x() + (place_world.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
        side.is_inside = !side.is_inside;
    }
  side.distance_m = std::sqrt(nearest);
  return side;
}

RoadBed::RoadBed(const RoadNetwork& network, const RoadHeights& heights,
                 const RoadGroundFunction& ground,
                 const std::vector<std::vector<std::pair<double, double>>>& gaps,
                 std::vector<Pad> pads)
    : pads_(std::move(pads)) {
  add_pieces(network, heights, ground, gaps);
  index();
}

void RoadBed::add_pieces(const RoadNetwork& network, const RoadHeights& heights,
                         const RoadGroundFunction& ground,
                         const std::vector<std::vector<std::pair<double, double>>>& gaps) {
  // Banks by the ground beside each point: how steep it is, and how far out it is met.
  struct Bank {
    float slope = static_cast<float>(kBankSlope);
    float reach_m = static_cast<float>(kLeastReach_m);
    float wall_m = 0.0f;  ///< how far out a wall goes
  };
  const auto& lines = network.lines();
  std::vector<std::vector<Bank>> banks(lines.size());
  core::parallel_for(static_cast<std::int64_t>(lines.size()), [&](std::int64_t l) {
    const Line& line = lines[static_cast<std::size_t>(l)];
    auto& own = banks[static_cast<std::size_t>(l)];
    own.resize(line.points.size());
    for (const Span& span : line.spans) {
      const WayStyle& style = network.style(span);
      if (!style.is_shaped || style.is_bridge || style.is_tunnel) continue;
      const double core_m = style.half_width_m + style.shoulder_m;
      double last_along_m = -1e9;
      std::uint32_t last_p = span.first_point;
      for (std::uint32_t p = span.first_point; p <= span.last_point; ++p) {
        const Line::Point& point = line.points[p];
        if (p != span.last_point && point.along_m - last_along_m < 6.0) {
          own[p] = own[last_p];
          continue;
        }
        last_along_m = point.along_m;
        last_p = p;
        const double level_m = heights.level_m(point);
        const Vector2d left(-point.tangent.y(), point.tangent.x());
        double slope = kBankSlope;
        double reach_m = kLeastReach_m;
        double wall_m = 0.0;
        for (const double side : {-1.0, 1.0}) {
          const auto ground_at = [&](double out_m) {
            return ground(point.at_world + side * (core_m + out_m) * left).level_m;
          };
          const double at_side_m = ground_at(0.0);
          const double off_m = std::abs(at_side_m - level_m);
          if (off_m < 1.0) {
            reach_m = std::max(reach_m, 4.0 + 3.0 * off_m / kBankSlope);
            continue;
          }
          // Ground that falls away from a dam, or rises from a cutting, is met by steeper banks only.
          const double far_m = ground_at(12.0);
          const double away =
              at_side_m < level_m ? (at_side_m - far_m) / 12.0 : (far_m - at_side_m) / 12.0;
          slope = std::max(slope, std::min(1.3 * away + 0.25, kSteepestBank));
          double out_m = off_m / slope;
          for (; out_m < kMostReach_m; out_m += 4.0)
            if (std::abs(ground_at(out_m) - level_m) < slope * out_m) break;
          reach_m = std::max(reach_m, 1.5 * out_m + 6.0);
          if (slope > kWallSlope && slope * out_m > kWall_m)
            wall_m = std::max(wall_m, std::min(out_m + kWallTop_m, kMostReach_m));
        }
        own[p] = {static_cast<float>(slope), static_cast<float>(std::min(reach_m, kMostReach_m)),
                  static_cast<float>(wall_m)};
      }
    }
    // What one point needs its neighbours have, so that banks change little by little.
    std::vector<Bank> wide = own;
    for (std::size_t p = 0; p < own.size(); ++p)
      for (const std::size_t q : {p - 1, p + 1})
        if (q < own.size()) {
          wide[p].slope = std::max(wide[p].slope, own[q].slope);
          wide[p].reach_m = std::max(wide[p].reach_m, own[q].reach_m);
          wide[p].wall_m = std::max(wide[p].wall_m, own[q].wall_m);
        }
    own = std::move(wide);
  });

  for (std::size_t l = 0; l < lines.size(); ++l) {
    const Line& line = lines[l];
    for (std::size_t s = 0; s < line.spans.size(); ++s) {
      const Span& span = line.spans[s];
      const WayStyle& style = network.style(span);
      if (style.is_tunnel || (!style.is_shaped && !style.is_bridge)) continue;
      const auto is_ground = [&](std::size_t other) {
        const WayStyle& there = network.style(line.spans[other]);
        return there.is_shaped && !there.is_bridge && !there.is_tunnel;
      };
      const bool goes_on_before = s > 0 ? is_ground(s - 1) : line.is_closed;
      const bool goes_on_after = s + 1 < line.spans.size() ? is_ground(s + 1) : line.is_closed;
      // The line ends among others, or in the open.
      const bool leaves_before = s > 0 && !is_ground(s - 1);
      const bool leaves_after = s + 1 < line.spans.size() && !is_ground(s + 1);
      const double begin_m = line.points[span.first_point].along_m;
      const double end_m = line.points[span.last_point].along_m;
      const double core_m = style.half_width_m + style.shoulder_m;
      for (std::uint32_t p = span.first_point; p < span.last_point; ++p) {
        const Line::Point& a = line.points[p];
        const Line::Point& b = line.points[p + 1];
        const Vector2d step = b.at_world - a.at_world;
        const double length_m = step.norm();
        if (length_m < 1e-4) continue;
        const double middle_m = 0.5 * (a.along_m + b.along_m);
        if (std::any_of(gaps[l].begin(), gaps[l].end(), [&](const auto& gap) {
              return middle_m > gap.first && middle_m < gap.second;
            }))
          continue;
        Piece piece{};
        piece.a = a.at_world;
        piece.direction = step / length_m;
        piece.tangent_a = a.tangent;
        piece.tangent_b = b.tangent;
        // Cross-sections of sharp corners would run along the way.
        if (piece.tangent_a.dot(piece.direction) < 0.4) piece.tangent_a = piece.direction;
        if (piece.tangent_b.dot(piece.direction) < 0.4) piece.tangent_b = piece.direction;
        piece.length_m = length_m;
        piece.level_a = heights.level_m(a);
        piece.level_b = heights.level_m(b);
        piece.is_deck = style.is_bridge;
        piece.core_m = static_cast<float>(style.is_bridge ? style.half_width_m + 0.6 : core_m);
        piece.held_m =
            piece.core_m +
            (style.is_bridge ? 0.0f : std::max(banks[l][p].wall_m, banks[l][p + 1].wall_m));
        piece.bank_slope_a = banks[l][p].slope;
        piece.bank_slope_b = banks[l][p + 1].slope;
        piece.reach_a_m = banks[l][p].reach_m;
        piece.reach_b_m = banks[l][p + 1].reach_m;
        if (style.is_bridge) {
          // Ground stays below the underside.
          const double under_m = RoadHeights::deck_m(style) + kBelowDeck_m;
          const auto sunk = [&](double along_m) {
            const bool first_of = s == 0 || !network.style(line.spans[s - 1]).is_bridge;
            const bool last_of =
                s + 1 == line.spans.size() || !network.style(line.spans[s + 1]).is_bridge;
            const double from_end_m =
                std::min(first_of ? along_m - begin_m : 1e9, last_of ? end_m - along_m : 1e9);
            return under_m * std::clamp(from_end_m - 1.0, 0.0, 1.0);
          };
          piece.level_a -= sunk(a.along_m);
          piece.level_b -= sunk(b.along_m);
          piece.bank_slope_a = piece.bank_slope_b = 2.0f;
          piece.reach_a_m = piece.reach_b_m = 8.0f;
        }
        const bool is_first = p == span.first_point;
        const bool is_last = p + 1 == span.last_point;
        piece.has_end_a = is_first && !goes_on_before;
        piece.has_end_b = is_last && !goes_on_after;
        piece.is_open_a = is_first && leaves_before;
        piece.is_open_b = is_last && leaves_after;
        pieces_.push_back(piece);
      }
    }
  }
}

void RoadBed::index() {
  for (std::uint32_t k = 0; k < pieces_.size(); ++k) {
    const Piece& piece = pieces_[k];
    const double far_m = static_cast<double>(piece.core_m) +
                         static_cast<double>(std::max(piece.reach_a_m, piece.reach_b_m));
    const Vector2d b = piece.a + piece.length_m * piece.direction;
    const Vector2d low = piece.a.cwiseMin(b).array() - far_m;
    const Vector2d high = piece.a.cwiseMax(b).array() + far_m;
    for (std::int32_t j = cell_of(low.y()); j <= cell_of(high.y()); ++j)
      for (std::int32_t i = cell_of(low.x()); i <= cell_of(high.x()); ++i) {
        // Not in corners that it does not reach.
        const Vector2d middle((i + 0.5) * kCell_m, (j + 0.5) * kCell_m);
        const double t = std::clamp((middle - piece.a).dot(piece.direction), 0.0, piece.length_m);
        if ((piece.a + t * piece.direction - middle).norm() > far_m + 0.75 * kCell_m) continue;
        cells_[key_of(i, j)].pieces.push_back(k);
      }
  }
  for (std::uint32_t k = 0; k < pads_.size(); ++k) {
    const Pad& pad = pads_[k];
    Vector2d low = pad.rings_world.front().front();
    Vector2d high = low;
    for (const Vector2d& at : pad.rings_world.front()) {
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    for (std::int32_t j = cell_of(low.y() - pad.reach_m); j <= cell_of(high.y() + pad.reach_m); ++j)
      for (std::int32_t i = cell_of(low.x() - pad.reach_m); i <= cell_of(high.x() + pad.reach_m);
           ++i)
        cells_[key_of(i, j)].pads.push_back(k);
  }
}

const RoadBed::Cell* RoadBed::cell_at(const Vector2d& place_world) const {
  const auto found = cells_.find(key_of(cell_of(place_world.x()), cell_of(place_world.y())));
  return found == cells_.end() ? nullptr : &found->second;
}

bool RoadBed::is_near(const Vector2d& place_world, double within_m) const {
  const std::int32_t last_x = cell_of(place_world.x() + within_m);
  const std::int32_t last_y = cell_of(place_world.y() + within_m);
  for (std::int32_t j = cell_of(place_world.y() - within_m); j <= last_y; ++j)
    for (std::int32_t i = cell_of(place_world.x() - within_m); i <= last_x; ++i)
      if (cells_.count(key_of(i, j)) != 0) return true;
  return false;
}

RoadBed::Met RoadBed::meet(const Piece& piece, const Vector2d& place_world) {
  // Between the cross-sections at its ends, by how far it is from either along the piece: so the share goes
  // on from piece to piece round bends, on both sides of the line.
  const Vector2d from_a = place_world - piece.a;
  const double along_m = from_a.dot(piece.direction);
  const double beside_m =
      std::abs(piece.direction.x() * from_a.y() - piece.direction.y() * from_a.x());
  const Vector2d from_b = from_a - piece.length_m * piece.direction;
  const double to_a = from_a.dot(piece.tangent_a) / piece.direction.dot(piece.tangent_a);
  const double to_b = -from_b.dot(piece.tangent_b) / piece.direction.dot(piece.tangent_b);
  if (to_a >= 0.0 && to_b >= 0.0 && to_a + to_b > 0.0)
    return {to_a / (to_a + to_b), beside_m, 0.0, false};
  const bool is_beyond = to_b < 0.0 && (to_a >= 0.0 || along_m > 0.5 * piece.length_m);
  const double clamped_m = std::clamp(along_m, 0.0, piece.length_m);
  const double distance_m = (from_a - clamped_m * piece.direction).norm();
  return {is_beyond ? 1.0 : 0.0, distance_m, is_beyond ? -to_b : std::max(-to_a, 0.0), is_beyond};
}

RoadBed::Shaped RoadBed::shaped(const Vector2d& place_world, double ground_m) const {
  const Cell* cell = cell_at(place_world);
  if (cell == nullptr) return {ground_m, false};
  double sum_weights = 0.0;
  double sum_levels = 0.0;
  double least_m = -std::numeric_limits<double>::infinity();
  double most_m = std::numeric_limits<double>::infinity();
  double least_out_m = 0.0;  // how far out the one is that asks for it
  double most_out_m = 0.0;
  double deck_most_m = std::numeric_limits<double>::infinity();
  const auto bound = [&](double level_m, double room_m, double out_m) {
    if (level_m - room_m > least_m) {
      least_m = level_m - room_m;
      least_out_m = out_m;
    }
    if (level_m + room_m < most_m) {
      most_m = level_m + room_m;
      most_out_m = out_m;
    }
  };
  for (const std::uint32_t k : cell->pieces) {
    const Piece& piece = pieces_[k];
    const Met met = meet(piece, place_world);
    const double core_m = static_cast<double>(piece.core_m);
    const auto between = [&](float a, float b) {
      return static_cast<double>(a) + met.along_share * static_cast<double>(b - a);
    };
    const double reach_m = between(piece.reach_a_m, piece.reach_b_m);
    if (met.beside_m >= core_m + reach_m) continue;
    const double slope = between(piece.bank_slope_a, piece.bank_slope_b);
    const double level_m = piece.level_a + met.along_share * (piece.level_b - piece.level_a);
    if (piece.is_deck) {
      if (met.before_m > 0.0) continue;
      deck_most_m = std::min(deck_most_m, level_m + bank_m(met.beside_m - core_m, slope, reach_m));
      continue;
    }
    double out_m = std::max(met.beside_m - core_m, 0.0);
    double room_m = 0.0;
    if (met.before_m > 0.0) {
      const bool is_open = met.is_beyond_b ? piece.is_open_b : piece.is_open_a;
      const bool is_end = met.is_beyond_b ? piece.has_end_b : piece.has_end_a;
      if (is_open) {
        out_m = std::max(out_m, met.before_m);
      } else if (is_end && out_m == 0.0) {  // the round end
        const double weight = (core_m - met.beside_m) / core_m;
        sum_weights += weight;
        sum_levels += weight * level_m;
        continue;
      } else {
        room_m = kYield * met.before_m;
      }
    } else if (out_m == 0.0) {
      const double weight = (core_m - met.beside_m) / core_m;
      sum_weights += weight;
      sum_levels += weight * level_m;
      continue;
    }
    bound(level_m, room_m + bank_m(out_m, slope, reach_m), out_m);
  }
  for (const std::uint32_t k : cell->pads) {
    const Pad& pad = pads_[k];
    const RingSide side = side_of_rings(pad.rings_world, place_world);
    if (!side.is_inside && side.distance_m >= pad.reach_m) continue;
    const double level_m = pad.level_at(place_world);
    if (side.is_inside) {
      const double weight = 0.25 * std::min(side.distance_m / kPadBlend_m, 1.0);
      sum_weights += weight;
      sum_levels += weight * level_m;
      if (weight > 0.0) continue;
    }
    bound(level_m, bank_m(side.distance_m, pad.bank_slope, pad.reach_m), side.distance_m);
  }
  if (sum_weights > 0.0) return {sum_levels / sum_weights, true};
  double level_m = std::clamp(ground_m, std::min(least_m, most_m), std::max(least_m, most_m));
  if (least_m > most_m) {
    // Two ways too near to each other for their banks: the nearer to one, the more as it wants.
    const double sum_m = least_out_m + most_out_m;
    level_m = sum_m > 0.0 ? (least_m * most_out_m + most_m * least_out_m) / sum_m
                          : 0.5 * (least_m + most_m);
  }
  return {std::min(level_m, deck_most_m), false};
}

bool RoadBed::holds(const Vector2d& place_world, double radius_m) const {
  // Discs are as wide as buildings; cells know what reaches some metres into them.
  const std::int32_t x0 = cell_of(place_world.x() - radius_m);
  const std::int32_t x1 = cell_of(place_world.x() + radius_m);
  const std::int32_t y0 = cell_of(place_world.y() - radius_m);
  const std::int32_t y1 = cell_of(place_world.y() + radius_m);
  for (std::int32_t j = y0; j <= y1; ++j)
    for (std::int32_t i = x0; i <= x1; ++i) {
      const auto found = cells_.find(key_of(i, j));
      if (found == cells_.end()) continue;
      for (const std::uint32_t k : found->second.pieces) {
        const Piece& piece = pieces_[k];
        const double t =
            std::clamp((place_world - piece.a).dot(piece.direction), 0.0, piece.length_m);
        if ((piece.a + t * piece.direction - place_world).norm() <
            static_cast<double>(piece.held_m) + radius_m)
          return true;
      }
      for (const std::uint32_t k : found->second.pads) {
        const RingSide side = side_of_rings(pads_[k].rings_world, place_world);
        if (side.is_inside || side.distance_m < radius_m) return true;
      }
    }
  return false;
}

bool RoadBed::is_on_way(const Vector2d& place_world, double radius_m) const {
  const Cell* cell = cell_at(place_world);
  if (cell == nullptr) return false;
  return std::any_of(cell->pieces.begin(), cell->pieces.end(), [&](std::uint32_t k) {
    const Piece& piece = pieces_[k];
    if (piece.is_deck) return false;
    const double t = std::clamp((place_world - piece.a).dot(piece.direction), 0.0, piece.length_m);
    return (piece.a + t * piece.direction - place_world).norm() <
           static_cast<double>(piece.core_m) + radius_m;
  });
}

}  // namespace terracast::tiler
