#include "world/ray_lanes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/packet_code.h"

namespace terracast::world {
namespace {

constexpr int kLanes = RayLanes::kLanes;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Below this share of the direction's length a component moves the ray by less than 1e-90 m in any
// world.
constexpr double kNegligible = 1e-100;

TERRACAST_PACKET_INLINE void invert(const Doubles& length_m, Doubles& component, Doubles& inverse,
                                    Doubles& never) {
  Doubles given, quotient;
  for (int i = 0; i < kLanes; ++i) {
    given[i] = component[i];
    quotient[i] = 1.0 / component[i];
  }
  for (int i = 0; i < kLanes; ++i) {
    const bool is_none = (given[i] == 0.0) | ((given[i] < kNegligible * length_m[i]) &
                                              (-given[i] < kNegligible * length_m[i]));
    component[i] = is_none ? 0.0 : given[i];
    inverse[i] = is_none ? 0.0 : quotient[i];
    never[i] = is_none ? kInfinity : 0.0;
  }
}

/// What follows from the rays. Returns those that can be traced.
TERRACAST_PACKET_CODE
LaneMask prepare(RayLanes& __restrict r) {
  Doubles good;
  for (int i = 0; i < kLanes; ++i) {
    const double squared = r.direction_x[i] * r.direction_x[i] +
                           r.direction_y[i] * r.direction_y[i] +
                           r.direction_z[i] * r.direction_z[i];
    r.length_m[i] = std::sqrt(squared);
    r.inverse_length[i] = 1.0 / r.length_m[i];
    const double sum = std::abs(r.origin_x[i]) + std::abs(r.origin_y[i]) + std::abs(r.origin_z[i]);
    good[i] = core::truth((r.length_m[i] > 0.0) & (r.length_m[i] < kInfinity) & (sum < kInfinity) &
                          (r.t_min[i] > -kInfinity) & (r.t_max[i] == r.t_max[i]));
  }
  Integers is_good;
  set_integers(good, is_good);
  invert(r.length_m, r.direction_x, r.inverse_x, r.never_x);
  invert(r.length_m, r.direction_y, r.inverse_y, r.never_y);
  invert(r.length_m, r.direction_z, r.inverse_z, r.never_z);
  for (int i = 0; i < kLanes; ++i)
    r.unit_x[i] = static_cast<float>(r.direction_x[i] * r.inverse_length[i]);
  for (int i = 0; i < kLanes; ++i)
    r.unit_y[i] = static_cast<float>(r.direction_y[i] * r.inverse_length[i]);
  for (int i = 0; i < kLanes; ++i)
    r.unit_z[i] = static_cast<float>(r.direction_z[i] * r.inverse_length[i]);
  return lanes_where(is_good);
}

}  // namespace

LaneMask RayLanes::load(std::span<const WorldRay, kLanes> rays, std::uint32_t first_id) {
  for (int i = 0; i < kLanes; ++i) {
    const WorldRay& ray = rays[static_cast<std::size_t>(i)];
    origin_x[i] = ray.origin_world.x();
    origin_y[i] = ray.origin_world.y();
    origin_z[i] = ray.origin_world.z();
    direction_x[i] = ray.direction_world.x();
    direction_y[i] = ray.direction_world.y();
    direction_z[i] = ray.direction_world.z();
    t_min[i] = ray.t_min;
    t_max[i] = ray.t_max;
    id[i] = first_id + static_cast<std::uint32_t>(i);
  }
  return prepare(*this);
}

LaneMask RayLanes::load(const RayFan& rays, std::uint32_t first_id) {
  std::fill_n(origin_x, kLanes, rays.origin_world.x());
  std::fill_n(origin_y, kLanes, rays.origin_world.y());
  std::fill_n(origin_z, kLanes, rays.origin_world.z());
  std::copy_n(rays.x.data(), kLanes, direction_x);
  std::copy_n(rays.y.data(), kLanes, direction_y);
  std::copy_n(rays.z.data(), kLanes, direction_z);
  std::fill_n(t_min, kLanes, rays.t_min);
  if (rays.t_ends.empty())
    std::fill_n(t_max, kLanes, rays.t_max);
  else
    std::copy_n(rays.t_ends.data(), kLanes, t_max);
  std::iota(id, id + kLanes, first_id);
  return prepare(*this);
}

void RayLanes::copy_ray(int lane, const RayLanes& from, int from_lane) {
  origin_x[lane] = from.origin_x[from_lane];
  origin_y[lane] = from.origin_y[from_lane];
  origin_z[lane] = from.origin_z[from_lane];
  direction_x[lane] = from.direction_x[from_lane];
  direction_y[lane] = from.direction_y[from_lane];
  direction_z[lane] = from.direction_z[from_lane];
  inverse_x[lane] = from.inverse_x[from_lane];
  never_x[lane] = from.never_x[from_lane];
  inverse_y[lane] = from.inverse_y[from_lane];
  never_y[lane] = from.never_y[from_lane];
  inverse_z[lane] = from.inverse_z[from_lane];
  never_z[lane] = from.never_z[from_lane];
  length_m[lane] = from.length_m[from_lane];
  inverse_length[lane] = from.inverse_length[from_lane];
  t_min[lane] = from.t_min[from_lane];
  t_max[lane] = from.t_max[from_lane];
  unit_x[lane] = from.unit_x[from_lane];
  unit_y[lane] = from.unit_y[from_lane];
  unit_z[lane] = from.unit_z[from_lane];
  id[lane] = from.id[from_lane];
}

void RayLanes::copy_passage(int lane, const RayLanes& from, int from_lane) {
  tile[lane] = from.tile[from_lane];
  side[lane] = from.side[from_lane];
  t_entry[lane] = from.t_entry[from_lane];
  t_exit[lane] = from.t_exit[from_lane];
  t_top[lane] = from.t_top[from_lane];
  may_be_on_surface =
      (may_be_on_surface & ~lane_bit(lane)) | ((from.may_be_on_surface >> from_lane) & 1U) << lane;
}

}  // namespace terracast::world
