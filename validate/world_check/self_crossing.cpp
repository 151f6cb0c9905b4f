#include "validate/world_check/self_crossing.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <map>
#include <vector>

namespace terracast::world_check {

namespace processing = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

bool meets_itself(std::span<const Eigen::Vector3i> places, std::span<const Corners> triangles) {
  std::vector<Kernel::Point_3> points;
  std::map<std::size_t, std::size_t> numbers;  // of the places of this body alone
  std::vector<Corners> body(triangles.begin(), triangles.end());
  for (Corners& corners : body)
    for (std::size_t& corner : corners) {
      const auto [known, is_new] = numbers.try_emplace(corner, points.size());
      if (is_new) points.emplace_back(places[corner].x(), places[corner].y(), places[corner].z());
      corner = known->second;
    }
  if (!processing::is_polygon_soup_a_polygon_mesh(body)) return true;
  Mesh mesh;
  processing::polygon_soup_to_polygon_mesh(points, body, mesh);
  return processing::does_self_intersect(mesh);
}

}  // namespace terracast::world_check
