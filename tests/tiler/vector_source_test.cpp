#include "tiler/vector_source.h"

#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <set>

#include "tests/tiler/vector_files.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2d;
using tiler::FeatureKind;
using tiler::OsmKind;
using tiler::read_vectors;
using tiler::VectorData;
using tiler::VectorFeature;
using tiler::VectorOptions;

constexpr double kSize_m = 20480.0;
constexpr double kGround_m = 1234.5;

/// A world about the tests' origin whose ground has one height.
const geo::WorldFrame& flat_frame() {
  static const geo::WorldFrame frame(
      {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg, .height_m = 0.0});
  return frame;
}
tiler::VectorFrame flat_world() {
  return {.frame = flat_frame(), .size_m = kSize_m, .ground_height_m = [](const geo::Geodetic&) {
            return kGround_m;
          }};
}

VectorData read(const std::filesystem::path& file, const VectorOptions& options = {}) {
  return read_vectors(path_of(file), options, flat_world());
}

std::int64_t count_of(const VectorData& data, const std::string& name) {
  for (const auto& [key, value] : data.counts)
    if (key == name) return value;
  ADD_FAILURE() << "nothing is counted as " << name;
  return -1;
}

/// World x and y by GeographicLib alone.
Vector2d place_m(double lat_deg, double lon_deg) {
  const GeographicLib::LocalCartesian local(kOriginLat_deg, kOriginLon_deg, 0.0);
  double z = 0.0;
  Vector2d at;
  local.Forward(lat_deg, lon_deg, kGround_m, at.x(), at.y(), z);
  return at;
}

std::string geojson(const std::vector<std::string>& features) {
  std::string text = R"({"type":"FeatureCollection","features":[)";
  for (std::size_t i = 0; i < features.size(); ++i) text += (i == 0 ? "" : ",") + features[i];
  return text + "]}";
}
std::string json_feature(const std::string& geometry, const std::string& properties = "{}") {
  return R"({"type":"Feature","properties":)" + properties + R"(,"geometry":)" + geometry + "}";
}
std::string json_point(double lon_deg, double lat_deg, const std::string& properties = "{}") {
  return json_feature(
      fmt::format(R"({{"type":"Point","coordinates":[{:.9f},{:.9f}]}})", lon_deg, lat_deg),
      properties);
}

TEST(VectorSource, PlacesAreWhereGeographicLibPutsThem) {
  const ScratchFolder folder;
  write_text(folder / "points.geojson",
             geojson({json_point(1.5, 42.5), json_point(1.58, 42.55), json_point(1.42, 42.43)}));
  const VectorData data = read(folder / "points.geojson");
  ASSERT_EQ(data.features.size(), 3U);
  for (const auto& [lon, lat] : {std::pair(1.5, 42.5), {1.58, 42.55}, {1.42, 42.43}}) {
    double nearest_m = 1e9;
    for (const VectorFeature& feature : data.features)
      nearest_m =
          std::min(nearest_m, (feature.parts_world.at(0).at(0).at(0) - place_m(lat, lon)).norm());
    EXPECT_LT(nearest_m, 1e-6) << lon << " " << lat;  // 9 decimals of a degree are exact text
  }
}

TEST(VectorSource, ProjectedFilesComeOutWhereGeographicOnesDo) {
  const ScratchFolder folder;
  std::string degrees = "POLYGON ((";
  std::string metres = degrees;
  const std::vector<std::pair<double, double>> ring = {
      {42.51, 1.51}, {42.51, 1.512}, {42.511, 1.5115}, {42.51, 1.51}};
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d utm = utm31(ring[i].first, ring[i].second);
    degrees += fmt::format("{}{:.12f} {:.12f}", i == 0 ? "" : ", ", ring[i].second, ring[i].first);
    metres += fmt::format("{}{:.6f} {:.6f}", i == 0 ? "" : ", ", utm.x(), utm.y());
  }
  write_vectors(folder / "degrees.gpkg", "GPKG", {{degrees + "))", {}}});
  write_vectors(folder / "metres.gpkg", "GPKG", {{metres + "))", {}}}, "EPSG:32631");
  write_vectors(folder / "metres.shp", "ESRI Shapefile", {{metres + "))", {{"a", "b"}}}},
                "EPSG:32631");
  for (const char* name : {"degrees.gpkg", "metres.gpkg", "metres.shp"}) {
    const VectorData data = read(folder / name);
    ASSERT_EQ(data.features.size(), 1U) << name;
    const VectorFeature& area = data.features[0];
    EXPECT_EQ(area.kind, FeatureKind::Area);
    ASSERT_EQ(area.parts_world.size(), 1U);
    ASSERT_EQ(area.parts_world[0].size(), 1U);
    ASSERT_EQ(area.parts_world[0][0].size(), 3U) << "closed by the first point, not repeated";
    for (std::size_t i = 0; i < 3; ++i) {
      double nearest_m = 1e9;  // a Shapefile turns rings its own way
      for (const Vector2d& at : area.parts_world[0][0])
        nearest_m = std::min(nearest_m, (at - place_m(ring[i].first, ring[i].second)).norm());
      EXPECT_LT(nearest_m, 2e-6) << name;  // 1 um of the file's text
    }
  }
}

TEST(VectorSource, KindsPartsAndRingsAreKept) {
  const ScratchFolder folder;
  write_vectors(folder / "all.gpkg", "GPKG",
                {{"POINT (1.5 42.5)", {}},
                 {"MULTILINESTRING ((1.5 42.5, 1.501 42.5, 1.501 42.5, 1.502 42.501), (1.51 42.5, "
                  "1.511 42.5))",
                  {}},
                 {"MULTIPOLYGON (((1.5 42.5, 1.504 42.5, 1.504 42.504, 1.5 42.504, 1.5 42.5), "
                  "(1.501 42.501, 1.502 42.501, 1.502 42.502, 1.501 42.501)), "
                  "((1.51 42.5, 1.511 42.5, 1.511 42.501, 1.51 42.5)))",
                  {}}});
  const VectorData data = read(folder / "all.gpkg");
  ASSERT_EQ(data.features.size(), 3U);
  EXPECT_EQ(data.features[0].kind, FeatureKind::Point);
  EXPECT_EQ(data.features[1].kind, FeatureKind::Line);
  ASSERT_EQ(data.features[1].parts_world.size(), 2U);
  EXPECT_EQ(data.features[1].parts_world[0][0].size(), 3U) << "a repeated point is one";
  EXPECT_EQ(data.features[2].kind, FeatureKind::Area);
  ASSERT_EQ(data.features[2].parts_world.size(), 2U);
  EXPECT_EQ(data.features[2].parts_world[0].size(), 2U) << "an outer ring and a hole";
  EXPECT_EQ(data.features[2].parts_world[0][1].size(), 3U);

  const VectorData lines = read(folder / "all.gpkg", {.points = false, .areas = false});
  ASSERT_EQ(lines.features.size(), 1U);
  EXPECT_EQ(lines.features[0].kind, FeatureKind::Line);
}

TEST(VectorSource, TagsArePackedAndPlain) {
  const ScratchFolder folder;
  write_text(folder / "tags.geojson",
             geojson({json_point(1.5, 42.5,
                                 R"({"building":"yes","levels":3,"other_tags":)"
                                 R"("\"height\"=>\"40 ft\",\"name\"=>\"a \\\"b\\\" c\",)"
                                 R"(\"roof:shape\"=>\"gabled\""})")}));
  const VectorData data = read(folder / "tags.geojson");
  ASSERT_EQ(data.features.size(), 1U);
  const tiler::FeatureTags& tags = data.features[0].tags;
  EXPECT_EQ(tags.value("building"), "yes");
  EXPECT_EQ(tags.value("roof:shape"), "gabled");
  EXPECT_EQ(tags.value("name"), "a \"b\" c");
  EXPECT_EQ(tags.value("levels"), "3");
  EXPECT_EQ(tags.value("height"), "40 ft");
  EXPECT_FALSE(tags.has("other_tags"));
}

TEST(VectorSource, WantedFeaturesAreChosenByTheirTags) {
  const ScratchFolder folder;
  write_text(folder / "tags.geojson", geojson({json_point(1.5, 42.5, R"({"a":"1"})"),
                                               json_point(1.5, 42.501, R"({"b":"1"})")}));
  const VectorData data =
      read(folder / "tags.geojson",
           {.wanted = [](const tiler::FeatureTags& tags) { return tags.has("b"); }});
  ASSERT_EQ(data.features.size(), 1U);
  EXPECT_EQ(count_of(data, "features of no use here"), 1);
}

TEST(VectorSource, NumbersDoNotDependOnTheOrderOfTheFile) {
  const ScratchFolder folder;
  std::vector<std::string> features;
  std::vector<VectorSpec> specs;
  for (int i = 0; i < 40; ++i) {
    const std::string id = std::to_string(1000 + 37 * i % 40);
    features.push_back(json_point(1.45 + 0.002 * i, 42.5, R"({"id_":")" + id + "\"}"));
    specs.push_back({fmt::format("POINT ({:.9f} 42.5)", 1.45 + 0.002 * i), {{"id_", id}}});
  }
  write_text(folder / "a.geojson", geojson(features));
  write_vectors(folder / "a.gpkg", "GPKG", specs);
  std::reverse(features.begin(), features.end());
  std::swap(features[3], features[17]);
  write_text(folder / "b.geojson", geojson(features));
  const auto numbers = [&](const char* name, const std::string& field) {
    std::vector<std::pair<std::uint64_t, double>> all;
    for (const VectorFeature& f : read(folder / name, {.number_field = field}).features)
      all.emplace_back(f.number, f.parts_world[0][0][0].x());
    return all;
  };
  EXPECT_EQ(numbers("a.geojson", ""), numbers("b.geojson", ""));
  EXPECT_EQ(numbers("a.geojson", "id_"), numbers("b.geojson", "id_"));
  EXPECT_EQ(numbers("a.geojson", "id_"), numbers("a.gpkg", "id_"));
  EXPECT_EQ(numbers("a.gpkg", "id_").front().first, 1000U);
  std::set<std::uint64_t> different;
  for (const auto& [number, x] : numbers("a.geojson", "")) different.insert(number);
  EXPECT_EQ(different.size(), 40U);
  expect_error(ErrorKind::Input, {"no field \"nr\"", "id_"},
               [&] { read(folder / "a.gpkg", {.number_field = "nr"}); });
}

TEST(VectorSource, OsmElementsOfOneIdHaveDifferentNumbers) {
  const ScratchFolder folder;
  const std::string square = "POLYGON ((1.5 42.5, 1.501 42.5, 1.501 42.501, 1.5 42.5))";
  write_vectors(folder / "osm.gpkg", "GPKG",
                {{square, {{"osm_way_id", "77"}}}, {square, {{"osm_id", "77"}}}});
  const VectorData data = read(folder / "osm.gpkg");
  ASSERT_EQ(data.features.size(), 2U);
  EXPECT_EQ(data.features[0].number, tiler::osm_number(OsmKind::Way, 77));
  EXPECT_EQ(data.features[1].number, tiler::osm_number(OsmKind::Relation, 77));
  EXPECT_EQ(count_of(data, "features numbered by OpenStreetMap"), 2);
  write_vectors(folder / "named.gpkg", "GPKG",
                {{square, {{"@id", "way/77"}}}, {square, {{"@id", "relation/77"}}}});
  const VectorData named = read(folder / "named.gpkg", {.number_field = "@id"});
  ASSERT_EQ(named.features.size(), 2U);
  EXPECT_EQ(named.features[0].number, data.features[0].number);
  EXPECT_EQ(named.features[1].number, data.features[1].number);
}

TEST(VectorSource, LongEdgesFollowTheSourcesStraightLine) {
  const ScratchFolder folder;
  // A parallel of latitude, 16 km long: it bends from the chord by s^2 / 8R tan(latitude) = 4.6 m.
  write_vectors(folder / "line.gpkg", "GPKG", {{"LINESTRING (1.4 42.5, 1.6 42.5)", {}}});
  const VectorData data = read(folder / "line.gpkg");
  ASSERT_EQ(data.features.size(), 1U);
  const auto& line = data.features[0].parts_world[0][0];
  double farthest_m = 0.0;
  for (int i = 0; i <= 400; ++i) {
    const Vector2d truth = place_m(42.5, 1.4 + 0.2 * i / 400);
    double nearest_m = 1e9;
    for (std::size_t k = 1; k < line.size(); ++k) {
      const Vector2d along = line[k] - line[k - 1];
      const double t = std::clamp((truth - line[k - 1]).dot(along) / along.squaredNorm(), 0.0, 1.0);
      nearest_m = std::min(nearest_m, (line[k - 1] + t * along - truth).norm());
    }
    farthest_m = std::max(farthest_m, nearest_m);
  }
  EXPECT_LT(farthest_m, 0.02);
}

TEST(VectorSource, AreasRoundTheWholeEarthKeepTheWorldInside) {
  const ScratchFolder folder;
  write_vectors(folder / "earth.gpkg", "GPKG",
                {{"POLYGON ((-180 -90, 180 -90, 180 90, -180 90, -180 -90), "
                  "(1.49 42.49, 1.51 42.49, 1.51 42.51, 1.49 42.51, 1.49 42.49))",
                  {}}});
  const VectorData data = read(folder / "earth.gpkg");
  ASSERT_EQ(data.features.size(), 1U);
  EXPECT_EQ(count_of(data, "features cut far from the world"), 1);
  const auto is_inside = [&](const Vector2d& p) {  // even-odd over all rings
    bool inside = false;
    for (const auto& part : data.features[0].parts_world)
      for (const auto& ring : part)
        for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++)
          if ((ring[i].y() > p.y()) != (ring[j].y() > p.y()) &&
              p.x() < (ring[j].x() - ring[i].x()) * (p.y() - ring[i].y()) /
                              (ring[j].y() - ring[i].y()) +
                          ring[i].x())
            inside = !inside;
    return inside;
  };
  EXPECT_TRUE(is_inside({5000.0, 5000.0}));
  EXPECT_TRUE(is_inside({-9000.0, 100.0}));
  EXPECT_FALSE(is_inside({0.0, 0.0}));
}

TEST(VectorSource, AHundredThousandFeaturesOutsideAreCounted) {
  const ScratchFolder folder;
  std::ofstream file(folder / "many.geojson");
  file << R"({"type":"FeatureCollection","features":[)" << json_point(1.5, 42.5);
  for (int i = 0; i < 100000; ++i) file << "," << json_point(10.0 + 1e-5 * i, 50.0);
  file << "]}";
  file.close();
  const VectorData data = read(folder / "many.geojson");
  EXPECT_EQ(data.features.size(), 1U);
  EXPECT_EQ(count_of(data, "features outside the world"), 100000);
  EXPECT_EQ(count_of(data, "features read"), 100001);
}

TEST(VectorSource, FeaturesBeyondTheMarginAreOutside) {
  const ScratchFolder folder;
  // x is 10 240 m at the border; a degree of longitude has 82.2 km here.
  const double border_deg = 10240.0 / (place_m(42.5, 1.6).x() / 0.1);
  write_text(folder / "near.geojson", geojson({json_point(1.5 + border_deg * 1.01, 42.5),
                                               json_point(1.5 + border_deg * 1.05, 42.5)}));
  EXPECT_EQ(read(folder / "near.geojson", {.margin_m = 200.0}).features.size(), 1U);
  EXPECT_EQ(read(folder / "near.geojson", {.margin_m = 1000.0}).features.size(), 2U);
}

TEST(VectorSource, AWrongCrsIsAnErrorThatSaysWhereThingsLie) {
  const ScratchFolder folder;
  const Vector2d utm = utm31(42.5, 1.5);
  const std::string point = fmt::format("POINT ({:.3f} {:.3f})", utm.x(), utm.y());
  write_vectors(folder / "zone33.gpkg", "GPKG", {{point, {}}}, "EPSG:32633");
  expect_error(ErrorKind::Input, {"none of its 1 features", "longitudes 13.5", "EPSG:32633"},
               [&] { read(folder / "zone33.gpkg"); });
  // Metres that are called degrees are no places at all.
  write_vectors(folder / "degrees.gpkg", "GPKG", {{point, {}}, {"POINT (1.5 42.5)", {}}});
  EXPECT_EQ(count_of(read(folder / "degrees.gpkg"), "features with places that are none"), 1);
  write_vectors(folder / "only.gpkg", "GPKG", {{point, {}}});
  expect_error(ErrorKind::Input, {"none of its 1 features", "on the Earth", "EPSG:4326"},
               [&] { read(folder / "only.gpkg"); });
  write_vectors(folder / "none.shp", "ESRI Shapefile", {{point, {{"a", "b"}}}}, "");
  expect_error(ErrorKind::Input, {"no coordinate reference system", "ogr2ogr -a_srs"},
               [&] { read(folder / "none.shp"); });
  write_vectors(folder / "axes.gpkg", "GPKG", {{"POINT (42.5 1.5)", {}}});
  expect_error(ErrorKind::Input, {"latitudes 1.5000"}, [&] { read(folder / "axes.gpkg"); });
}

/// A GeoJSON of a point, with what its member "crs" says before or behind the features.
std::string with_crs(const std::string& crs, const Vector2d& at, bool is_last = false) {
  const std::string member = "\"crs\":" + crs;
  return R"({"type":"FeatureCollection",)" + (is_last ? "" : member + ",") + R"("features":[)" +
         json_point(at.x(), at.y(), R"({"crs":"none, \"crs\":{","note":"] }"})") + "]" +
         (is_last ? "," + member : "") + "}\n";
}
std::string named_crs(const std::string& name) {
  return R"({"type":"name","properties":{"name":")" + name + R"("}})";
}

// Seen in November 2026: such files were called damaged or, where GDAL says nothing, were taken for
// WGS84.
TEST(VectorSource, ACrsThatIsNotKnownIsNamed) {
  const ScratchFolder folder;
  const auto refuses = [&](const std::string& crs, const std::string& shown) {
    for (const bool is_last : {false, true}) {
      write_text(folder / "points.geojson", with_crs(crs, {1.5, 42.5}, is_last));
      expect_error(ErrorKind::Input,
                   {"points.geojson: its coordinate reference system " + shown + " is not known",
                    "ogr2ogr -a_srs EPSG:…"},
                   [&] { read(folder / "points.geojson"); });
    }
  };
  for (const char* name :
       {"urn:ogc:def:crs:EPSG::999999", "EPSG:999999", "Town grid", "urn:city:grid:1"})
    refuses(named_crs(name), name);
  refuses(R"({"type":"EPSG","properties":{"code":999999}})", "EPSG:999999");
  refuses(R"({"type":"OGC","properties":{"urn":"urn:ogc:def:crs:EPSG::999999"}})",
          "urn:ogc:def:crs:EPSG::999999");
  const std::string and_then = ",\"crs\":";  // GDAL takes the last of several
  refuses(named_crs("EPSG:32631") + and_then + named_crs("EPSG:999999"), "EPSG:999999");
  // And in either case, the first.
  refuses(named_crs("EPSG:999999") + ",\"CRS\":" + named_crs("EPSG:32631"), "EPSG:999999");
  for (const char* text : {R"("EPSG:25831")", R"({"type":"name"})",
                           R"({"type":"strange","properties":{"name":"EPSG:25831"}})"})
    refuses(text, text);
  // A file is no name.
  write_text(folder / "system.wkt", "EPSG:25831");
  refuses(named_crs((folder / "system.wkt").string()), (folder / "system.wkt").string());

  // Other formats do not tell the name; what GDAL says of it is passed on.
  const auto says = [&](const std::string& file) {
    expect_error(ErrorKind::Input,
                 {file, "its coordinate reference system is not known (GDAL: ",
                  "state the right one with ogr2ogr -a_srs EPSG:…"},
                 [&] { read(folder / file); });
  };
  write_text(
      folder / "points.json",
      R"({"geometryType":"esriGeometryPoint","spatialReference":{"wkid":999999},"fields":[],)"
      R"("features":[{"attributes":{},"geometry":{"x":1.5,"y":42.5}}]})");
  says("points.json");
  write_vectors(folder / "points.shp", "ESRI Shapefile", {{"POINT (1.5 42.5)", {{"a", "b"}}}});
  write_text(folder / "points.prj", "PROJCS[\"Town grid\",GEOGCS[\"town\"");
  says("points.shp");
}

TEST(VectorSource, ACrsThatGeoJsonStatesIsTaken) {
  const ScratchFolder folder;
  const Vector2d utm = utm31(42.51, 1.52);
  const auto place_of = [&](const std::string& text) {
    write_text(folder / "points.geojson", text);
    return read(folder / "points.geojson").features.at(0).parts_world.at(0).at(0).at(0);
  };
  for (const bool is_last : {false, true}) {
    for (const std::string& crs :
         {named_crs("EPSG:32631"), named_crs("urn:ogc:def:crs:EPSG::32631"),
          named_crs("EPSG:999999") + ",\"crs\":" + named_crs("EPSG:32631"),
          named_crs("EPSG:32631") + ",\"Crs\":" + named_crs("EPSG:999999"),
          std::string(R"({"type":"EPSG","properties":{"code":32631}})"),
          std::string(R"({"type":"OGC","properties":{"urn":"urn:ogc:def:crs:EPSG::32631"}})")})
      EXPECT_LT((place_of(with_crs(crs, utm, is_last)) - place_m(42.51, 1.52)).norm(), 1e-4) << crs;
    for (const std::string& crs : {named_crs("urn:ogc:def:crs:OGC:1.3:CRS84"), std::string("null")})
      EXPECT_LT((place_of(with_crs(crs, {1.52, 42.51}, is_last)) - place_m(42.51, 1.52)).norm(),
                1e-6)
          << crs;
  }
}

TEST(VectorSource, FilesWithoutACrsAreRefused) {
  const ScratchFolder folder;
  // GeoPackage calls none "Undefined geographic SRS", which passed for WGS84 with a warning.
  for (const char* file : {"none.gpkg", "none.sqlite", "none.fgb"}) {
    const std::string name = file;
    const std::string driver = name.ends_with("gpkg")     ? "GPKG"
                               : name.ends_with("sqlite") ? "SQLite"
                                                          : "FlatGeobuf";
    write_vectors(folder / name, driver, {{"POINT (1.5 42.5)", {}}}, "");
    expect_error(ErrorKind::Input,
                 {name, "states no coordinate reference system; add it with ogr2ogr -a_srs EPSG:…"},
                 [&] { read(folder / name); });
  }
}

TEST(VectorSource, EmptyFilesAreCalledSo) {
  const ScratchFolder folder;
  for (const char* name :
       {"points.geojson", "points.shp", "points.gpkg", "points.osm.pbf", "points.zip"}) {
    write_text(folder / name, "");
    expect_error(ErrorKind::Input, {std::string(name) + ": is empty", "fetch or write it again"},
                 [&] { read(folder / name); });
  }
}

TEST(VectorSource, FeaturesWithoutPlacesAreCounted) {
  const ScratchFolder folder;
  write_vectors(folder / "bad.gpkg", "GPKG",
                {{"POINT (1.5 42.5)", {}},
                 {"POINT EMPTY", {}},
                 {"LINESTRING (1.5 42.5, 1.6 42.5)", {}, std::numeric_limits<double>::quiet_NaN()},
                 {"LINESTRING (1.5 42.5, 1.6 42.5)", {}, std::numeric_limits<double>::infinity()},
                 {"LINESTRING (1.5 42.5, 1.5 42.5)", {}},
                 {"POLYGON ((1.5 42.5, 1.501 42.5, 1.5 42.5))", {}}});
  const VectorData data = read(folder / "bad.gpkg");
  EXPECT_EQ(data.features.size(), 1U);
  EXPECT_EQ(count_of(data, "features without a geometry"), 1);
  EXPECT_EQ(count_of(data, "features with places that are none"), 2);
  EXPECT_EQ(count_of(data, "lines and rings of too few points"), 2);
}

TEST(VectorSource, APolygonOfAMillionPointsIsRead) {
  const ScratchFolder folder;
  std::ofstream file(folder / "big.geojson");
  file << R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{},"geometry":)"
       << R"({"type":"Polygon","coordinates":[[)";
  constexpr int kPoints = 1000000;
  for (int i = 0; i <= kPoints; ++i) {
    const double a = 2.0 * M_PI * (i % kPoints) / kPoints;
    file << fmt::format("{}[{:.10f},{:.10f}]", i == 0 ? "" : ",", 1.5 + 0.05 * std::cos(a),
                        42.5 + 0.05 * std::sin(a));
  }
  file << "]]}}]}";
  file.close();
  const VectorData data = read(folder / "big.geojson");
  ASSERT_EQ(data.features.size(), 1U);
  EXPECT_EQ(data.features[0].parts_world[0][0].size(), static_cast<std::size_t>(kPoints));
}

TEST(VectorSource, DamagedAndMisleadingFilesAreRefused) {
  const ScratchFolder folder;
  expect_error(ErrorKind::Io, {"there is no such file"}, [&] { read(folder / "missing.gpkg"); });
  write_text(folder / "text.geojson", "this is no GeoJSON");
  expect_error(ErrorKind::Input, {"cannot be opened as features"},
               [&] { read(folder / "text.geojson"); });
  const std::string whole = geojson({json_point(1.5, 42.5), json_point(1.51, 42.5)});
  write_text(folder / "cut.geojson", whole.substr(0, whole.size() - 60));
  expect_error(ErrorKind::Input, {"truncated"}, [&] { read(folder / "cut.geojson"); });
  write_text(folder / "points.geojson", whole);
  write_text(folder / "other.vrt",
             "<OGRVRTDataSource><OGRVRTLayer name=\"points\"><SrcDataSource>" +
                 (folder / "points.geojson").string() +
                 "</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>");
  expect_error(ErrorKind::Input, {"leads elsewhere"}, [&] { read(folder / "other.vrt"); });
  const core::Path outward{.written = "/vsizip/" + (folder / "a.zip").string() + "/../x.geojson",
                           .resolved = {}};
  write_text(folder / "a.zip", "");
  EXPECT_THROW(read_vectors(outward, {}, flat_world()), core::Error);
  expect_error(ErrorKind::Input, {"has no layer \"roads\"", "things"}, [&] {
    write_vectors(folder / "layers.gpkg", "GPKG", {{"POINT (1.5 42.5)", {}}});
    read(folder / "layers.gpkg", {.layers = {"roads"}});
  });
}

/// Writes a member of a zip by GDAL.
void write_zipped(const std::filesystem::path& archive, const std::string& member,
                  const std::string& text, int repeats = 1) {
  VSILFILE* file = VSIFOpenL(("/vsizip/" + archive.string() + "/" + member).c_str(), "wb");
  ASSERT_NE(file, nullptr);
  for (int i = 0; i < repeats; ++i)
    ASSERT_EQ(VSIFWriteL(text.data(), 1, text.size(), file), text.size());
  ASSERT_EQ(VSIFCloseL(file), 0);
}

TEST(VectorSource, ArchivesAreReadUnlessTheyAreBombs) {
  const ScratchFolder folder;
  write_zipped(folder / "points.zip", "points.geojson", geojson({json_point(1.5, 42.5)}));
  EXPECT_EQ(read(folder / "points.zip").features.size(), 1U);
  write_zipped(folder / "bomb.zip", "points.geojson", std::string(1 << 20, ' '), 300);
  EXPECT_LT(std::filesystem::file_size(folder / "bomb.zip"), 2U << 20);
  expect_error(ErrorKind::Input, {"unpacks from", "name the file"},
               [&] { read(folder / "bomb.zip"); });
}

TEST(VectorSource, ContentHashFollowsTheFilesBytes) {
  const ScratchFolder folder;
  const std::vector<VectorSpec> specs = {{"POINT (1.5 42.5)", {{"a", "b"}}}};
  write_vectors(folder / "a.shp", "ESRI Shapefile", specs);
  const std::string hash = read(folder / "a.shp").content_hash;
  EXPECT_EQ(read(folder / "a.shp").content_hash, hash);
  std::fstream dbf(folder / "a.dbf", std::ios::in | std::ios::out | std::ios::binary);
  dbf.seekp(-3, std::ios::end);
  dbf << "x";
  dbf.close();
  EXPECT_NE(read(folder / "a.shp").content_hash, hash);
}

TEST(VectorSource, AndorraIsReadWithItsOwnNumbersInTwoFormats) {
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra.osm.pbf");
  const geo::WorldFrame frame({.lat_deg = 42.54, .lon_deg = 1.5796, .height_m = 0.0});
  const tiler::VectorFrame world{.frame = frame,
                                 .size_m = 51200.0,
                                 .ground_height_m = [](const geo::Geodetic&) { return 1500.0; }};
  const auto is_building = [](const tiler::FeatureTags& tags) { return tags.has("building"); };
  const auto start = std::chrono::steady_clock::now();
  const VectorData pbf =
      read_vectors(path_of(shared_data() / "andorra/andorra.osm.pbf"),
                   {.points = false, .lines = false, .wanted = is_building}, world);
  const double taken_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  RecordProperty("seconds", std::to_string(taken_s));
  EXPECT_LT(taken_s, 20.0);  // 1 s alone on a machine
  const VectorData gpkg = read_vectors(path_of(shared_data() / "andorra/andorra_osm.gpkg"),
                                       {.layers = {"buildings"}, .wanted = is_building}, world);
  ASSERT_EQ(gpkg.features.size(), 4906U);
  std::map<std::uint64_t, const VectorFeature*> by_number;
  for (const VectorFeature& f : pbf.features) by_number[f.number] = &f;
  int num_found = 0;
  for (const VectorFeature& f : gpkg.features) {
    const auto at = by_number.find(f.number);
    if (at == by_number.end()) continue;
    ++num_found;
    ASSERT_EQ(at->second->parts_world.size(), f.parts_world.size());
    EXPECT_EQ(at->second->parts_world[0][0].size(), f.parts_world[0][0].size());
    EXPECT_EQ(at->second->tags.value("building:levels"), f.tags.value("building:levels"));
  }
  EXPECT_EQ(num_found, 4906);
}

}  // namespace
}  // namespace terracast::test
