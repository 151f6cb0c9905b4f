#pragma once

#include <cstdint>
#include <vector>

#include "tiler/country/plan_geometry.h"
#include "tiler/flow_routing.h"
#include "tiler/grid.h"

namespace terracast::tiler {
class WorldSurface;
}

namespace terracast::tiler::country {

/// The ground that a country is planned on: heights above the sphere on a coarse grid, on a lattice
/// of 2^-6 m, so that no decision hangs on the last bit.
class PlanGround {
 public:
  /// cost   of a square of 51.2 km 2.6 million samples
  explicit PlanGround(const WorldSurface& surface);

  double half_size_m() const { return half_size_m_; }
  double spacing_m() const { return spacing_m_; }
  int side() const { return heights_m_.width; }
  double half_grid_m() const { return half_grid_m_; }
  Point place(int i, int j) const {
    return {i * spacing_m_ - half_grid_m_, j * spacing_m_ - half_grid_m_};
  }
  Point node_of(const Point& at) const { return (at.array() + half_grid_m_) / spacing_m_; }

  const Grid<float>& heights_m() const { return heights_m_; }
  const Grid<std::uint8_t>& is_sea() const { return is_sea_; }
  const FlowRouting& flow() const { return flow_; }

  double height_m(const Point& at) const { return bilinear(heights_m_, node_of(at)); }
  /// Rise over run, over the grid's spacing.
  double slope(const Point& at) const { return bilinear(slope_, node_of(at)); }
  /// Rise per metre to the east and north.
  Point gradient(const Point& at) const;
  /// Distance to the sea from land; 1e9 where there is none.
  double sea_distance_m(const Point& at) const { return bilinear(sea_m_, node_of(at)); }
  /// Distance to land from the sea; 0 on land.
  double land_distance_m(const Point& at) const { return bilinear(land_m_, node_of(at)); }
  /// Of the coarse grid.
  bool is_land_near(const Point& at) const { return sea_distance_m(at) > 0.5 * spacing_m_; }
  /// Of the ground itself.
  bool is_sea_at(const Point& at) const;
  bool is_in_square(const Point& at, double margin_m) const {
    return at.cwiseAbs().maxCoeff() <= half_size_m_ - margin_m;
  }
  /// Whether no corner, no edge's middle and not the middle of a ring lie in the sea or beyond the square.
  bool is_dry(const PointsWorld& ring) const;
  /// Between the highest and the lowest corner.
  double rise_m(const PointsWorld& ring) const;

 private:
  const WorldSurface& surface_;
  double half_size_m_;
  double spacing_m_;
  double half_grid_m_ = 0.0;
  Grid<float> heights_m_;
  Grid<std::uint8_t> is_sea_;
  Grid<float> slope_;
  Grid<float> sea_m_;
  Grid<float> land_m_;
  FlowRouting flow_;
};

}  // namespace terracast::tiler::country
