#include "world/crossing_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geo/rounding.h"
#include "world/tile_id.h"

namespace terracast::world {
namespace {

using geo::kU;

/// A corner in the sheared frame, and what its first two coordinates err by.
struct Corner {
  double x, y, t;
  double error_x, error_y;
};

/// A difference from the origin is rounded once. Its product with a shear, itself a quotient, has three
/// roundings; the second difference one more.
Corner sheared(const ShearedRay& ray, const Eigen::Vector3i& steps) {
  const auto from_origin = [&](std::size_t k) {
    return static_cast<double>(steps[ray.axes[k]]) * kHeightStep_m - ray.origin[k];
  };
  const double from_x = from_origin(0), from_y = from_origin(1), from_z = from_origin(2);
  const double fall_x = ray.shear_x * from_z, fall_y = ray.shear_y * from_z;
  const double x = from_x - fall_x, y = from_y - fall_y;
  return {.x = x,
          .y = y,
          .t = from_z * ray.inverse_z,
          .error_x = kU * (std::abs(from_x) + 3.0 * std::abs(fall_x) + std::abs(x)),
          .error_y = kU * (std::abs(from_y) + 3.0 * std::abs(fall_y) + std::abs(y))};
}

/// How much a corner counts: a difference of two products, and what it errs by.
struct Weight {
  double value, error;
};

/// As cross_block() has it: from rounded products unless that could show in a sign.
std::array<Weight, 3> weights_of(const Corner& a, const Corner& b, const Corner& c) {
  const std::array<std::array<double, 4>, 3> factors = {std::array{c.x, b.y, c.y, b.x},
                                                        std::array{a.x, c.y, a.y, c.x},
                                                        std::array{b.x, a.y, b.y, a.x}};
  std::array<Weight, 3> weights;
  bool are_sure = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const double p = factors[k][0] * factors[k][1], q = factors[k][2] * factors[k][3];
    const double size = std::abs(p) + std::abs(q);
    weights[k] = {.value = p - q, .error = 2.0 * kU * size};
    are_sure = are_sure && std::abs(p - q) > kProductsDoubt * size;
  }
  if (are_sure) return weights;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& [f, g, h, i] = factors[k];
    const double value = difference_of_products(f, g, h, i);
    // Two sums; the roundings of the products themselves are rounded once.
    const double of_roundings = 3.0 * kU * kU * (std::abs(f * g) + std::abs(h * i));
    weights[k] = {.value = value, .error = 2.0 * kU * std::abs(value) + of_roundings};
  }
  return weights;
}

Eigen::Vector3d normal_of(const TriangleCorners& corners) {
  using Vector3l = Eigen::Matrix<std::int64_t, 3, 1>;
  const Vector3l along = corners[1].cast<std::int64_t>() - corners[0].cast<std::int64_t>();
  const Vector3l across = corners[2].cast<std::int64_t>() - corners[0].cast<std::int64_t>();
  return along.cross(across).cast<double>();
}

}  // namespace

// Turned by a conjugate, less a difference's rounding; the scale is a quotient, and multiplied with.
RayError error_of_moved_ray(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                            const Eigen::Quaterniond& world_from_shape) {
  const double turn = geo::turn_error(world_from_shape);
  return {.origin_m = kU * (turn + 3.0) * origin_m.norm(),
          .direction = kU * (turn + 2.0) * direction.norm()};
}

// With n the triangle's normal, d the ray and X, Y the exact corners in the sheared frame, whose t is linear
// there, the exact t is
//
//     t* = sum w_k T_k - r_x dt/dX - r_y dt/dY,   r = sum w_k (X_k, Y_k),   dt/dX = -n_x / (n d)
//
// for any weights w whose sum is 1. Weights that follow from rounded corners exactly would have a sum of 0
// with these; so r is what the corners err by, and what rounding of the weights themselves leaves. T has three
// roundings (difference, quotient, product); products with weights, sums and the quotient have six.
double crossing_error(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                      const RayError& ray_error, const TriangleCorners& corners) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kOfT = 3.0 + 6.0;
  const ShearedRay ray(origin_m, direction);
  const Corner a = sheared(ray, corners[0]), b = sheared(ray, corners[1]),
               c = sheared(ray, corners[2]);
  const std::array<Weight, 3> weights = weights_of(a, b, c);
  const double sum = std::abs(weights[0].value + weights[1].value + weights[2].value);
  if (!(sum > 0.0)) return kInfinity;

  const std::array<const Corner*, 3> all = {&a, &b, &c};
  double aside_x = 0.0, aside_y = 0.0, along = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double share = std::abs(weights[k].value) / sum;
    const double share_error = weights[k].error / sum;
    aside_x += share * all[k]->error_x + share_error * std::abs(all[k]->x);
    aside_y += share * all[k]->error_y + share_error * std::abs(all[k]->y);
    along += share * std::abs(all[k]->t);
  }

  const Eigen::Vector3d normal = normal_of(corners);
  const double length = normal.norm();
  const double rate = std::abs(normal.dot(direction));
  const double least_rate =
      rate - 5.0 * kU * normal.cwiseAbs().dot(direction.cwiseAbs()) - ray_error.direction * length;
  if (!(least_rate > 0.0)) return kInfinity;
  const double across = std::abs(normal[ray.axes[0]]) * aside_x +
                        std::abs(normal[ray.axes[1]]) * aside_y +
                        length * (ray_error.origin_m + along * ray_error.direction);
  constexpr double kProductsOfErrors = 1.001;
  return kProductsOfErrors * (kU * kOfT * along + across / least_rate);
}

}  // namespace terracast::world
