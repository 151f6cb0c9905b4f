#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "tiler/gradient_noise.h"

namespace terracast::tiler {

/// A patch of forest of one age and mix. Kind and variety are uniform in [0, 1), and all numbers are drawn independently.
struct Stand {
  std::uint64_t key = 0;
  double height = 1.0;   ///< of trees of a mean age: 0.62 … 1.28
  double density = 1.0;  ///< of the trees of a dense one: 0.88 … 1
  double kind = 0.0;     ///< a draw: which species dominates it
  double variety = 0.0;  ///< a draw: which of the broadleaves does
  double light = 0.0;    ///< of its leaves against others: -1 … 1
  double warm = 0.0;     ///< the same of their colour
  bool is_mixed = false;
  bool is_clearing = false;
  bool is_dying = false;  ///< where conifers dominate it
};

/// Parts forest into stands of 0.1 to 5 ha: cells about random centres with wavy borders, of which half are
/// parted again.
///
/// threads   safe; all is a function of the seed and the place
class Stands {
 public:
  explicit Stands(std::uint64_t seed);

  Stand at(const Eigen::Vector2d& place_world) const;

 private:
  std::uint64_t seed_;
  GradientNoise noise_;
};

}  // namespace terracast::tiler
