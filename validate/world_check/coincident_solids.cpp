#include "validate/world_check/coincident_solids.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "validate/world_check/shape_check.h"
#include "world/tile.h"

namespace terracast::world_check {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kOnePlane_steps = 1.5;
constexpr double kLeastArea_m2 = 0.01;
/// A hundredth of that, of two triangles.
constexpr double kLeastPiece_m2 = 1e-4;
constexpr double kStepArea_m2 = world::kHeightStep_m * world::kHeightStep_m;
/// Normals of faces in one plane; those of slivers are far off by the rounding of their corners.
constexpr double kLeastCosine = 0.99;

using Box = Eigen::AlignedBox3d;

struct Face {
  std::array<Vector3d, 3> corners;  ///< steps, in the world
  Vector3d normal;
  Box box;
};

Box shown_box(const ShownSolid& solid) {
  Box box;
  for (const Eigen::Vector3i& vertex : solid.shape->vertices_steps)
    box.extend((solid.origin_steps + vertex).cast<double>());
  const Vector3d margin = Vector3d::Constant(kOnePlane_steps);
  return box.isEmpty() ? box : Box(box.min() - margin, box.max() + margin);
}

/// Of a solid's triangles those in a box, by where they begin in the west.
std::vector<Face> faces_in(const ShownSolid& solid, const Box& where) {
  std::vector<Face> faces;
  for (const world::Shape::Triangle& triangle : solid.shape->triangles) {
    if (is_sheet(solid.shape->finishes[triangle.finish].material)) continue;
    Face face;
    for (std::size_t k = 0; k < 3; ++k) {
      face.corners[k] =
          (solid.origin_steps + solid.shape->vertices_steps[triangle.corners[k]]).cast<double>();
      face.box.extend(face.corners[k]);
    }
    if (!face.box.intersects(where)) continue;
    face.normal =
        (face.corners[1] - face.corners[0]).cross(face.corners[2] - face.corners[0]).normalized();
    if (!face.normal.allFinite() || face.normal.isZero()) continue;
    faces.push_back(face);
  }
  std::sort(faces.begin(), faces.end(),
            [](const Face& a, const Face& b) { return a.box.min().x() < b.box.min().x(); });
  return faces;
}

/// A corner of what two triangles share, seen along an axis.
using Polygon = std::vector<Vector2d>;

/// What lies to the left of an edge (Sutherland and Hodgman 1974).
Polygon clipped(const Polygon& polygon, const Vector2d& a, const Vector2d& b) {
  const auto left_of = [&](const Vector2d& p) {
    return (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
  };
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& p = polygon[i];
    const Vector2d& q = polygon[(i + 1) % polygon.size()];
    const double at_p = left_of(p), at_q = left_of(q);
    if (at_p >= 0.0) kept.push_back(p);
    if ((at_p < 0.0) != (at_q < 0.0)) kept.push_back(p + at_p / (at_p - at_q) * (q - p));
  }
  return kept;
}

double area_of(const Polygon& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& p = polygon[i];
    const Vector2d& q = polygon[(i + 1) % polygon.size()];
    twice += p.x() * q.y() - p.y() * q.x();
  }
  return 0.5 * twice;
}

struct Piece {
  double area_m2;
  Vector3d place_steps;
};

/// What two triangles have in common, if they lie in one plane there.
std::optional<Piece> common(const Face& one, const Face& other) {
  if (std::abs(one.normal.dot(other.normal)) < kLeastCosine) return std::nullopt;
  // Seen along the axis that is nearest to the normal, about a corner so that numbers stay small.
  Eigen::Index axis = 0;
  const double along = one.normal.cwiseAbs().maxCoeff(&axis);
  const Eigen::Index u = (axis + 1) % 3, v = (axis + 2) % 3;
  const Vector3d& origin = one.corners[0];
  const auto seen = [&](const Face& face) {
    Polygon polygon;
    for (const Vector3d& corner : face.corners)
      polygon.emplace_back(corner[u] - origin[u], corner[v] - origin[v]);
    if (area_of(polygon) < 0.0) std::swap(polygon[1], polygon[2]);
    return polygon;
  };
  const Polygon window = seen(other);
  Polygon shared = seen(one);
  for (std::size_t k = 0; k < 3 && !shared.empty(); ++k)
    shared = clipped(shared, window[k], window[(k + 1) % 3]);
  if (shared.size() < 3) return std::nullopt;
  const double area_m2 = area_of(shared) / along * kStepArea_m2;
  if (area_m2 < kLeastPiece_m2) return std::nullopt;
  const auto height = [&](const Face& face, const Vector2d& at) {
    const Vector3d from = face.corners[0] - origin;
    return from[axis] -
           (face.normal[u] * (at.x() - from[u]) + face.normal[v] * (at.y() - from[v])) /
               face.normal[axis];
  };
  for (const Vector2d& at : shared)
    if (std::abs(height(one, at) - height(other, at)) * along > kOnePlane_steps)
      return std::nullopt;
  Vector3d place = origin;
  place[u] += shared[0].x();
  place[v] += shared[0].y();
  place[axis] += height(one, shared[0]);
  return Piece{area_m2, place};
}

/// All that two solids share.
Piece shared_by(const ShownSolid& one, const ShownSolid& other, const Box& where) {
  const std::vector<Face> of_one = faces_in(one, where);
  Piece all{0.0, Vector3d::Zero()};
  if (of_one.empty()) return all;
  const std::vector<Face> of_other = faces_in(other, where);
  double widest = 0.0;
  for (const Face& face : of_other) widest = std::max(widest, face.box.sizes().x());
  for (const Face& face : of_one) {
    const double from = face.box.min().x() - widest - kOnePlane_steps;
    for (auto at =
             std::lower_bound(of_other.begin(), of_other.end(), from,
                              [](const Face&each, double x) { return each.box.min().x() < x; });
         at != of_other.end() && at->box.min().x() <= face.box.max().x() + kOnePlane_steps; ++at) {
      if (face.box.exteriorDistance(at->box) > kOnePlane_steps) continue;
      const std::optional<Piece> piece = common(face, *at);
      if (!piece) continue;
      if (all.area_m2 == 0.0) all.place_steps = piece->place_steps;
      all.area_m2 += piece->area_m2;
    }
  }
  return all;
}

}  // namespace

std::vector<Coincident> find_coincident(
    std::span<const ShownSolid> solids,
    const std::function<bool(std::size_t first, std::size_t second)>& are_shown) {
  std::vector<Box> boxes;
  std::vector<std::size_t> by_west;
  for (const ShownSolid& solid : solids) {
    boxes.push_back(shown_box(solid));
    if (!boxes.back().isEmpty()) by_west.push_back(boxes.size() - 1);
  }
  std::sort(by_west.begin(), by_west.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(boxes[a].min().x(), a) < std::pair(boxes[b].min().x(), b);
  });
  std::vector<Coincident> found;
  std::vector<std::size_t> open;  // that may reach as far east
  for (const std::size_t next : by_west) {
    std::erase_if(open, [&](std::size_t i) { return boxes[i].max().x() < boxes[next].min().x(); });
    for (const std::size_t i : open) {
      if (!boxes[i].intersects(boxes[next]) || solids[i].instance_id == solids[next].instance_id)
        continue;
      const auto [first, second] = std::minmax(i, next);
      if (are_shown && !are_shown(first, second)) continue;
      const Piece shared =
          shared_by(solids[first], solids[second], boxes[i].intersection(boxes[next]));
      if (shared.area_m2 > kLeastArea_m2)
        found.push_back({first, second, shared.area_m2, shared.place_steps});
    }
    open.push_back(next);
  }
  std::sort(found.begin(), found.end(), [](const Coincident& a, const Coincident& b) {
    return std::pair(a.first, a.second) < std::pair(b.first, b.second);
  });
  return found;
}

}  // namespace terracast::world_check
