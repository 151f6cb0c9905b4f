#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>

namespace terracast::tiler {

/// Among LayerInfo::counts: of how many features the number is cell_number().
inline constexpr std::string_view kCellCount = "outlines numbered by cells of their raster";

/// The number of an outline that is made of a raster's cells: its first cell, row by row, counted
/// from 0.
constexpr std::uint64_t cell_number(int column, int row) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(row)) << 32 |
         static_cast<std::uint32_t>(column);
}
/// Column and row.
inline Eigen::Vector2i cell_of_number(std::uint64_t number) {
  return {static_cast<int>(number & 0x7fffffff), static_cast<int>((number >> 32) & 0x7fffffff)};
}

}  // namespace terracast::tiler
