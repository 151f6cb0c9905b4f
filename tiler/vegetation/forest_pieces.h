#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>

#include "tiler/vegetation/plant_sink.h"
#include "tiler/vegetation/tile_ground.h"
#include "tiler/vegetation/tile_places.h"

namespace terracast::tiler {

inline constexpr int kCoarsestClumpLevel = kFinestClumpLevel + kNumClumpSizes - 1;

/// A cell's ground is forest where so many of its places bear trees.
inline constexpr double kForestShare = 0.3;

/// Pieces of forest that stand for their trees on coarse tiles (PlantLibrary::clumps), as wide as the tile's
/// terrain samples are apart, at most 65 536 of them on a tile. Which cells are such pieces is decided for each
/// of the three sizes by the cell's own ground.
class ForestPieces {
 public:
  /// all   live as long
  ForestPieces(const VegetationPlan& plan, const world::TileId& id, const LayerSite& site,
               TileGround& ground, TilePlaces& places, PlantSink& sink)
      : plan_(plan), id_(id), site_(site), ground_(ground), places_(places), sink_(sink) {}

  /// Whether the cell of 8 m of a place is shown as a piece of forest where its level says so.
  bool is_piece(const Eigen::Vector2d& place_world);

  void add_all();

 private:
  /// How a cell of 8, 16 or 32 m is shown where its level says so.
  struct Piece {
    bool is_forest = false;
    bool is_blocked = false;  ///< it would be forest, but others hold some of it
    bool is_open = false;
    ForestKind kind = ForestKind::Mixed;
    double scale = 1.0;
    double foot_z_world = 0.0;  ///< of forest
    const PlantModel* model = nullptr;
    Tint tint{};
  };

  const Piece& piece(int size, std::int32_t x, std::int32_t y);
  Piece make_piece(int size, std::int32_t x, std::int32_t y);
  PlaceDraws draws(int size, std::int32_t x, std::int32_t y) const;
  void add_clumps(int size);
  void add_clump(int size, std::int32_t x, std::int32_t y, const PlanBox& box, int last_level);

  const VegetationPlan& plan_;
  world::TileId id_;
  const LayerSite& site_;
  TileGround& ground_;
  TilePlaces& places_;
  PlantSink& sink_;
  std::array<std::unordered_map<std::uint64_t, Piece>, kNumClumpSizes> pieces_;
};

/// Checks that no piece of a library reaches farther than tiles look for such.
void check_reach_of_pieces(const PlantLibrary& library);

}  // namespace terracast::tiler
