#include "export/world/tile_ground.h"

#include <algorithm>
#include <array>

#include "world/lod.h"

namespace terracast::world_export {

using world::kTileCells;
using world::Tile;

TileGround::TileGround(Tile tile, std::uint8_t coarser_sides)
    : tile_(std::move(tile)),
      half_steps_(world::stitched_half_steps(tile_, coarser_sides)),
      paint_(tile_.id, tile_.objects.strips, tile_.objects.areas) {}

/// The corner at the triangle's right angle first, then the ones along x and along y.
struct TileGround::OnTriangle {
  std::array<std::size_t, 3> samples;
  std::array<double, 3> weights;
  std::array<double, 3> above_center_m;
  double sense;  ///< -1: the right angle lies in the north-east
};

Eigen::Vector2d TileGround::within(double x_world, double y_world) const {
  const Eigen::Vector2d corner = tile_.id.corner_world();
  const double side_m = tile_.id.side_m();
  return {std::clamp(x_world, corner.x(), corner.x() + side_m),
          std::clamp(y_world, corner.y(), corner.y() + side_m)};
}

TileGround::OnTriangle TileGround::triangle_at(double x_world, double y_world) const {
  const Eigen::Vector2d cell =
      (Eigen::Vector2d(x_world, y_world) - tile_.id.corner_world()) / tile_.id.spacing_m();
  const int i = std::clamp(static_cast<int>(cell.x()), 0, kTileCells - 1);
  const int j = std::clamp(static_cast<int>(cell.y()), 0, kTileCells - 1);
  const double fx = cell.x() - i;
  const double fy = cell.y() - j;
  const int far = fx + fy > 1.0 ? 1 : 0;
  const int near = 1 - far;
  const double along_x = far != 0 ? 1.0 - fx : fx;
  const double along_y = far != 0 ? 1.0 - fy : fy;
  return {.samples = {Tile::sample(i + far, j + far), Tile::sample(i + near, j + far),
                      Tile::sample(i + far, j + near)},
          .weights = {1.0 - along_x - along_y, along_x, along_y},
          .above_center_m = {above_center_m(i + far, j + far), above_center_m(i + near, j + far),
                             above_center_m(i + far, j + near)},
          .sense = far != 0 ? -1.0 : 1.0};
}

double TileGround::z_world(double x_world, double y_world) const {
  const OnTriangle on = triangle_at(x_world, y_world);
  const auto& z = on.above_center_m;
  return tile_.center_z_m + z[0] + on.weights[1] * (z[1] - z[0]) + on.weights[2] * (z[2] - z[0]);
}

TileGround::Place TileGround::at(double x_world, double y_world) const {
  const Eigen::Vector2d here = within(x_world, y_world);
  const OnTriangle on = triangle_at(here.x(), here.y());
  const auto& z = on.above_center_m;
  const double spacing_m = tile_.id.spacing_m();
  Place place;
  place.point_world = {
      here.x(), here.y(),
      tile_.center_z_m + z[0] + on.weights[1] * (z[1] - z[0]) + on.weights[2] * (z[2] - z[0])};
  place.normal_world = Eigen::Vector3d(-on.sense * (z[1] - z[0]) / spacing_m,
                                       -on.sense * (z[2] - z[0]) / spacing_m, 1.0)
                           .normalized();
  const std::size_t nearest = on.samples[static_cast<std::size_t>(
      std::max_element(on.weights.begin(), on.weights.end()) - on.weights.begin())];
  double moisture = 0.0;
  for (std::size_t k = 0; k < 3; ++k) moisture += on.weights[k] * tile_.moisture[on.samples[k]];
  place.surface.spacing_m = spacing_m;
  place.surface.cover = tile_.cover[nearest];
  place.surface.source = tile_.source[nearest];
  place.surface.moisture = std::clamp(moisture / 255.0, 0.0, 1.0);
  find_paint(here.x(), here.y(), place.surface.paint);
  return place;
}

void TileGround::find_paint(double x_world, double y_world, world::PaintSample& paint) const {
  paint.is_painted = false;
  if (paint_.is_empty()) return;
  const Eigen::Vector2d here = within(x_world, y_world);
  paint_.find(here.x(), here.y(), paint);
}

}  // namespace terracast::world_export
