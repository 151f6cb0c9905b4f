#pragma once

#include <cstdint>
#include <vector>

#include "tiler/grid.h"

namespace terracast::tiler {

/// Regions of samples that hang together by their eight neighbours.
struct Regions {
  Grid<std::int32_t> label;  ///< 0: not in a region; else 1 + index
  struct Region {
    std::int64_t num_samples = 0;
    bool touches_border = false;  ///< of the grid
  };
  std::vector<Region> regions;
};
Regions find_regions(const Grid<std::uint8_t>& is_member);

/// Gives unknown samples heights from their surroundings: the membrane (Laplace's equation) that
/// the known samples round a region hold, solved on coarser grids first. Heights stay within the
/// range of the known samples beside the region: no spikes.
/// is_unknown   at least one sample must be known
/// cost         about 1 us an unknown sample
void fill_from_surroundings(Grid<double>& heights_m, const Grid<std::uint8_t>& is_unknown);

/// A start that no sample is reached from.
inline constexpr double kNoStart_m2 = 1e12;

/// The least sum, over all samples, of a sample's start and its squared distance: exact (Felzenszwalb
/// and Huttenlocher 2012). Starts of 0 give squared distances to their samples; a start of -r^2 makes
/// the sum negative within r of its sample.
/// sample_size   of a step along a row and along a column, m
Grid<double> least_squared_distance(Grid<double> start_m2, const Eigen::Vector2d& sample_size);

/// Euclidean distance to the nearest sample that is no member; 0 for those.
/// sample_size   of a step along a row and along a column
Grid<float> distance_to_others(const Grid<std::uint8_t>& is_member,
                               const Eigen::Vector2d& sample_size = {1.0, 1.0});

}  // namespace terracast::tiler
