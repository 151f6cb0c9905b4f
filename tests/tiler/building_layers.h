#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/toml_reader.h"
#include "tests/tiler/made_layer.h"
#include "tests/tiler/raster_files.h"
#include "tiler/layer_stack.h"
#include "world/tile_id.h"

/// Layers of buildings over a slope.
namespace terracast::test {

inline tiler::LayerOptions layer_of(const std::string& text) {
  tiler::LayerOptions options;
  core::TomlDocument::parse("kind = \"buildings\"\n" + text, "layer.toml").read(options);
  return options;
}

/// A rectangle in metres about the tests' origin.
inline std::string wkt(double x, double y, double length, double width) {
  const Eigen::Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg) + Eigen::Vector2d(x, y);
  return fmt::format(
      "POLYGON(({0:.3f} {1:.3f},{2:.3f} {1:.3f},{2:.3f} {3:.3f},{0:.3f} {3:.3f},{0:.3f} {1:.3f}))",
      at.x(), at.y(), at.x() + length, at.y() + width);
}

/// A slope, without anything on it.
struct Land final : tiler::LayerSite {
  double slope = 0.0;
  double ground_z_world(const Eigen::Vector2d& place) const override {
    return 300.0 + slope * place.x();
  }
  world::Cover cover(const Eigen::Vector2d&) const override { return world::Cover::Land; }
  bool is_free(const Eigen::Vector2d&, double) const override { return true; }
};

struct Built {
  explicit Built(const std::string& text, tiler::WorldOptions options = world_of("plane"),
                 core::LogLevel level = core::LogLevel::Off) {
    options.elevation[0].height_m = 300.0;
    surface = prepare(options);
    layer = made_layer(layer_of(text), *surface, 1, {}, level);
  }
  std::int64_t count(const std::string& name) const {
    for (const auto& [key, value] : layer->info().counts)
      if (key == name) return value;
    return 0;
  }
  std::vector<world::Solid> on(const world::TileId& id, const Land& land) const {
    world::TileObjects objects;
    layer->add_objects(id, land, objects);
    return objects.solids;
  }
  /// All of the world by number, as they stand on the finest tiles that hold their places.
  std::map<std::uint32_t, world::Solid> all(const Land& land, int level = 0) const {
    std::map<std::uint32_t, world::Solid> solids;
    const int side = static_cast<int>(surface->options().size_m) / (256 << level);
    for (int j = -side / 2; j < side / 2; ++j)
      for (int i = -side / 2; i < side / 2; ++i) {
        const world::TileId id =
            world::tile_at(level, (i + 0.5) * (256 << level), (j + 0.5) * (256 << level));
        for (world::Solid& solid : on(id, land))
          if (world::tile_at(level, solid.place_m.x(), solid.place_m.y()) == id)
            solids.emplace(solid.provenance.instance_id, std::move(solid));
      }
    return solids;
  }

  std::shared_ptr<const tiler::WorldSurface> surface;
  std::unique_ptr<tiler::Layer> layer;
};

inline std::string files_key(const std::filesystem::path& file) {
  return "files = [\"" + file.string() + "\"]\n";
}

}  // namespace terracast::test
