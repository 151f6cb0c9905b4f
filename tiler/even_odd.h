#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace terracast::tiler {

/// Places that an odd number of rings goes round, found by bands of y.
/// cost   of a question: the edges that pass its place's band, of which there are four times the root of all edges
class EvenOdd {
 public:
  /// edges   of closed rings, in steps of some lattice
  explicit EvenOdd(std::span<const std::array<Eigen::Vector2i, 2>> edges);
  bool contains(const Eigen::Vector2d& at_steps) const;

 private:
  std::size_t band_of(double y) const;

  double low_ = 0.0;
  double band_ = 1.0;
  std::vector<std::vector<std::array<Eigen::Vector2i, 2>>> bands_;
};

}  // namespace terracast::tiler
