#include "tiler/buildings/sound_shape.h"

#include <array>
#include <cstdint>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "tiler/roofs/self_intersection.h"

namespace terracast::tiler {
namespace {

bool is_closed(const world::Shape& shape) {
  const auto place = [&](std::uint32_t corner) {
    const Eigen::Vector3i& at = shape.vertices_steps[corner];
    return std::tuple(at.x(), at.y(), at.z());
  };
  using Place = std::tuple<int, int, int>;
  std::set<std::pair<Place, Place>> edges;
  for (const auto& triangle : shape.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Place a = place(triangle.corners[k]);
      const Place b = place(triangle.corners[(k + 1) % 3]);
      if (a == b || !edges.emplace(a, b).second) return false;
    }
  for (const auto& [a, b] : edges)
    if (!edges.contains({b, a})) return false;
  return !edges.empty();
}

}  // namespace

bool is_sound(const world::Shape& shape) {
  if (!is_closed(shape)) return false;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const auto& triangle : shape.triangles) triangles.push_back(triangle.corners);
  return !meets_itself(shape.vertices_steps, triangles);
}

}  // namespace terracast::tiler
