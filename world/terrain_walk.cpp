#include "world/terrain_walk.h"

#include <algorithm>
#include <limits>

#include "world/triangle_plane.h"

namespace terracast::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// The columns (or rows) of cells that a ray passes, one after the other. Line k of the grid is
/// crossed at (k-th line's coordinate - origin) / direction, from world coordinates alone: two
/// tiles that share a line give it the same t.
class AxisWalk {
 public:
  AxisWalk(double corner_world, double spacing_m, double origin, double direction, double inverse)
      : corner_(corner_world),
        spacing_(spacing_m),
        origin_(origin),
        inverse_(inverse),
        step_(direction > 0 ? 1 : -1),
        is_parallel_(direction == 0.0) {}

  void start(int cell, double t) {
    cell_ = cell;
    update();
    if (is_parallel_) return;
    // The cell was found from a rounded position: make it the one whose lines enclose t.
    while (t_out_ < t && is_inside(cell_ + step_)) step();
    while (t_in_ > t && is_inside(cell_ - step_)) {
      cell_ -= step_;
      update();
    }
  }
  void step() {
    cell_ += step_;
    t_in_ = t_out_;
    t_out_ = line(cell_ + (step_ > 0 ? 1 : 0));
  }
  int cell() const { return cell_; }
  double t_in() const { return t_in_; }
  double t_out() const { return t_out_; }
  bool is_over() const { return !is_inside(cell_); }
  double coordinate_world() const { return corner_ + cell_ * spacing_; }

 private:
  static bool is_inside(int cell) { return cell >= 0 && cell < kTileCells; }
  double line(int k) const { return ((corner_ + k * spacing_) - origin_) * inverse_; }
  void update() {
    t_in_ = is_parallel_ ? -kInfinity : line(cell_ + (step_ > 0 ? 0 : 1));
    t_out_ = is_parallel_ ? kInfinity : line(cell_ + (step_ > 0 ? 1 : 0));
  }

  double corner_;
  double spacing_;
  double origin_;
  double inverse_;
  int step_;
  bool is_parallel_;
  int cell_ = 0;
  double t_in_ = 0.0;
  double t_out_ = 0.0;
};

/// The state of a walk between triangles.
class ClearanceTest {
 public:
  explicit ClearanceTest(const WalkSpan& span)
      : span_(span),
        starts_at_entry_(span.t_from <= span.t_entry),
        is_on_surface_(starts_at_entry_ && span.may_be_on_surface) {}

  /// Whether the clearance a + b t has its first zero in [t_in, t_out].
  bool crosses(double a, double b, double t_in, double t_out) {
    const double g_in = a + b * t_in;
    g_out_ = a + b * t_out;
    if (is_first_) {
      is_first_ = false;
      if (starts_at_entry_) {
        was_clear_at_entry_ = span_.t_clear <= span_.t_entry && g_in > span_.clear_m;
        if (was_clear_at_entry_) return false;
        if (is_on_surface_ && g_in < -kOnSurface_m) return found(t_in);
        is_on_surface_ = is_on_surface_ && g_in <= kOnSurface_m;
      } else {
        was_under_ = g_in <= 0.0;
      }
    }
    if (is_on_surface_) {
      if (g_out_ < -kOnSurface_m) return found(root(a, b, t_in, t_out));
      is_on_surface_ = g_out_ <= kOnSurface_m;
      return false;
    }
    if (g_in <= 0.0) return found(t_in);
    if (g_out_ <= 0.0) return found(root(a, b, t_in, t_out));
    return false;
  }
  double t() const { return t_; }
  bool is_on_surface() const { return is_on_surface_; }
  /// The walk began under the surface although it was to begin above it.
  bool was_under() const { return was_under_; }
  bool was_clear_at_entry() const { return was_clear_at_entry_; }
  bool is_clear(double t_out) const { return t_out >= span_.t_clear && g_out_ > span_.clear_m; }

 private:
  static double root(double a, double b, double t_in, double t_out) {
    return b < 0.0 ? std::clamp(-a / b, t_in, t_out) : t_in;
  }
  bool found(double t) {
    t_ = t;
    return true;
  }

  const WalkSpan& span_;
  bool starts_at_entry_;
  bool is_on_surface_;
  bool is_first_ = true;
  bool was_under_ = false;
  bool was_clear_at_entry_ = false;
  double g_out_ = 0.0;
  double t_ = 0.0;
};

int nearest_cell(double cells) {
  return static_cast<int>(std::clamp(cells, 0.0, kTileCells - 1.0));
}

/// What of a ray and a tile every cell needs.
struct CellFrame {
  CellFrame(const TerrainGrid& terrain, const WalkRay& ray)
      : grid(terrain),
        z0(ray.origin_world.z() - terrain.center_z_m),
        dz(ray.direction_world.z()),
        qx(ray.direction_world.x() * terrain.inverse_spacing),
        qy(ray.direction_world.y() * terrain.inverse_spacing) {}

  /// fx, fy   the ray's origin in the cell, in cells
  TrianglePlane plane(int i, int j, bool is_upper, double fx, double fy) const {
    const int k = is_upper ? 1 : 0;
    return triangle_plane(grid.z(i + k, j + k), grid.z(i + 1 - k, j + k), grid.z(i + k, j + 1 - k),
                          is_upper ? 1.0 : -1.0, fx - k, fy - k, z0, dz, qx, qy);
  }

  void set_crossing(double t, int i, int j, bool is_upper, const TrianglePlane& plane,
                    WalkResult& result) const {
    result.end = WalkResult::End::Crossed;
    result.t = t;
    result.is_on_surface = false;
    result.cell_x = i;
    result.cell_y = j;
    result.is_upper = is_upper;
    result.slope_x = plane.rise_x * grid.inverse_spacing;
    result.slope_y = plane.rise_y * grid.inverse_spacing;
  }

  const TerrainGrid& grid;
  double z0;
  double dz;
  double qx;
  double qy;
};

}  // namespace

int TerrainGrid::column_at(double x_world_m) const {
  return nearest_cell((x_world_m - corner_x_world) * inverse_spacing);
}

int TerrainGrid::row_at(double y_world_m) const {
  return nearest_cell((y_world_m - corner_y_world) * inverse_spacing);
}

double TerrainGrid::z_at(double x_world_m, double y_world_m) const {
  const int i = column_at(x_world_m);
  const int j = row_at(y_world_m);
  const double fx = (x_world_m - x_world(i)) * inverse_spacing;
  const double fy = (y_world_m - y_world(j)) * inverse_spacing;
  const double z10 = z(i + 1, j);
  const double z01 = z(i, j + 1);
  if (fx + fy <= 1.0) {
    const double z00 = z(i, j);
    return z00 + (z10 - z00) * fx + (z01 - z00) * fy;
  }
  const double z11 = z(i + 1, j + 1);
  return z11 + (z11 - z01) * (fx - 1.0) + (z11 - z10) * (fy - 1.0);
}

void walk_terrain(const TerrainGrid& grid, const WalkRay& ray, const WalkSpan& span,
                  WalkResult& result) {
  const CellFrame frame(grid, ray);
  result.end = WalkResult::End::Left;
  result.is_on_surface = false;
  const Eigen::Vector3d& o = ray.origin_world;
  const Eigen::Vector3d& d = ray.direction_world;
  AxisWalk columns(grid.corner_x_world, grid.spacing_m, o.x(), d.x(), ray.inverse_x);
  AxisWalk rows(grid.corner_y_world, grid.spacing_m, o.y(), d.y(), ray.inverse_y);
  columns.start(grid.column_at(o.x() + span.t_from * d.x()), span.t_from);
  rows.start(grid.row_at(o.y() + span.t_from * d.y()), span.t_from);
  ClearanceTest clearance(span);
  for (;;) {
    const int i = columns.cell();
    const int j = rows.cell();
    const double t_in = std::max({columns.t_in(), rows.t_in(), span.t_entry});
    const double t_out = std::max(std::min({columns.t_out(), rows.t_out(), span.t_exit}), t_in);

    // Position in the cell at t = 0, and where along the ray the diagonal fx + fy = 1 lies.
    const double fx = (o.x() - columns.coordinate_world()) * grid.inverse_spacing;
    const double fy = (o.y() - rows.coordinate_world()) * grid.inverse_spacing;
    const double s = fx + fy - 1.0;
    const double qs = frame.qx + frame.qy;
    const bool is_upper_in = s + t_in * qs > 0.0;
    const bool is_upper_out = qs == 0.0 ? is_upper_in : s + t_out * qs > 0.0;  // t_out may be inf
    const double t_diagonal =
        is_upper_in == is_upper_out ? t_out : std::clamp(-s / qs, t_in, t_out);

    for (int part = 0; part < (is_upper_in == is_upper_out ? 1 : 2); ++part) {
      const bool is_upper = part == 0 ? is_upper_in : is_upper_out;
      const TrianglePlane plane = frame.plane(i, j, is_upper, fx, fy);
      if (!clearance.crosses(plane.a, plane.b, part == 0 ? t_in : t_diagonal,
                             part == 0 ? t_diagonal : t_out)) {
        if (!clearance.was_clear_at_entry()) continue;
        result.end = WalkResult::End::Clear;
        result.t = span.t_entry;
        return;
      }
      if (clearance.was_under()) {
        WalkSpan whole = span;
        whole.t_from = span.t_entry;
        walk_terrain(grid, ray, whole, result);
        return;
      }
      frame.set_crossing(clearance.t(), i, j, is_upper, plane, result);
      return;
    }
    AxisWalk& next = columns.t_out() <= rows.t_out() ? columns : rows;
    if (next.t_out() >= span.t_exit) {
      result.is_on_surface = clearance.is_on_surface();
      return;
    }
    if (clearance.is_clear(t_out)) {
      result.end = WalkResult::End::Clear;
      result.t = t_out;
      return;
    }
    next.step();
    if (next.is_over()) return;
  }
}

}  // namespace terracast::world
