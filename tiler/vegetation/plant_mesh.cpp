#include "tiler/vegetation/plant_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "world/tile_id.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;
using world::Shape;

/// Of the triangles of a plant with leaves, this share goes to its stems.
constexpr double kWoodShare = 0.3;

Vector3i steps_of(const Vector3d& place_m) {
  return (place_m / world::kHeightStep_m).array().round().cast<int>().matrix();
}

void add_triangle(Shape& shape, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                  std::uint8_t finish) {
  shape.triangles.push_back({{a, b, c}, finish});
}

std::uint32_t add_vertex(Shape& shape, const Vector3d& place_m) {
  shape.vertices_steps.push_back(steps_of(place_m));
  return static_cast<std::uint32_t>(shape.vertices_steps.size() - 1);
}

/// How stems are drawn with a budget.
struct WoodDetail {
  int trunk_sides;
  int branch_sides;
  int num_trunk_rings;  ///< at most, its point not counted
  int num_branch_rings;
};

WoodDetail wood_detail(int max_triangles) {
  if (max_triangles >= 3000) return {9, 4, 12, 4};
  if (max_triangles >= 800) return {6, 3, 7, 2};
  if (max_triangles >= 200) return {5, 3, 4, 1};
  if (max_triangles >= 40) return {3, 3, 2, 1};
  return {3, 3, 1, 1};
}

/// Rings of a stem that are drawn: its start and, with `num_rings` above 1, some after it, and its
/// end.
std::vector<Stem::Node> drawn_nodes(const Stem& stem, int num_rings) {
  const int last = static_cast<int>(stem.nodes.size()) - 1;
  std::vector<Stem::Node> nodes;
  const int num = std::min(num_rings, last);
  for (int i = 0; i < num; ++i)
    nodes.push_back(stem.nodes[static_cast<std::size_t>(i * last / num)]);
  nodes.push_back(stem.nodes.back());
  return nodes;
}

int num_rings_of(const Stem& stem, const WoodDetail& detail) {
  if (stem.order >= 2) return 1;
  const int wanted = stem.order == 0 ? detail.num_trunk_rings : detail.num_branch_rings;
  return std::min(wanted, static_cast<int>(stem.nodes.size()) - 1);
}

int num_sides_of(const Stem& stem, const WoodDetail& detail) {
  return stem.order == 0 ? detail.trunk_sides : stem.order == 1 ? detail.branch_sides : 3;
}

/// Caps at the start, rings between, and a point at the end.
int num_triangles_of(const Stem& stem, const WoodDetail& detail) {
  const int sides = num_sides_of(stem, detail);
  return sides - 2 + 2 * sides * (num_rings_of(stem, detail) - 1) + sides;
}

void add_stem(Shape& shape, const Stem& stem, const WoodDetail& detail) {
  const std::vector<Stem::Node> nodes = drawn_nodes(stem, num_rings_of(stem, detail));
  const int sides = num_sides_of(stem, detail);
  const auto first = static_cast<std::uint32_t>(shape.vertices_steps.size());
  Vector3d x = across((nodes[1].place_m - nodes[0].place_m).normalized());
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    const Vector3d before = nodes[i].place_m - nodes[i == 0 ? 0 : i - 1].place_m;
    const Vector3d after = nodes[i + 1].place_m - nodes[i].place_m;
    const Vector3d direction = (before + after).normalized();
    // Carried along, so that the tube does not twist.
    x = (x - x.dot(direction) * direction).normalized();
    const Vector3d y = direction.cross(x);
    for (int k = 0; k < sides; ++k) {
      const double angle_rad = 2.0 * std::numbers::pi * k / sides;
      add_vertex(shape, nodes[i].place_m + nodes[i].radius_m *
                                               (std::cos(angle_rad) * x + std::sin(angle_rad) * y));
    }
  }
  const std::uint32_t tip = add_vertex(shape, nodes.back().place_m);
  const auto at = [&](std::size_t ring, int k) {
    return first + static_cast<std::uint32_t>(ring) * static_cast<std::uint32_t>(sides) +
           static_cast<std::uint32_t>(k % sides);
  };
  for (int k = 1; k + 1 < sides; ++k)
    add_triangle(shape, at(0, 0), at(0, k + 1), at(0, k), stem.finish);
  for (std::size_t ring = 0; ring + 2 < nodes.size(); ++ring)
    for (int k = 0; k < sides; ++k) {
      add_triangle(shape, at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), stem.finish);
      add_triangle(shape, at(ring, k), at(ring + 1, k + 1), at(ring + 1, k), stem.finish);
    }
  for (int k = 0; k < sides; ++k)
    add_triangle(shape, at(nodes.size() - 2, k), at(nodes.size() - 2, k + 1), tip, stem.finish);
}

void add_leaf(Shape& shape, const Leaf& leaf) {
  const Vector3d normal = leaf.side_m.cross(leaf.tip_m).normalized();
  const Vector3d lift = leaf.lift_m * normal;
  if (leaf.form == LeafForm::Kite) {
    const std::uint32_t base = add_vertex(shape, leaf.base_m);
    const Vector3d middle = leaf.base_m + 0.45 * leaf.tip_m + lift;
    const std::uint32_t right = add_vertex(shape, middle + leaf.side_m);
    const std::uint32_t tip = add_vertex(shape, leaf.base_m + leaf.tip_m);
    const std::uint32_t left = add_vertex(shape, middle - leaf.side_m);
    add_triangle(shape, base, right, tip, leaf.finish);
    add_triangle(shape, base, tip, left, leaf.finish);
    return;
  }
  const std::uint32_t base_left = add_vertex(shape, leaf.base_m - leaf.side_m);
  const std::uint32_t base_right = add_vertex(shape, leaf.base_m + leaf.side_m);
  const Vector3d middle = leaf.base_m + 0.55 * leaf.tip_m + lift;
  const std::uint32_t right = add_vertex(shape, middle + 0.75 * leaf.side_m);
  const std::uint32_t left = add_vertex(shape, middle - 0.75 * leaf.side_m);
  const std::uint32_t tip = add_vertex(shape, leaf.base_m + leaf.tip_m);
  add_triangle(shape, base_left, base_right, right, leaf.finish);
  add_triangle(shape, base_left, right, left, leaf.finish);
  add_triangle(shape, left, right, tip, leaf.finish);
}

struct Box {
  Vector3d lowest = Vector3d::Constant(std::numeric_limits<double>::infinity());
  Vector3d highest = Vector3d::Constant(-std::numeric_limits<double>::infinity());
};

Box box_of(const Shape& shape) {
  Box box;
  for (const Vector3i& vertex : shape.vertices_steps) {
    const Vector3d place_m = vertex.cast<double>() * world::kHeightStep_m;
    box.lowest = box.lowest.cwiseMin(place_m);
    box.highest = box.highest.cwiseMax(place_m);
  }
  return box;
}

Box box_of(std::span<const Leaf> leaves) {
  Shape shape;
  for (const Leaf& leaf : leaves) add_leaf(shape, leaf);
  return box_of(shape);
}

/// Bits of a whole number spread to every third.
std::uint64_t spread(std::uint64_t bits) {
  std::uint64_t sum = 0;
  for (unsigned i = 0; i < 10; ++i) sum |= (bits >> i & 1U) << (3 * i);
  return sum;
}

/// Rows of the leaves along a curve that fills space (Morton), so that neighbours are near; in plan:
/// those above each other are neighbours.
std::vector<std::size_t> along_curve(std::span<const Leaf> leaves, bool in_plan) {
  Box box;
  for (const Leaf& leaf : leaves) {
    box.lowest = box.lowest.cwiseMin(leaf.center_m());
    box.highest = box.highest.cwiseMax(leaf.center_m());
  }
  const double side_m = std::max((box.highest - box.lowest).maxCoeff(), 1e-3);
  std::vector<std::pair<std::uint64_t, std::size_t>> keyed;
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    const Vector3d at = (leaves[i].center_m() - box.lowest) / side_m * 1023.0;
    keyed.emplace_back(spread(static_cast<std::uint64_t>(at.x())) |
                           spread(static_cast<std::uint64_t>(at.y())) << 1U |
                           (in_plan ? 0 : spread(static_cast<std::uint64_t>(at.z())) << 2U),
                       i);
  }
  std::sort(keyed.begin(), keyed.end());
  std::vector<std::size_t> order;
  for (const auto& [key, row] : keyed) order.push_back(row);
  return order;
}

double area_of(const Leaf& leaf) { return 2.0 * leaf.side_m.norm() * leaf.tip_m.norm(); }

/// Fewer leaves, each in the middle of a run of neighbours and as large as they are together.
std::vector<Leaf> gathered(const Plant& plant, std::size_t num_leaves) {
  const std::span<const Leaf> all(plant.leaves);
  if (num_leaves >= all.size()) return plant.leaves;
  const std::vector<std::size_t> order = along_curve(all, plant.keeps_leaf_length);
  Vector3d crown = Vector3d::Zero();
  for (const Leaf& leaf : all) crown += leaf.center_m() / static_cast<double>(all.size());
  std::vector<Leaf> few;
  for (std::size_t i = 0; i < num_leaves; ++i) {
    const std::size_t begin = i * all.size() / num_leaves;
    const std::size_t end = (i + 1) * all.size() / num_leaves;
    std::size_t row = order[(begin + end) / 2];
    // Of a stand of blades the upright ones are seen.
    if (plant.keeps_leaf_length)
      row = *std::max_element(
          order.begin() + static_cast<std::ptrdiff_t>(begin),
          order.begin() + static_cast<std::ptrdiff_t>(end),
          [&](std::size_t a, std::size_t b) { return all[a].tip_m.z() < all[b].tip_m.z(); });
    Leaf leaf = all[row];
    const double own_area = area_of(leaf);
    Vector3d center = Vector3d::Zero();
    double area = 0.0;
    for (std::size_t k = begin; k < end; ++k) {
      center += all[order[k]].center_m() / static_cast<double>(end - begin);
      area += area_of(all[order[k]]);
    }
    const double factor = area / own_area;
    if (plant.keeps_leaf_length) {
      leaf.side_m *= factor;
    } else {
      const double size = std::sqrt(factor);
      // A large leaf stands for the hull of many: it looks outward as well as its own way.
      Vector3d normal = leaf.side_m.cross(leaf.tip_m).normalized();
      const double share = std::min(1.0, static_cast<double>(end - begin) / 40.0);
      normal = ((1.0 - 0.75 * share) * normal + 0.75 * share * (center - crown).normalized());
      const double length = size * leaf.tip_m.norm();
      const double width = 2.0 * size * leaf.side_m.norm();
      // The more leaves in one, the rounder it is.
      const double round_share = std::sqrt(share);
      const double side = std::sqrt(length * width);
      const double long_side = std::pow(length, 1.0 - round_share) * std::pow(side, round_share);
      Vector3d tip = leaf.tip_m - leaf.tip_m.dot(normal.normalized()) * normal.normalized();
      if (tip.norm() < 1e-3 * leaf.tip_m.norm()) tip = across(normal.normalized());
      tip = long_side * tip.normalized();
      leaf = make_leaf(center - 0.5 * tip, tip, length * width / long_side, normal, leaf.form,
                       leaf.lift_m * size, leaf.finish);
    }
    few.push_back(leaf);
  }
  return few;
}

/// Leaves `factor` times as large (or as wide), moved so that they fill a box as before.
std::vector<Leaf> resized(std::vector<Leaf> leaves, double factor, bool keeps_length,
                          const Box& box) {
  for (Leaf& leaf : leaves) {
    leaf.side_m *= factor;
    if (keeps_length) continue;
    const Vector3d center = leaf.center_m();
    leaf.tip_m *= factor;
    leaf.lift_m *= factor;
    leaf.base_m = center - 0.5 * leaf.tip_m;
  }
  for (int pass = 0; pass < 3; ++pass) {
    const Box now = box_of(leaves);
    for (Leaf& leaf : leaves)
      for (int k = 0; k < 3; ++k) {
        const double extent = now.highest[k] - now.lowest[k];
        if (extent <= 0.0) continue;
        const double center = leaf.center_m()[k];
        const double share = (center - now.lowest[k]) / extent;
        // The middle stays, the borders come to where they were.
        leaf.base_m[k] += (1.0 - share) * (box.lowest[k] - now.lowest[k]) +
                          share * (box.highest[k] - now.highest[k]);
      }
  }
  return leaves;
}

/// How a crown's hull is drawn with a budget: so many corners on each of so many rings.
struct HullDetail {
  int num_sides;
  int num_rings;
  int num_triangles() const { return 2 * num_sides * num_rings; }
};

HullDetail hull_detail(int max_triangles) {
  if (max_triangles >= 54) return {6, 4};
  if (max_triangles >= 26) return {5, 2};
  if (max_triangles >= 20) return {4, 2};
  return {4, 1};
}

/// Leaves shade each other; on a hull nothing does. Its colours (sRGB) are darker by this factor.
constexpr double kHullShade = 0.8;

/// Plants of so many triangles and fewer show hulls.
constexpr int kHullTriangles = 64;

/// A closed body round the leaves of a crown: rings about an axis through its middle, each corner as
/// far out as the leaves near it.
/// factor   scales how far out
void add_hull(Shape& shape, const Plant& plant, const HullDetail& detail, double factor) {
  const Box box = box_of(plant.leaves);
  const double height_m = box.highest.z() - box.lowest.z();
  Vector2d axis_m = Vector2d::Zero();
  for (const Leaf& leaf : plant.leaves)
    axis_m += leaf.center_m().head<2>() / static_cast<double>(plant.leaves.size());
  const int sides = detail.num_sides;
  const int rings = detail.num_rings;
  const auto num_cells = static_cast<std::size_t>(sides * rings);
  std::vector<double> squares(num_cells, 0.0);
  std::vector<double> weights(num_cells, 1e-9);
  std::vector<std::uint8_t> finish(num_cells, plant.leaves.front().finish);
  const auto cell = [&](int ring, int side) {
    return static_cast<std::size_t>(ring * sides + (side + sides) % sides);
  };
  for (const Leaf& leaf : plant.leaves) {
    const Vector2d out = leaf.center_m().head<2>() - axis_m;
    const double up = (leaf.center_m().z() - box.lowest.z()) / std::max(height_m, 1e-3);
    const int ring = std::clamp(static_cast<int>(up * rings), 0, rings - 1);
    const double turn = std::atan2(out.y(), out.x()) / (2.0 * std::numbers::pi) * sides;
    for (int side = 0; side < sides; ++side) {
      double apart = std::abs(turn - side);
      apart = std::min(apart, sides - apart);
      const double weight = std::max(1.0 - apart, 0.0);
      squares[cell(ring, side)] += weight * out.squaredNorm();
      weights[cell(ring, side)] += weight;
      if (weight > 0.9) finish[cell(ring, side)] = leaf.finish;
    }
  }
  const auto first = static_cast<std::uint32_t>(shape.vertices_steps.size());
  const Vector3d axis(axis_m.x(), axis_m.y(), 0.0);
  for (int ring = 0; ring < rings; ++ring)
    for (int side = 0; side < sides; ++side) {
      const std::size_t i = cell(ring, side);
      // Leaves all over a disc have a root mean square of its radius by the root of 2.
      const double out_m =
          std::max(factor * std::sqrt(2.0 * squares[i] / weights[i]), 0.02 * height_m + 0.05);
      const double angle_rad = 2.0 * std::numbers::pi * side / sides;
      Vector3d place = axis + out_m * Vector3d(std::cos(angle_rad), std::sin(angle_rad), 0.0);
      place = place.cwiseMax(box.lowest).cwiseMin(box.highest);
      place.z() = box.lowest.z() + (ring + 0.5) / rings * height_m;
      add_vertex(shape, place);
    }
  const std::uint32_t foot = add_vertex(shape, {axis_m.x(), axis_m.y(), box.lowest.z()});
  const std::uint32_t top = add_vertex(shape, {axis_m.x(), axis_m.y(), box.highest.z()});
  const auto at = [&](int ring, int side) {
    return first + static_cast<std::uint32_t>(cell(ring, side));
  };
  for (int side = 0; side < sides; ++side) {
    add_triangle(shape, at(0, side + 1), at(0, side), foot, finish[cell(0, side)]);
    for (int ring = 0; ring + 1 < rings; ++ring) {
      add_triangle(shape, at(ring, side), at(ring, side + 1), at(ring + 1, side + 1),
                   finish[cell(ring, side)]);
      add_triangle(shape, at(ring, side), at(ring + 1, side + 1), at(ring + 1, side),
                   finish[cell(ring + 1, side)]);
    }
    add_triangle(shape, at(rings - 1, side), at(rings - 1, side + 1), top,
                 finish[cell(rings - 1, side)]);
  }
}

/// A sphere of 20 * 4^n triangles of nearly equal size.
Shape icosphere(int num_divisions) {
  const double a = 0.5257311121191336;
  const double b = 0.8506508083520399;
  std::vector<Vector3d> places = {{-a, b, 0}, {a, b, 0}, {-a, -b, 0}, {a, -b, 0},
                                  {0, -a, b}, {0, a, b}, {0, -a, -b}, {0, a, -b},
                                  {b, 0, -a}, {b, 0, a}, {-b, 0, -a}, {-b, 0, a}};
  std::vector<std::array<std::uint32_t, 3>> triangles = {
      {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int i = 0; i < num_divisions; ++i) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t p, std::uint32_t q) {
      const auto [entry, is_new] =
          middles.try_emplace(std::minmax(p, q), static_cast<std::uint32_t>(places.size()));
      if (is_new) places.push_back((places[p] + places[q]).normalized());
      return entry->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [p, q, r] : triangles) {
      const std::uint32_t pq = middle(p, q);
      const std::uint32_t qr = middle(q, r);
      const std::uint32_t rp = middle(r, p);
      finer.insert(finer.end(), {{p, pq, rp}, {q, qr, pq}, {r, rp, qr}, {pq, qr, rp}});
    }
    triangles = std::move(finer);
  }
  Shape shape;
  for (const Vector3d& place : places) shape.vertices_steps.push_back(steps_of(place * 1024.0));
  for (const auto& corners : triangles) shape.triangles.push_back({corners, 0});
  return shape;
}

/// scale   of all, about the stone's middle
Shape stone_mesh(const Plant& plant, int num_divisions, double scale) {
  Shape shape = icosphere(num_divisions);
  for (Vector3i& vertex : shape.vertices_steps) {
    const Vector3d direction = vertex.cast<double>().normalized();
    vertex = steps_of(plant.stone_center_m + scale * plant.stone_reach_m(direction) * direction);
  }
  shape.finishes = plant.finishes;
  return shape;
}

constexpr int kStoneDivisions = 3;  ///< of the finest

Shape coarse_stone(const Plant& plant, int max_triangles, double full_area_m2) {
  int num_divisions = 0;
  while (num_divisions < kStoneDivisions && (20 << (2 * (num_divisions + 1))) <= max_triangles)
    ++num_divisions;
  const double area_m2 = seen_area_m2(stone_mesh(plant, num_divisions, 1.0));
  return stone_mesh(plant, num_divisions, std::sqrt(full_area_m2 / area_m2));
}

/// Number of cells of a raster that a shape covers, seen along -z of `view`.
std::int64_t num_covered(const Shape& shape, const Eigen::Matrix3d& view, double cell_m,
                         double reach_m) {
  const int side = 2 * static_cast<int>(std::ceil(reach_m / cell_m)) + 2;
  std::vector<std::uint8_t> is_covered(static_cast<std::size_t>(side) *
                                       static_cast<std::size_t>(side));
  std::vector<Vector2d> places;
  for (const Vector3i& vertex : shape.vertices_steps)
    places.emplace_back((view * vertex.cast<double>()).head<2>() * (world::kHeightStep_m / cell_m) +
                        Vector2d::Constant(0.5 * side));
  for (const Shape::Triangle& triangle : shape.triangles) {
    const Vector2d& a = places[triangle.corners[0]];
    Vector2d b = places[triangle.corners[1]];
    Vector2d c = places[triangle.corners[2]];
    const auto cross = [](const Vector2d& u, const Vector2d& v) {
      return u.x() * v.y() - u.y() * v.x();
    };
    if (cross(b - a, c - a) < 0.0) std::swap(b, c);
    const Vector2d lowest = a.cwiseMin(b).cwiseMin(c);
    const Vector2d highest = a.cwiseMax(b).cwiseMax(c);
    for (int j = std::max(static_cast<int>(std::ceil(lowest.y() - 0.5)), 0);
         j + 0.5 <= highest.y() && j < side; ++j)
      for (int i = std::max(static_cast<int>(std::ceil(lowest.x() - 0.5)), 0);
           i + 0.5 <= highest.x() && i < side; ++i) {
        const Vector2d at(i + 0.5, j + 0.5);
        if (cross(b - a, at - a) >= 0.0 && cross(c - b, at - b) >= 0.0 &&
            cross(a - c, at - c) >= 0.0)
          is_covered[static_cast<std::size_t>(j) * static_cast<std::size_t>(side) +
                     static_cast<std::size_t>(i)] = 1;
      }
  }
  return std::accumulate(is_covered.begin(), is_covered.end(), std::int64_t{0});
}

}  // namespace

namespace {

/// Areas of a shape's outline, seen from headings and tilts.
class Outlines {
 public:
  Outlines(const Shape& shape, int num_cells) : shape_(shape) {
    for (const Vector3i& vertex : shape.vertices_steps)
      reach_m_ = std::max(reach_m_, vertex.cast<double>().norm() * world::kHeightStep_m);
    const Box box = box_of(shape);
    cell_m_ = (box.highest - box.lowest).maxCoeff() / num_cells;
  }
  double area_m2(double heading_rad, double tilt_rad) const {
    const Eigen::Matrix3d view = (Eigen::AngleAxisd(tilt_rad, Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(heading_rad, Vector3d::UnitZ()))
                                     .toRotationMatrix();
    return static_cast<double>(num_covered(shape_, view, cell_m_, reach_m_)) * cell_m_ * cell_m_;
  }

 private:
  const Shape& shape_;
  double reach_m_ = 0.0;
  double cell_m_ = 0.0;
};

}  // namespace

double seen_area_m2(const Shape& shape) {
  const Outlines outlines(shape, 160);
  constexpr double kLevel = -0.5 * std::numbers::pi;
  return (outlines.area_m2(0.3, kLevel) + outlines.area_m2(1.4, kLevel) +
          outlines.area_m2(2.4, 0.5 * kLevel) + outlines.area_m2(4.5, 0.5 * kLevel) +
          outlines.area_m2(0.0, 0.0)) /
         5.0;
}

double plan_area_m2(const Shape& shape) { return Outlines(shape, 96).area_m2(0.0, 0.0); }

Shape full_mesh(const Plant& plant) {
  if (plant.stone_reach_m) return stone_mesh(plant, kStoneDivisions, 1.0);
  Shape shape;
  const WoodDetail detail = wood_detail(std::numeric_limits<int>::max());
  for (const Stem& stem : plant.stems) add_stem(shape, stem, detail);
  for (const Leaf& leaf : plant.leaves) add_leaf(shape, leaf);
  shape.finishes = plant.finishes;
  return shape;
}

Shape mesh_of(const Plant& plant, int max_triangles, double full_area_m2) {
  if (plant.stone_reach_m) return coarse_stone(plant, max_triangles, full_area_m2);
  const WoodDetail detail = wood_detail(max_triangles);
  Shape wood;
  wood.finishes = plant.finishes;
  std::vector<std::size_t> rows(plant.stems.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  const auto size_of = [&](std::size_t row) {
    const Stem& stem = plant.stems[row];
    return stem.nodes.front().radius_m *
           (stem.nodes.back().place_m - stem.nodes.front().place_m).norm();
  };
  std::stable_sort(rows.begin(), rows.end(),
                   [&](std::size_t a, std::size_t b) { return size_of(a) > size_of(b); });
  int leaf_triangles = 0;
  for (const Leaf& leaf : plant.leaves) leaf_triangles += leaf.num_triangles();
  const bool is_hull = plant.has_crown && max_triangles <= kHullTriangles;
  if (is_hull) {
    leaf_triangles = hull_detail(max_triangles).num_triangles();
    for (world::Finish& finish : wood.finishes)
      if (finish.material != world::Material::Bark)
        for (std::uint8_t& value : finish.color_srgb)
          value = static_cast<std::uint8_t>(std::lround(kHullShade * value));
  }
  const double wood_share = plant.leaves.empty() ? 1.0 : is_hull ? 0.0 : kWoodShare;
  const int most_wood =
      std::max(static_cast<int>(max_triangles * wood_share), max_triangles - leaf_triangles);
  int num_triangles = 0;
  for (const std::size_t row : rows) {
    const int own = num_triangles_of(plant.stems[row], detail);
    if (num_triangles + own > most_wood) break;
    add_stem(wood, plant.stems[row], detail);
    num_triangles += own;
  }
  if (plant.leaves.empty()) return wood;

  const auto num_leaves = static_cast<std::size_t>(
      std::max((max_triangles - num_triangles) / plant.leaves.front().num_triangles(), 1));
  if (!is_hull && num_leaves >= plant.leaves.size()) {
    for (const Leaf& leaf : plant.leaves) add_leaf(wood, leaf);
    return wood;
  }
  const std::vector<Leaf> few = is_hull ? std::vector<Leaf>() : gathered(plant, num_leaves);
  const Box box = box_of(plant.leaves);
  const auto with_leaves = [&](double factor) {
    Shape shape = wood;
    if (is_hull)
      add_hull(shape, plant, hull_detail(max_triangles), factor);
    else
      for (const Leaf& leaf : resized(few, factor, plant.keeps_leaf_length, box))
        add_leaf(shape, leaf);
    return shape;
  };
  // To about one per cent.
  double smallest = 0.4;
  double largest = 2.3;
  for (int i = 0; i < 7; ++i) {
    const double middle = std::sqrt(smallest * largest);
    (seen_area_m2(with_leaves(middle)) < full_area_m2 ? smallest : largest) = middle;
  }
  return with_leaves(std::sqrt(smallest * largest));
}

world::ShapeLevels levels_of(const Plant& plant, std::span<const PlantLevel> levels) {
  const double full_area_m2 = seen_area_m2(full_mesh(plant));
  world::ShapeLevels shapes;
  for (const PlantLevel& level : levels)
    shapes.push_back({static_cast<std::int8_t>(level.coarsest_level),
                      mesh_of(plant, level.max_triangles, full_area_m2)});
  return shapes;
}

}  // namespace terracast::tiler
