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

namespace terracast::world_check {
namespace {

using Vector3l = Eigen::Matrix<std::int64_t, 3, 1>;
using Place = std::tuple<int, int, int>;
using Corners = std::array<std::size_t, 3>;

/// The vertices of a shape by number, those of one place once.
std::vector<std::size_t> places_of(const world::Shape& shape) {
  std::map<Place, std::size_t> numbers;
  std::vector<std::size_t> places;
  places.reserve(shape.vertices_steps.size());
  for (const Eigen::Vector3i& v : shape.vertices_steps)
    places.push_back(numbers.try_emplace({v.x(), v.y(), v.z()}, numbers.size()).first->second);
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

}  // namespace

bool is_sheet(world::Material material) {
  return material == world::Material::Leaves || material == world::Material::Needles ||
         material == world::Material::Blades || material == world::Material::Textured;
}

ShapeFaults find_shape_faults(const world::Shape& shape) {
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
    if (is_sheet(shape.finishes[triangle.finish].material)) continue;
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
  return faults;
}

}  // namespace terracast::world_check
