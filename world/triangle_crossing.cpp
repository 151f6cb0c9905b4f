#include "world/triangle_crossing.h"

#include <cmath>

#include "core/packet_code.h"
#include "world/tile_id.h"

namespace terracast::world {
namespace {

using core::truth;

constexpr int kTriangles = TriangleBlock::kTriangles;
using Lanes = double[kTriangles];

struct Corner {
  double x, y, z;
};

Corner sheared(const ShearedRay& ray, const Eigen::Vector3i& steps) {
  const auto from_origin = [&](std::size_t k) {
    return static_cast<double>(steps[ray.axes[k]]) * kHeightStep_m - ray.origin[k];
  };
  const double z = from_origin(2);
  return {from_origin(0) - ray.shear_x * z, from_origin(1) - ray.shear_y * z, z * ray.inverse_z};
}

/// Where edges pass too near to the ray to tell their sides from rounded products.
bool cross_exactly(const Corner& a, const Corner& b, const Corner& c, TriangleCrossing& crossing) {
  const double u = difference_of_products(c.x, b.y, c.y, b.x);
  const double v = difference_of_products(a.x, c.y, a.y, c.x);
  const double w = difference_of_products(b.x, a.y, b.y, a.x);
  const bool has_positive = u > 0.0 || v > 0.0 || w > 0.0;
  const bool has_negative = u < 0.0 || v < 0.0 || w < 0.0;
  const double sum = u + v + w;
  if ((has_positive && has_negative) || sum == 0.0) return false;
  crossing.t = (u * a.z + v * b.z + w * c.z) / sum;
  crossing.weights = {u / sum, v / sum, w / sum};
  return true;
}

/// returns   lanes that are crossed; those of which it cannot be said in the upper four bits
TERRACAST_PACKET_CODE
std::uint32_t cross_plainly(const ShearedRay& ray, const TriangleBlock& block,
                            double* __restrict t) {
  Lanes x[3], y[3], z[3];
  const auto& steps_x = block.steps[ray.axes[0]];
  const auto& steps_y = block.steps[ray.axes[1]];
  const auto& steps_z = block.steps[ray.axes[2]];
  for (int corner = 0; corner < 3; ++corner) {
    for (int i = 0; i < kTriangles; ++i) {
      const double from_x = static_cast<double>(steps_x[corner][i]) * kHeightStep_m - ray.origin[0];
      const double from_y = static_cast<double>(steps_y[corner][i]) * kHeightStep_m - ray.origin[1];
      const double from_z = static_cast<double>(steps_z[corner][i]) * kHeightStep_m - ray.origin[2];
      x[corner][i] = from_x - ray.shear_x * from_z;
      y[corner][i] = from_y - ray.shear_y * from_z;
      z[corner][i] = from_z * ray.inverse_z;
    }
  }
  Lanes is_positive, is_negative, all_positive, all_negative;
  for (int i = 0; i < kTriangles; ++i) {
    const double u0 = x[2][i] * y[1][i];
    const double u1 = y[2][i] * x[1][i];
    const double v0 = x[0][i] * y[2][i];
    const double v1 = y[0][i] * x[2][i];
    const double w0 = x[1][i] * y[0][i];
    const double w1 = y[1][i] * x[0][i];
    const double u = u0 - u1;
    const double v = v0 - v1;
    const double w = w0 - w1;
    const double doubt_u = kProductsDoubt * (std::abs(u0) + std::abs(u1));
    const double doubt_v = kProductsDoubt * (std::abs(v0) + std::abs(v1));
    const double doubt_w = kProductsDoubt * (std::abs(w0) + std::abs(w1));
    is_positive[i] = truth((u > doubt_u) | (v > doubt_v) | (w > doubt_w));
    is_negative[i] = truth((u < -doubt_u) | (v < -doubt_v) | (w < -doubt_w));
    all_positive[i] = truth((u > doubt_u) & (v > doubt_v) & (w > doubt_w));
    all_negative[i] = truth((u < -doubt_u) & (v < -doubt_v) & (w < -doubt_w));
    t[i] = (u * z[0][i] + v * z[1][i] + w * z[2][i]) / (u + v + w);
  }
  std::int32_t crossed[kTriangles], doubtful[kTriangles];
  for (int i = 0; i < kTriangles; ++i)
    crossed[i] = static_cast<std::int32_t>(all_positive[i] + all_negative[i]);
  for (int i = 0; i < kTriangles; ++i)
    doubtful[i] = static_cast<std::int32_t>((1.0 - is_positive[i] * is_negative[i]) *
                                            (1.0 - all_positive[i] - all_negative[i]));
  std::uint32_t lanes = 0;
  for (int i = 0; i < kTriangles; ++i)
    lanes |= static_cast<std::uint32_t>(crossed[i] | doubtful[i] << kTriangles) << i;
  return lanes;
}

}  // namespace

ShearedRay::ShearedRay(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d size = direction.cwiseAbs();
  const int z = size.x() > size.y() ? (size.x() > size.z() ? 0 : 2) : (size.y() > size.z() ? 1 : 2);
  axes = {(z + 1) % 3, (z + 2) % 3, z};
  for (std::size_t k = 0; k < 3; ++k) origin[k] = origin_m[axes[k]];
  shear_x = direction[axes[0]] / direction[z];
  shear_y = direction[axes[1]] / direction[z];
  inverse_z = 1.0 / direction[z];
}

void TriangleBlock::set(int lane, const TriangleCorners& corners, std::uint32_t triangle_number) {
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t corner = 0; corner < 3; ++corner)
      steps[axis][corner][lane] = corners[corner][axis];
  number[lane] = triangle_number;
}

void cross_block(const ShearedRay& ray, const TriangleBlock& block, BlockCrossings& crossings) {
  const std::uint32_t asked = (1U << block.count) - 1;
  const std::uint32_t lanes = cross_plainly(ray, block, crossings.t);
  crossings.crossed = lanes & asked;
  for (std::uint32_t doubtful = lanes >> kTriangles & asked; doubtful != 0;
       doubtful &= doubtful - 1) {
    const int lane = __builtin_ctz(doubtful);
    const auto corner = [&](int k) {
      return sheared(ray,
                     {block.steps[0][k][lane], block.steps[1][k][lane], block.steps[2][k][lane]});
    };
    TriangleCrossing crossing;
    if (!cross_exactly(corner(0), corner(1), corner(2), crossing)) continue;
    crossings.t[lane] = crossing.t;
    crossings.crossed |= 1U << lane;
  }
}

bool cross_triangle(const ShearedRay& ray, const TriangleCorners& corners,
                    TriangleCrossing& crossing) {
  return cross_exactly(sheared(ray, corners[0]), sheared(ray, corners[1]), sheared(ray, corners[2]),
                       crossing);
}

}  // namespace terracast::world
