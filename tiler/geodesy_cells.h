#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "geo/geodesy.h"
#include "geo/geoid.h"
#include "tiler/height_field.h"

namespace terracast::tiler {

/// A place on the vertical line (parallel to world z) through a world (x, y).
struct ColumnPoint {
  double z_world = 0.0;
  Eigen::Vector2d map = Eigen::Vector2d::Zero();  ///< of the projection
  double undulation_m = 0.0;                      ///< of the field's datum above the ellipsoid
};

/// World z, map coordinates and undulation along a vertical line, as polynomials of the ellipsoidal
/// height.
class GeodesyColumn {
 public:
  static constexpr int kNumTerms = 16;  ///< z, map x, map y, undulation; four coefficients each
  using Terms = std::array<double, kNumTerms>;

  GeodesyColumn(const Terms& terms, double middle_m, double half_range_m)
      : terms_(terms), middle_m_(middle_m), half_range_m_(half_range_m) {}

  ColumnPoint at(double height_m) const {
    const double s = (height_m - middle_m_) / half_range_m_;
    const auto polynomial = [&](int first) {
      const double* c = &terms_[static_cast<std::size_t>(first)];
      return c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    };
    return {.z_world = polynomial(0),
            .map = {polynomial(4), polynomial(8)},
            .undulation_m = polynomial(12)};
  }
  double middle_m() const { return middle_m_; }

 private:
  Terms terms_;
  double middle_m_;
  double half_range_m_;
};

/// Geodesy, projection and geoid over the world's square, exact at the nodes of a grid that is
/// fixed to the world's lattice and quadratic between them (cubic in height): a pure function of
/// (x, y), whatever tile asks.
///
/// accuracy   z and map coordinates 1e-7 m on the ground against GeographicLib and PROJ: the
///            spacing of the nodes is halved until probes between them agree, down to 32 m or a
///            million nodes. A projection that bends more is as good as largest_probe_error_m()
///            says, 1e-3 m at worst. Undulation 1 mm of GeographicLib's where that is smooth (its
///            cubic jumps by up to 2 cm between cells of the geoid's grid; here it does not)
/// cost       20 ns a column; made once, about 10 us a node
/// threads    safe
class GeodesyCells {
 public:
  static constexpr double kTolerance_m = 1e-7;

  /// half_side_m    of the square that is covered, about the world's origin
  /// throws         Input: probes stay apart by more than 1e-3 m; the projection has a seam or a
  ///                pole within the square
  GeodesyCells(const geo::WorldFrame& frame, const MapProjection& projection,
               const geo::Geoid* geoid, double half_side_m, double lowest_m, double highest_m);
  ~GeodesyCells();
  GeodesyCells(const GeodesyCells&) = delete;
  GeodesyCells& operator=(const GeodesyCells&) = delete;

  /// The same cells where the spacing of their nodes is known: a cell's nodes are computed when it is first needed.
  /// For few places; column() takes a lock.
  /// frame, projection, geoid   must outlive the cells
  /// node_spacing_m             node_spacing_m() of the cells above
  /// returns                    cells whose columns are equal to those of the cells above, bit for bit
  static std::unique_ptr<GeodesyCells> on_demand(const geo::WorldFrame& frame,
                                                 const MapProjection& projection,
                                                 const geo::Geoid* geoid, double half_side_m,
                                                 double lowest_m, double highest_m,
                                                 double node_spacing_m);

  /// x, y   within the square
  GeodesyColumn column(double x_world, double y_world) const;

  /// Columns of a run of places along x: x = x_first + k * step.
  class Row {
   public:
    Row(const GeodesyCells& cells, double y_world);
    GeodesyColumn column(double x_world);

   private:
    const GeodesyCells& cells_;
    double y_world_;
    int cell_x_ = -1;
    std::array<GeodesyColumn::Terms, 3> nodes_;  // of the cell, at y
  };

  double node_spacing_m() const { return node_spacing_m_; }
  double largest_probe_error_m() const { return largest_probe_error_m_; }

 private:
  /// The nodes of a cell, row by row.
  using Cell = std::array<GeodesyColumn::Terms, 9>;
  struct OnDemand;

  GeodesyCells(double half_side_m, double lowest_m, double highest_m);
  void set_spacing(double node_spacing_m);
  int cell_of(double coordinate) const;
  void fill(const geo::WorldFrame& frame, const MapProjection& projection, const geo::Geoid* geoid);
  /// Of a row of nodes, a run of them from a column on.
  void compute_nodes(const geo::WorldFrame& frame, const MapProjection& projection,
                     const geo::Geoid* geoid, int row, int first_column,
                     std::span<GeodesyColumn::Terms> nodes) const;
  const Cell& cell_on_demand(int cell_x, int cell_y) const;
  double probe(const geo::WorldFrame& frame, const MapProjection& projection) const;

  double half_side_m_ = 0.0;
  double middle_m_ = 0.0;
  double half_range_m_ = 1.0;
  double node_spacing_m_ = 0.0;
  double largest_probe_error_m_ = 0.0;
  int num_cells_ = 0;
  int num_nodes_ = 0;
  std::vector<GeodesyColumn::Terms> nodes_;  ///< empty: on demand
  std::unique_ptr<OnDemand> on_demand_;
};

/// The place above or below a world (x, y) at an ellipsoidal height.
struct PlaceAtHeight {
  double z_world = 0.0;
  geo::Geodetic place;        ///< within tolerance_m of it
  double height_per_z = 1.0;  ///< how the height grows along world z: the cosine of up's lean
};

/// Solves for z by Newton's iteration.
/// tolerance_m   how near the returned place must be; up to 1 m
/// accuracy      z to 1e-9 m whatever the tolerance (the height is all but linear in z)
PlaceAtHeight place_at_height(const geo::WorldFrame& frame, double x_world, double y_world,
                              double height_m, double tolerance_m);

}  // namespace terracast::tiler
