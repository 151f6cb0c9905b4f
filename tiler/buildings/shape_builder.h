#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <tuple>

#include "world/shape.h"
#include "world/tile.h"

namespace terracast::tiler {

/// Puts triangles of a building together. Places are in steps, level about its place.
class ShapeBuilder {
 public:
  explicit ShapeBuilder(const Eigen::Matrix3d& world_from_level)
      : world_from_level_(world_from_level) {}

  /// uv_m   rounded to 2^-6 m
  std::uint32_t vertex(const Eigen::Vector3d& level_steps, const Eigen::Vector2d& uv_m) {
    const Eigen::Vector3i at = (world_from_level_ * level_steps).array().round().cast<int>();
    const int u = static_cast<int>(std::lround(uv_m.x() * 64.0));
    const int v = static_cast<int>(std::lround(uv_m.y() * 64.0));
    const auto [found, is_new] = known_.try_emplace(
        {at.x(), at.y(), at.z(), u, v}, static_cast<std::uint32_t>(shape_.vertices_steps.size()));
    if (is_new) {
      shape_.vertices_steps.push_back(at);
      shape_.uv.emplace_back(static_cast<float>(u) / 64.0f, static_cast<float>(v) / 64.0f);
    }
    return found->second;
  }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint8_t finish) {
    shape_.triangles.push_back({.corners = {a, b, c}, .finish = finish});
  }
  /// Level or leaning: uv runs level and up the slope.
  void surface(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
               std::uint8_t finish) {
    Eigen::Vector3d normal = (b - a).cross(c - a);
    normal /= std::max(normal.norm(), 1e-9);
    Eigen::Vector3d level = Eigen::Vector3d::UnitX();
    if (normal.head<2>().norm() > 0.02)
      level = Eigen::Vector3d(-normal.y(), normal.x(), 0.0).normalized();
    const Eigen::Vector3d up_slope = normal.cross(level);
    const auto add = [&](const Eigen::Vector3d& at) {
      return vertex(at, world::kHeightStep_m * Eigen::Vector2d(level.dot(at), up_slope.dot(at)));
    };
    const std::uint32_t i = add(a);
    const std::uint32_t j = add(b);
    triangle(i, j, add(c), finish);
  }
  /// Upright, from a to b seen from outside; corners along the wall and up, in steps.
  /// uv_scale   on lengths along the wall and up
  void wall_quad(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double low, double high,
                 std::uint8_t finish, const Eigen::Vector2d& uv_scale = Eigen::Vector2d::Ones()) {
    const double length_m = (b - a).norm() * world::kHeightStep_m * uv_scale.x();
    const double low_m = low * world::kHeightStep_m * uv_scale.y();
    const double high_m = high * world::kHeightStep_m * uv_scale.y();
    const std::uint32_t i = vertex({a.x(), a.y(), low}, {0.0, low_m});
    const std::uint32_t j = vertex({b.x(), b.y(), low}, {length_m, low_m});
    const std::uint32_t k = vertex({b.x(), b.y(), high}, {length_m, high_m});
    triangle(i, j, k, finish);
    triangle(i, k, vertex({a.x(), a.y(), high}, {0.0, high_m}), finish);
  }
  std::uint8_t add_finish(const world::Finish& finish) {
    shape_.finishes.push_back(finish);
    return static_cast<std::uint8_t>(shape_.finishes.size() - 1);
  }

  world::Shape take() { return std::move(shape_); }

 private:
  Eigen::Matrix3d world_from_level_;
  world::Shape shape_;
  std::map<std::tuple<int, int, int, int, int>, std::uint32_t> known_;
};

}  // namespace terracast::tiler
