#include "tiler/roofs/touching_rings.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "tiler/roofs/triangulation.h"
#include "tiler/roofs/turn.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2i;
using Edge = std::array<int, 2>;
using Triangle = std::array<int, 3>;

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

/// Triangles that are put together as long as no ring of what becomes of them comes to a point
/// twice.
class Pieces {
 public:
  Pieces(const std::vector<Vector2i>& points, const std::vector<Triangle>& triangles)
      : points_(points), triangles_(triangles), changes_(triangles.size(), 0) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      piece_of_.push_back(t);
      members_.push_back({t});
      next_.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        left_of_[{triangles[t][k], triangles[t][(k + 1) % 3]}] = t;
        next_[t][triangles[t][k]] = triangles[t][(k + 1) % 3];
      }
    }
  }

  /// Across the longest edges first; what could not be joined may be when others have been.
  void join() {
    const std::vector<Common> edges = longest_first();
    for (bool has_joined = true; has_joined;) {
      has_joined = false;
      for (const Common& edge : edges) {
        ++num_steps_;
        const std::size_t one = piece_of_[edge.left];
        const std::size_t other = piece_of_[edge.right];
        if (one != other) has_joined = join_if_simple(one, other) || has_joined;
      }
    }
  }

  std::int64_t num_steps() const { return num_steps_; }

  std::vector<RingsSteps> polygons() const {
    std::vector<RingsSteps> polygons;
    for (const auto& members : members_)
      if (!members.empty()) polygons.push_back(rings_of(border_of(members)));
    return polygons;
  }

 private:
  /// An edge with a triangle on either side.
  struct Common {
    std::int64_t squared_length;
    Edge ends;
    std::size_t left;
    std::size_t right;
  };

  const Vector2i& point(int i) const { return points_[static_cast<std::size_t>(i)]; }

  std::vector<Common> longest_first() const {
    std::vector<Common> edges;
    for (const auto& [edge, left] : left_of_)
      if (const auto right = left_of_.find({edge[1], edge[0]});
          edge[0] < edge[1] && right != left_of_.end())
        edges.push_back(
            {squared_length(point(edge[0]), point(edge[1])), edge, left, right->second});
    std::sort(edges.begin(), edges.end(), [](const Common& a, const Common& b) {
      return std::pair(-a.squared_length, a.ends) < std::pair(-b.squared_length, b.ends);
    });
    return edges;
  }

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

  /// Whether an edge of a piece's border is one of another piece's, too.
  bool is_common(std::size_t other, int from, int to) const {
    const auto back = next_[other].find(to);
    return back != next_[other].end() && back->second == from;
  }

  /// Whether the border of two pieces together comes to no point twice: from each point to which both
  /// come, at least one of them goes on along what becomes inside.
  bool are_simple_together(std::size_t one, std::size_t other) {
    if (next_[one].size() > next_[other].size()) std::swap(one, other);
    return std::all_of(next_[one].begin(), next_[one].end(), [&](const auto& edge) {
      ++num_steps_;
      const auto [at, to] = edge;
      const auto of_other = next_[other].find(at);
      return of_other == next_[other].end() || is_common(other, at, to) ||
             is_common(one, at, of_other->second);
    });
  }

  bool join_if_simple(std::size_t one, std::size_t other) {
    // Two that could not be joined cannot be until one of them changes.
    const std::pair changes(changes_[one], changes_[other]);
    const auto [tried, is_new] = tried_.try_emplace(one * triangles_.size() + other, changes);
    if (!is_new && tried->second == changes) return false;
    tried->second = changes;
    if (!are_simple_together(one, other)) return false;
    for (const std::size_t t : members_[other]) piece_of_[t] = one;
    members_[one].insert(members_[one].end(), members_[other].begin(), members_[other].end());
    num_steps_ += static_cast<std::int64_t>(members_[other].size() + next_[other].size());
    members_[other].clear();
    join_borders(one, other);
    ++changes_[one];
    return true;
  }

  void join_borders(std::size_t one, std::size_t other) {
    std::vector<Edge> added;
    for (const auto& [from, to] : next_[other]) {
      if (is_common(one, from, to))
        next_[one].erase(to);
      else
        added.push_back({from, to});
    }
    for (const auto& [from, to] : added) next_[one][from] = to;
    next_[other].clear();
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
  /// Of each piece's border, which comes to each point once: the point after a point.
  std::vector<std::unordered_map<int, int>> next_;
  std::vector<std::uint32_t> changes_;  ///< of each piece: how many have been joined to it
  /// Of two pieces that were tried: their changes then.
  std::unordered_map<std::size_t, std::pair<std::uint32_t, std::uint32_t>> tried_;
  std::int64_t num_steps_ = 0;
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

std::optional<std::vector<RingsSteps>> cut_where_rings_touch(const RingsSteps& rings,
                                                             std::int64_t* num_steps) {
  const Border border = border_of(rings);
  const auto triangles = triangulate(border.points, border.edges, {});
  if (!triangles || !have_same_area(border.points, *triangles, rings)) return std::nullopt;
  Pieces pieces(border.points, *triangles);
  pieces.join();
  if (num_steps != nullptr) *num_steps += pieces.num_steps();
  return pieces.polygons();
}

}  // namespace terracast::tiler
