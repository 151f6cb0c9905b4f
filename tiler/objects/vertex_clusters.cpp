#include "tiler/objects/vertex_clusters.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "world/tile_id.h"

namespace terracast::tiler {

using Eigen::Vector3d;
using Eigen::Vector3i;

world::Shape clustered(const world::Shape& shape, double cell_m) {
  struct Cluster {
    Vector3d sum = Vector3d::Zero();
    int count = 0;
    std::uint32_t nearest = 0;
    double distance = 1e300;
    std::uint32_t number = 0;
  };
  const double cell_steps = cell_m / world::kHeightStep_m;
  const auto key = [&](const Vector3i& vertex) {
    return std::tuple(static_cast<int>(std::floor(vertex.x() / cell_steps)),
                      static_cast<int>(std::floor(vertex.y() / cell_steps)),
                      static_cast<int>(std::floor(vertex.z() / cell_steps)));
  };
  std::map<std::tuple<int, int, int>, Cluster> clusters;
  for (const Vector3i& vertex : shape.vertices_steps) {
    Cluster& cluster = clusters[key(vertex)];
    cluster.sum += vertex.cast<double>();
    ++cluster.count;
  }
  for (std::uint32_t i = 0; i < shape.vertices_steps.size(); ++i) {
    Cluster& cluster = clusters[key(shape.vertices_steps[i])];
    const double distance =
        (shape.vertices_steps[i].cast<double>() - cluster.sum / cluster.count).squaredNorm();
    if (distance < cluster.distance) {
      cluster.distance = distance;
      cluster.nearest = i;
    }
  }
  world::Shape coarse;
  coarse.finishes = shape.finishes;
  // Textured surfaces keep their own uv where several meet: a vertex for each.
  std::map<std::pair<std::uint32_t, std::pair<float, float>>, std::uint32_t> numbers;
  std::set<std::array<std::uint32_t, 3>> known;
  for (const world::Shape::Triangle& triangle : shape.triangles) {
    std::array<std::uint32_t, 3> ends{};
    for (std::size_t k = 0; k < 3; ++k)
      ends[k] = clusters.at(key(shape.vertices_steps[triangle.corners[k]])).nearest;
    if (ends[0] == ends[1] || ends[1] == ends[2] || ends[2] == ends[0]) continue;
    std::array<std::uint32_t, 3> sorted = ends;
    std::rotate(sorted.begin(), std::min_element(sorted.begin(), sorted.end()), sorted.end());
    if (!known.insert(sorted).second) continue;
    const Vector3d a = shape.vertices_steps[ends[0]].cast<double>();
    const Vector3d b = shape.vertices_steps[ends[1]].cast<double>();
    const Vector3d c = shape.vertices_steps[ends[2]].cast<double>();
    if ((b - a).cross(c - a).squaredNorm() == 0.0) continue;
    world::Shape::Triangle own{.corners = {}, .finish = triangle.finish};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::pair<float, float> uv =
          shape.uv.empty()
              ? std::pair(0.0F, 0.0F)
              : std::pair(shape.uv[triangle.corners[k]].x(), shape.uv[triangle.corners[k]].y());
      const auto [entry, is_new] = numbers.try_emplace(
          {ends[k], uv}, static_cast<std::uint32_t>(coarse.vertices_steps.size()));
      if (is_new) {
        coarse.vertices_steps.push_back(shape.vertices_steps[ends[k]]);
        if (!shape.uv.empty()) coarse.uv.emplace_back(uv.first, uv.second);
      }
      own.corners[k] = entry->second;
    }
    coarse.triangles.push_back(own);
  }
  return coarse;
}

}  // namespace terracast::tiler
