#include "tiler/vegetation/strata.h"

#include <cmath>

#include "core/error.h"
#include "core/instance_id.h"
#include "tiler/vegetation/fields.h"

namespace terracast::tiler {
namespace {

constexpr std::uint32_t kIdBit = 0x80000000U;

constexpr std::array<double, kNumStrata + 1 + kNumClumpSizes> kCells_m = {
    kStrata[0].cell_m, kStrata[1].cell_m, kStrata[2].cell_m, kStrata[3].cell_m, kStrata[4].cell_m,
    Fields::kCell_m,   clump_side_m(0),   clump_side_m(1),   clump_side_m(2)};

}  // namespace

CellNumbers::CellNumbers(double size_m) : half_size_m_(0.5 * size_m) {
  std::uint64_t first = 0;
  for (const double cell_m : kCells_m) {
    // A cell more on either side, for places on the border.
    const auto side = static_cast<std::uint64_t>(std::ceil(size_m / cell_m)) + 2;
    ranges_.push_back({first, side});
    first += side * side;
  }
  if (first > core::kFirstMovingId - kIdBit) {
    double per_m2 = 0.0;
    for (const double cell_m : kCells_m) per_m2 += 1.0 / (cell_m * cell_m);
    core::fail(core::ErrorKind::Config,
               "vegetation can tell its plants apart in worlds of up to {:.0f} km, and size_m = {} "
               "is more; make the world smaller, or leave the layer out",
               std::floor(std::sqrt((core::kFirstMovingId - kIdBit) / per_m2) / 1000.0), size_m);
  }
}

std::uint32_t CellNumbers::id(std::size_t kind, std::int32_t cell_x, std::int32_t cell_y) const {
  const Range& range = ranges_[kind];
  const auto offset = static_cast<std::int64_t>(std::floor(half_size_m_ / kCells_m[kind])) + 1;
  const auto x = static_cast<std::uint64_t>(cell_x + offset);
  const auto y = static_cast<std::uint64_t>(cell_y + offset);
  TERRACAST_CHECK(x < range.side && y < range.side, "cell {}/{} of {}", cell_x, cell_y, kind);
  return kIdBit | static_cast<std::uint32_t>(range.first + y * range.side + x);
}

}  // namespace terracast::tiler
