#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "core/image.h"
#include "export/world/tile_ground.h"
#include "scene/ground/ground.h"
#include "scene/ground/ground_imagery.h"
#include "world/tile_store.h"

namespace terracast::world_export {

/// What the ground looks like in any light: the albedo that the renderer's materials give it, with roads, runways and
/// their marks, streams, and pictures of the ground where the world has them. Of water it is what comes from below the
/// surface. Threads: safe.
class GroundBaker {
 public:
  /// The store must outlive it.
  /// throws   Input, Io: from its coarsest tiles
  explicit GroundBaker(const world::TileStore& store);

  /// A square of the ground, its sides along world x and y.
  struct Square {
    const TileGround* ground = nullptr;  ///< on which it lies; null: nowhere
    Eigen::Vector2d center_world = Eigen::Vector2d::Zero();
    double width_m = 1.0;
  };
  using Code = std::array<std::uint8_t, 3>;

  /// The mean albedo of each square in codes of sRGB; black where there is no ground. Materials are filtered over the
  /// square; where paint ends in it, 4 x 4 parts of it are looked at.
  /// codes    as many as squares
  /// throws   Input, Io: from pictures of the ground
  void bake(std::span<const Square> squares, std::span<Code> codes) const;

  /// A picture of a whole tile, its north up.
  core::Image8 picture_of(const TileGround& ground, int side_px) const;

 private:
  class Batch;

  const scene::Ground ground_;
  const scene::GroundImagery imagery_;
};

}  // namespace terracast::world_export
