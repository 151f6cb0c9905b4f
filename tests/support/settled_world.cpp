#include "tests/support/settled_world.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tests/support/tiny_world.h"
#include "world/instance_frame.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<Vector3d, 3>;
using world::kHeightStep_m;

constexpr std::uint64_t kSeed = 20261130;

TinyWorldOptions options() {
  TinyWorldOptions options;
  options.coarsest_level = 1;
  options.refine = [](const world::TileId& id) { return id.x == 0 && id.y == 0; };
  return options;
}

Eigen::Vector3i steps_of(const Vector3d& place_m) {
  return (place_m / kHeightStep_m).array().round().matrix().cast<int>();
}

/// An upright box about the origin, from z = 0 upwards.
world::Shape box(double width_x_m, double width_y_m, double height_m) {
  world::Shape shape;
  shape.finishes = {world::Finish{}};
  for (const double z : {0.0, height_m})
    for (const double y : {-0.5, 0.5})
      for (const double x : {-0.5, 0.5})
        shape.vertices_steps.push_back(steps_of({x * width_x_m, y * width_y_m, z}));
  for (const auto& [a, b, c, d] : {std::array<std::uint32_t, 4>{0, 1, 3, 2},
                                   {4, 5, 7, 6},
                                   {0, 1, 5, 4},
                                   {2, 3, 7, 6},
                                   {0, 2, 6, 4},
                                   {1, 3, 7, 5}}) {
    shape.triangles.push_back({{a, b, c}, 0});
    shape.triangles.push_back({{a, c, d}, 0});
  }
  return shape;
}

/// Triangles every which way about a place, slivers among them.
world::Shape thicket() {
  world::Shape shape;
  shape.finishes = {world::Finish{}};
  std::uint64_t drawn = 0;
  const auto draw = [&](double half_m) {
    return core::random_between(-half_m, half_m, kSeed, 1, drawn++);
  };
  for (std::uint32_t i = 0; i < 40; ++i) {
    const double third_m = i % 4 == 0 ? 0.003 : 1.5;
    const Vector3d middle(draw(2.0), draw(2.0), 4.0 + draw(3.0));
    for (const double size_m : {1.5, 1.5, third_m})
      shape.vertices_steps.push_back(
          steps_of(middle + Vector3d(draw(size_m), draw(size_m), draw(size_m))));
    shape.triangles.push_back({{3 * i, 3 * i + 1, 3 * i + 2}, 0});
  }
  return shape;
}

double distance_to_side_m(const Vector3d& point, const Vector3d& from, const Vector3d& to) {
  const Vector3d side = to - from;
  if (side.squaredNorm() == 0.0) return (point - from).norm();
  return (from + std::clamp(side.dot(point - from) / side.squaredNorm(), 0.0, 1.0) * side - point)
      .norm();
}

/// To the plane where the point's foot is within all sides, else to the nearest side.
double distance_to_triangle_m(const Vector3d& point, const Triangle& triangle) {
  double nearest_m = 1e300;
  const Vector3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
  bool is_within = normal.allFinite() && normal.norm() > 0.5;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3d &from = triangle[k], &to = triangle[(k + 1) % 3];
    nearest_m = std::min(nearest_m, distance_to_side_m(point, from, to));
    is_within = is_within && normal.cross(to - from).dot(point - from) >= 0.0;
  }
  return is_within ? std::min(nearest_m, std::abs(normal.dot(point - triangle[0]))) : nearest_m;
}

}  // namespace

double SettledWorld::ground_m(double x, double y) {
  return 300.0 + 20.0 * std::sin(0.02 * x) * std::cos(0.015 * y) + 2.0 * std::sin(0.3 * x);
}

SettledWorld::SettledWorld()
    : store_(settle()), cut_(world::finest_cut(store_)), terrain_(store_, cut_) {}

world::TileStore SettledWorld::settle() {
  const world::TileStore bare = make_tiny_world(folder_ / "world", ground_m, options());
  world::WorldManifest manifest = bare.manifest();
  for (const char* name : {"masts", "wood"})
    manifest.layers.push_back({.name = name,
                               .kind = "objects",
                               .source = "",
                               .content_hash = "",
                               .licence = "CC0",
                               .accuracy = "",
                               .counts = {}});
  const world::Shape wood = thicket();
  manifest.prototypes.push_back(
      world::write_prototype(folder_ / "world", 0, {"thicket", {{127, wood}}}));
  const auto foot = [](double x, double y) { return Vector3d(x, y, ground_m(x, y)); };
  world::TileObjects objects;
  const auto add_solid = [&](const Vector3d& place, const world::Shape& shape) {
    world::Solid solid;
    solid.provenance = {.instance_id = static_cast<std::uint32_t>(objects.solids.size() + 1)};
    solid.place_m = place.head<2>().cast<int>();
    solid.origin_steps = steps_of(place);
    solid.levels = {{127, shape}};
    for (const auto& triangle : shape.triangles) {
      Triangle corners;
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] =
            (solid.origin_steps + shape.vertices_steps[triangle.corners[k]]).cast<double>() *
            kHeightStep_m;
      triangles_.push_back(corners);
    }
    objects.solids.push_back(solid);
  };
  add_solid(foot(kMastX_m, kMastY_m), box(kMastWidth_m, kMastWidth_m, kMastHeight_m));
  add_solid(foot(-60.0, 2.0), box(20.0, 12.0, 9.0));  // over the border of tiles
  const geo::WorldFrame frame(manifest.origin);
  for (std::uint32_t i = 0; i < 40; ++i) {
    const auto draw = [&](double from, double to, std::uint64_t k) {
      return core::random_between(from, to, kSeed, 2, 4 * i + k);
    };
    world::Instance instance;
    instance.provenance = {.instance_id = 100 + i, .layer = 1};
    instance.place_steps = steps_of(foot(draw(-150.0, 150.0, 0), draw(-150.0, 150.0, 1)));
    instance.heading = static_cast<std::uint16_t>(draw(0.0, 65535.0, 2));
    instance.scale = static_cast<std::uint16_t>(draw(2000.0, 9000.0, 3));
    const world::InstanceFrame placed = world::instance_frame(instance, frame);
    for (const auto& triangle : wood.triangles) {
      Triangle corners;
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] =
            placed * (wood.vertices_steps[triangle.corners[k]].cast<double>() * kHeightStep_m);
      triangles_.push_back(corners);
    }
    objects.instances.push_back(instance);
  }
  for (world::TileInfo& info : manifest.tiles) {
    world::Tile tile = bare.load(info.id);
    tile.objects = objects;
    tile.objects_top_steps = static_cast<std::int32_t>(100.0 / kHeightStep_m);
    info = world::write_tile(folder_ / "world", tile);
  }
  world::write_manifest(folder_ / "world", manifest);
  return world::TileStore::open(folder_ / "world");
}

double SettledWorld::brute_distance_m(const Vector3d& point, double reach_m) const {
  double nearest_m = reach_m;
  for (const Triangle& triangle : triangles_)
    nearest_m = std::min(nearest_m, distance_to_triangle_m(point, triangle));
  for (std::size_t t = 0; t < cut_.size(); ++t) {
    const Eigen::Vector2d corner = cut_[t].id.corner_world();
    const double spacing_m = cut_[t].id.spacing_m();
    const auto cells = [&](int axis) {
      const double at = (point[axis] - corner[axis]) / spacing_m;
      return std::pair(
          std::max(0, static_cast<int>(std::floor(at - reach_m / spacing_m))),
          std::min(world::kTileCells - 1, static_cast<int>(std::floor(at + reach_m / spacing_m))));
    };
    for (int j = cells(1).first; j <= cells(1).second; ++j)
      for (int i = cells(0).first; i <= cells(0).second; ++i)
        for (const bool is_upper : {false, true})
          nearest_m = std::min(nearest_m,
                               distance_to_triangle_m(point, terrain_.triangle(t, i, j, is_upper)));
  }
  return nearest_m;
}

}  // namespace terracast::test
