#include "tiler/collar.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tiler/void_filling.h"

namespace terracast::tiler {
namespace {

constexpr std::int64_t kFewestSamples = 64;
constexpr double kSmallestShare = 0.002;
constexpr double kCliff_m = 25.0;
constexpr double kGentleShare = 0.05;  ///< of the samples beside a collar that may be no cliff
constexpr double kHullShare = 0.98;

/// The samples of a value that hang together with the window's border.
Grid<std::uint8_t> border_regions(const Grid<double>& heights_m, double value_m) {
  Grid<std::uint8_t> is_member(heights_m.width, heights_m.height, 0);
  for (std::size_t k = 0; k < is_member.values.size(); ++k)
    is_member.values[k] = heights_m.values[k] == value_m ? 1 : 0;
  const Regions regions = find_regions(is_member);
  for (std::size_t k = 0; k < is_member.values.size(); ++k)
    if (is_member.values[k] != 0 &&
        !regions.regions[static_cast<std::size_t>(regions.label.values[k] - 1)].touches_border)
      is_member.values[k] = 0;
  return is_member;
}

/// Whether the ground falls or rises steeply wherever it meets the members.
bool ends_in_cliff(const Grid<double>& heights_m, const Grid<std::uint8_t>& is_member,
                   double value_m) {
  std::int64_t num_beside = 0;
  std::int64_t num_gentle = 0;
  for (int j = 0; j < heights_m.height; ++j)
    for (int i = 0; i < heights_m.width; ++i) {
      if (is_member(i, j) != 0 || std::isnan(heights_m(i, j))) continue;
      const bool is_beside = is_member.clamped(i - 1, j) != 0 || is_member.clamped(i + 1, j) != 0 ||
                             is_member.clamped(i, j - 1) != 0 || is_member.clamped(i, j + 1) != 0;
      if (!is_beside) continue;
      ++num_beside;
      num_gentle += std::abs(heights_m(i, j) - value_m) <= kCliff_m ? 1 : 0;
    }
  return num_beside > 0 &&
         static_cast<double>(num_gentle) <= kGentleShare * static_cast<double>(num_beside);
}

struct Corner {
  double x, y;
};
double turn(const Corner& a, const Corner& b, const Corner& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Area of the convex hull of the samples that are no members, each a unit square; and their
/// number. Andrew's monotone chain (1979) over each row's ends.
double hull_share(const Grid<std::uint8_t>& is_member) {
  std::vector<Corner> points;
  std::int64_t num_left = 0;
  for (int j = 0; j < is_member.height; ++j) {
    int first = -1;
    int last = -1;
    for (int i = 0; i < is_member.width; ++i) {
      if (is_member(i, j) != 0) continue;
      ++num_left;
      if (first < 0) first = i;
      last = i;
    }
    if (first < 0) continue;
    for (const int row : {j, j + 1})
      for (const int column : {first, last + 1})
        points.push_back({static_cast<double>(column), static_cast<double>(row)});
  }
  if (points.empty()) return 0.0;
  std::sort(points.begin(), points.end(), [](const Corner& a, const Corner& b) {
    return a.x < b.x || (a.x == b.x && a.y < b.y);
  });
  std::vector<Corner> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = hull.size();
    for (const Corner& point : points) {
      while (hull.size() >= first + 2 && turn(hull[hull.size() - 2], hull.back(), point) <= 0.0)
        hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  double twice_area = 0.0;
  for (std::size_t k = 0; k < hull.size(); ++k) {
    const Corner& a = hull[k];
    const Corner& b = hull[(k + 1) % hull.size()];
    twice_area += a.x * b.y - b.x * a.y;
  }
  return static_cast<double>(num_left) / (0.5 * std::abs(twice_area));
}

int num_corners(const Grid<std::uint8_t>& is_member) {
  const int right = is_member.width - 1;
  const int bottom = is_member.height - 1;
  return is_member(0, 0) + is_member(right, 0) + is_member(0, bottom) + is_member(right, bottom);
}

}  // namespace

std::optional<Collar> remove_collar(Grid<double>& heights_m,
                                    std::span<const double> corner_heights_m) {
  for (std::size_t corner = 0; corner < corner_heights_m.size(); ++corner) {
    const double value_m = corner_heights_m[corner];
    const auto seen = corner_heights_m.first(corner);
    if (std::isnan(value_m) || std::find(seen.begin(), seen.end(), value_m) != seen.end()) continue;
    const Grid<std::uint8_t> is_member = border_regions(heights_m, value_m);
    const auto count = static_cast<std::int64_t>(
        std::count(is_member.values.begin(), is_member.values.end(), std::uint8_t{1}));
    if (count < kFewestSamples ||
        static_cast<double>(count) < kSmallestShare * static_cast<double>(is_member.values.size()))
      continue;
    const bool is_turned_rectangle =
        num_corners(is_member) >= 3 && hull_share(is_member) >= kHullShare;
    if (!is_turned_rectangle && !ends_in_cliff(heights_m, is_member, value_m)) continue;
    for (std::size_t k = 0; k < is_member.values.size(); ++k)
      if (is_member.values[k] != 0) heights_m.values[k] = std::numeric_limits<double>::quiet_NaN();
    return Collar{.height_m = value_m, .num_samples = count};
  }
  return std::nullopt;
}

}  // namespace terracast::tiler
