#include "tiler/vegetation/forest_pieces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// With more trees a forest is a dense one.
constexpr double kDenseShare = 0.62;
/// Broadleaved forest has fewer conifers than this.
constexpr double kMixedShare = 0.3;

/// Pieces of forest are drawn so much smaller or larger at most.
constexpr double kSmallestClump = 0.7;
constexpr double kLargestClump = 1.3;

/// How far a piece of forest reaches from its middle: to its corner, where a crown goes on.
constexpr double clump_reach_m(int size) {
  return kLargestClump * (0.5 * std::numbers::sqrt2 * clump_side_m(size) + 5.5);
}

std::int32_t clump_cell(double at, int size) {
  return static_cast<std::int32_t>(std::floor(at / clump_side_m(size)));
}
Vector2d clump_center(int size, std::int32_t x, std::int32_t y) {
  return clump_side_m(size) * Vector2d(x + 0.5, y + 0.5);
}

std::uint64_t cell_key(std::int32_t x, std::int32_t y) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32U |
         static_cast<std::uint32_t>(x);
}

}  // namespace

bool ForestPieces::is_piece(const Vector2d& place_world) {
  return piece(0, clump_cell(place_world.x(), 0), clump_cell(place_world.y(), 0)).is_forest;
}

void ForestPieces::add_all() {
  for (int size = 0; size < kNumClumpSizes; ++size) add_clumps(size);
}

const ForestPieces::Piece& ForestPieces::piece(int size, std::int32_t x, std::int32_t y) {
  const auto [entry, is_new] = pieces_[static_cast<std::size_t>(size)].try_emplace(cell_key(x, y));
  if (is_new) entry->second = make_piece(size, x, y);
  return entry->second;
}

PlaceDraws ForestPieces::draws(int size, std::int32_t x, std::int32_t y) const {
  return {plan_.seed,
          plan_.numbers.id(CellNumbers::kClumps + static_cast<std::size_t>(size), x, y)};
}

ForestPieces::Piece ForestPieces::make_piece(int size, std::int32_t x, std::int32_t y) {
  Piece piece;
  const double side_m = clump_side_m(size);
  const Vector2d center = clump_center(size, x, y);
  if (!is_inside(center, plan_.half_size_m - 0.5 * side_m)) return piece;
  const TileGround::Here here = ground_.broadly(center);
  if (here.growth.trees < kForestShare) return piece;
  const TreeKinds kinds = ground_.tree_kinds(here);
  const double top_m = here.canopy_m.value_or(kinds.size * kinds.top_m());
  piece.tint = {kinds.tint.light, kinds.tint.warm, 0.8};
  piece.is_open = here.growth.trees < kDenseShare;
  piece.kind = kinds.conifers > 0.65                        ? ForestKind::Conifer
               : kinds.pines > 0.55                         ? ForestKind::Pine
               : kinds.conifers + kinds.pines < kMixedShare ? ForestKind::Broadleaf
                                                            : ForestKind::Mixed;
  const std::vector<PlantModel>& models =
      plan_.library->clumps(piece.kind, size, piece.is_open, top_m);
  // A little wider or narrower than its cell.
  piece.scale = std::clamp(top_m / models.front().height_m, kSmallestClump, kLargestClump);
  piece.model = &draws(size, x, y).variety(models);
  const int level = kFinestClumpLevel + size;
  const double reach_m = piece.scale * piece.model->reach_m;
  piece.is_forest = site_.is_free(center, reach_m) && !site_.is_kept_low(center, reach_m);
  if (piece.is_forest) {
    piece.foot_z_world = site_.ground_z_world(center);
    piece.is_forest = last_level_on_land(site_, center, piece.foot_z_world, level, level) == level;
  }
  piece.is_blocked = !piece.is_forest;
  return piece;
}

void ForestPieces::add_clumps(int size) {
  const int finest_level = kFinestClumpLevel + size;
  const bool has_parent = size + 1 < kNumClumpSizes;
  const int coarsest_level = has_parent ? finest_level + 1 : finest_level;
  for (const PlanBox& box : places_.boxes(finest_level, coarsest_level, clump_reach_m(size))) {
    // By cells twice as wide: most of them decide for all four in them.
    for (std::int32_t y = clump_cell(box.lowest.y(), size + 1);
         y <= clump_cell(box.highest.y(), size + 1); ++y)
      for (std::int32_t x = clump_cell(box.lowest.x(), size + 1);
           x <= clump_cell(box.highest.x(), size + 1); ++x) {
        // On the next level they are shown themselves; where such a one would be forest and has no
        // room for it, these go on.
        const bool goes_on = has_parent && piece(size + 1, x, y).is_blocked;
        const int last_level = goes_on ? coarsest_level : finest_level;
        if (id_.level > last_level && contains(places_.box(), clump_center(size + 1, x, y)))
          continue;
        for (const std::int32_t north : {0, 1})
          for (const std::int32_t east : {0, 1})
            add_clump(size, 2 * x + east, 2 * y + north, box, last_level);
      }
  }
}

void ForestPieces::add_clump(int size, std::int32_t x, std::int32_t y, const PlanBox& box,
                             int last_level) {
  const Vector2d center = clump_center(size, x, y);
  if (!contains(box, center) || !is_inside(center, plan_.half_size_m)) return;
  const Piece& own = piece(size, x, y);
  if (!own.is_forest) return;
  const PlaceDraws draws = this->draws(size, x, y);
  const auto quarter_turns = static_cast<std::uint16_t>((draws.bits(kHeading) & 3U) << 14U);
  sink_.add({.id = draws.id,
             .model = *own.model,
             .heading = quarter_turns,
             .scale = own.scale,
             .coarsest_level = last_level,
             .first_level = kFinestClumpLevel + size + 1,
             .tint = own.tint},
            Eigen::Vector3d(center.x(), center.y(), own.foot_z_world));
}

void check_reach_of_pieces(const PlantLibrary& library) {
  for (const ForestKind kind :
       {ForestKind::Broadleaf, ForestKind::Conifer, ForestKind::Pine, ForestKind::Mixed})
    for (int size = 0; size < kNumClumpSizes; ++size)
      for (const double top_m : {5.0, 10.0, 16.0, 30.0})
        for (const PlantModel& model : library.clumps(kind, size, false, top_m))
          TERRACAST_CHECK(kLargestClump * model.reach_m <= clump_reach_m(size), "{} m",
                          model.reach_m);
}

}  // namespace terracast::tiler
