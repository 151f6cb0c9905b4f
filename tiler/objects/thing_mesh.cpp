#include "tiler/objects/thing_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "world/tile_id.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Triangles of a simple polygon by clipping ears; corners are indices of its points, turning as it does.
std::vector<std::array<std::size_t, 3>> triangulated(const Ring& ring) {
  Vector3d normal = Vector3d::Zero();  // Newell's
  for (std::size_t i = 0; i < ring.size(); ++i)
    normal += ring[i].cross(ring[(i + 1) % ring.size()]);
  // Onto the plane of the axes that keeps most of its area.
  int drop = 0;
  normal.cwiseAbs().maxCoeff(&drop);
  const int u = (drop + 1) % 3;
  const int v = (drop + 2) % 3;
  Outline flat;
  const double sign = normal[drop] < 0.0 ? -1.0 : 1.0;
  for (const Vector3d& point : ring) flat.emplace_back(sign * point[u], point[v]);

  std::vector<std::size_t> left(ring.size());
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = i;
  std::vector<std::array<std::size_t, 3>> triangles;
  while (left.size() > 3) {
    std::size_t best = 0;
    bool is_found = false;
    for (std::size_t i = 0; i < left.size() && !is_found; ++i) {
      const std::size_t before = left[(i + left.size() - 1) % left.size()];
      const std::size_t after = left[(i + 1) % left.size()];
      const Vector2d& a = flat[before];
      const Vector2d& b = flat[left[i]];
      const Vector2d& c = flat[after];
      if (cross(b - a, c - b) <= 1e-9) continue;
      bool is_ear = true;
      for (const std::size_t other : left) {
        if (other == before || other == left[i] || other == after) continue;
        const Vector2d& p = flat[other];
        if (cross(b - a, p - a) > -1e-9 && cross(c - b, p - b) > -1e-9 &&
            cross(a - c, p - c) > -1e-9) {
          is_ear = false;
          break;
        }
      }
      if (!is_ear) continue;
      best = i;
      is_found = true;
    }
    // Points in a line are left: any corner will do, its triangle has no area.
    triangles.push_back(
        {left[(best + left.size() - 1) % left.size()], left[best], left[(best + 1) % left.size()]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
  }
  triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

}  // namespace

FinishNumber ThingMesh::finish(world::Material material, const Color& color) {
  return finish(material, color, semantic_class_);
}

FinishNumber ThingMesh::finish(world::Material material, const Color& color,
                               core::SemanticClass semantic_class) {
  const world::Finish wanted{
      .material = material, .semantic_class = semantic_class, .color_srgb = color, .pattern = 0};
  const auto found = std::find(shape_.finishes.begin(), shape_.finishes.end(), wanted);
  if (found != shape_.finishes.end())
    return static_cast<FinishNumber>(found - shape_.finishes.begin());
  TERRACAST_CHECK(shape_.finishes.size() < 256, "a thing has too many finishes");
  shape_.finishes.push_back(wanted);
  return static_cast<FinishNumber>(shape_.finishes.size() - 1);
}

void ThingMesh::set_frame(const Vector3d& origin, double turn_rad) {
  origin_ = origin;
  turn_rad_ = turn_rad;
}

Vector3d ThingMesh::placed(const Vector3d& point) const {
  if (turn_rad_ == 0.0) return origin_ + point;
  return origin_ + Eigen::AngleAxisd(turn_rad_, Vector3d::UnitZ()) * point;
}

void ThingMesh::turning(Turning how, const std::function<void()>& build) {
  if (!splits_turning_) {
    build();
    return;
  }
  how.origin_m = placed(how.origin_m);
  how.axis = Eigen::AngleAxisd(turn_rad_, Vector3d::UnitZ()) * how.axis;
  std::vector<Vector3i> vertices_steps = std::exchange(shape_.vertices_steps, {});
  std::vector<world::Shape::Triangle> triangles = std::exchange(shape_.triangles, {});
  part_origin_ = how.origin_m;
  build();
  part_origin_ = Vector3d::Zero();
  TurningShape part{.turning = std::move(how), .shape = {}};
  part.shape.vertices_steps = std::exchange(shape_.vertices_steps, std::move(vertices_steps));
  part.shape.triangles = std::exchange(shape_.triangles, std::move(triangles));
  if (!part.shape.triangles.empty()) turning_.push_back(std::move(part));
}

std::vector<TurningShape> ThingMesh::turning_shapes() const {
  std::vector<TurningShape> shapes = turning_;
  std::map<std::string, int> count;
  for (TurningShape& part : shapes) {
    part.shape.finishes = shape_.finishes;
    part.turning.name += std::to_string(++count[part.turning.name]);
  }
  return shapes;
}

void ThingMesh::loft(const std::vector<Ring>& rings, const FinishOfFace& sides,
                     FinishNumber first_end, FinishNumber last_end) {
  const std::size_t num_points = rings.front().size();
  TERRACAST_CHECK(rings.size() >= 2 && num_points >= 3, "no body");
  // Vertices of one place are one, within this part.
  std::map<std::tuple<int, int, int>, std::uint32_t> known;
  std::vector<std::uint32_t> numbers;
  for (const Ring& ring : rings) {
    TERRACAST_CHECK(ring.size() == num_points, "rings of {} and {} points", num_points,
                    ring.size());
    for (const Vector3d& point : ring) {
      const Vector3i steps =
          ((placed(point) - part_origin_) / world::kHeightStep_m).array().round().cast<int>();
      const auto [entry, is_new] =
          known.try_emplace({steps.x(), steps.y(), steps.z()},
                            static_cast<std::uint32_t>(shape_.vertices_steps.size()));
      if (is_new) shape_.vertices_steps.push_back(steps);
      numbers.push_back(entry->second);
    }
  }
  const std::size_t first_triangle = shape_.triangles.size();
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c, FinishNumber finish) {
    const std::array<std::uint32_t, 3> corners = {numbers[a], numbers[b], numbers[c]};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) return;
    shape_.triangles.push_back({.corners = corners, .finish = finish});
  };
  for (std::size_t r = 0; r + 1 < rings.size(); ++r)
    for (std::size_t i = 0; i < num_points; ++i) {
      const std::size_t j = (i + 1) % num_points;
      const std::size_t low = r * num_points;
      const std::size_t high = low + num_points;
      const FinishNumber finish = sides(r, i);
      // Split along the shorter diagonal.
      const double rising = (rings[r][i] - rings[r + 1][j]).squaredNorm();
      const double falling = (rings[r][j] - rings[r + 1][i]).squaredNorm();
      if (rising <= falling * (1.0 + 1e-9)) {
        add(low + i, low + j, high + j, finish);
        add(low + i, high + j, high + i, finish);
      } else {
        add(low + i, low + j, high + i, finish);
        add(low + j, high + j, high + i, finish);
      }
    }
  const std::size_t last = (rings.size() - 1) * num_points;
  for (const auto& [a, b, c] : triangulated(rings.front())) add(c, b, a, first_end);
  for (const auto& [a, b, c] : triangulated(rings.back()))
    add(last + a, last + b, last + c, last_end);
  // Turned outward: its volume is not below 0.
  double volume = 0.0;
  for (std::size_t t = first_triangle; t < shape_.triangles.size(); ++t) {
    const auto& corners = shape_.triangles[t].corners;
    const Vector3d origin = shape_.vertices_steps[numbers[0]].cast<double>();
    const auto at = [&](int k) -> Vector3d {
      return shape_.vertices_steps[corners[static_cast<std::size_t>(k)]].cast<double>() - origin;
    };
    volume += at(0).dot(at(1).cross(at(2)));
  }
  if (volume < 0.0)
    for (std::size_t t = first_triangle; t < shape_.triangles.size(); ++t)
      std::swap(shape_.triangles[t].corners[1], shape_.triangles[t].corners[2]);
}

void ThingMesh::loft(const std::vector<Ring>& rings, FinishNumber finish) {
  loft(
      rings, [finish](std::size_t, std::size_t) { return finish; }, finish, finish);
}

void ThingMesh::box(const Vector3d& lowest, const Vector3d& highest, FinishNumber finish) {
  tapered_box(lowest, highest, lowest.head<2>(), highest.head<2>(), finish);
}

void ThingMesh::tapered_box(const Vector3d& lowest, const Vector3d& highest,
                            const Vector2d& top_lowest, const Vector2d& top_highest,
                            FinishNumber finish) {
  loft({ring_at(lowest.z(), rectangle(lowest.head<2>(), highest.head<2>())),
        ring_at(highest.z(), rectangle(top_lowest, top_highest))},
       finish);
}

void ThingMesh::prism(const Outline& outline, double low_z_m, double high_z_m, FinishNumber sides,
                      FinishNumber ends) {
  loft(
      {ring_at(low_z_m, outline), ring_at(high_z_m, outline)},
      [sides](std::size_t, std::size_t) { return sides; }, ends, ends);
}

void ThingMesh::prism_across(const Outline& outline, double low_y_m, double high_y_m,
                             FinishNumber sides, FinishNumber ends) {
  std::vector<Ring> rings(2);
  for (const Vector2d& point : outline) {
    rings[0].emplace_back(point.x(), low_y_m, point.y());
    rings[1].emplace_back(point.x(), high_y_m, point.y());
  }
  loft(
      rings, [sides](std::size_t, std::size_t) { return sides; }, ends, ends);
}

void ThingMesh::bar(const Vector3d& from, const Vector3d& to, double width_m, FinishNumber finish,
                    int num_sides) {
  // The radius of a square's corners.
  const double radius_m = num_sides == 4 ? width_m * std::numbers::sqrt2 / 2.0 : width_m / 2.0;
  cone(from, to, radius_m, radius_m, num_sides, finish, finish);
}

void ThingMesh::cone(const Vector3d& from, const Vector3d& to, double from_radius_m,
                     double to_radius_m, int num_sides, FinishNumber sides, FinishNumber ends) {
  const Vector3d along = (to - from).normalized();
  // Squares lie flat: their corners halfway between the level and the upright direction.
  const bool is_upright = along.head<2>().squaredNorm() < 1e-12;
  const Vector3d level = is_upright ? Vector3d::UnitX().eval()
                                    : Vector3d(-along.y(), along.x(), 0.0).normalized().eval();
  const Vector3d down = is_upright ? Vector3d(0.0, -1.0, 0.0) : level.cross(along).eval();
  const Vector3d lowest = down.z() > 0.0 ? Vector3d(-down) : down;
  std::vector<Ring> rings(2);
  for (int k = 0; k < num_sides; ++k) {
    const double turn = 2.0 * std::numbers::pi * (k + (num_sides == 4 ? 0.5 : 0.0)) / num_sides;
    const Vector3d out = std::cos(turn) * lowest + std::sin(turn) * level;
    rings[0].push_back(from + from_radius_m * out);
    rings[1].push_back(to + to_radius_m * out);
  }
  loft(
      rings, [sides](std::size_t, std::size_t) { return sides; }, ends, ends);
}

void ThingMesh::lathe(const Vector2d& axis, const Outline& profile, int num_sides,
                      const std::function<FinishNumber(std::size_t)>& finish) {
  std::vector<Ring> rings;
  for (const Vector2d& point : profile) {
    Ring ring;
    for (int k = 0; k < num_sides; ++k) {
      const double turn = 2.0 * std::numbers::pi * k / num_sides;
      ring.emplace_back(axis.x() + point.x() * std::cos(turn),
                        axis.y() + point.x() * std::sin(turn), point.y());
    }
    rings.push_back(std::move(ring));
  }
  loft(
      rings, [&](std::size_t ring, std::size_t) { return finish(ring); }, finish(0),
      finish(profile.size() - 2));
}

Ring ring_across(double x_m, const Outline& outline) {
  Ring ring;
  for (const Vector2d& point : outline) ring.emplace_back(x_m, point.x(), point.y());
  return ring;
}

Ring ring_at(double z_m, const Outline& outline) {
  Ring ring;
  for (const Vector2d& point : outline) ring.emplace_back(point.x(), point.y(), z_m);
  return ring;
}

Outline round_outline(double radius_x_m, double radius_y_m, int num_points,
                      const Vector2d& middle) {
  Outline outline;
  for (int k = 0; k < num_points; ++k) {
    const double turn = 2.0 * std::numbers::pi * k / num_points - std::numbers::pi / 2.0;
    outline.emplace_back(middle.x() + radius_x_m * std::cos(turn),
                         middle.y() + radius_y_m * std::sin(turn));
  }
  return outline;
}

Outline cut_rectangle(const Vector2d& lowest, const Vector2d& highest, double cut_m) {
  return {{lowest.x() + cut_m, lowest.y()},   {highest.x() - cut_m, lowest.y()},
          {highest.x(), lowest.y() + cut_m},  {highest.x(), highest.y() - cut_m},
          {highest.x() - cut_m, highest.y()}, {lowest.x() + cut_m, highest.y()},
          {lowest.x(), highest.y() - cut_m},  {lowest.x(), lowest.y() + cut_m}};
}

Outline rectangle(const Vector2d& lowest, const Vector2d& highest) {
  return {lowest, {highest.x(), lowest.y()}, highest, {lowest.x(), highest.y()}};
}

}  // namespace terracast::tiler
