#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/toml_reader.h"
#include "tests/tiler/made_layer.h"
#include "tests/tiler/raster_files.h"
#include "tiler/layer_stack.h"
#include "world/tile_id.h"

/// Layers of plants on a plane.
namespace terracast::test {

inline tiler::LayerOptions vegetation_of(const std::string& text) {
  tiler::LayerOptions options;
  core::TomlDocument::parse("kind = \"vegetation\"\n" + text, "layer.toml").read(options);
  return options;
}

/// Ground whose cover is a function of place, and where things stand that leave no room.
struct PlantedLand final : tiler::LayerSite {
  std::function<world::Cover(const Eigen::Vector2d&)> cover_at = [](const Eigen::Vector2d&) {
    return world::Cover::Forest;
  };
  /// Distance to the nearest of what others hold; below 0 within.
  std::function<double(const Eigen::Vector2d&)> room_m = [](const Eigen::Vector2d&) { return 1e9; };
  std::function<double(const Eigen::Vector2d&)> z_at = [](const Eigen::Vector2d& place) {
    return 300.0 + 0.02 * place.x();
  };
  bool has_walls = false;

  double ground_z_world(const Eigen::Vector2d& place) const override { return z_at(place); }
  bool has_walls_near(const Eigen::Vector2d&, double) const override { return has_walls; }
  world::Cover cover(const Eigen::Vector2d& place) const override { return cover_at(place); }
  bool is_free(const Eigen::Vector2d& place, double radius_m) const override {
    return room_m(place) >= radius_m;
  }
};

/// A layer on a plane that rises towards the east.
struct Planted {
  explicit Planted(const std::string& text = "", double size_m = 16384.0, double ground_m = 300.0,
                   std::int64_t seed = 1, double slope = 0.0) {
    tiler::WorldOptions options = world_of("ramp", size_m);
    options.elevation[0].height_m = ground_m;
    options.elevation[0].slope = slope;
    surface = prepare(options);
    layer = made_layer(vegetation_of(text), *surface, static_cast<std::uint64_t>(seed));
  }

  std::vector<world::Instance> on(const world::TileId& id, const PlantedLand& land) const {
    world::TileObjects objects;
    layer->add_objects(id, land, objects);
    EXPECT_TRUE(objects.solids.empty() && objects.strips.empty() && objects.areas.empty());
    return objects.instances;
  }
  /// What is shown of those that stand on a tile, by id.
  std::map<std::uint32_t, world::Instance> shown_on(const world::TileId& id,
                                                    const PlantedLand& land) const {
    std::map<std::uint32_t, world::Instance> shown;
    for (const world::Instance& instance : on(id, land)) {
      const Eigen::Vector2d at = place_of(instance);
      if (world::tile_at(id.level, at.x(), at.y()) != id || shape_of(instance, id.level) == nullptr)
        continue;
      EXPECT_TRUE(shown.emplace(instance.provenance.instance_id, instance).second);
    }
    return shown;
  }
  /// Null: nothing is shown.
  const world::Shape* shape_of(const world::Instance& instance, int level) const {
    if (level > instance.coarsest_level) return nullptr;
    const world::Shape* shape =
        world::shape_at(layer->prototypes()[instance.prototype].levels, level);
    return shape == nullptr || shape->triangles.empty() ? nullptr : shape;
  }
  const std::string& name_of(const world::Instance& instance) const {
    return layer->prototypes()[instance.prototype].name;
  }
  bool is_a(const world::Instance& instance, std::string_view words) const {
    return name_of(instance).find(words) != std::string::npos;
  }
  bool is_tree(const world::Instance& instance) const {
    return !is_a(instance, "forest") &&
           (is_a(instance, "oak") || is_a(instance, "birch") || is_a(instance, "poplar") ||
            is_a(instance, "spruce") || is_a(instance, "pine_") || is_a(instance, "palm") ||
            is_a(instance, "dead")) &&
           !is_a(instance, "mountain");
  }
  /// How far its shapes reach from its place, in the plane.
  double reach_m(const world::Instance& instance) const {
    if (reaches_m.empty())
      for (const world::Prototype& prototype : layer->prototypes()) {
        reaches_m.push_back(0.0);
        for (const world::ShapeLevel& level : prototype.levels)
          for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
            reaches_m.back() = std::max(
                reaches_m.back(), vertex.head<2>().cast<double>().norm() * world::kHeightStep_m);
      }
    return reaches_m[instance.prototype] * instance.scale / 4096.0;
  }
  double height_m(const world::Instance& instance) const {
    int highest = 0;
    for (const world::ShapeLevel& level : layer->prototypes()[instance.prototype].levels)
      for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
        highest = std::max(highest, vertex.z());
    return highest * world::kHeightStep_m * instance.scale / 4096.0;
  }
  static Eigen::Vector2d place_of(const world::Instance& instance) {
    return instance.place_steps.head<2>().cast<double>() * world::kHeightStep_m;
  }

  std::shared_ptr<const tiler::WorldSurface> surface;
  std::unique_ptr<tiler::Layer> layer;
  mutable std::vector<double> reaches_m;
};

/// The layer without options; made once for all tests.
inline const Planted& planted() {
  static const Planted layer;
  return layer;
}

/// A road, a lake and houses.
inline PlantedLand with_things() {
  PlantedLand land;
  land.room_m = [](const Eigen::Vector2d& at) {
    const double road = std::abs(at.y() - 0.3 * at.x() - 70.0) / std::hypot(1.0, 0.3) - 4.0;
    const double lake = (at - Eigen::Vector2d(180.0, 60.0)).norm() - 35.0;
    const Eigen::Vector2d in_block = at.array() - 48.0 * (at.array() / 48.0).floor() - 24.0;
    const Eigen::Vector2d out_of_house = (in_block.cwiseAbs().array() - 5.0).cwiseMax(0.0);
    return std::min({road, lake, out_of_house.norm()});
  };
  return land;
}

}  // namespace terracast::test
