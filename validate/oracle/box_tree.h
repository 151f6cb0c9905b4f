#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace terracast::oracle {

/// A box along the axes.
struct Box {
  Eigen::Vector3d lowest = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d highest = -lowest;

  void grow(const Eigen::Vector3d& point) {
    lowest = lowest.cwiseMin(point);
    highest = highest.cwiseMax(point);
  }
  void grow(const Box& by) {
    lowest = lowest.cwiseMin(by.lowest);
    highest = highest.cwiseMax(by.highest);
  }
};

/// A ray as doubles for boxes: where it enters them, never too late.
class BoxRay {
 public:
  /// margin   by which boxes are larger: more than what rounding moves a point of the ray by
  BoxRay(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double margin)
      : origin_(origin), direction_(direction), margin_(margin) {}

  /// The parameter at which the ray enters a box; +inf where it misses it, or enters beyond t_max.
  double entry(const Box& box, double t_max) const {
    double first = 0.0;
    double last = t_max;
    for (int k = 0; k < 3; ++k) {
      const double low = box.lowest[k] - margin_ - origin_[k];
      const double high = box.highest[k] + margin_ - origin_[k];
      if (direction_[k] == 0.0) {
        if (low > 0.0 || high < 0.0) return std::numeric_limits<double>::infinity();
        continue;
      }
      const double a = low / direction_[k];
      const double b = high / direction_[k];
      first = std::max(first, std::min(a, b));
      last = std::min(last, std::max(a, b));
    }
    return first <= last ? first : std::numeric_limits<double>::infinity();
  }

 private:
  Eigen::Vector3d origin_, direction_;
  double margin_;
};

/// Boxes in a tree, halved at the middle of their longest extent. Immutable; threads: safe.
class BoxTree {
 public:
  BoxTree() = default;
  explicit BoxTree(std::span<const Box> boxes);

  bool is_empty() const { return nodes_.empty(); }
  const Box& box() const { return nodes_.front().box; }
  std::size_t num_bytes() const {
    return nodes_.size() * sizeof(Node) + order_.size() * sizeof(std::uint32_t);
  }

  /// Calls visit(index) for each box, and perhaps some others, that a ray enters before t_max.
  template <class Visit>
  void visit(const BoxRay& ray, double t_max, const Visit& visit) const {
    if (nodes_.empty()) return;
    std::vector<std::uint32_t> to_do = {0};
    while (!to_do.empty()) {
      const Node& node = nodes_[to_do.back()];
      to_do.pop_back();
      if (ray.entry(node.box, t_max) == std::numeric_limits<double>::infinity()) continue;
      if (node.count > 0) {
        for (std::uint32_t i = 0; i < node.count; ++i) visit(order_[node.first + i]);
      } else {
        to_do.push_back(node.first);
        to_do.push_back(node.first + 1);
      }
    }
  }

 private:
  struct Node {
    Box box;
    std::uint32_t first = 0;  ///< of order_, or the first of two nodes side by side
    std::uint32_t count = 0;  ///< 0: it has two nodes below it
  };

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace terracast::oracle
