#include "tiler/roofs/touching_rings.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "tiler/roofs/triangulation.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2i;
using Vector2l = Eigen::Matrix<std::int64_t, 2, 1>;
using Edge = std::array<int, 2>;
using Triangle = std::array<int, 3>;

std::int64_t turn(const Vector2i& a, const Vector2i& b, const Vector2i& c) {
  const Vector2l u = (b - a).cast<std::int64_t>(), v = (c - a).cast<std::int64_t>();
  return u.x() * v.y() - u.y() * v.x();
}

std::int64_t squared_length(const Vector2i& a, const Vector2i& b) {
  return (b - a).cast<std::int64_t>().squaredNorm();
}

/// Where the inside ends, cut at each corner that lies on it.
struct Border {
  std::vector<Vector2i> points;  ///< by x and y, no two alike
  std::vector<Edge> edges;       ///< the inside is on one side of each
};

/// Along an edge, from one end to the other.
std::vector<int> points_on(const Border& border, int a, int b) {
  const auto at = [&](int i) -> const Vector2i& {
    return border.points[static_cast<std::size_t>(i)];
  };
  std::vector<int> on;
  // Points are sorted by x.
  for (int i = std::min(a, b); i <= std::max(a, b); ++i)
    if (turn(at(a), at(b), at(i)) == 0 &&
        (at(i) - at(a)).cast<std::int64_t>().dot((at(i) - at(b)).cast<std::int64_t>()) <= 0)
      on.push_back(i);
  std::sort(on.begin(), on.end(), [&](int one, int other) {
    return squared_length(at(a), at(one)) < squared_length(at(a), at(other));
  });
  return on;
}

Border border_of(const RingsSteps& rings) {
  std::map<std::pair<int, int>, int> numbers;
  for (const auto& ring : rings)
    for (const Vector2i& point : ring) numbers[{point.x(), point.y()}] = 0;
  Border border;
  for (auto& [place, number] : numbers) {
    number = static_cast<int>(border.points.size());
    border.points.emplace_back(place.first, place.second);
  }
  std::set<Edge> once;  // what two rings have in common is no border
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vector2i &from = ring[i], &to = ring[(i + 1) % ring.size()];
      const std::vector<int> on =
          points_on(border, numbers[{from.x(), from.y()}], numbers[{to.x(), to.y()}]);
      for (std::size_t k = 0; k + 1 < on.size(); ++k) {
        const Edge edge = {std::min(on[k], on[k + 1]), std::max(on[k], on[k + 1])};
        if (!once.erase(edge)) once.insert(edge);
      }
    }
  border.edges.assign(once.begin(), once.end());
  return border;
}

/// Triangles that are put together as long as no ring of what becomes of them comes to a point twice.
class Pieces {
 public:
  Pieces(const std::vector<Vector2i>& points, const std::vector<Triangle>& triangles)
      : points_(points), triangles_(triangles) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      piece_of_.push_back(t);
      members_.push_back({t});
      for (std::size_t k = 0; k < 3; ++k)
        left_of_[{triangles[t][k], triangles[t][(k + 1) % 3]}] = t;
    }
  }

  /// Across the longest edges first; what could not be joined may be when others have been.
  void join() {
    std::vector<std::tuple<std::int64_t, int, int>> edges;
    for (const auto& [edge, triangle] : left_of_)
      if (edge[0] < edge[1] && left_of_.contains({edge[1], edge[0]}))
        edges.emplace_back(-squared_length(point(edge[0]), point(edge[1])), edge[0], edge[1]);
    std::sort(edges.begin(), edges.end());
    for (bool has_joined = true; has_joined;) {
      has_joined = false;
      for (const auto& [length, a, b] : edges) {
        const std::size_t one = piece_of_[left_of_.at({a, b})];
        const std::size_t other = piece_of_[left_of_.at({b, a})];
        if (one != other) has_joined = join_if_simple(one, other) || has_joined;
      }
    }
  }

  std::vector<RingsSteps> polygons() const {
    std::vector<RingsSteps> polygons;
    for (const auto& members : members_)
      if (!members.empty()) polygons.push_back(rings_of(border_of(members)));
    return polygons;
  }

 private:
  const Vector2i& point(int i) const { return points_[static_cast<std::size_t>(i)]; }

  /// Its edges from point to point, the inside on their left.
  std::vector<Edge> border_of(const std::vector<std::size_t>& members) const {
    const auto piece = [&](std::size_t t) { return piece_of_[t]; };
    std::vector<Edge> border;
    for (const std::size_t t : members)
      for (std::size_t k = 0; k < 3; ++k) {
        const Edge edge = {triangles_[t][k], triangles_[t][(k + 1) % 3]};
        const auto right = left_of_.find({edge[1], edge[0]});
        if (right == left_of_.end() || piece(right->second) != piece(t)) border.push_back(edge);
      }
    std::sort(border.begin(), border.end());
    return border;
  }

  bool join_if_simple(std::size_t one, std::size_t other) {
    const std::vector<std::size_t> added = members_[other];
    std::vector<std::size_t> both = members_[one];
    both.insert(both.end(), added.begin(), added.end());
    for (const std::size_t t : added) piece_of_[t] = one;
    const std::vector<Edge> border = border_of(both);
    const bool is_simple = std::adjacent_find(border.begin(), border.end(), [](auto& a, auto& b) {
                             return a[0] == b[0];
                           }) == border.end();
    if (is_simple) {
      members_[one] = std::move(both);
      members_[other].clear();
    } else {
      for (const std::size_t t : added) piece_of_[t] = other;
    }
    return is_simple;
  }

  /// Of a border that comes to each point once; the outer ring is the one that turns left.
  RingsSteps rings_of(const std::vector<Edge>& border) const {
    std::map<int, int> next;
    for (const Edge& edge : border) next[edge[0]] = edge[1];
    RingsSteps rings;
    while (!next.empty()) {
      std::vector<Vector2i> ring;
      for (auto at = next.begin(); at != next.end();) {
        ring.push_back(point(at->first));
        const int to = at->second;
        next.erase(at);
        at = next.find(to);
      }
      ring = without_straight_points(ring);
      const bool is_outer = doubled_area(ring) > 0.0;
      rings.insert(is_outer ? rings.begin() : rings.end(), std::move(ring));
    }
    return rings;
  }

  const std::vector<Vector2i>& points_;
  const std::vector<Triangle>& triangles_;
  std::vector<std::size_t> piece_of_;  ///< of each triangle
  std::vector<std::vector<std::size_t>>
      members_;                          ///< of each piece; none: it has become part of another
  std::map<Edge, std::size_t> left_of_;  ///< the triangle to the left of an edge
};

bool have_same_area(const std::vector<Vector2i>& points, const std::vector<Triangle>& triangles,
                    const RingsSteps& rings) {
  double doubled = 0.0;  // whole numbers below 2^53
  for (const auto& ring : rings) doubled -= doubled_area(ring);
  for (const auto& [a, b, c] : triangles)
    doubled += static_cast<double>(turn(points[static_cast<std::size_t>(a)],
                                        points[static_cast<std::size_t>(b)],
                                        points[static_cast<std::size_t>(c)]));
  return doubled == 0.0;
}

}  // namespace

std::optional<std::vector<RingsSteps>> cut_where_rings_touch(const RingsSteps& rings) {
  const Border border = border_of(rings);
  const auto triangles = triangulate(border.points, border.edges, {});
  if (!triangles || !have_same_area(border.points, *triangles, rings)) return std::nullopt;
  Pieces pieces(border.points, *triangles);
  pieces.join();
  return pieces.polygons();
}

}  // namespace terracast::tiler
