#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "sensors/camera/frame_renderer.h"
#include "sensors/camera/ground_truth.h"
#include "sensors/camera/pixel_blocks.h"
#include "tests/bench/bare_scene.h"

/// The rays by which `render` finds all facts of a camera, ready for bare Embree.
namespace terracast::bench {

struct FrameRays {
  std::vector<std::vector<RTCRayHit16>> packets;  ///< primary, to each view, beside edges
  double num_rays = 0.0;
  double num_edge_rays = 0.0;     ///< of these
  double share_of_objects = 0.0;  ///< of the pixels
  double share_of_sky = 0.0;      ///< of the pixels
};

/// Pixels of a frame in the order in which it is traced.
template <class Take>
void for_each_traced_pixel(int width_px, int height_px, const Take& take) {
  constexpr int kUnitSide = 32;
  const auto grid = sensors::PixelGrid::of_squares(width_px, height_px, kUnitSide);
  for (int unit = 0; unit < grid.num_units(); ++unit)
    sensors::for_each_pixel(grid.unit(unit), take);
}

/// Whether a neighbour shows something else: sky, the ground, another object.
inline bool is_beside_edge(const sensors::TruthFrame& truth, int width_px, int height_px, int x,
                           int y) {
  const auto shown_at = [&](int i, int j) {
    const auto pixel = static_cast<std::size_t>(j * width_px + i);
    return std::pair(std::isinf(truth.range_m[pixel]), truth.facts.instance_id.data()[pixel]);
  };
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, height_px - 1); ++j)
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, width_px - 1); ++i)
      if (shown_at(i, j) != shown_at(x, y)) return true;
  return false;
}

/// others   views to which visibility is asked
inline FrameRays rays_of_frame(const sensors::FrameRenderer& renderer, int frame, int camera,
                               const std::vector<const sensors::View*>& others,
                               const BareScene& bare) {
  const sensors::View& view = renderer.views().at(frame, camera);
  const int width_px = view.model->width_px();
  const int height_px = view.model->height_px();
  const sensors::TruthFrame truth = renderer.truth(frame, camera);
  FrameRays result;
  std::vector<world::WorldRay> rays;
  const auto add = [&] {
    result.packets.push_back(bare.packets(rays));
    result.num_rays += static_cast<double>(rays.size());
    rays.clear();
  };
  const double pixel_share = 1.0 / (width_px * height_px);
  for_each_traced_pixel(width_px, height_px, [&](int x, int y) {
    rays.push_back(
        {.origin_world = view.center_world, .direction_world = view.ray_world({x + 0.5, y + 0.5})});
    const auto pixel = static_cast<std::size_t>(y * width_px + x);
    if (std::isinf(truth.range_m[pixel])) result.share_of_sky += pixel_share;
    if (truth.facts.instance_id.data()[pixel] != 0) result.share_of_objects += pixel_share;
  });
  add();
  for (const sensors::View* other : others) {
    for_each_traced_pixel(width_px, height_px, [&](int x, int y) {
      const auto pixel = static_cast<std::size_t>(y * width_px + x);
      const Eigen::Vector3d& point = truth.point_world[pixel];
      if (std::isinf(truth.range_m[pixel]) || !other->has_in_image(point)) return;
      rays.push_back({.origin_world = other->center_world,
                      .direction_world = point - other->center_world,
                      .t_max = 1.0 + 1e-6});
    });
    add();
  }
  for_each_traced_pixel(width_px, height_px, [&](int x, int y) {
    if (!is_beside_edge(truth, width_px, height_px, x, y)) return;
    constexpr double kShift_px = sensors::kEdgeShift_px;
    for (const Eigen::Vector2d& shift :
         {Eigen::Vector2d(-kShift_px, 0.0), Eigen::Vector2d(kShift_px, 0.0),
          Eigen::Vector2d(0.0, -kShift_px), Eigen::Vector2d(0.0, kShift_px)})
      rays.push_back(
          {.origin_world = view.center_world,
           .direction_world = view.ray_world(Eigen::Vector2d(x + 0.5, y + 0.5) + shift)});
  });
  result.num_edge_rays = static_cast<double>(rays.size());
  if (!rays.empty()) add();
  return result;
}

}  // namespace terracast::bench
