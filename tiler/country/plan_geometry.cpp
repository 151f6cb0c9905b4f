#include "tiler/country/plan_geometry.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler::country {

Point snapped(const Point& at) {
  return {std::round(at.x() / kPlanStep_m) * kPlanStep_m,
          std::round(at.y() / kPlanStep_m) * kPlanStep_m};
}

double length_of(std::span<const Point> line) {
  double sum = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i) sum += (line[i] - line[i - 1]).norm();
  return sum;
}

double signed_area(std::span<const Point> ring) {
  double twice = 0.0;
  for (std::size_t i = 0; i < ring.size(); ++i)
    twice += cross(ring[i] - ring[0], ring[(i + 1) % ring.size()] - ring[0]);
  return 0.5 * twice;
}

bool contains(std::span<const Point> ring, const Point& at) {
  bool is_inside = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Point& a = ring[i];
    const Point& b = ring[j];
    if ((a.y() > at.y()) == (b.y() > at.y())) continue;
    if (at.x() < a.x() + (b.x() - a.x()) * (at.y() - a.y()) / (b.y() - a.y()))
      is_inside = !is_inside;
  }
  return is_inside;
}

bool is_within(std::span<const Point> inner, std::span<const Point> outer) {
  for (std::size_t k = 0; k < inner.size(); ++k) {
    if (!contains(outer, inner[k])) return false;
    for (std::size_t e = 0; e < outer.size(); ++e)
      if (crossing(inner[k], inner[(k + 1) % inner.size()], outer[e],
                   outer[(e + 1) % outer.size()]))
        return false;
  }
  return true;
}

double distance_to_segment(const Point& at, const Point& from, const Point& to) {
  const Point along = to - from;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((at - from).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (at - from - t * along).norm();
}

double distance_of_segments(const Point& a, const Point& b, const Point& c, const Point& d) {
  if (crossing(a, b, c, d)) return 0.0;
  return std::min({distance_to_segment(a, c, d), distance_to_segment(b, c, d),
                   distance_to_segment(c, a, b), distance_to_segment(d, a, b)});
}

std::optional<double> crossing(const Point& from, const Point& to, const Point& other_from,
                               const Point& other_to) {
  const Point along = to - from;
  const Point other = other_to - other_from;
  const double area = cross(along, other);
  if (area == 0.0) return std::nullopt;
  const double t = cross(other_from - from, other) / area;
  const double u = cross(other_from - from, along) / area;
  if (t < 0.0 || t > 1.0 || u < 0.0 || u > 1.0) return std::nullopt;
  return t;
}

bool is_simple(std::span<const Point> ring) {
  const std::size_t n = ring.size();
  if (n < 3) return false;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j) {
      const Point& a = ring[i];
      const Point& b = ring[(i + 1) % n];
      const Point& c = ring[j];
      const Point& d = ring[(j + 1) % n];
      if (j == i + 1 || (i == 0 && j == n - 1)) {
        // Neighbours share a corner; the far ends must not lie on the other edge.
        const Point& far_first = j == i + 1 ? a : b;
        const Point& far_second = j == i + 1 ? d : c;
        if (distance_to_segment(far_second, a, b) < 1e-9 ||
            distance_to_segment(far_first, c, d) < 1e-9)
          return false;
      } else if (distance_of_segments(a, b, c, d) < 1e-9) {
        return false;
      }
    }
  return true;
}

Station station_at(std::span<const Point> line, double along_m) {
  for (std::size_t i = 1; i < line.size(); ++i) {
    const double length = (line[i] - line[i - 1]).norm();
    if (length <= 0.0) continue;
    if (along_m <= length || i + 1 == line.size()) {
      const Point along = (line[i] - line[i - 1]) / length;
      return {line[i - 1] + std::clamp(along_m, 0.0, length) * along, along};
    }
    along_m -= length;
  }
  return {line.empty() ? Point::Zero() : line.front(), Point::UnitX()};
}

PointsWorld part_of(std::span<const Point> line, double from_m, double to_m) {
  PointsWorld part{station_at(line, from_m).at};
  double along_m = 0.0;
  for (std::size_t i = 1; i + 1 < line.size(); ++i) {
    along_m += (line[i] - line[i - 1]).norm();
    if (along_m > from_m + 0.05 && along_m < to_m - 0.05) part.push_back(line[i]);
  }
  part.push_back(station_at(line, to_m).at);
  return part;
}

PointsWorld resampled(std::span<const Point> line, double step_m) {
  const double length = length_of(line);
  const int count = std::max(static_cast<int>(std::ceil(length / step_m)), 1);
  PointsWorld points;
  std::size_t segment = 1;
  double before_m = 0.0;
  for (int k = 0; k <= count; ++k) {
    if (k == count) {
      points.push_back(line.back());
      break;
    }
    const double at_m = length * k / count;
    while (segment + 1 < line.size() &&
           before_m + (line[segment] - line[segment - 1]).norm() < at_m) {
      before_m += (line[segment] - line[segment - 1]).norm();
      ++segment;
    }
    const Point along = line[segment] - line[segment - 1];
    const double piece_m = along.norm();
    points.push_back(line[segment - 1] +
                     (piece_m > 0.0 ? (at_m - before_m) / piece_m : 0.0) * along);
  }
  return points;
}

PointsWorld simplified(std::span<const Point> line, double tolerance_m) {
  if (line.size() < 3) return {line.begin(), line.end()};
  std::vector<std::uint8_t> is_kept(line.size(), 0);
  is_kept.front() = is_kept.back() = 1;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, line.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    double farthest_m = tolerance_m;
    std::size_t farthest = first;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double distance_m = distance_to_segment(line[i], line[first], line[last]);
      if (distance_m > farthest_m) {
        farthest_m = distance_m;
        farthest = i;
      }
    }
    if (farthest == first) continue;
    is_kept[farthest] = 1;
    open.emplace_back(first, farthest);
    open.emplace_back(farthest, last);
  }
  PointsWorld kept;
  for (std::size_t i = 0; i < line.size(); ++i)
    if (is_kept[i] != 0) kept.push_back(line[i]);
  return kept;
}

PointsWorld splined(std::span<const Point> line, int num_between) {
  PointsWorld points;
  const std::size_t n = line.size();
  if (n < 3) return {line.begin(), line.end()};
  const auto tangent = [&](std::size_t i) -> Point {
    if (i == 0) return (line[1] - line[0]).normalized();
    if (i == n - 1) return (line[n - 1] - line[n - 2]).normalized();
    const Point before = line[i] - line[i - 1];
    const Point after = line[i + 1] - line[i];
    const double before_m = std::max(before.norm(), 1e-6);
    const double after_m = std::max(after.norm(), 1e-6);
    const Point mean = before * (after_m / before_m) + after * (before_m / after_m);
    return mean.norm() > 1e-6 ? mean.normalized() : Point(after / after_m);
  };
  for (std::size_t i = 0; i + 1 < n; ++i) {
    points.push_back(line[i]);
    const double length = (line[i + 1] - line[i]).norm();
    const Point from = tangent(i) * length;
    const Point to = tangent(i + 1) * length;
    for (int k = 1; k <= num_between; ++k) {
      const double t = static_cast<double>(k) / (num_between + 1);
      const double t2 = t * t;
      const double t3 = t2 * t;
      points.push_back((2 * t3 - 3 * t2 + 1) * line[i] + (t3 - 2 * t2 + t) * from +
                       (3 * t2 - 2 * t3) * line[i + 1] + (t3 - t2) * to);
    }
  }
  points.push_back(line[n - 1]);
  return points;
}

std::optional<PointsWorld> inset(std::span<const Point> ring, std::span<const double> inward_m) {
  const std::size_t n = ring.size();
  if (n < 3) return std::nullopt;
  PointsWorld result;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = (i + n - 1) % n;
    const Point first = (ring[i] - ring[before]).normalized();
    const Point second = (ring[(i + 1) % n] - ring[i]).normalized();
    const Point on_first = ring[i] + inward_m[before] * left_of(first);
    const Point on_second = ring[i] + inward_m[i] * left_of(second);
    const double turn = cross(first, second);
    Point at = 0.5 * (on_first + on_second);
    if (std::abs(turn) > 0.05) at = on_first + first * (cross(on_second - on_first, second) / turn);
    if ((at - ring[i]).norm() > 6.0 * std::max(inward_m[before], inward_m[i]) + 1.0)
      return std::nullopt;
    result.push_back(at);
  }
  for (std::size_t i = 0; i < n; ++i)
    if ((result[(i + 1) % n] - result[i]).dot(ring[(i + 1) % n] - ring[i]) <= 0.0)
      return std::nullopt;
  if (!is_simple(result)) return std::nullopt;
  return result;
}

PlaceIndex::PlaceIndex(double half_size_m, double cell_m)
    : half_size_m_(half_size_m),
      cell_m_(cell_m),
      side_(std::max(static_cast<int>(std::ceil(2.0 * half_size_m / cell_m)), 1)),
      cells_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_)) {}

int PlaceIndex::cell_of(double coordinate) const {
  return static_cast<int>(
      std::clamp(std::floor((coordinate + half_size_m_) / cell_m_), 0.0, side_ - 1.0));
}

void PlaceIndex::add(std::int32_t item, const Point& lowest, const Point& highest) {
  for (int j = cell_of(lowest.y()); j <= cell_of(highest.y()); ++j)
    for (int i = cell_of(lowest.x()); i <= cell_of(highest.x()); ++i)
      cells_[static_cast<std::size_t>(j) * static_cast<std::size_t>(side_) +
             static_cast<std::size_t>(i)]
          .push_back(item);
}

void PlaceIndex::find(const Point& lowest, const Point& highest,
                      std::vector<std::int32_t>& items) const {
  items.clear();
  for (int j = cell_of(lowest.y()); j <= cell_of(highest.y()); ++j)
    for (int i = cell_of(lowest.x()); i <= cell_of(highest.x()); ++i) {
      const auto& cell = cells_[static_cast<std::size_t>(j) * static_cast<std::size_t>(side_) +
                                static_cast<std::size_t>(i)];
      items.insert(items.end(), cell.begin(), cell.end());
    }
  std::sort(items.begin(), items.end());
  items.erase(std::unique(items.begin(), items.end()), items.end());
}

}  // namespace terracast::tiler::country
