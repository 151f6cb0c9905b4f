#include "tests/support/tiny_world.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <vector>

#include "world/lod.h"

namespace terracast::test {

world::Tile make_tile(const world::TileId& id, const HeightFunction& height_m,
                      const TinyWorldOptions& options) {
  world::Tile tile;
  tile.id = id;
  const double spacing_m = id.spacing_m();
  const Eigen::Vector2d corner = id.corner_world();
  std::vector<double> steps;
  for (int j = 0; j < world::kTileSamples; ++j) {
    for (int i = 0; i < world::kTileSamples; ++i) {
      const double x = corner.x() + i * spacing_m;
      const double y = corner.y() + j * spacing_m;
      steps.push_back(std::nearbyint(height_m(x, y) / world::kHeightStep_m));
      tile.cover.push_back(options.cover(x, y));
      tile.moisture.push_back(
          static_cast<std::uint8_t>(std::lround(255.0 * options.moisture(x, y))));
      tile.source.push_back(0);
    }
  }
  const auto [lowest, highest] = std::minmax_element(steps.begin(), steps.end());
  tile.center_z_m = std::nearbyint((*lowest + *highest) / 2.0 * world::kHeightStep_m);
  const double center_steps = tile.center_z_m / world::kHeightStep_m;
  for (const double step : steps)
    tile.height_steps.push_back(static_cast<std::int32_t>(step - center_steps));
  return tile;
}

world::TileStore make_tiny_world(const std::filesystem::path& folder,
                                 const HeightFunction& height_m, const TinyWorldOptions& options) {
  std::vector<world::TileId> leaves;
  const std::function<void(const world::TileId&)> grow = [&](const world::TileId& id) {
    if (id.level <= options.finest_level || !options.refine(id)) {
      leaves.push_back(id);
      return;
    }
    for (int quadrant = 0; quadrant < 4; ++quadrant) grow(id.child(quadrant));
  };
  const int half = options.num_roots / 2;
  for (int y = -half; y < half; ++y)
    for (int x = -half; x < half; ++x)
      grow({options.coarsest_level, options.center_x + x, options.center_y + y});

  std::set<world::TileId> tiles;
  for (world::TileId id : world::balance(leaves))
    for (; id.level <= options.coarsest_level; id = id.parent()) tiles.insert(id);

  world::WorldManifest manifest;
  manifest.name = "tiny";
  manifest.input_hash = "tiny";
  manifest.origin = options.origin;
  // The world's square is centred on the origin in any case.
  const int reach = half + std::max(std::abs(options.center_x), std::abs(options.center_y));
  manifest.size_m = reach * 2 * world::TileId{options.coarsest_level, 0, 0}.side_m();
  manifest.finest_level = options.finest_level;
  manifest.base_level = options.coarsest_level;
  manifest.coarsest_level = options.coarsest_level;
  manifest.measured_level = options.finest_level;
  manifest.apron_radius_m = manifest.size_m / 2;
  manifest.outside = "error";
  manifest.sources = {{.name = "tiny",
                       .kind = "analytic",
                       .horizontal_crs = "",
                       .vertical_datum = "ellipsoid",
                       .pipeline = "",
                       .spacing_m = std::ldexp(1.0, options.finest_level),
                       .content_hash = "tiny",
                       .licence = "CC0",
                       .accuracy = ""}};
  for (const world::TileId& id : tiles)
    manifest.tiles.push_back(world::write_tile(folder, make_tile(id, height_m, options)));
  world::write_manifest(folder, manifest);
  return world::TileStore::open(folder);
}

double on_height_lattice(double value_m) {
  return std::nearbyint(value_m / world::kHeightStep_m) * world::kHeightStep_m;
}

world::TileStore make_wet_world(const std::filesystem::path& folder,
                                const HeightFunction& surface_m, const HeightFunction& depth_m,
                                TinyWorldOptions options) {
  options.cover = [&](double x, double y) {
    return on_height_lattice(depth_m(x, y)) > 0.0 ? world::Cover::Lake : world::Cover::Land;
  };
  const world::TileStore dry = make_tiny_world(folder, surface_m, options);
  world::WorldManifest manifest = dry.manifest();
  for (world::TileInfo& info : manifest.tiles) {
    world::Tile tile = dry.load(info.id);
    for (int j = 0; j < world::kTileSamples; ++j)
      for (int i = 0; i < world::kTileSamples; ++i) {
        const Eigen::Vector2d corner = info.id.corner_world();
        const double depth =
            depth_m(corner.x() + i * info.id.spacing_m(), corner.y() + j * info.id.spacing_m());
        tile.water_depth_steps.push_back(
            static_cast<std::int32_t>(std::nearbyint(std::max(depth, 0.0) / world::kHeightStep_m)));
      }
    info = world::write_tile(folder, tile);
  }
  world::write_manifest(folder, manifest);
  return world::TileStore::open(folder);
}

}  // namespace terracast::test
