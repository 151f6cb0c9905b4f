#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/toml_reader.h"
#include "tests/support/test_data.h"
#include "tests/tiler/made_layer.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/surface.h"
#include "world/tile_id.h"

/// Worlds of a layer of objects, with what stands in its way.
namespace terracast::test {

inline constexpr double kSize_m = 4096.0;

inline tiler::LayerOptions objects_of(const std::string& text) {
  tiler::LayerOptions options;
  core::TomlDocument::parse("kind = \"objects\"\n" + text, "layer.toml").read(options);
  return options;
}

/// What stands in the way: a round block, and a lake.
class Obstacles final : public tiler::Layer {
 public:
  static inline const Eigen::Vector2d kBlock{-300.0, 200.0};
  static constexpr double kBlockRadius_m = 80.0;
  static constexpr double kShore_m = 600.0;  ///< water lies east of it

  world::LayerInfo info() const override { return {}; }
  std::string input_hash() const override { return "obstacles"; }
  std::optional<world::Cover> cover(const Eigen::Vector2d& place,
                                    const tiler::SurfaceSample&) const override {
    if (place.x() > kShore_m) return world::Cover::Lake;
    return std::nullopt;
  }
  bool holds(const Eigen::Vector2d& place, double radius_m) const override {
    return (place - kBlock).norm() < kBlockRadius_m + radius_m;
  }
};

struct OpenLand final : tiler::LayerSite {
  explicit OpenLand(const tiler::WorldSurface& ground) : surface(ground) {}
  double ground_z_world(const Eigen::Vector2d& place) const override {
    return z_at ? z_at(place) : surface.sample(place.x(), place.y()).z_world;
  }
  bool has_walls_near(const Eigen::Vector2d&, double) const override { return z_at != nullptr; }
  world::Cover cover(const Eigen::Vector2d&) const override { return world::Cover::Land; }
  bool is_free(const Eigen::Vector2d&, double) const override { return true; }
  const tiler::WorldSurface& surface;
  std::function<double(const Eigen::Vector2d&)> z_at =
      nullptr;  ///< in place of the surface, with walls
};

struct PlacedWorld {
  explicit PlacedWorld(const std::string& text, const std::string& ground = "plane",
                       const std::function<void(tiler::WorldOptions&)>& change = {}) {
    tiler::WorldOptions options = world_of(ground, kSize_m);
    if (change) change(options);
    surface = prepare(options);
    earlier.push_back(std::make_unique<Obstacles>());
    layer = made_layer(objects_of(text), *surface, 5, earlier);
  }
  world::TileObjects on(const world::TileId& id) const {
    world::TileObjects objects;
    layer->add_objects(id, OpenLand(*surface), objects);
    return objects;
  }
  /// All things of the world, by their ids: from the one tile of level 4.
  std::map<std::uint32_t, world::Instance> all() const {
    std::map<std::uint32_t, world::Instance> found;
    for (int y = -8; y < 8; ++y)
      for (int x = -8; x < 8; ++x)
        for (const world::Instance& instance : on({0, x, y}).instances)
          found.emplace(instance.provenance.instance_id, instance);
    return found;
  }
  std::string name_of(const world::Instance& instance) const {
    return layer->prototypes()[instance.prototype].name;
  }
  std::int64_t count_of(const std::string& name) const {
    for (const auto& [own, count] : layer->info().counts)
      if (own == name) return count;
    return 0;
  }
  std::shared_ptr<const tiler::WorldSurface> surface;
  std::vector<std::unique_ptr<tiler::Layer>> earlier;
  std::unique_ptr<tiler::Layer> layer;
};

inline Eigen::Vector2d place_of(const world::Instance& instance) {
  return instance.place_steps.head<2>().cast<double>() * world::kHeightStep_m;
}

/// Degrees of a place in the world, so that features may be written in metres.
inline std::string text_of(double x, double y) {
  const geo::WorldFrame frame(
      {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg, .height_m = 0.0});
  const geo::Geodetic at = frame.geodetic_from_world({x, y, 0.0});
  return fmt::format("{:.11f} {:.11f}", at.lon_deg, at.lat_deg);
}
inline std::string line_of(const std::vector<Eigen::Vector2d>& points) {
  std::string text;
  for (const Eigen::Vector2d& point : points)
    text += (text.empty() ? "" : ", ") + text_of(point.x(), point.y());
  return text;
}
inline std::string area_of(double low_x, double low_y, double high_x, double high_y) {
  return "POLYGON ((" +
         line_of(
             {{low_x, low_y}, {high_x, low_y}, {high_x, high_y}, {low_x, high_y}, {low_x, low_y}}) +
         "))";
}

inline std::string write(const ScratchFolder& folder, std::vector<VectorSpec> specs,
                         const std::string& name) {
  write_vectors(folder / name, "GeoJSON", specs);
  return fmt::format("files = [\"{}\"]\n", (folder / name).string());
}

}  // namespace terracast::test
