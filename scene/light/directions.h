#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "geo/camera_model.h"
#include "world/ray_query.h"

namespace terracast::scene {

/// Where rays to points end, the point being at 1.
inline constexpr double kJustBeyond = 1.0 + 1e-6;

/// Directions of rays, field by field.
class Directions {
 public:
  /// most   how many will be added at most
  void clear(std::size_t most) {
    if (x_.size() <= most) {
      x_.resize(most + 1);
      y_.resize(most + 1);
      z_.resize(most + 1);
    }
    count_ = 0;
  }
  std::size_t size() const { return count_; }
  Eigen::Vector3d operator[](std::size_t i) const { return {x_[i], y_[i], z_[i]}; }

  void add(const Eigen::Vector3d& direction) { add_if(true, direction); }
  void add_if(bool is_wanted, const Eigen::Vector3d& direction) {
    x_[count_] = direction.x();
    y_[count_] = direction.y();
    z_[count_] = direction.z();
    count_ += is_wanted ? 1 : 0;
  }
  void add(const geo::VectorBlock& block, std::size_t count) {
    std::copy_n(block.x, count, &x_[count_]);
    std::copy_n(block.y, count, &y_[count_]);
    std::copy_n(block.z, count, &z_[count_]);
    count_ += count;
  }

  /// Puts one in the place of an earlier one.
  void move(std::size_t from, std::size_t to) {
    x_[to] = x_[from];
    y_[to] = y_[from];
    z_[to] = z_[from];
  }
  /// Leaves the first ones.
  void keep(std::size_t count) { count_ = count; }

  /// Rays without an end.
  world::RayFan from(const Eigen::Vector3d& origin_world) const {
    return {.origin_world = origin_world,
            .x = {x_.data(), count_},
            .y = {y_.data(), count_},
            .z = {z_.data(), count_}};
  }
  /// Rays to points whose differences from the origin these are; they end a little beyond, so that
  /// the crossing at a point is within.
  world::RayFan just_beyond(const Eigen::Vector3d& origin_world) const {
    world::RayFan rays = from(origin_world);
    rays.t_max = kJustBeyond;
    return rays;
  }

 private:
  std::vector<double> x_, y_, z_;  ///< one more than may be added
  std::size_t count_ = 0;
};

}  // namespace terracast::scene
