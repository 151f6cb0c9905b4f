#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <set>
#include <vector>

#include "world/tile_store.h"

namespace terracast::test {

/// First crossings by testing every triangle of every column (or row) of cells below the ray: no
/// index, no Embree, nothing of the product but the tiles themselves. Stitching is done again here,
/// by the written rule: where the neighbour on a side is coarser, every odd sample there is the
/// mean of its two neighbours.
///
/// A triangle is hit when the ray passes all its edges on one side, zeros included; edges are
/// tested in extended precision from the same end whichever triangle asks, so that no ray slips
/// between two triangles.
class BruteTerrain {
 public:
  template <class CutTiles>
  BruteTerrain(const world::TileStore& store, const CutTiles& cut) {
    std::set<world::TileId> leaves;
    for (const auto& tile : cut) leaves.insert(tile.id);
    for (const auto& tile : cut) tiles_.push_back(read(store, tile.id, leaves));
  }

  /// The ray's first crossing in [t_min, t_max], or infinity. Its start must be above the ground.
  double first_crossing(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                        double t_min, double t_max) const;

  /// z of the ground, or NaN outside.
  double ground_z(double x, double y) const;

  /// Corners of a triangle of a tile of the cut: at its right angle, then beside it along x and
  /// along y.
  std::array<Eigen::Vector3d, 3> triangle(std::size_t tile_index, int i, int j,
                                          bool is_upper) const;

 private:
  using Real = long double;
  struct Grid {
    double x0, y0, spacing;
    std::vector<double> z;
    double highest;
    double at(int i, int j) const {
      return z[static_cast<std::size_t>(j) * 257 + static_cast<std::size_t>(i)];
    }
  };
  struct Ray {
    Eigen::Vector3d o;
    Eigen::Vector3d d;
    double t_min;
    double t_max;
    double best = std::numeric_limits<double>::infinity();
  };
  struct Point {
    Real x, y, z;
  };

  static Grid read(const world::TileStore& store, const world::TileId& id,
                   const std::set<world::TileId>& leaves);

  static void cross_grid(const Grid& grid, Ray& ray);

  /// Which side of the edge the ray passes: the volume of the edge and the ray. From the southern,
  /// then western end.
  static Real side(const Point& p, const Point& q, const Ray& ray);

  static void cross_triangle(const Point& p, const Point& q, const Point& r, Ray& ray);

  std::vector<Grid> tiles_;
};

}  // namespace terracast::test
