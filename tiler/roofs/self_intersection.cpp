#include "tiler/roofs/self_intersection.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <map>
#include <vector>

namespace terracast::tiler {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
namespace processing = CGAL::Polygon_mesh_processing;

bool meets_itself(std::span<const Eigen::Vector3i> places,
                  std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<Kernel::Point_3> points;
  std::map<std::array<int, 3>, std::size_t> known;
  std::vector<std::vector<std::size_t>> faces;
  for (const auto& triangle : triangles) {
    faces.emplace_back();
    for (const std::uint32_t corner : triangle) {
      const Eigen::Vector3i& at = places[corner];
      const auto [found, is_new] = known.try_emplace({at.x(), at.y(), at.z()}, points.size());
      if (is_new) points.emplace_back(at.x(), at.y(), at.z());
      faces.back().push_back(found->second);
    }
  }
  if (!processing::is_polygon_soup_a_polygon_mesh(faces)) return true;
  CGAL::Surface_mesh<Kernel::Point_3> mesh;
  processing::polygon_soup_to_polygon_mesh(points, faces, mesh);
  return processing::does_self_intersect(mesh);
}

}  // namespace terracast::tiler
