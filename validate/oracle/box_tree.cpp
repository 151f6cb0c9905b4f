#include "validate/oracle/box_tree.h"

#include <algorithm>
#include <numeric>

namespace terracast::oracle {

BoxTree::BoxTree(std::span<const Box> boxes) {
  constexpr std::uint32_t kMostInLeaf = 4;
  if (boxes.empty()) return;
  order_.resize(boxes.size());
  std::iota(order_.begin(), order_.end(), 0U);
  nodes_.push_back({.box = {}, .first = 0, .count = static_cast<std::uint32_t>(boxes.size())});
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const std::uint32_t first = nodes_[i].first;
    const std::uint32_t count = nodes_[i].count;
    Box centers;
    for (std::uint32_t k = first; k < first + count; ++k) {
      const Box& box = boxes[order_[k]];
      nodes_[i].box.grow(box);
      centers.grow(box.lowest + box.highest);
    }
    if (count <= kMostInLeaf) continue;
    int axis = 0;
    (centers.highest - centers.lowest).maxCoeff(&axis);
    const std::uint32_t half = count / 2;
    const auto begin = order_.begin() + first;
    std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
      const double at_a = boxes[a].lowest[axis] + boxes[a].highest[axis];
      const double at_b = boxes[b].lowest[axis] + boxes[b].highest[axis];
      return at_a != at_b ? at_a < at_b : a < b;
    });
    nodes_[i].first = static_cast<std::uint32_t>(nodes_.size());
    nodes_[i].count = 0;
    nodes_.push_back({.box = {}, .first = first, .count = half});
    nodes_.push_back({.box = {}, .first = first + half, .count = count - half});
  }
}

}  // namespace terracast::oracle
