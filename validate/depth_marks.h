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

/// Edges of surfaces, along rows and columns, and how many of them are no edges but ramps. Ramps between two surfaces
/// say nothing: a slope that is seen from above is one, a few pixels wide, and has no hidden side.
struct DepthEdges {
  struct Count {
    int num_edges = 0;
    int num_ramps = 0;
    /// returns  nothing of fewer than 100 edges
    std::optional<double> share_of_ramps() const;
  };
  /// From smooth ground to no depth: of ramps the last pixel is three times as near, or ten times as far, as the ground
  /// further in leads to.
  Count ends;

  void add(const DepthEdges& other);
};
DepthEdges find_edges(const core::ImageF& depth);

}  // namespace terracast::validate
