#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "tiler/gradient_noise.h"
#include "world/field_pattern.h"

namespace terracast::tiler {

/// Shares as Growth's.
struct Grove {
  double trees = 0.0;
  double bushes = 0.0;
};

/// How trees and bushes of open land stand: in copses and loose groups, in rows along borders of fields, ways
/// and waters, here and there one alone; between them is nothing over hundreds of metres. Some regions have many,
/// others hardly any.
///
/// threads   safe; all is a function of the seed and the place
class Groves {
 public:
  /// fields   what rows follow
  Groves(std::uint64_t seed, const world::FieldPattern& fields);

  /// Copses of 0.03 to 1 ha, and groups of trees far apart; more of both on slopes.
  /// slope   rise per metre
  Grove groups(const Eigen::Vector2d& place_world, double slope) const;

  /// Stretches of rows along borders of fields, as land under a cover is parted into them.
  Grove along_fields(const Eigen::Vector2d& place_world, world::Cover cover) const;
  /// Beside a way; beside a river, a stream or a lake.
  Grove along_ways(const Eigen::Vector2d& place_world) const;
  Grove along_waters(const Eigen::Vector2d& place_world) const;

  /// Trees that stand alone, as a share like the others.
  double lone_trees(const Eigen::Vector2d& place_world) const;

 private:
  /// 0: open country; 1: full of copses and rows.
  double fullness(const Eigen::Vector2d& place_world) const;

  std::uint64_t seed_;
  world::FieldPattern fields_;
  GradientNoise noise_;
};

}  // namespace terracast::tiler
