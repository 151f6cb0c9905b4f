#include "tiler/roofs/inner_polygons.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "tiler/roofs/triangulation.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using Edge = std::array<Vector2i, 2>;

/// The cosine by which a border turns at most that keeps its corner.
constexpr double kLeastCosine = -0.5;

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }
Vector2d left_of(const Vector2d& along) { return {-along.y(), along.x()}; }

/// A ring whose edges have moved, joined by what goes round nothing: where it turns left, from end
/// to end, where it turns right, by its corner, or by two where that is far off.
std::vector<Vector2i> moved_ring(const std::vector<Vector2i>& ring, double by_steps) {
  std::vector<Vector2i> moved;
  const auto put = [&](const Vector2d& at) { moved.push_back(at.array().round().cast<int>()); };
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d at = ring[i].cast<double>();
    const Vector2d in =
        (at - ring[(i + ring.size() - 1) % ring.size()].cast<double>()).normalized();
    const Vector2d out = (ring[(i + 1) % ring.size()].cast<double>() - at).normalized();
    const Vector2d end = at + by_steps * left_of(in);
    const Vector2d begin = at + by_steps * left_of(out);
    const double cosine = in.dot(out);
    if (cross(in, out) > 0.0 || cosine > 1.0 - 1e-9) {
      put(end);
      put(begin);
    } else if (cosine >= kLeastCosine) {
      put(at + by_steps / (1.0 + cosine) * (left_of(in) + left_of(out)));
    } else {
      // By half of the turn at each of two corners.
      const double half_cosine = std::sqrt(std::max(0.5 + 0.5 * cosine, 0.0));
      const double beyond_steps = by_steps * std::sqrt((1.0 - half_cosine) / (1.0 + half_cosine));
      put(end + beyond_steps * in);
      put(begin - beyond_steps * out);
    }
  }
  return moved;
}

/// How often edges go round a place anticlockwise.
int winding_number(std::span<const Edge> edges, const Vector2d& at) {
  int num = 0;
  for (const auto& [from, to] : edges) {
    const Vector2d a = from.cast<double>();
    const Vector2d b = to.cast<double>();
    if ((a.y() > at.y()) == (b.y() > at.y())) continue;
    const double side = cross(b - a, at - a);
    if (b.y() > a.y() && side > 0.0) ++num;
    if (b.y() < a.y() && side < 0.0) --num;
  }
  return num;
}

}  // namespace

std::vector<RingsSteps> polygons_within(const RingsSteps& rings, double by_steps) {
  std::vector<Edge> edges;
  for (const auto& ring : rings) {
    const std::vector<Vector2i> moved = moved_ring(ring, by_steps);
    for (std::size_t i = 0; i < moved.size(); ++i)
      edges.push_back({moved[i], moved[(i + 1) % moved.size()]});
  }
  return polygons_where(edges, [&](const Vector2d& at) { return winding_number(edges, at) > 0; });
}

}  // namespace terracast::tiler
