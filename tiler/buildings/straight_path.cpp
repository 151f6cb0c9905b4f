#include "tiler/buildings/straight_path.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;

/// Longer walls are of several stretches, on one line.
constexpr std::size_t kMostSides = 256;
/// The steps of a wall along no cells lie off its line by a twelfth of a squared cell a side, on
/// average; a cut has to be dearer than those of one of four walls, and no dearer, or short paths
/// lose their corners.
constexpr double kSidesOfCut = 40.0;
constexpr double kDearestCut = 6.0;
constexpr double kFarthestCorner = 1.5;
/// Lines that meet at a flatter angle than that (its sine) make no corner.
constexpr double kParallel = 0.02;

struct Line {
  Vector2d at = Vector2d::Zero();
  Vector2d along = Vector2d::UnitX();
};

/// Middles of sides, with sums from which lines through some in a row are found at once.
class Sides {
 public:
  Sides(std::span<const Vector2i> path, bool is_ring) {
    const std::size_t num = is_ring ? path.size() : path.size() - 1;
    // About the first, so that sums stay exact in rasters of any size.
    origin_ = path.front().cast<double>();
    sums_.resize(num + 1);
    for (std::size_t k = 0; k < num; ++k) {
      const Vector2d a = path[k].cast<double>();
      const Vector2d b = path[(k + 1) % path.size()].cast<double>();
      const Vector2d middle = 0.5 * (a + b) - origin_;
      middles_.push_back(middle);
      sums_[k + 1] = {sums_[k].sum + middle, sums_[k].xx + middle.x() * middle.x(),
                      sums_[k].xy + middle.x() * middle.y(), sums_[k].yy + middle.y() * middle.y()};
      ends_.push_back(b - a);
    }
  }
  std::size_t size() const { return middles_.size(); }

  /// Through the sides [from, to), and the sum of their squared distances.
  Line line(std::size_t from, std::size_t to, double& squares) const {
    const auto num = static_cast<double>(to - from);
    const Vector2d middle = (sums_[to].sum - sums_[from].sum) / num;
    const double xx = sums_[to].xx - sums_[from].xx - num * middle.x() * middle.x();
    const double xy = sums_[to].xy - sums_[from].xy - num * middle.x() * middle.y();
    const double yy = sums_[to].yy - sums_[from].yy - num * middle.y() * middle.y();
    Line line{middle, ends_[from]};
    squares = 0.0;
    if (to - from == 1) return line;
    // The lesser eigenvalue of the scatter, and the direction of the greater one.
    const double half = 0.5 * (xx - yy);
    const double root = std::sqrt(half * half + xy * xy);
    squares = std::max(0.5 * (xx + yy) - root, 0.0);
    line.along = half >= 0.0 ? Vector2d(half + root, xy) : Vector2d(xy, root - half);
    const double length = line.along.norm();
    line.along = length > 0.0 ? Vector2d(line.along / length) : ends_[from];
    return line;
  }
  bool are_near(const Line& line, std::size_t from, std::size_t to, double farthest) const {
    const Vector2d across(-line.along.y(), line.along.x());
    for (std::size_t k = from; k < to; ++k)
      if (std::abs(across.dot(middles_[k] - line.at)) > farthest) return false;
    return true;
  }
  const Vector2d& origin() const { return origin_; }

 private:
  struct Sums {
    Vector2d sum = Vector2d::Zero();
    double xx = 0.0, xy = 0.0, yy = 0.0;
  };
  Vector2d origin_;
  std::vector<Vector2d> middles_;
  std::vector<Vector2d> ends_;  ///< of each side from its begin
  std::vector<Sums> sums_;
};

/// Where a path is cut at least cost: its first side, …, the number of its sides.
/// share   of the usual price of a cut
std::vector<std::size_t> cuts_of(const Sides& sides, double farthest, double share) {
  const std::size_t num = sides.size();
  const double price = share * std::min(kDearestCut, static_cast<double>(num) / kSidesOfCut);
  std::vector<double> cost(num + 1, std::numeric_limits<double>::infinity());
  std::vector<std::size_t> before(num + 1, 0);
  cost[0] = 0.0;
  for (std::size_t from = 0; from < num; ++from)
    for (std::size_t to = from + 1; to <= std::min(num, from + kMostSides); ++to) {
      double squares = 0.0;
      const Line line = sides.line(from, to, squares);
      // Squares only grow with the sides.
      if (squares > farthest * farthest * static_cast<double>(kMostSides)) break;
      const double total = cost[from] + squares + price;
      if (total >= cost[to] || !sides.are_near(line, from, to, farthest)) continue;
      cost[to] = total;
      before[to] = from;
    }
  std::vector<std::size_t> cuts = {num};
  while (cuts.back() > 0) cuts.push_back(before[cuts.back()]);
  std::reverse(cuts.begin(), cuts.end());
  return cuts;
}

/// Where two lines meet near a cut.
Vector2d corner_of(const Line& one, const Line& other, const Vector2d& cut) {
  const double sine = one.along.x() * other.along.y() - one.along.y() * other.along.x();
  const Vector2d apart = other.at - one.at;
  const auto foot = [&](const Line& line) -> Vector2d {
    return line.at + line.along.dot(cut - line.at) * line.along;
  };
  if (std::abs(sine) > kParallel) {
    const double along = (apart.x() * other.along.y() - apart.y() * other.along.x()) / sine;
    const Vector2d corner = one.at + along * one.along;
    if ((corner - cut).norm() <= kFarthestCorner) return corner;
  }
  const Vector2d between = 0.5 * (foot(one) + foot(other));
  return (between - cut).norm() <= kFarthestCorner ? between : cut;
}

/// Where the walls of a path that is cut at some of its points have corners.
std::vector<std::optional<Vector2d>> corners_of(const std::vector<Vector2i>& path, bool is_ring,
                                                const Sides& sides,
                                                const std::vector<std::size_t>& cuts) {
  std::vector<Line> lines;
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    double ignored = 0.0;
    lines.push_back(sides.line(cuts[k], cuts[k + 1], ignored));
    lines.back().at += sides.origin();
  }
  std::vector<std::optional<Vector2d>> corners(path.size());
  for (std::size_t k = 1; k < lines.size(); ++k)
    corners[cuts[k]] = corner_of(lines[k - 1], lines[k], path[cuts[k]].cast<double>());
  if (is_ring) {
    corners.front() = corner_of(lines.back(), lines.front(), path.front().cast<double>());
  } else {
    corners.front() = path.front().cast<double>();
    corners.back() = path.back().cast<double>();
  }
  return corners;
}

template <class Points>
double doubled_area_of(const Points& ring) {
  double sum = 0.0;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Vector2d a = ring[k].template cast<double>();
    const Vector2d b = ring[(k + 1) % ring.size()].template cast<double>();
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum;
}

/// Whether a ring's walls go round about as much as its cells: narrow ones may fold onto one line.
bool is_as_large(const std::vector<std::optional<Vector2d>>& corners,
                 const std::vector<Vector2i>& path) {
  constexpr double kMostChange = 0.1;
  std::vector<Vector2d> ring;
  for (const auto& corner : corners)
    if (corner) ring.push_back(*corner);
  const double area = doubled_area_of(path);
  return ring.size() >= 3 && std::abs(doubled_area_of(ring) - area) <= kMostChange * std::abs(area);
}

/// Each turn of a path is a corner.
std::vector<std::optional<Vector2d>> turns_of(const std::vector<Vector2i>& path) {
  std::vector<std::optional<Vector2d>> corners(path.size());
  for (std::size_t k = 0; k < path.size(); ++k) {
    const Vector2i& at = path[k];
    if (path[(k + 1) % path.size()] - at != at - path[(k + path.size() - 1) % path.size()])
      corners[k] = at.cast<double>();
  }
  return corners;
}

}  // namespace

std::vector<std::optional<Vector2d>> straightened(std::span<const Vector2i> path, bool is_ring,
                                                  double farthest) {
  std::vector<Vector2i> turned(path.begin(), path.end());
  if (!is_ring) {
    if (turned.size() < 2) return std::vector<std::optional<Vector2d>>(turned.size());
    const Sides sides(turned, false);
    return corners_of(turned, false, sides, cuts_of(sides, farthest, 1.0));
  }
  // From one of the corners of a first try, which has to begin anywhere: one that is far from
  // there.
  const std::vector<std::size_t> tried = cuts_of(Sides(turned, true), farthest, 1.0);
  const std::size_t first = tried.size() > 2 ? tried[tried.size() / 2] : 0;
  std::rotate(turned.begin(), turned.begin() + static_cast<std::ptrdiff_t>(first), turned.end());
  const Sides sides(turned, true);
  std::vector<std::optional<Vector2d>> corners;
  for (const double price : {1.0, 0.25, 0.0625}) {
    corners = corners_of(turned, true, sides, cuts_of(sides, farthest, price));
    if (is_as_large(corners, turned)) break;
    corners.clear();
  }
  if (corners.empty()) corners = turns_of(turned);
  std::rotate(corners.begin(), corners.end() - static_cast<std::ptrdiff_t>(first), corners.end());
  return corners;
}

}  // namespace terracast::tiler
