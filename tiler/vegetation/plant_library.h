#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "world/shape.h"

namespace terracast::tiler {

/// A prototype that can be put somewhere.
struct PlantModel {
  std::uint16_t prototype = 0;  ///< row of PlantLibrary::prototypes
  double height_m = 0.0;
  double reach_m = 0.0;  ///< of its crown from its foot, in the plane
  int coarsest_level = 0;
  double sunk_m = 0.0;        ///< how deep below its foot it reaches, in any of its shapes
  double root_reach_m = 0.0;  ///< of what is below its foot, in the plane
};

/// What a piece of forest mostly is.
enum class ForestKind : std::uint8_t { Broadleaf, Conifer, Pine, Mixed };
inline constexpr int kNumForestKinds = 4;

/// Pieces of forest that stand for their trees on coarse tiles, as wide as such a tile's samples are apart:
/// 8, 16 and 32 m on tiles of the levels 3, 4 and 5.
inline constexpr int kFinestClumpLevel = 3;
inline constexpr int kNumClumpSizes = 3;
inline constexpr double clump_side_m(int size) { return 8 << size; }

/// All species grown, and pieces of forest made of them. It is the same in every world.
class PlantLibrary {
 public:
  /// Grown once in a process.
  /// cost      4 s of one core
  /// threads   safe
  static std::shared_ptr<const PlantLibrary> grown();

  const std::vector<world::Prototype>& prototypes() const { return prototypes_; }
  /// Of all prototypes.
  const std::string& content_hash() const { return content_hash_; }

  /// Varieties of a species.
  const std::vector<PlantModel>& of(std::string_view species) const;

  /// Pieces of forest, by the height of trees that is nearest; each made so that it can be turned by
  /// quarters.
  /// size       0 … kNumClumpSizes - 1
  /// is_open    half the trees
  /// height_m   of their tops
  const std::vector<PlantModel>& clumps(ForestKind kind, int size, bool is_open,
                                        double height_m) const;

 private:
  PlantLibrary();

  static constexpr std::array<double, 4> kClumpHeights_m = {7.0, 11.0, 17.0, 26.0};

  std::vector<world::Prototype> prototypes_;
  std::string content_hash_;
  std::vector<std::vector<PlantModel>> species_;  ///< by row of all_species()
  std::vector<std::vector<PlantModel>> clumps_;   ///< by kind, size, openness, height
};

}  // namespace terracast::tiler
