#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "tiler/grid.h"

namespace terracast::tiler {

/// Samples of a row that hang together.
struct SampleRun {
  int row = 0;
  int first_column = 0;
  int num_columns = 0;
  bool operator==(const SampleRun&) const = default;
};

/// Bodies of samples that hang together by their four neighbours, each as its runs in the order of rows
/// and columns; bodies in the order of their first samples.
/// memory   a run for each run: what is no member takes none
std::vector<std::vector<SampleRun>> find_bodies(const Grid<std::uint8_t>& values,
                                                const std::function<bool(std::uint8_t)>& is_member);

}  // namespace terracast::tiler
