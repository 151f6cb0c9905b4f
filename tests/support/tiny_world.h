#pragma once

#include <filesystem>
#include <functional>

#include "world/tile_store.h"

namespace terracast::test {

/// World z of the ground in metres, from world x and y.
using HeightFunction = std::function<double(double x_world, double y_world)>;

struct TinyWorldOptions {
  int finest_level = 0;
  int coarsest_level = 2;
  int num_roots = 2;  ///< along a side of the square of coarsest tiles; even
  /// Address of the coarsest tile north-east of the square's centre; (0, 0): it is centred on the
  /// origin.
  int center_x = 0;
  int center_y = 0;
  /// Whether a tile above the finest level is split; the tree is balanced afterwards. Default:
  /// never.
  std::function<bool(const world::TileId&)> refine = [](const world::TileId&) { return false; };
  std::function<world::Cover(double x_world, double y_world)> cover = [](double, double) {
    return world::Cover::Land;
  };
  std::function<double(double x_world, double y_world)> moisture = [](double, double) {
    return 0.5;
  };
  geo::Geodetic origin = {.lat_deg = 46.0, .lon_deg = 8.0, .height_m = 0.0};
};

/// A tile of a height function, rounded to the lattice of heights.
world::Tile make_tile(const world::TileId& id, const HeightFunction& height_m,
                      const TinyWorldOptions& options = {});

/// Writes a whole world of a height function into `folder` and opens it: the coarsest tiles and,
/// where `refine` says so, finer ones down to the finest level, with all their ancestors.
world::TileStore make_tiny_world(const std::filesystem::path& folder,
                                 const HeightFunction& height_m,
                                 const TinyWorldOptions& options = {});

/// The same with water: of a surface over a bed, as deep as a function says; where that is above 0 a lake stands.
world::TileStore make_wet_world(const std::filesystem::path& folder,
                                const HeightFunction& surface_m, const HeightFunction& depth_m,
                                TinyWorldOptions options = {});

/// The nearest height that tiles hold.
double on_height_lattice(double value_m);

}  // namespace terracast::test
