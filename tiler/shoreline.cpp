#include "tiler/shoreline.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace terracast::tiler {
namespace {

/// Sides are smoothed by the binomial (1 4 6 4 1) / 16 along rows and columns: over straight coasts of
/// all directions the line then strays from a straight one by 0.14 of a sample (RMS), the sides of cells by 0.27.
constexpr int kReach = 2;
constexpr int kBinomial[2 * kReach + 1] = {1, 4, 6, 4, 1};
constexpr int kSumOfWeights = 256;
/// The least side of a sample by the coast: what smoothing would drown or fill keeps a fifth of a sample to
/// each side.
constexpr float kLeastSide = 0.15F;
/// Splines of heights over sides swing below 0 beside cliffs, which would turn sea into land. They count
/// at least this share of the bilinear value.
constexpr double kLeastShare = 0.25;
/// Splines of measured heights swing above 0 between samples of the sea beside steep or sunken ones: bars of
/// sand. No place is so many times higher than the land between its four samples.
constexpr double kShoreRise = 4.0;

/// Of the 4 x 4 samples about a place, from the cell's south-western one at (1, 1).
struct Stencil {
  Stencil(const Grid<double>& heights_m, const Grid<float>& sides, const Eigen::Vector2d& at) {
    const double x0 = std::floor(at.x());
    const double y0 = std::floor(at.y());
    tx = at.x() - x0;
    ty = at.y() - y0;
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const int column = static_cast<int>(x0) + i - 1;
        const int row = static_cast<int>(y0) + j - 1;
        side[j][i] = static_cast<double>(sides.clamped(column, row));
        height_m[j][i] = heights_m.clamped(column, row);
      }
  }
  bool has_coast() const {
    return std::any_of(&side[0][0], &side[0][0] + 16,
                       [&](double one) { return one != side[0][0]; });
  }
  double tx, ty;
  double side[4][4];
  double height_m[4][4];
};

using Values = double[4][4];

double spline(const Values& values, double tx, double ty) {
  double wx[4];
  double wy[4];
  catmull_rom_weights(tx, wx);
  catmull_rom_weights(ty, wy);
  double sum = 0.0;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) sum += wy[j] * wx[i] * values[j][i];
  return sum;
}

/// Between the four samples in the middle.
template <class Value>
double bilinear_of_cell(const Value& value, double tx, double ty) {
  const double south = value(1, 1) + tx * (value(2, 1) - value(1, 1));
  const double north = value(1, 2) + tx * (value(2, 2) - value(1, 2));
  return south + ty * (north - south);
}

/// How high the land by a sample is: its own, or at sea the highest beside it.
double land_by(const Stencil& stencil, int i, int j) {
  if (stencil.side[j][i] > 0.0) return stencil.height_m[j][i];
  double highest_m = 0.0;
  for (int dj = -1; dj <= 1; ++dj)
    for (int di = -1; di <= 1; ++di)
      highest_m = std::max(highest_m, stencil.height_m[j + dj][i + di]);
  return highest_m;
}

/// The product of the splines of sides and of heights over sides.
double product_m(const Stencil& stencil) {
  Values over_side_m;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) over_side_m[j][i] = stencil.height_m[j][i] / stencil.side[j][i];
  const double between_m =
      bilinear_of_cell([&](int i, int j) { return over_side_m[j][i]; }, stencil.tx, stencil.ty);
  double factor_m = spline(over_side_m, stencil.tx, stencil.ty);
  if (between_m > 0.0) factor_m = std::max(factor_m, kLeastShare * between_m);
  return factor_m * spline(stencil.side, stencil.tx, stencil.ty);
}

/// Samples near those of a measured floor: so near that a cell whose surface sides would shape, and no shelf, has its
/// four corners among them.
Grid<std::uint8_t> near_floors(const Grid<std::uint8_t>& is_sea,
                               const Grid<std::uint8_t>& is_shelf) {
  constexpr int kNear = kReach + 2;
  Grid<std::uint8_t> in_row(is_sea.width, is_sea.height), near(is_sea.width, is_sea.height);
  core::parallel_for(is_sea.height, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < is_sea.width; ++i)
      for (int k = -kNear; k <= kNear && in_row(i, j) == 0; ++k)
        in_row(i, j) = is_sea.clamped(i + k, j) != 0 && is_shelf.clamped(i + k, j) == 0 ? 1 : 0;
  });
  core::parallel_for(is_sea.height, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < is_sea.width; ++i)
      for (int k = -kNear; k <= kNear && near(i, j) == 0; ++k)
        near(i, j) = in_row.clamped(i, j + k);
  });
  return near;
}

/// The side of a sample from those about it.
float side_of(const Grid<std::uint8_t>& is_sea, int i, int j) {
  int sum = 0;
  for (int dj = -kReach; dj <= kReach; ++dj)
    for (int di = -kReach; di <= kReach; ++di) {
      const bool is_sea_there = is_sea.clamped(i + di, j + dj) != 0;
      const int weight = kBinomial[di + kReach] * kBinomial[dj + kReach];
      sum += is_sea_there ? -weight : weight;
    }
  const float smooth = static_cast<float>(sum) / kSumOfWeights;
  return is_sea(i, j) != 0 ? std::min(smooth, -kLeastSide) : std::max(smooth, kLeastSide);
}

/// The contour of 0 of measured heights stays, without the bars that their spline makes.
double by_measured_floor_m(const Stencil& stencil, double smooth_m) {
  return std::min(smooth_m, kShoreRise * bilinear_of_cell(
                                             [&](int i, int j) {
                                               return std::max(stencil.height_m[j][i], 0.0);
                                             },
                                             stencil.tx, stencil.ty));
}

/// Beside a shelf whose floor nobody knows.
double by_shelf_m(const Stencil& stencil, double smooth_m) {
  if (!stencil.has_coast()) return smooth_m;
  // Between samples of unlike sides the product rises above the land, and sinks below the floor.
  const double land_m = bilinear_of_cell([&](int i, int j) { return land_by(stencil, i, j); },
                                         stencil.tx, stencil.ty);
  const double floor_m = bilinear_of_cell(
      [&](int i, int j) { return std::min(stencil.height_m[j][i], 0.0); }, stencil.tx, stencil.ty);
  return std::max(std::min(product_m(stencil), std::max(smooth_m, land_m)), floor_m);
}

}  // namespace

Shoreline::Shoreline(const Grid<std::uint8_t>& is_sea, const Grid<std::uint8_t>& is_shelf)
    : side_(is_sea.width, is_sea.height), has_floor_(near_floors(is_sea, is_shelf)) {
  core::parallel_for(is_sea.height, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < is_sea.width; ++i) side_(i, j) = side_of(is_sea, i, j);
  });
}

double Shoreline::height_m(const Grid<double>& heights_m, const Eigen::Vector2d& at) const {
  const double smooth_m = bicubic(heights_m, at);
  if (side_.values.empty()) return smooth_m;
  const Stencil stencil(heights_m, side_, at);
  const int x0 = static_cast<int>(std::floor(at.x())), y0 = static_cast<int>(std::floor(at.y()));
  const double floor_share = bilinear_of_cell(
      [&](int i, int j) { return 1.0 * has_floor_.clamped(x0 + i - 1, y0 + j - 1); }, stencil.tx,
      stencil.ty);
  const double floor_m = floor_share > 0.0 ? by_measured_floor_m(stencil, smooth_m) : 0.0;
  const double shelf_m = floor_share < 1.0 ? by_shelf_m(stencil, smooth_m) : 0.0;
  return floor_share * floor_m + (1.0 - floor_share) * shelf_m;
}

}  // namespace terracast::tiler
