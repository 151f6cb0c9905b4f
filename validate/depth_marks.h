#pragma once

#include <optional>
#include <vector>

#include "core/image.h"

/// What single depth images tell of how they were stored and treated, as numbers.
namespace terracast::validate {

/// Steps to which depths are rounded.
struct DepthSteps {
  double step_m = 0.0;  ///< whole multiples of it; 0: a rounding to `num_bits`
  int num_bits = 0;     ///< significant binary digits: 11 of a 16-bit float
  double share = 0.0;   ///< of the different values that are such
};

/// The coarsest steps that fit most of an image's different depths; those of float32 itself are none.
/// returns  nothing of fewer than 500 different depths
std::optional<DepthSteps> find_steps(const core::ImageF& depth);

}  // namespace terracast::validate
