#include "tiler/roofs/triangulation.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <iterator>
#include <map>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "core/error.h"
#include "tiler/roofs/touching_rings.h"
#include "tiler/roofs/turn.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2i;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertices = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using Faces = CGAL::Constrained_triangulation_face_base_2<Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<Vertices, Faces>;
/// Edges that cross are refused.
using Triangulation =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure,
                                               CGAL::No_constraint_intersection_tag>;
/// Where edges cross there is a new point.
using CrossingTriangulation =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure, CGAL::Exact_predicates_tag>;

/// More than this and a crossing's rounding makes new ones for ever.
constexpr int kRepairRounds = 6;

using Triangles = std::vector<std::array<int, 3>>;

std::optional<Triangles> from_cgal(std::span<const Vector2i> points,
                                   std::span<const std::array<int, 2>> border,
                                   std::span<const std::array<int, 2>> edges) {
  Triangulation triangulation;
  std::vector<Triangulation::Vertex_handle> handles;
  Triangulation::Face_handle hint;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto handle = triangulation.insert(Kernel::Point_2(points[i].x(), points[i].y()), hint);
    handle->info() = static_cast<int>(i);
    handles.push_back(handle);
    hint = handle->face();
  }
  if (triangulation.number_of_vertices() != points.size() || triangulation.dimension() < 2)
    return std::nullopt;
  std::unordered_set<std::uint64_t> is_border;
  const auto key = [](int a, int b) {
    return static_cast<std::uint64_t>(std::min(a, b)) << 32U |
           static_cast<std::uint64_t>(std::max(a, b));
  };
  const auto insert = [&](const std::array<int, 2>& edge) {
    triangulation.insert_constraint(handles[static_cast<std::size_t>(edge[0])],
                                    handles[static_cast<std::size_t>(edge[1])]);
  };
  for (const auto& edge : border) {
    insert(edge);
    is_border.insert(key(edge[0], edge[1]));
  }
  for (const auto& edge : edges) insert(edge);
  for (const auto list : {border, edges})
    for (const auto& edge : list)
      if (!triangulation.is_edge(handles[static_cast<std::size_t>(edge[0])],
                                 handles[static_cast<std::size_t>(edge[1])]))
        return std::nullopt;

  // From outside inward; the border is where the parity changes.
  std::unordered_map<Triangulation::Face_handle, bool> is_inside;
  std::vector<Triangulation::Face_handle> open = {triangulation.infinite_face()};
  is_inside[open.front()] = false;
  while (!open.empty()) {
    const auto face = open.back();
    open.pop_back();
    for (int k = 0; k < 3; ++k) {
      const auto a = face->vertex(Triangulation::cw(k));
      const auto b = face->vertex(Triangulation::ccw(k));
      const bool crosses = !triangulation.is_infinite(a) && !triangulation.is_infinite(b) &&
                           is_border.contains(key(a->info(), b->info()));
      const auto next = face->neighbor(k);
      if (is_inside.emplace(next, is_inside.at(face) != crosses).second) open.push_back(next);
    }
  }
  Triangles triangles;
  for (auto face = triangulation.finite_faces_begin(); face != triangulation.finite_faces_end();
       ++face) {
    if (!is_inside.at(face)) continue;
    std::array<int, 3> corners = {face->vertex(0)->info(), face->vertex(1)->info(),
                                  face->vertex(2)->info()};
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    triangles.push_back(corners);
  }
  // In an order that does not know where faces lie in memory.
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

/// Whether a place lies within an odd number of a ring's windings.
bool contains(std::span<const Vector2i> ring, const Eigen::Vector2d& at) {
  bool is_in = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Eigen::Vector2d a = ring[i].cast<double>();
    const Eigen::Vector2d b = ring[j].cast<double>();
    if ((a.y() > at.y()) != (b.y() > at.y()) &&
        at.x() < (b.x() - a.x()) * (at.y() - a.y()) / (b.y() - a.y()) + a.x())
      is_in = !is_in;
  }
  return is_in;
}

/// Within the box of a and b; for a point of their line: on the edge.
bool is_between(const Vector2i& a, const Vector2i& b, const Vector2i& c) {
  return (c.array() >= a.array().min(b.array())).all() &&
         (c.array() <= a.array().max(b.array())).all();
}

bool meet(const Vector2i& a, const Vector2i& b, const Vector2i& c, const Vector2i& d) {
  if ((a.array().max(b.array()) < c.array().min(d.array())).any() ||
      (c.array().max(d.array()) < a.array().min(b.array())).any())
    return false;
  const std::int64_t abc = turn(a, b, c);
  const std::int64_t abd = turn(a, b, d);
  const std::int64_t cda = turn(c, d, a);
  const std::int64_t cdb = turn(c, d, b);
  if (((abc > 0) != (abd > 0)) && abc != 0 && abd != 0 && ((cda > 0) != (cdb > 0)) && cda != 0 &&
      cdb != 0)
    return true;
  return (abc == 0 && is_between(a, b, c)) || (abd == 0 && is_between(a, b, d)) ||
         (cda == 0 && is_between(c, d, a)) || (cdb == 0 && is_between(c, d, b));
}

/// A ring that comes back to a point is cut there into rings that do not.
void add_simple_loops(std::vector<Vector2i> loop, std::vector<std::vector<Vector2i>>& loops) {
  std::vector<Vector2i> open;
  for (const Vector2i& point : loop) {
    const auto before = std::find(open.begin(), open.end(), point);
    if (before != open.end()) {
      if (open.end() - before >= 3) loops.emplace_back(before, open.end());
      open.erase(before, open.end());
    }
    open.push_back(point);
  }
  if (open.size() >= 3) loops.push_back(std::move(open));
}

/// A place within a ring: amid the widest stretch of a line across it that meets no corner.
Eigen::Vector2d place_within(std::span<const Vector2i> ring) {
  const auto [low, high] =
      std::minmax_element(ring.begin(), ring.end(),
                          [](const auto& one, const auto& other) { return one.y() < other.y(); });
  const double y = std::floor(0.5 * low->y() + 0.5 * high->y()) + 0.5;
  std::vector<double> crossings;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Eigen::Vector2d a = ring[i].cast<double>();
    const Eigen::Vector2d b = ring[j].cast<double>();
    if ((a.y() > y) != (b.y() > y))
      crossings.push_back((b.x() - a.x()) * (y - a.y()) / (b.y() - a.y()) + a.x());
  }
  std::sort(crossings.begin(), crossings.end());
  double widest = -1.0;
  Eigen::Vector2d place(0.0, y);
  for (std::size_t i = 0; i + 1 < crossings.size(); i += 2)
    if (const double width = crossings[i + 1] - crossings[i]; width > widest) {
      widest = width;
      place.x() = crossings[i] + 0.5 * width;
    }
  return place;
}

/// Each hole in the smallest outer ring about it. A part has several outer rings where rounding
/// closes its necks; one may then lie in another's hole.
std::vector<RingsSteps> with_holes(std::vector<std::vector<Vector2i>> outers,
                                   std::vector<std::vector<Vector2i>> holes) {
  std::stable_sort(outers.begin(), outers.end(), [](const auto& one, const auto& other) {
    return doubled_area(one) < doubled_area(other);
  });
  std::vector<RingsSteps> polygons;
  for (auto& outer : outers) polygons.push_back({std::move(outer)});
  for (auto& hole : holes) {
    const double hole_area = -doubled_area(hole);
    const Eigen::Vector2d place = place_within(hole);
    const auto about = std::find_if(polygons.begin(), polygons.end(), [&](const auto& polygon) {
      return polygons.size() == 1 ||
             (doubled_area(polygon.front()) > hole_area && contains(polygon.front(), place));
    });
    if (about != polygons.end()) about->push_back(std::move(hole));
  }
  return polygons;
}

/// What lies inside, its corners rounded.
std::vector<RingsSteps> polygons_of(std::span<const std::array<Vector2i, 2>> edges,
                                    const std::function<bool(const Eigen::Vector2d&)>& is_inside) {
  CrossingTriangulation triangulation;
  for (const auto& [a, b] : edges)
    if (a != b)
      triangulation.insert_constraint(Kernel::Point_2(a.x(), a.y()), Kernel::Point_2(b.x(), b.y()));
  if (triangulation.dimension() < 2) return {};
  using Face = CrossingTriangulation::Face_handle;
  const auto point_of = [](CrossingTriangulation::Vertex_handle vertex) {
    return Vector2i(static_cast<int>(std::lround(vertex->point().x())),
                    static_cast<int>(std::lround(vertex->point().y())));
  };
  std::vector<Face> inside;
  std::unordered_map<Face, int> part_of;
  for (auto face = triangulation.finite_faces_begin(); face != triangulation.finite_faces_end();
       ++face) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (int k = 0; k < 3; ++k)
      middle += Eigen::Vector2d(face->vertex(k)->point().x(), face->vertex(k)->point().y()) / 3.0;
    if (is_inside(middle)) {
      inside.push_back(face);
      part_of[face] = -1;
    }
  }
  int num_parts = 0;
  for (const Face& first : inside) {
    if (part_of[first] >= 0) continue;
    std::vector<Face> open = {first};
    part_of[first] = num_parts;
    while (!open.empty()) {
      const Face face = open.back();
      open.pop_back();
      for (int k = 0; k < 3; ++k) {
        const auto next = part_of.find(face->neighbor(k));
        if (next == part_of.end() || next->second >= 0) continue;
        next->second = num_parts;
        open.push_back(next->first);
      }
    }
    ++num_parts;
  }
  // Along the border of each part, the inside on the left.
  std::vector<std::vector<std::vector<Vector2i>>> loops(static_cast<std::size_t>(num_parts));
  std::map<std::pair<Face, int>, bool> is_walked;
  const auto is_border = [&](const Face& face, int k) {
    return !part_of.contains(face->neighbor(k));
  };
  for (const Face& first : inside)
    for (int k = 0; k < 3; ++k) {
      if (!is_border(first, k) || is_walked[{first, k}]) continue;
      std::vector<Vector2i> loop;
      Face face = first;
      int side = k;
      while (!is_walked[{face, side}]) {
        is_walked[{face, side}] = true;
        loop.push_back(point_of(face->vertex(CrossingTriangulation::ccw(side))));
        const auto end = face->vertex(CrossingTriangulation::cw(side));
        // The next edge of the border after the end, turning through the inside.
        side = CrossingTriangulation::ccw(side);
        while (!is_border(face, side)) {
          face = face->neighbor(side);
          side = CrossingTriangulation::cw(face->index(end));
        }
      }
      add_simple_loops(std::move(loop), loops[static_cast<std::size_t>(part_of.at(first))]);
    }
  std::vector<RingsSteps> polygons;
  for (auto& part : loops) {
    std::vector<std::vector<Vector2i>> outers;
    std::vector<std::vector<Vector2i>> holes;
    for (const auto& loop : part) {
      std::vector<Vector2i> ring = without_straight_points(loop);
      if (ring.size() < 3) continue;
      const double area = doubled_area(ring);
      if (area > 0.0) outers.push_back(std::move(ring));
      if (area < 0.0) holes.push_back(std::move(ring));
    }
    for (RingsSteps& polygon : with_holes(std::move(outers), std::move(holes)))
      polygons.push_back(std::move(polygon));
  }
  return polygons;
}

/// The inside once: what is valid unless the rounding made new crossings.
std::vector<RingsSteps> repaired_once(const RingsSteps& rings) {
  std::vector<std::array<Vector2i, 2>> edges;
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i)
      edges.push_back({ring[i], ring[(i + 1) % ring.size()]});
  return polygons_of(edges, [&](const Eigen::Vector2d& middle) {
    bool is_in = contains(rings.front(), middle);
    for (std::size_t k = 1; k < rings.size() && is_in; ++k) is_in = !contains(rings[k], middle);
    return is_in;
  });
}

void repair_into(const RingsSteps& rings, int rounds, std::vector<RingsSteps>& polygons) {
  for (RingsSteps& polygon : repaired_once(rings)) {
    if (is_valid(polygon)) {
      polygons.push_back(std::move(polygon));
    } else if (auto pieces = cut_where_rings_touch(polygon)) {
      std::move(pieces->begin(), pieces->end(), std::back_inserter(polygons));
    } else if (rounds > 0) {
      repair_into(polygon, rounds - 1, polygons);
    } else if (RingsSteps outer = {polygon.front()}; is_valid(outer)) {
      // Holes whose rounded edges cross the border's again and again are given up.
      polygons.push_back(std::move(outer));
    }
  }
}

}  // namespace

std::vector<Vector2i> without_straight_points(const std::vector<Vector2i>& loop) {
  std::vector<Vector2i> kept;
  for (std::size_t i = 0; i < loop.size(); ++i)
    if (turn(loop[(i + loop.size() - 1) % loop.size()], loop[i], loop[(i + 1) % loop.size()]) != 0)
      kept.push_back(loop[i]);
  return kept;
}

double doubled_area(std::span<const Vector2i> ring) {
  std::int64_t sum = 0;
  for (std::size_t i = 1; i + 1 < ring.size(); ++i) sum += turn(ring[0], ring[i], ring[i + 1]);
  return static_cast<double>(sum);
}

bool is_valid(const RingsSteps& rings) {
  struct Edge {
    Vector2i a;
    Vector2i b;
    std::size_t ring;
    std::size_t index;
  };
  std::vector<Edge> edges;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    if (rings[r].size() < 3 || (doubled_area(rings[r]) > 0.0) != (r == 0)) return false;
    for (std::size_t i = 0; i < rings[r].size(); ++i)
      edges.push_back({rings[r][i], rings[r][(i + 1) % rings[r].size()], r, i});
  }
  // By where they begin in x, so that most pairs are never looked at.
  std::sort(edges.begin(), edges.end(), [](const Edge& one, const Edge& other) {
    return std::min(one.a.x(), one.b.x()) < std::min(other.a.x(), other.b.x());
  });
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Edge& one = edges[i];
    if (one.a == one.b) return false;
    for (std::size_t j = i + 1; j < edges.size(); ++j) {
      const Edge& other = edges[j];
      if (std::min(other.a.x(), other.b.x()) > std::max(one.a.x(), one.b.x())) break;
      const std::size_t size = rings[one.ring].size();
      const bool follows = one.ring == other.ring && other.index == (one.index + 1) % size;
      const bool precedes = one.ring == other.ring && one.index == (other.index + 1) % size;
      if (follows || precedes) {
        // They share a corner; nothing else.
        const Edge& before = follows ? one : other;
        const Edge& after = follows ? other : one;
        if (turn(before.a, before.b, after.b) == 0 &&
            (before.b - before.a)
                    .cast<std::int64_t>()
                    .dot((after.b - after.a).cast<std::int64_t>()) < 0)
          return false;
        continue;
      }
      if (meet(one.a, one.b, other.a, other.b)) return false;
    }
  }
  for (std::size_t r = 1; r < rings.size(); ++r) {
    if (!contains(rings.front(), rings[r].front().cast<double>())) return false;
    for (std::size_t other = 1; other < rings.size(); ++other)
      if (other != r && contains(rings[other], rings[r].front().cast<double>())) return false;
  }
  return true;
}

std::optional<Triangles> triangulate(std::span<const Vector2i> points,
                                     std::span<const std::array<int, 2>> border,
                                     std::span<const std::array<int, 2>> edges) {
  try {
    return from_cgal(points, border, edges);
  } catch (const std::exception&) {
    return std::nullopt;  // edges that cross
  }
}

std::vector<RingsSteps> polygons_where(
    std::span<const std::array<Vector2i, 2>> edges,
    const std::function<bool(const Eigen::Vector2d& at_steps)>& is_inside) {
  try {
    return polygons_of(edges, is_inside);
  } catch (const CGAL::Failure_exception& error) {
    core::fail(core::ErrorKind::Internal, "edges of polygons that CGAL cannot order: {}",
               error.what());
  }
}

std::vector<RingsSteps> repaired(const RingsSteps& rings) {
  std::vector<RingsSteps> polygons;
  try {
    repair_into(rings, kRepairRounds, polygons);
  } catch (const std::exception&) {
    // What CGAL cannot order has no area that counts.
  }
  std::stable_sort(polygons.begin(), polygons.end(), [](const auto& one, const auto& other) {
    return doubled_area(one.front()) > doubled_area(other.front());
  });
  return polygons;
}

}  // namespace terracast::tiler
