#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terracast::tiler {

/// The best fit (least squares) to some values that never rises from one to the next: pool adjacent
/// violators (Barlow et al. 1972).
/// cost   linear
std::vector<double> falling_fit(std::span<const double> values);

/// A line along which water runs, before its levels are known.
struct Waterline {
  std::uint64_t number = 0;  ///< of its feature
  int part = 0;              ///< of it, in its order
  int rank = 0;  ///< rivers above canals above streams: the course of the greater is kept
  double half_width_m = 1.0;
  bool is_covered = false;  ///< runs below ground: is not seen, but hands its level on
  std::string name;
  std::vector<Eigen::Vector2d> points_world;  ///< downstream, as OpenStreetMap has it
};

/// A line with levels: a piece of a Waterline between junctions, downstream.
struct WaterCourse {
  std::size_t line = 0;                       ///< of the lines given
  std::vector<Eigen::Vector2d> points_world;  ///< at most kCourseStep_m apart
  std::vector<double> levels_m;               ///< above what the ground's heights are above
  std::vector<std::uint8_t> is_in_lake;       ///< or in the sea
};
inline constexpr double kCourseStep_m = 12.0;

/// What is known of the ground at a place of a line.
struct CourseGround {
  double height_m = 0.0;
  /// Of a lake or the sea there; a course has this level there.
  std::optional<double> level_m = {};
};

struct WaterCourses {
  std::vector<WaterCourse> courses;
  std::int64_t num_reversed = 0;   ///< lines that the ground says run the other way
  std::int64_t num_conflicts = 0;  ///< places where lakes and lines fit no level that falls
};

/// Levels of a network of lines: the best fit to the ground that never rises downstream. Lines that share a
/// point of which one is an end are joined there and have one level at it. Greater courses are fitted
/// first, tributaries run into them.
/// ground   must be safe for many threads
/// Depends on the lines' contents alone, not on their order.
WaterCourses fit_courses(std::span<const Waterline> lines,
                         const std::function<CourseGround(const Eigen::Vector2d&)>& ground);

/// How far a river lies below the ground beside it.
double freeboard_m(double half_width_m);

}  // namespace terracast::tiler
