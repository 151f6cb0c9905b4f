#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/random.h"
#include "tiler/vegetation/plant_library.h"

namespace terracast::tiler {

/// What is strewn, each kind by cells of its own.
enum Stratum : std::size_t { kTallTrees, kLowTrees, kBushes, kPlants, kStones, kNumStrata };
struct StratumInfo {
  double cell_m;
  int coarsest_level;  ///< of tiles on which any of it is shown
  double reach_m;      ///< nothing of it reaches farther from its place
};
inline constexpr std::array<StratumInfo, kNumStrata> kStrata = {{
    {5.0, 4, 20.0},  // tall trees, 7 m apart
    {2.5, 2, 20.0},  // trees below and between them, 3.5 m apart
    {3.0, 2, 5.0},
    {3.0, 1, 5.0},
    {10.0, 3, 8.0},
}};
/// Low trees keep so far from tall ones.
inline constexpr double kTreeDistance_m = 3.5;

inline constexpr int kFinestTile = -3;
/// Tiles beside a tile of a cut differ from it by a level, those at its corners by two.
inline constexpr int kLevelsAtCorner = 2;

/// Numbers cells of the world's square, kind after kind: the ids of what stands in them.
class CellNumbers {
 public:
  /// throws   Config: the square has more cells than there are ids
  explicit CellNumbers(double size_m);

  /// kind   a Stratum, kCrops, or kClumps and the size of a piece of forest
  std::uint32_t id(std::size_t kind, std::int32_t cell_x, std::int32_t cell_y) const;

  static constexpr std::size_t kCrops = kNumStrata;
  static constexpr std::size_t kClumps = kNumStrata + 1;  ///< and one for each larger size

 private:
  struct Range {
    std::uint64_t first;
    std::uint64_t side;
  };
  double half_size_m_;
  std::vector<Range> ranges_;
};

/// Numbers drawn for a place.
enum Draw : std::uint64_t { kTake, kKind, kVariety, kSize, kHeading, kColour };

/// Numbers of a place: a pure function of its id.
struct PlaceDraws {
  std::uint64_t seed;
  std::uint32_t id;

  double unit(Draw draw) const { return core::random_unit(seed, draw, id); }
  std::uint64_t bits(Draw draw) const { return core::random_bits(seed, draw, id); }
  std::uint16_t heading() const { return static_cast<std::uint16_t>(bits(kHeading)); }
  const PlantModel& variety(const std::vector<PlantModel>& models) const {
    return models[static_cast<std::size_t>(unit(kVariety) * static_cast<double>(models.size()))];
  }
};

}  // namespace terracast::tiler
