#include "tests/support/mesh_checks.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <array>
#include <map>

#include "world/tile.h"

namespace terracast::test {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
namespace processing = CGAL::Polygon_mesh_processing;

MeshFacts mesh_facts(const world::Shape& shape) {
  MeshFacts facts;
  std::vector<Kernel::Point_3> points;
  std::map<std::array<int, 3>, std::size_t> known;
  std::vector<std::vector<std::size_t>> triangles;
  for (const auto& triangle : shape.triangles) {
    triangles.emplace_back();
    for (const std::uint32_t corner : triangle.corners) {
      const auto& at = shape.vertices_steps.at(corner);
      const auto [found, is_new] = known.try_emplace({at.x(), at.y(), at.z()}, points.size());
      if (is_new) points.emplace_back(at.x(), at.y(), at.z());
      triangles.back().push_back(found->second);
    }
  }
  if (!processing::is_polygon_soup_a_polygon_mesh(triangles)) {
    facts.problem = "an edge with other than two triangles, or turned against each other";
    return facts;
  }
  Mesh mesh;
  processing::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  for (const auto face : mesh.faces())
    if (processing::is_degenerate_triangle_face(face, mesh)) facts.problem = "no area";
  if (!CGAL::is_closed(mesh)) facts.problem = "not closed";
  if (!facts.problem.empty()) return facts;
  constexpr double kStep_m = world::kHeightStep_m;
  facts.volume_m3 = CGAL::to_double(processing::volume(mesh)) * kStep_m * kStep_m * kStep_m;
  if (!(facts.volume_m3 > 0.0)) facts.problem = "turned inside out";
  facts.meets_itself = processing::does_self_intersect(mesh);
  return facts;
}

}  // namespace terracast::test
