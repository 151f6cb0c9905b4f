#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tiler/vector_source.h"

/// Plane geometry of plans. Nothing here calls a function that differs between machines: directions
/// are unit vectors, never angles.
namespace terracast::tiler::country {

using Point = Eigen::Vector2d;

/// Places of a plan lie on a lattice of 2^-7 m, which the world's own holds.
inline constexpr double kPlanStep_m = 0x1.0p-7;
Point snapped(const Point& at);

inline double cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }
/// Turned left by a right angle.
inline Point left_of(const Point& direction) { return {-direction.y(), direction.x()}; }
/// The unit vector at t in [-1, 1] from -90 to 90 degrees (not evenly), by the rational circle.
inline Point turned(const Point& direction, double t) {
  const double c = (1.0 - t * t) / (1.0 + t * t);
  const double s = 2.0 * t / (1.0 + t * t);
  return {c * direction.x() - s * direction.y(), s * direction.x() + c * direction.y()};
}

double length_of(std::span<const Point> line);
/// Above 0: counter-clockwise.
double signed_area(std::span<const Point> ring);
bool contains(std::span<const Point> ring, const Point& at);
/// Whether all of a polygon lies within another.
bool is_within(std::span<const Point> inner, std::span<const Point> outer);
/// Whether no two of a ring's edges touch, but for neighbours at their corner.
bool is_simple(std::span<const Point> ring);
double distance_to_segment(const Point& at, const Point& from, const Point& to);
double distance_of_segments(const Point& a, const Point& b, const Point& c, const Point& d);
/// Where a segment meets another, as the share of its length; touching counts.
std::optional<double> crossing(const Point& from, const Point& to, const Point& other_from,
                               const Point& other_to);

/// A place and the direction of a line at some distance along it.
struct Station {
  Point at = Point::Zero();
  Point along = Point::UnitX();
};
Station station_at(std::span<const Point> line, double along_m);
/// The part of a line between two distances along it.
PointsWorld part_of(std::span<const Point> line, double from_m, double to_m);
/// Points at most step_m apart, evenly.
PointsWorld resampled(std::span<const Point> line, double step_m);
/// Without points that lie within the tolerance of the line of the others (Douglas and Peucker 1973).
PointsWorld simplified(std::span<const Point> line, double tolerance_m);
/// A smooth curve through all points: cubics whose tangents are those of Catmull and Rom, chordal.
PointsWorld splined(std::span<const Point> line, int num_between);

/// A counter-clockwise ring, each edge moved inward by its own distance; nothing where edges vanish.
std::optional<PointsWorld> inset(std::span<const Point> ring, std::span<const double> inward_m);

/// A rectangle: `along` is a unit vector.
struct Rectangle {
  Point center = Point::Zero();
  Point along = Point::UnitX();
  double half_along_m = 0.0;
  double half_across_m = 0.0;

  /// Its place at shares of its halves.
  Point at(double along_share, double across_share) const {
    return center + along_share * half_along_m * along +
           across_share * half_across_m * left_of(along);
  }
  PointsWorld ring() const { return {at(-1, -1), at(1, -1), at(1, 1), at(-1, 1)}; }
};

/// Things of the plan in cells, to find those near a place.
class PlaceIndex {
 public:
  explicit PlaceIndex(double half_size_m, double cell_m = 64.0);
  void add(std::int32_t item, const Point& lowest, const Point& highest);
  /// Each item near the box once, in the order in which they were added.
  void find(const Point& lowest, const Point& highest, std::vector<std::int32_t>& items) const;

 private:
  int cell_of(double coordinate) const;
  double half_size_m_;
  double cell_m_;
  int side_;
  std::vector<std::vector<std::int32_t>> cells_;
};

}  // namespace terracast::tiler::country
