#include "export/world/tile_ground.h"

#include <algorithm>
#include <array>

#include "world/lod.h"
#include "world/terrain_triangle.h"

namespace terracast::world_export {

using world::kTileCells;
using world::Tile;

TileGround::TileGround(Tile tile, std::uint8_t coarser_sides)
    : tile_(std::move(tile)),
      half_steps_(world::stitched_half_steps(tile_, coarser_sides)),
      paint_(tile_.id, std::move(tile_.objects.strips), std::move(tile_.objects.areas)) {}

struct TileGround::OnTriangle {
  world::TrianglePlace place;
  std::array<double, 3> above_center_m;  ///< of its corners
  double sense;                          ///< -1: the right angle lies in the north-east

  double z_world(double center_z_m) const {
    const auto& z = above_center_m;
    return center_z_m + z[0] + place.weights[1] * (z[1] - z[0]) + place.weights[2] * (z[2] - z[0]);
  }
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
  const bool is_upper = fx + fy > 1.0;
  OnTriangle on{.place = world::place_on_triangle(i, j, is_upper, fx, fy),
                .above_center_m = {},
                .sense = is_upper ? -1.0 : 1.0};
  for (std::size_t k = 0; k < 3; ++k)
    on.above_center_m[k] = above_center_m(on.place.corners[k].i, on.place.corners[k].j);
  return on;
}

double TileGround::z_world(double x_world, double y_world) const {
  return triangle_at(x_world, y_world).z_world(tile_.center_z_m);
}

TileGround::Place TileGround::at(double x_world, double y_world) const {
  const Eigen::Vector2d here = within(x_world, y_world);
  const OnTriangle on = triangle_at(here.x(), here.y());
  const auto& z = on.above_center_m;
  const double spacing_m = tile_.id.spacing_m();
  Place place;
  place.point_world = {here.x(), here.y(), on.z_world(tile_.center_z_m)};
  place.normal_world = Eigen::Vector3d(-on.sense * (z[1] - z[0]) / spacing_m,
                                       -on.sense * (z[2] - z[0]) / spacing_m, 1.0)
                           .normalized();
  const std::size_t nearest = on.place.nearest().sample();
  double moisture = 0.0;
  for (std::size_t k = 0; k < 3; ++k)
    moisture += on.place.weights[k] * tile_.moisture[on.place.corners[k].sample()];
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
