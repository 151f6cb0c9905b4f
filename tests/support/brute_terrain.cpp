#include "tests/support/brute_terrain.h"

#include <algorithm>
#include <cmath>

namespace terracast::test {

double BruteTerrain::first_crossing(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                    double t_min, double t_max) const {
  Ray ray{origin, direction, t_min, t_max};
  for (const Grid& grid : tiles_) cross_grid(grid, ray);
  return ray.best;
}

double BruteTerrain::ground_z(double x, double y) const {
  const double inf = std::numeric_limits<double>::infinity();
  const double t = first_crossing({x, y, 1e5}, {0.0, 0.0, -1.0}, 0.0, inf);
  return std::isinf(t) ? std::numeric_limits<double>::quiet_NaN() : 1e5 - t;
}

std::array<Eigen::Vector3d, 3> BruteTerrain::triangle(std::size_t tile_index, int i, int j,
                                                      bool is_upper) const {
  const Grid& grid = tiles_.at(tile_index);
  const auto corner = [&](int x, int y) {
    return Eigen::Vector3d(grid.x0 + x * grid.spacing, grid.y0 + y * grid.spacing, grid.at(x, y));
  };
  if (is_upper) return {corner(i + 1, j + 1), corner(i, j + 1), corner(i + 1, j)};
  return {corner(i, j), corner(i + 1, j), corner(i, j + 1)};
}

BruteTerrain::Grid BruteTerrain::read(const world::TileStore& store, const world::TileId& id,
                                      const std::set<world::TileId>& leaves) {
  const world::Tile tile = store.load(id);
  const double spacing = std::pow(2.0, id.level);
  Grid grid{id.x * 256.0 * spacing, id.y * 256.0 * spacing, spacing, {}, -1e300};
  for (const std::int32_t steps : tile.height_steps)
    grid.z.push_back(tile.center_z_m + steps / 1024.0);
  const auto is_coarser = [&](int dx, int dy) {
    const auto half = [](int k) { return static_cast<int>(std::floor(k / 2.0)); };
    return leaves.count({id.level + 1, half(id.x + dx), half(id.y + dy)}) > 0;
  };
  const auto mean = [&](int i, int j, int di, int dj) {
    grid.z[static_cast<std::size_t>(j) * 257 + static_cast<std::size_t>(i)] =
        (grid.at(i - di, j - dj) + grid.at(i + di, j + dj)) / 2.0;
  };
  for (int k = 1; k < 257; k += 2) {
    if (is_coarser(-1, 0)) mean(0, k, 0, 1);
    if (is_coarser(1, 0)) mean(256, k, 0, 1);
    if (is_coarser(0, -1)) mean(k, 0, 1, 0);
    if (is_coarser(0, 1)) mean(k, 256, 1, 0);
  }
  grid.highest = *std::max_element(grid.z.begin(), grid.z.end());
  return grid;
}

void BruteTerrain::cross_grid(const Grid& grid, Ray& ray) {
  const int major = std::abs(ray.d.x()) >= std::abs(ray.d.y()) ? 0 : 1;
  const int minor = 1 - major;
  const std::array<double, 2> corner = {grid.x0, grid.y0};
  const double s = grid.spacing;
  const double pad = 1e-3 * s;
  const auto a = static_cast<std::size_t>(major);
  const auto b = static_cast<std::size_t>(minor);
  for (std::size_t k : {a, b}) {  // the whole tile out of the way?
    const double d = ray.d[static_cast<Eigen::Index>(k)];
    const double o = ray.o[static_cast<Eigen::Index>(k)] - corner[k];
    if (d == 0.0 && (o < -pad || o > 256 * s + pad)) return;
  }
  double t0 = ray.t_min;
  double t1 = std::min(ray.t_max, ray.best);
  for (std::size_t k : {a, b}) {
    const double d = ray.d[static_cast<Eigen::Index>(k)];
    if (d == 0.0) continue;
    const double o = ray.o[static_cast<Eigen::Index>(k)] - corner[k];
    t0 = std::max(t0, std::min((-pad - o) / d, (256 * s + pad - o) / d));
    t1 = std::min(t1, std::max((-pad - o) / d, (256 * s + pad - o) / d));
  }
  if (t0 > t1) return;
  const double zs = ray.o.z();
  const double dz = ray.d.z();
  if (std::min(zs + t0 * dz, zs + t1 * dz) > grid.highest + 1.0) return;

  const double om = ray.o[major] - corner[a];
  const double dm = ray.d[major];
  const double on = ray.o[minor] - corner[b];
  const double dn = ray.d[minor];
  const auto cell = [&](double at) {
    return static_cast<int>(std::clamp(std::floor(at / s), 0.0, 255.0));
  };
  const int first = cell(std::min(om + t0 * dm, om + t1 * dm) - pad);
  const int last = cell(std::max(om + t0 * dm, om + t1 * dm) + pad);
  for (int m = first; m <= last; ++m) {
    double u0 = t0;
    double u1 = t1;
    if (dm != 0.0) {
      const double e0 = (m * s - pad - om) / dm;
      const double e1 = ((m + 1) * s + pad - om) / dm;
      u0 = std::max(u0, std::min(e0, e1));
      u1 = std::min(u1, std::max(e0, e1));
    }
    const double low = std::min(zs + u0 * dz, zs + u1 * dz) - 1e-3;
    const double high = std::max(zs + u0 * dz, zs + u1 * dz) + 1e-3;
    const int n0 = cell(std::min(on + u0 * dn, on + u1 * dn) - pad);
    const int n1 = cell(std::max(on + u0 * dn, on + u1 * dn) + pad);
    for (int n = n0; n <= n1; ++n) {
      const int i = major == 0 ? m : n;
      const int j = major == 0 ? n : m;
      const double z00 = grid.at(i, j);
      const double z10 = grid.at(i + 1, j);
      const double z01 = grid.at(i, j + 1);
      const double z11 = grid.at(i + 1, j + 1);
      if (low > std::max({z00, z10, z01, z11}) || high < std::min({z00, z10, z01, z11})) continue;
      const Point p00{grid.x0 + i * s, grid.y0 + j * s, z00};
      const Point p10{grid.x0 + (i + 1) * s, grid.y0 + j * s, z10};
      const Point p01{grid.x0 + i * s, grid.y0 + (j + 1) * s, z01};
      const Point p11{grid.x0 + (i + 1) * s, grid.y0 + (j + 1) * s, z11};
      cross_triangle(p00, p10, p01, ray);
      cross_triangle(p10, p11, p01, ray);
    }
  }
}

BruteTerrain::Real BruteTerrain::side(const Point& p, const Point& q, const Ray& ray) {
  const bool is_turned = q.y < p.y || (q.y == p.y && q.x < p.x);
  const Point& a = is_turned ? q : p;
  const Point& b = is_turned ? p : q;
  const Real ax = a.x - ray.o.x(), ay = a.y - ray.o.y(), az = a.z - ray.o.z();
  const Real bx = b.x - ray.o.x(), by = b.y - ray.o.y(), bz = b.z - ray.o.z();
  const Real volume = ray.d.x() * (ay * bz - az * by) + ray.d.y() * (az * bx - ax * bz) +
                      ray.d.z() * (ax * by - ay * bx);
  return is_turned ? -volume : volume;
}

void BruteTerrain::cross_triangle(const Point& p, const Point& q, const Point& r, Ray& ray) {
  const Real e0 = side(p, q, ray);
  const Real e1 = side(q, r, ray);
  const Real e2 = side(r, p, ray);
  const bool inside = (e0 >= 0 && e1 >= 0 && e2 >= 0) || (e0 <= 0 && e1 <= 0 && e2 <= 0);
  if (!inside || (e0 == 0 && e1 == 0 && e2 == 0)) return;
  const Real nx = (q.y - p.y) * (r.z - p.z) - (q.z - p.z) * (r.y - p.y);
  const Real ny = (q.z - p.z) * (r.x - p.x) - (q.x - p.x) * (r.z - p.z);
  const Real nz = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
  const Real along = nx * ray.d.x() + ny * ray.d.y() + nz * ray.d.z();
  if (along == 0) return;
  const Real t = (nx * (p.x - ray.o.x()) + ny * (p.y - ray.o.y()) + nz * (p.z - ray.o.z())) / along;
  if (t < ray.t_min || t > ray.t_max) return;
  ray.best = std::min(ray.best, static_cast<double>(t));
}

}  // namespace terracast::test
