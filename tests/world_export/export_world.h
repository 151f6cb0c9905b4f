#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include "core/log.h"
#include "core/parallel.h"
#include "core/registry.h"
#include "export/world/world_format.h"
#include "tests/support/tiny_world.h"
#include "world/tile_file.h"

namespace terracast::world_export {

namespace fs = std::filesystem;
using world::kHeightStep_m;

inline constexpr double kPi = std::numbers::pi;

inline double hills_m(double x, double y) {
  return 400.0 + 30.0 * std::sin(x / 90.0) * std::cos(y / 70.0);
}

inline world::Shape tetrahedron(double size_m, core::SemanticClass semantic_class) {
  const auto steps = static_cast<int>(size_m / kHeightStep_m);
  world::Shape shape;
  shape.vertices_steps = {{0, 0, 0}, {steps, 0, 0}, {0, steps, 0}, {0, 0, steps}};
  shape.triangles = {{{0, 2, 1}, 0}, {{0, 1, 3}, 0}, {{1, 2, 3}, 0}, {{0, 3, 2}, 0}};
  shape.finishes = {{.material = world::Material::Brick,
                     .semantic_class = semantic_class,
                     .color_srgb = {200, 100, 50},
                     .pattern = 0}};
  return shape;
}

inline Eigen::Vector3i steps_of(const Eigen::Vector3d& place_m) {
  return (place_m / kHeightStep_m).array().round().cast<int>();
}

/// A square of 10 m, seen from above, with a texture twice along x and once along y.
inline world::Shape textured_square() {
  world::Shape shape;
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)}) {
    shape.vertices_steps.emplace_back(10240 * x, 10240 * y, 0);
    shape.uv.emplace_back(2.0f * static_cast<float>(x), static_cast<float>(y));
  }
  shape.triangles = {{{0, 1, 2}, 0}, {{0, 2, 3}, 0}};
  shape.finishes = {{.material = world::Material::Textured,
                     .semantic_class = core::SemanticClass::Object,
                     .color_srgb = {188, 255, 137},
                     .pattern = 0}};
  return shape;
}

/// Rows from the top: red, green; yellow, and nothing, which is white.
inline core::Image8 texture_image() {
  core::Image8 image(2, 2, 4, 255);
  const std::uint8_t codes[4][4] = {
      {200, 10, 10, 255}, {10, 200, 10, 255}, {200, 200, 10, 255}, {9, 9, 9, 0}};
  for (int k = 0; k < 4; ++k) std::copy(codes[k], codes[k] + 4, &image(k % 2, k / 2));
  return image;
}

using Code = std::array<std::uint8_t, 3>;

/// What the picture shows of the ground, in squares of 16 m: no two near each other are alike.
inline Code pictured(double x_world, double y_world) {
  const auto column = static_cast<int>(std::floor(x_world / 16.0));
  const auto row = static_cast<int>(std::floor(y_world / 16.0));
  return {static_cast<std::uint8_t>(60 + column * 53 % 120),
          static_cast<std::uint8_t>(60 + row * 37 % 120),
          static_cast<std::uint8_t>(60 + (column * 29 + row * 71) % 120)};
}

/// A world of a kilometre, fine in its east, with a solid that reaches over a tile's border, a textured one and an
/// instance; a road along y and a picture of the ground in its north-east; a cloud. Heights, places of objects, their
/// frames and the picture are known in closed form.
class WorldExport : public testing::Test {
 protected:
  static constexpr double kSolidX = 250.0;
  static constexpr double kSolidY = 40.0;
  static constexpr double kTreeX = 60.0;
  static constexpr double kTreeY = 90.0;

  static constexpr double kSquareX = 300.0;
  static constexpr double kSquareY = -120.0;
  static constexpr double kRoadX = 152.0;
  static constexpr double kRoadHalfWidth_m = 6.0;

  WorldExport() : folder_(fs::temp_directory_path() / fmt::format("terracast-we-{}", getpid())) {
    fs::remove_all(folder_);
    make_world();
  }
  ~WorldExport() override { fs::remove_all(folder_); }

  void make_world() {
    const test::TinyWorldOptions options{
        .finest_level = 0,
        .coarsest_level = 1,
        .num_roots = 2,
        .refine = [](const world::TileId& id) { return id.x >= 0; }};
    world::TileStore plain = test::make_tiny_world(folder_ / "world", hills_m, options);
    world::WorldManifest manifest = plain.manifest();
    const geo::WorldFrame frame(manifest.origin);
    world::Prototype tree{
        .name = "tree",
        .levels = {{.coarsest_level = 1, .shape = tetrahedron(4.0, core::SemanticClass::Tree)}}};
    manifest.prototypes = {world::write_prototype(folder_ / "world", 0, tree)};
    manifest.layers.emplace_back();
    manifest.textures = {
        world::write_texture(folder_ / "world", 0, {.name = "four", .image = texture_image()})};
    add_picture(manifest);
    add_cloud(manifest);
    for (world::TileInfo& info : manifest.tiles) {
      world::Tile tile = test::make_tile(info.id, hills_m, options);
      const Eigen::Vector2d corner = info.id.corner_world();
      const double side_m = info.id.side_m();
      const auto reaches = [&](double x, double y, double size_m) {
        return x + size_m >= corner.x() && x <= corner.x() + side_m && y + size_m >= corner.y() &&
               y <= corner.y() + side_m;
      };
      if (reaches(kSolidX, kSolidY, 12.0)) {
        world::Solid solid;
        solid.provenance.instance_id = 7;
        solid.place_m = {static_cast<int>(kSolidX), static_cast<int>(kSolidY)};
        solid.origin_steps = steps_of({kSolidX, kSolidY, 400.0});
        solid.levels = {
            {.coarsest_level = 1, .shape = tetrahedron(12.0, core::SemanticClass::Building)}};
        tile.objects.solids.push_back(solid);
      }
      if (reaches(kSquareX, kSquareY, 10.0)) {
        world::Solid solid;
        solid.provenance.instance_id = 8;
        solid.place_m = {static_cast<int>(kSquareX), static_cast<int>(kSquareY)};
        solid.origin_steps = steps_of({kSquareX, kSquareY, 450.0});
        solid.levels = {{.coarsest_level = 1, .shape = textured_square()}};
        tile.objects.solids.push_back(solid);
      }
      if (corner.x() >= 0.0 && corner.x() < kRoadX) {
        world::Strip road;
        road.half_width_steps = static_cast<int>(kRoadHalfWidth_m / kHeightStep_m);
        road.whole_m = 400.0;
        for (const double y : {-200.0, 200.0})
          road.points_steps.push_back(steps_of({kRoadX, y, 0.0}).head<2>());
        tile.objects.strips.push_back(road);
      }
      if (reaches(kTreeX - 4.0, kTreeY - 4.0, 8.0)) {
        world::Instance instance;
        instance.provenance.instance_id = 9;
        instance.place_steps = steps_of({kTreeX, kTreeY, 410.0});
        instance.heading = 16384;  // a quarter turn
        instance.scale = 8192;
        tile.objects.instances.push_back(instance);
      }
      tile.objects_top_steps = static_cast<int>((460.0 - tile.center_z_m) / kHeightStep_m);
      info = world::write_tile(folder_ / "world", tile);
    }
    world::write_manifest(folder_ / "world", manifest);
    store_.emplace(world::TileStore::open(folder_ / "world"));
    frame_.emplace(store_->manifest().origin);
  }

  /// A picture of [0, 512) x [0, 512), a pixel a metre.
  void add_picture(world::WorldManifest& manifest) const {
    core::Image8 image(world::kImageryTile_px, world::kImageryTile_px, 4, 255);
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x) {
        const Code code = pictured(x + 0.5, image.height() - y - 0.5);
        std::copy(code.begin(), code.end(), &image(x, y));
      }
    world::ImageryInfo info{.finest_level = 0, .coarsest_level = 0, .sources = {"a"}, .tiles = {}};
    info.tiles = {world::write_imagery_tile(folder_ / "world", 0, {0, 0, 0}, image)};
    info.tiles[0].sources = {0};
    manifest.imagery.push_back(info);
  }
  /// No two voxels near each other are alike, and none is empty.
  static world::Volume cloud() {
    world::Volume volume{.name = "volume_0",
                         .size = {5, 4, 3},
                         .voxel_m = 4.0,
                         .lowest_m = {-10.0, -8.0, 1.0},
                         .density = {}};
    for (int k = 0; k < 60; ++k)
      volume.density.push_back(static_cast<std::uint8_t>(1 + k * 97 % 255));
    return volume;
  }
  static world::VolumePlace cloud_place() {
    return {.volume = 0,
            .layer = 0,
            .place_world = {130.0, -45.5, 900.25},
            .heading_rad = 0.75,
            .scale = 1.5,
            .extinction_per_m = 0.03};
  }
  void add_cloud(world::WorldManifest& manifest) const {
    manifest.volumes.push_back(world::write_volume(folder_ / "world", 0, cloud()));
    manifest.volume_places.push_back(cloud_place());
  }

  /// So many metres to each side of a place of the world frame.
  Region around(double x_world, double y_world, double half_m) const {
    const geo::Geodetic place = frame_->geodetic_from_world({x_world, y_world, 400.0});
    const double lat_deg = half_m / 111160.0;  // a metre is less than this at 46 degrees north
    const double lon_deg = lat_deg / std::cos(place.lat_deg * kPi / 180.0);
    return {place.lat_deg - lat_deg, place.lon_deg - lon_deg, place.lat_deg + lat_deg,
            place.lon_deg + lon_deg};
  }
  void write(std::string_view format, const Region& region, const fs::path& destination,
             double spacing_m = 1.0, int num_threads = 2, double texel_m = 8.0) const {
    const core::ThreadLimit limit(num_threads);
    export_region(core::find_registered(world_formats(), "format", format),
                  {.store = *store_,
                   .region = region,
                   .finest_spacing_m = spacing_m,
                   .texel_m = texel_m,
                   .destination = destination,
                   .context = {.log = log_, .num_threads = num_threads, .events_file = {}}});
  }
  /// The world's square becomes one of so many metres, about which the rest is its apron.
  void shrink_square(double size_m) {
    world::WorldManifest manifest = store_->manifest();
    manifest.size_m = size_m;
    world::write_manifest(folder_ / "world", manifest);
    store_.emplace(world::TileStore::open(folder_ / "world"));
  }
  /// From the y-up frame of a glTF file about a place of the ellipsoid.
  Eigen::Vector3d world_from_glb(const Eigen::Vector3d& point, const geo::Geodetic& about) const {
    const Eigen::Vector3d at = frame_->world_from_geodetic(about);
    return at + frame_->world_from_enu(at) * Eigen::Vector3d(point.x(), -point.z(), point.y());
  }

  /// Of a file about a place of the ellipsoid: east, north, up.
  Eigen::Vector3d enu_from_world(const Eigen::Vector3d& point_world,
                                 const geo::Geodetic& about) const {
    const Eigen::Vector3d at = frame_->world_from_geodetic(about);
    return frame_->world_from_enu(at).transpose() * (point_world - at);
  }

  fs::path folder_;
  core::Log log_{"test", core::LogLevel::Off};
  std::optional<world::TileStore> store_;
  std::optional<geo::WorldFrame> frame_;
};

// Floats hold 300 m to 2^-15 m; heights lie on steps of 2^-10 m, of which half is rounded off.
inline constexpr double kFloat_m = 1e-4;
inline constexpr double kRounded_m = 0.5 * kHeightStep_m + kFloat_m;

}  // namespace terracast::world_export
