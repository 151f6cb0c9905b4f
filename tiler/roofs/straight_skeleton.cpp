#include "tiler/roofs/straight_skeleton.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/create_straight_skeleton_2.h>

#include <cmath>
#include <exception>
#include <map>
#include <utility>

namespace terracast::tiler {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

std::optional<StraightSkeleton> from_cgal(const RingsSteps& rings) {
  std::vector<std::vector<Kernel::Point_2>> points;
  StraightSkeleton skeleton;
  std::map<std::pair<int, int>, int> corner_at;
  std::vector<int> next_corner;
  for (const auto& ring : rings) {
    points.emplace_back();
    const int first = static_cast<int>(skeleton.nodes.size());
    for (const Eigen::Vector2i& corner : ring) {
      points.back().emplace_back(corner.x(), corner.y());
      const int index = static_cast<int>(skeleton.nodes.size());
      if (!corner_at.emplace(std::pair(corner.x(), corner.y()), index).second) return std::nullopt;
      skeleton.nodes.push_back({corner.cast<double>(), 0.0});
      next_corner.push_back(index + 1);
    }
    next_corner.back() = first;
  }
  const auto found = CGAL::create_interior_straight_skeleton_2(
      points.front().begin(), points.front().end(), points.begin() + 1, points.end(), Kernel());
  if (!found) return std::nullopt;

  std::map<int, int> node_of;  // by CGAL's number
  for (auto vertex = found->vertices_begin(); vertex != found->vertices_end(); ++vertex) {
    if (vertex->has_infinite_time()) return std::nullopt;
    const double x = vertex->point().x();
    const double y = vertex->point().y();
    if (!std::isfinite(x) || !std::isfinite(y)) return std::nullopt;
    if (vertex->is_contour()) {
      const auto at = corner_at.find({static_cast<int>(x), static_cast<int>(y)});
      if (at == corner_at.end()) return std::nullopt;
      node_of[vertex->id()] = at->second;
      continue;
    }
    node_of[vertex->id()] = static_cast<int>(skeleton.nodes.size());
    skeleton.nodes.push_back({{x, y}, vertex->time()});
  }
  skeleton.faces.resize(next_corner.size());
  for (auto face = found->faces_begin(); face != found->faces_end(); ++face) {
    auto edge = face->halfedge();
    for (std::size_t guard = 0; edge->is_bisector(); edge = edge->next())
      if (++guard > 4 * found->size_of_halfedges()) return std::nullopt;
    const int from = node_of.at(edge->prev()->vertex()->id());
    const int to = node_of.at(edge->vertex()->id());
    if (from >= static_cast<int>(next_corner.size()) ||
        next_corner[static_cast<std::size_t>(from)] != to)
      return std::nullopt;
    std::vector<int>& nodes = skeleton.faces[static_cast<std::size_t>(from)];
    nodes = {from};
    for (auto at = edge; node_of.at(at->vertex()->id()) != from; at = at->next()) {
      nodes.push_back(node_of.at(at->vertex()->id()));
      if (nodes.size() > found->size_of_vertices() + 2) return std::nullopt;
    }
  }
  for (const auto& face : skeleton.faces)
    if (face.size() < 3) return std::nullopt;
  return skeleton;
}

}  // namespace

std::optional<StraightSkeleton> straight_skeleton(const RingsSteps& rings) {
  // CGAL's own checks of what it has made are exceptions; who asks has simpler roofs.
  try {
    return from_cgal(rings);
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace terracast::tiler
