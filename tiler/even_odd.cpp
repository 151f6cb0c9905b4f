#include "tiler/even_odd.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler {

EvenOdd::EvenOdd(std::span<const std::array<Eigen::Vector2i, 2>> edges) {
  if (edges.empty()) return;
  int low = edges.front()[0].y();
  int high = low;
  for (const auto& [a, b] : edges) {
    low = std::min({low, a.y(), b.y()});
    high = std::max({high, a.y(), b.y()});
  }
  low_ = low;
  bands_.resize(static_cast<std::size_t>(
      std::clamp(4.0 * std::sqrt(static_cast<double>(edges.size())), 1.0, 4096.0)));
  band_ = std::max((high - low_) / static_cast<double>(bands_.size()), 1.0);
  for (const auto& edge : edges) {
    const std::size_t last = band_of(std::max(edge[0].y(), edge[1].y()));
    for (std::size_t band = band_of(std::min(edge[0].y(), edge[1].y())); band <= last; ++band)
      bands_[band].push_back(edge);
  }
}

std::size_t EvenOdd::band_of(double y) const {
  return static_cast<std::size_t>(
      std::clamp((y - low_) / band_, 0.0, static_cast<double>(bands_.size()) - 1.0));
}

bool EvenOdd::contains(const Eigen::Vector2d& at_steps) const {
  if (bands_.empty()) return false;
  bool is_in = false;
  for (const auto& edge : bands_[band_of(at_steps.y())]) {
    const Eigen::Vector2d a = edge[0].cast<double>();
    const Eigen::Vector2d b = edge[1].cast<double>();
    if ((a.y() > at_steps.y()) != (b.y() > at_steps.y()) &&
        at_steps.x() < a.x() + (b.x() - a.x()) * (at_steps.y() - a.y()) / (b.y() - a.y()))
      is_in = !is_in;
  }
  return is_in;
}

}  // namespace terracast::tiler
