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
/// The steps of a wall along no cells lie off its line by a twelfth of a squared cell a side, on average; a cut has to
/// be dearer than those of one of four walls, and no dearer, or short paths lose their corners.
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
std::vector<std::size_t> cuts_of(const Sides& sides, double farthest) {
  const std::size_t num = sides.size();
  const double price = std::min(kDearestCut, static_cast<double>(num) / kSidesOfCut);
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

}  // namespace

std::vector<std::optional<Vector2d>> straightened(std::span<const Vector2i> path, bool is_ring,
                                                  double farthest) {
  std::vector<std::optional<Vector2d>> corners(path.size());
  if (path.size() < 2) return corners;
  std::vector<Vector2i> turned(path.begin(), path.end());
  std::size_t first = 0;
  if (is_ring) {
    // From one of the corners of a first try, which has to begin anywhere: one that is far from there.
    const Sides sides(path, true);
    const std::vector<std::size_t> cuts = cuts_of(sides, farthest);
    if (cuts.size() > 2) first = cuts[cuts.size() / 2];
    std::rotate(turned.begin(), turned.begin() + static_cast<std::ptrdiff_t>(first), turned.end());
  }
  const Sides sides(turned, is_ring);
  const std::vector<std::size_t> cuts = cuts_of(sides, farthest);
  std::vector<Line> lines;
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    double ignored = 0.0;
    lines.push_back(sides.line(cuts[k], cuts[k + 1], ignored));
    lines.back().at += sides.origin();
  }
  const auto put = [&](std::size_t at, const Vector2d& corner) {
    corners[(first + at) % path.size()] = corner;
  };
  for (std::size_t k = 1; k < lines.size(); ++k)
    put(cuts[k], corner_of(lines[k - 1], lines[k], turned[cuts[k]].cast<double>()));
  if (is_ring) {
    put(0, corner_of(lines.back(), lines.front(), turned[0].cast<double>()));
  } else {
    put(0, turned.front().cast<double>());
    put(path.size() - 1, turned.back().cast<double>());
  }
  return corners;
}

}  // namespace terracast::tiler
