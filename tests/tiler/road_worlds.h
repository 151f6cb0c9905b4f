#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/toml_reader.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/layer_stack.h"
#include "world/shape.h"

/// Worlds with roads that a test draws, and whether the triangles of a bridge are closed bodies.
namespace terracast::test {

/// A way or an area, in world x and y.
struct Drawn {
  std::uint64_t number;
  std::string kind = "LineString";  ///< or Polygon, Point
  std::vector<Eigen::Vector2d> points_world;
  std::vector<std::pair<std::string, std::string>> tags;
};

/// GeoJSON of places that lie where they are drawn once they are put on the ground.
inline std::string geojson(const tiler::WorldSurface& ground, const std::vector<Drawn>& drawn) {
  std::string text = "{\"type\":\"FeatureCollection\",\"features\":[";
  for (const Drawn& feature : drawn) {
    text += feature.number == drawn.front().number ? "" : ",";
    std::string places;
    for (const Eigen::Vector2d& at : feature.points_world) {
      const geo::Geodetic place = ground.frame().geodetic_from_world(
          {at.x(), at.y(), ground.sample(at.x(), at.y()).z_world});
      places += fmt::format("{}[{:.11f},{:.11f}]", places.empty() ? "" : ",", place.lon_deg,
                            place.lat_deg);
    }
    if (feature.kind == "LineString") places = "[" + places + "]";
    if (feature.kind == "Polygon") places = "[[" + places + "]]";
    text += fmt::format("{{\"type\":\"Feature\",\"properties\":{{\"number\":{}", feature.number);
    for (const auto& [key, value] : feature.tags) text += fmt::format(",\"{}\":\"{}\"", key, value);
    text += fmt::format("}},\"geometry\":{{\"type\":\"{}\",\"coordinates\":{}}}}}", feature.kind,
                        places);
  }
  return text + "]}";
}

struct RoadWorld {
  RoadWorld(const tiler::WorldOptions& bare_options, const std::vector<Drawn>& drawn,
            const std::string& toml = "") {
    bare = prepare(bare_options);
    write_text(folder / "roads.geojson", geojson(*bare, drawn));
    tiler::WorldOptions options = bare_options;
    tiler::LayerOptions layer;
    core::TomlDocument::parse("kind = \"roads\"\nnumber_field = \"number\"\nfiles = [\"" +
                                  (folder / "roads.geojson").string() + "\"]\n" + toml,
                              "layer.toml")
        .read(layer);
    options.layers.push_back(layer);
    finished = prepare(options);
  }

  double height_m(const Eigen::Vector2d& at) const {
    const double z = finished->sample(at.x(), at.y()).z_world;
    return finished->frame().geodetic_from_world({at.x(), at.y(), z}).height_m;
  }
  std::int64_t count(const std::string& name) const {
    for (const auto& [key, count] : finished->layers().infos().at(0).counts)
      if (key == name) return count;
    ADD_FAILURE() << "no count " << name;
    return -1;
  }

  ScratchFolder folder;
  std::shared_ptr<const tiler::WorldSurface> bare;
  std::shared_ptr<const tiler::WorldSurface> finished;
};

inline tiler::WorldOptions hills(double relief_m = 500.0) {
  tiler::WorldOptions options = world_of("fractal", 4096.0);
  options.elevation[0].relief_m = relief_m;
  return options;
}

inline std::vector<Eigen::Vector2d> straight(const Eigen::Vector2d& from,
                                             const Eigen::Vector2d& to) {
  return {from, to};
}

/// Whether each side of a triangle is one other's, the other way; and how many bodies there are.
inline int count_bodies(const world::Shape& shape) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  std::vector<std::uint32_t> body(shape.vertices_steps.size());
  for (std::uint32_t v = 0; v < body.size(); ++v) body[v] = v;
  const auto root = [&](std::uint32_t v) {
    while (body[v] != v) v = body[v] = body[body[v]];
    return v;
  };
  for (const auto& triangle : shape.triangles)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = triangle.corners[static_cast<std::size_t>(k)];
      const std::uint32_t b = triangle.corners[static_cast<std::size_t>((k + 1) % 3)];
      ++sides[{a, b}];
      body[root(a)] = root(b);
    }
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(sides.count({side.second, side.first}), 1u);
  }
  std::map<std::uint32_t, double> volumes;
  for (const auto& triangle : shape.triangles) {
    const auto at = [&](int k) {
      return Eigen::Vector3d(
          shape.vertices_steps[triangle.corners[static_cast<std::size_t>(k)]].cast<double>());
    };
    EXPECT_GT((at(1) - at(0)).cross(at(2) - at(0)).norm(), 0.0);
    volumes[root(triangle.corners[0])] += at(0).dot(at(1).cross(at(2))) / 6.0;
  }
  for (const auto& [first, volume] : volumes) EXPECT_GT(volume, 0.0);
  return static_cast<int>(volumes.size());
}

}  // namespace terracast::test
