#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "core/toml_reader.h"
#include "tests/support/mesh_checks.h"
#include "tests/tiler/vector_files.h"
#include "tiler/layer_stack.h"
#include "tiler/tile_builder.h"

/// Files of bad features, through every kind of layer that reads features: what is not used is counted.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;

constexpr int kNumOutside = 100000;

/// What every kind of layer looks at.
const char* const kTags =
    R"({"building":"yes","highway":"service","waterway":"river","natural":"water",
"landuse":"harbour","man_made":"tower"})";

/// A square of some metres, its south-west corner so far east and north of the origin.
std::string ring(double east_m, double north_m, double side_m) {
  const auto place = [&](double x, double y) {
    return fmt::format("[{:.8f},{:.8f}]", kOriginLon_deg + (east_m + x) / 82200.0,
                       kOriginLat_deg + (north_m + y) / 111080.0);
  };
  return fmt::format("[{0},{1},{2},{3},{0}]", place(0, 0), place(side_m, 0), place(side_m, side_m),
                     place(0, side_m));
}
std::string area(const std::string& ring, const std::string& tags) {
  return R"({"type":"Feature","properties":)" + tags +
         R"(,"geometry":{"type":"Polygon","coordinates":[)" + ring + "]}}";
}

/// One of use for every kind, and far beyond the world as many as would fill a country.
void write_outside(const fs::path& file) {
  std::ofstream text(file);
  text << R"({"type":"FeatureCollection","features":[)" << area(ring(-900.0, -900.0, 20.0), kTags);
  for (int i = 0; i < kNumOutside; ++i)
    text << "," << area(ring(90000.0 + 30.0 * (i % 300), 30.0 * (i / 300.0), 9.0), kTags);
  text << "]}";
}

void write_without_places(const fs::path& file) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<std::string, std::string>> tags = {
      {"building", "yes"}, {"highway", "service"}, {"waterway", "river"}, {"power", "line"}};
  write_vectors(
      file, "GPKG",
      {{"LINESTRING (1.5 42.5, 1.501 42.5)", tags, kNan},
       {"LINESTRING (1.5 42.5, 1.502 42.5)", tags, std::numeric_limits<double>::infinity()},
       {"POLYGON ((1.5 42.5, 1.501 42.5, 1.501 42.501, 1.5 42.5))", tags, kNan},
       {"POLYGON ((1.5 42.5, 1.5002 42.5, 1.5002 42.5002, 1.5 42.5))", tags},
       {"POLYGON ((1.5 42.5, 1.5 42.5, 1.5 42.5, 1.5 42.5))", tags}});
}

std::optional<tiler::LayerOptions> layer_of(const std::string& kind,
                                            const std::vector<fs::path>& files) {
  std::string names;
  for (const fs::path& file : files)
    names += (names.empty() ? "\"" : ", \"") + file.string() + "\"";
  tiler::LayerOptions layer;
  try {
    core::TomlDocument::parse(
        "kind = \"" + kind + "\"\nnumber_field = \"\"\nfiles = [" + names + "]", "layer.toml")
        .read(layer);
  } catch (const core::Error&) {
    return std::nullopt;  // it does not read features
  }
  return layer;
}

std::int64_t count_of(const world::LayerInfo& info, const std::string& name) {
  for (const auto& [key, count] : info.counts)
    if (key == name) return count;
  ADD_FAILURE() << info.kind << " counts no " << name;
  return -1;
}

TEST(BadFeatures, AHundredThousandOutsideAndThoseWithoutPlacesAreCountedByEveryLayer) {
  const ScratchFolder folder;
  write_outside(folder / "outside.geojson");
  write_without_places(folder / "nowhere.gpkg");
  int num_kinds = 0;
  for (const tiler::LayerKindInfo& kind : tiler::layer_kinds()) {
    const auto layer =
        layer_of(std::string(kind.name), {folder / "outside.geojson", folder / "nowhere.gpkg"});
    if (!layer) continue;
    ++num_kinds;
    tiler::WorldOptions options = world_of("plane");
    options.layers.push_back(*layer);
    const auto surface = prepare(options);
    const world::LayerInfo& info = surface->layers().infos().at(0);
    EXPECT_EQ(count_of(info, "features outside the world"), kNumOutside) << kind.name;
    // Lines are nothing to buildings.
    EXPECT_EQ(count_of(info, "features with places that are none"),
              kind.name == "buildings" ? 1 : 3)
        << kind.name;
    EXPECT_EQ(count_of(info, "lines and rings of too few points"), 1) << kind.name;
    EXPECT_NO_THROW(build_tile(*surface, {2, 0, 0}));
  }
  EXPECT_GE(num_kinds, 4);  // buildings, objects, roads, water
}

/// A ring of the feature's own shape; corners in metres east and north of its place.
std::string shape(double east_m, double north_m,
                  const std::vector<std::vector<Vector2d>>& rings_m) {
  std::string text;
  for (const auto& corners_m : rings_m) {
    std::string ring;
    for (std::size_t i = 0; i <= corners_m.size(); ++i) {
      const Vector2d& at = corners_m[i % corners_m.size()];
      ring += fmt::format("{}[{:.9f},{:.9f}]", ring.empty() ? "" : ",",
                          kOriginLon_deg + (east_m + at.x()) / 82200.0,
                          kOriginLat_deg + (north_m + at.y()) / 111080.0);
    }
    text += (text.empty() ? "[" : ",[") + ring + "]";
  }
  return area(text, kTags);
}

/// Areas that are none or not sound, far from each other: what crosses itself, holes outside and across, no width, a
/// circle of very many corners, half of them a hand's breadth off.
void write_unsound(const fs::path& file, int num_corners) {
  const std::vector<Vector2d> square = {{0, 0}, {30, 0}, {30, 30}, {0, 30}};
  std::vector<Vector2d> circle;
  for (int i = 0; i < num_corners; ++i) {
    const double angle = 2.0 * M_PI * i / num_corners;
    circle.emplace_back((40.0 + 0.1 * (i % 2)) * Vector2d(std::cos(angle), std::sin(angle)));
  }
  std::ofstream(file) << R"({"type":"FeatureCollection","features":[)"
                      << shape(100, 100, {{{0, 0}, {30, 30}, {30, 0}, {0, 30}}}) << ","
                      << shape(300, 100, {square, {{50, 0}, {70, 0}, {70, 20}, {50, 20}}}) << ","
                      << shape(100, 300, {square, {{20, 10}, {45, 10}, {45, 20}, {20, 20}}}) << ","
                      << shape(300, 300, {{{0, 0}, {20, 10}, {40, 20}, {20, 10.0}}}) << ","
                      << shape(-300, 300, {circle}) << "]}";
}

TEST(BadFeatures, UnsoundAreasAreRepairedOrLeftOutAndCountedByEveryLayer) {
  const ScratchFolder folder;
  for (const tiler::LayerKindInfo& kind : tiler::layer_kinds()) {
    write_unsound(folder / "unsound.geojson", 1'000'000);
    const auto layer = layer_of(std::string(kind.name), {folder / "unsound.geojson"});
    if (!layer) continue;
    SCOPED_TRACE(kind.name);
    tiler::WorldOptions options = world_of("plane");
    options.layers.push_back(*layer);
    const auto surface = prepare(options);
    const world::LayerInfo& info = surface->layers().infos().at(0);
    EXPECT_EQ(count_of(info, "features read"), 5);
    if (kind.name == "buildings") {
      EXPECT_EQ(count_of(info, "footprints repaired"), 3);
      EXPECT_EQ(count_of(info, "footprints without an area"), 1);
      EXPECT_EQ(count_of(info, "footprints simplified"), 1);
      EXPECT_EQ(count_of(info, "buildings"), 5) << "a bow tie is two";
    } else if (kind.name == "water") {
      EXPECT_EQ(count_of(info, "areas that are none"), 1);
      EXPECT_EQ(count_of(info, "areas repaired"), 3);
      EXPECT_EQ(count_of(info, "areas"), 5) << "a bow tie is two";
    }
    for (const world::TileId& id : {world::TileId{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, {0, -1, 1}}) {
      const world::Tile tile = build_tile(*surface, id);
      for (const world::Solid& solid : tile.objects.solids)
        for (const world::ShapeLevel& level : solid.levels) {
          const MeshFacts facts = mesh_facts(level.shape);
          EXPECT_EQ(facts.problem, "") << "feature " << solid.provenance.feature;
          EXPECT_FALSE(facts.meets_itself) << "feature " << solid.provenance.feature;
        }
    }
  }
}

TEST(BadFeatures, FootprintsInWaterAreLeftOutAndCounted) {
  const ScratchFolder folder;
  const std::string house = R"({"building":"house"})";
  write_text(folder / "lake.geojson",
             R"({"type":"FeatureCollection","features":[)" +
                 area(ring(100.0, 100.0, 200.0), R"({"natural":"water"})") + "]}");
  // In the lake, half on its shore, and on land.
  write_text(folder / "houses.geojson", R"({"type":"FeatureCollection","features":[)" +
                                            area(ring(200.0, 200.0, 12.0), house) + "," +
                                            area(ring(89.0, 150.0, 12.0), house) + "," +
                                            area(ring(50.0, 50.0, 12.0), house) + "]}");
  tiler::WorldOptions options = world_of("plane");
  options.layers.push_back(*layer_of("water", {folder / "lake.geojson"}));
  options.layers.push_back(*layer_of("buildings", {folder / "houses.geojson"}));
  const auto surface = prepare(options);
  const std::int64_t num_wet = count_of(surface->layers().infos().at(1), "footprints in water");
  EXPECT_GE(num_wet, 1);
  const world::Tile tile = build_tile(*surface, {1, 0, 0});
  EXPECT_EQ(static_cast<std::int64_t>(tile.objects.solids.size()), 3 - num_wet);
  for (const world::Solid& solid : tile.objects.solids) {
    const Vector2d at = solid.place_m.cast<double>();
    EXPECT_EQ(surface->sample(at.x(), at.y()).cover, world::Cover::Land) << at.transpose();
  }
}

}  // namespace
}  // namespace terracast::test
