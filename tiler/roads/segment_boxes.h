#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace terracast::tiler {

/// Boxes about the segments of a line in the plane, to find those near a place: a tree over the
/// segments in their order, which are near each other.
///
/// memory    43 B for each segment
/// cost      of a search: the logarithm of the number of segments, and those whose boxes are near, up
///           to kMostBoxes
/// threads   safe
class SegmentBoxes {
 public:
  /// A search looks at no more boxes. Where a road of 20 m that has a point each 0.4 m comes by four
  /// times, a few hundred are near.
  static constexpr int kMostBoxes = 1024;

  enum class Found : std::uint8_t {
    No,
    Yes,
    TooMany,  ///< none before kMostBoxes were looked at: the line is scribbled there
  };

  /// points   world x and y, m; less than two: no segments
  explicit SegmentBoxes(const std::vector<Eigen::Vector2d>& points) {
    std::vector<Box> boxes;
    for (std::size_t k = 1; k < points.size(); ++k)
      boxes.push_back({points[k - 1].cwiseMin(points[k]), points[k - 1].cwiseMax(points[k])});
    while (!boxes.empty()) {
      levels_.push_back(boxes);
      if (boxes.size() == 1) break;
      std::vector<Box> coarser;
      for (std::size_t k = 0; k < boxes.size(); ++k) {
        if (k % kWide == 0) {
          coarser.push_back(boxes[k]);
          continue;
        }
        coarser.back().lowest = coarser.back().lowest.cwiseMin(boxes[k].lowest);
        coarser.back().highest = coarser.back().highest.cwiseMax(boxes[k].highest);
      }
      boxes = std::move(coarser);
    }
  }

  /// Whether any segment is it, of those whose boxes are no farther from a place in x and in y.
  /// is_it   of the segment from the point with that row to the next; asked in order, up to the
  ///         first that is
  template <class IsIt>
  Found any(const Eigen::Vector2d& at_world, double within_m, const IsIt& is_it) const {
    int num_boxes = 0;
    return levels_.empty() ? Found::No
                           : any(levels_.size() - 1, 0, at_world, within_m, is_it, num_boxes);
  }

 private:
  static constexpr std::size_t kWide = 4;
  struct Box {
    Eigen::Vector2d lowest;
    Eigen::Vector2d highest;
  };

  template <class IsIt>
  Found any(std::size_t level, std::size_t row, const Eigen::Vector2d& at_world, double within_m,
            const IsIt& is_it, int& num_boxes) const {
    if (num_boxes++ == kMostBoxes) return Found::TooMany;
    const Box& box = levels_[level][row];
    if ((at_world.array() < box.lowest.array() - within_m).any() ||
        (at_world.array() > box.highest.array() + within_m).any())
      return Found::No;
    if (level == 0) return is_it(row) ? Found::Yes : Found::No;
    const std::size_t end = std::min((row + 1) * kWide, levels_[level - 1].size());
    for (std::size_t k = row * kWide; k < end; ++k) {
      const Found found = any(level - 1, k, at_world, within_m, is_it, num_boxes);
      if (found != Found::No) return found;
    }
    return Found::No;
  }

  std::vector<std::vector<Box>> levels_;  ///< each box of a level about kWide of the one before
};

}  // namespace terracast::tiler
