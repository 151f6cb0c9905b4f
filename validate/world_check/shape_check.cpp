#include "validate/world_check/shape_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "validate/world_check/self_crossing.h"

namespace terracast::world_check {
namespace {

using Vector3l = Eigen::Matrix<std::int64_t, 3, 1>;
using Place = std::tuple<int, int, int>;

/// The vertices of a shape by the first of those that lie at the same place.
std::vector<std::size_t> places_of(const world::Shape& shape) {
  std::map<Place, std::size_t> first;
  std::vector<std::size_t> places;
  places.reserve(shape.vertices_steps.size());
  for (const Eigen::Vector3i& v : shape.vertices_steps)
    places.push_back(first.try_emplace({v.x(), v.y(), v.z()}, places.size()).first->second);
  return places;
}

/// Parts that hang together by their corners.
class Parts {
 public:
  explicit Parts(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::size_t> parent_;
};

/// Triangles that hang together by edges: bodies that share no more than corners or edges are each their own.
std::vector<std::vector<Corners>> bodies_of(
    const std::vector<const world::Shape::Triangle*>& triangles,
    const std::vector<std::size_t>& places) {
  std::vector<Corners> corners;
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> at_edge;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    corners.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) corners[t][k] = places[triangles[t]->corners[k]];
    for (std::size_t k = 0; k < 3; ++k)
      at_edge[std::minmax(corners[t][k], corners[t][(k + 1) % 3])].push_back(t);
  }
  Parts joined(triangles.size());
  for (const auto& [edge, sides] : at_edge)
    if (sides.size() == 2) joined.join(sides[0], sides[1]);
  std::map<std::size_t, std::vector<Corners>> by_root;
  for (std::size_t t = 0; t < triangles.size(); ++t) by_root[joined.find(t)].push_back(corners[t]);
  std::vector<std::vector<Corners>> bodies;
  for (auto& [root, body] : by_root) bodies.push_back(std::move(body));
  return bodies;
}

}  // namespace

bool is_sheet(world::Material material) {
  return material == world::Material::Leaves || material == world::Material::Needles ||
         material == world::Material::Blades;
}

ShapeFaults find_shape_faults(const world::Shape& shape, bool is_model) {
  ShapeFaults faults;
  const std::vector<std::size_t> places = places_of(shape);
  const auto corner = [&](const world::Shape::Triangle& triangle, std::size_t k) {
    return Vector3l(shape.vertices_steps[triangle.corners[k]].cast<std::int64_t>());
  };
  std::map<std::pair<std::size_t, std::size_t>, int>
      edges;  // times it runs from the first to the second
  std::set<Corners> seen;
  Parts parts(places.size());
  std::vector<const world::Shape::Triangle*> closed;
  for (const world::Shape::Triangle& triangle : shape.triangles) {
    const Vector3l first = corner(triangle, 0);
    if ((corner(triangle, 1) - first).cross(corner(triangle, 2) - first).isZero()) {
      ++faults.num_degenerate;
      continue;
    }
    if (!is_model && is_sheet(shape.finishes[triangle.finish].material)) continue;
    closed.push_back(&triangle);
    Corners corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = places[triangle.corners[k]];
    for (std::size_t k = 0; k < 3; ++k) {
      ++edges[{corners[k], corners[(k + 1) % 3]}];
      parts.join(corners[k], corners[(k + 1) % 3]);
    }
    std::sort(corners.begin(), corners.end());
    if (!seen.insert(corners).second) ++faults.num_coincident;
  }
  std::set<std::size_t> open_parts;
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    const int returns = back == edges.end() ? 0 : back->second;
    if (count == returns || (returns > 0 && edge.first > edge.second)) continue;
    ++((count + returns) % 2 != 0 ? faults.num_open : faults.num_turned);
    open_parts.insert(parts.find(edge.first));
  }
  // Six times the volume, about a corner of the part so that it stays small.
  std::map<std::size_t, std::pair<Vector3l, long double>> volumes;
  for (const world::Shape::Triangle* triangle : closed) {
    auto& [origin, volume] =
        volumes.try_emplace(parts.find(places[triangle->corners[0]]), corner(*triangle, 0), 0.0L)
            .first->second;
    const Vector3l a = corner(*triangle, 0) - origin, b = corner(*triangle, 1) - origin,
                   c = corner(*triangle, 2) - origin;
    volume +=
        static_cast<long double>(a.cast<double>().dot(b.cast<double>().cross(c.cast<double>())));
  }
  for (const auto& [part, volume] : volumes)
    if (!open_parts.contains(part) && !(volume.second > 0.0L)) ++faults.num_inside_out;
  if (is_model) return faults;
  for (const std::vector<Corners>& body : bodies_of(closed, places)) {
    if (open_parts.contains(parts.find(body.front().front()))) continue;
    ++faults.num_bodies;
    if (meets_itself(shape.vertices_steps, body)) ++faults.num_meeting_themselves;
  }
  return faults;
}

}  // namespace terracast::world_check
