#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tiler/surface.h"
#include "world/tile.h"

namespace terracast::tiler {

class Layer;

/// What layers, in their order, say of what covers a place on land: the first that knows of water is right, then the
/// first that knows anything. What a layer builds in the water of an earlier one, by lifting or digging the ground
/// there, is as the layer itself has it: a dam of a road is dry. All that lies in water or beside it follows this.
/// threads   safe
class ToldCovers {
 public:
  struct Told {
    world::Cover cover;
    const Layer* by;
  };

  ToldCovers() = default;
  explicit ToldCovers(std::span<const std::unique_ptr<Layer>> layers);
  /// After those before. The layer has to live as long.
  void add(const Layer& layer);

  /// nullopt: no layer knows the place.
  std::optional<Told> at(const Eigen::Vector2d& place_world, const SurfaceSample& sample) const;
  /// Whether at() is water, at less cost.
  bool is_water(const Eigen::Vector2d& place_world, const SurfaceSample& sample) const;
  /// Whether water is at a place of which the surface, too, may know: the sea counts, what lies beyond the surface does
  /// not.
  bool is_water_on(const WorldSurface& surface, const Eigen::Vector2d& place_world) const;

 private:
  struct Row {
    const Layer* layer;
    bool may_tell_of_water;
  };
  std::vector<Row> rows_;
};

}  // namespace terracast::tiler
