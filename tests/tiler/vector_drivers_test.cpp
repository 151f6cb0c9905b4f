#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/expect_error.h"
#include "tests/tiler/vector_files.h"
#include "tiler/osm_census.h"
#include "tiler/osm_element.h"
#include "tiler/vector_source.h"

// What formats' readers pass over, and what they give in shapes of their own.
namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::OsmKind;
using tiler::VectorData;

VectorData read(const std::filesystem::path& file, const tiler::VectorOptions& options = {}) {
  static const geo::WorldFrame frame(
      {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg, .height_m = 0.0});
  return tiler::read_vectors(path_of(file), options,
                             {.frame = frame,
                              .size_m = 20480.0,
                              .ground_height_m = [](const geo::Geodetic&) { return 0.0; }});
}

std::map<std::string, std::int64_t> counts_of(const VectorData& data) {
  return {data.counts.begin(), data.counts.end()};
}

/// A square of 100 m about the tests' origin, moved east by steps of 0.01 degrees.
constexpr std::pair<double, double> kSquare[] = {
    {42.5, 1.5}, {42.5, 1.501}, {42.501, 1.501}, {42.501, 1.5}};

std::string node(int id, std::size_t corner, double east_deg, const std::string& more = "") {
  return fmt::format("<node id=\"{}\" lat=\"{:.7f}\" lon=\"{:.7f}\" {}/>\n", id,
                     kSquare[corner].first, kSquare[corner].second + east_deg, more);
}
std::string way(int id, const std::vector<int>& nodes, const std::string& more = "") {
  std::string text = fmt::format("<way id='{}' {}>\n", id, more);
  for (const int ref : nodes) text += fmt::format("  <nd ref=\"{}\"/>\n", ref);
  return text + "  <tag k=\"building\" v=\"yes\"/><tag k=\"height\" v=\"9\"/>\n</way>\n";
}
std::string osm(const std::string& elements) {
  return "<?xml version=\"1.0\"?>\n<osm version=\"0.6\">\n<!-- <node id=\"99\"> -->\n" + elements +
         "</osm>\n";
}
/// Four nodes from a number on, away from 0.
std::string nodes(int first, double east_deg) {
  std::string text;
  for (std::size_t i = 0; i < 4; ++i)
    text += node(first + (first < 0 ? -1 : 1) * static_cast<int>(i), i, east_deg);
  return text;
}

TEST(VectorDrivers, ElementsThatWereNeverUploadedAreRead) {
  const ScratchFolder folder;
  write_text(
      folder / "drawn.osm",
      osm(nodes(-1, 0.0) + nodes(-11, 0.01) + nodes(101, 0.02) + way(-21, {-1, -2, -3, -4, -1}) +
          way(-22, {-11, -12, -13, -14, -11}) + way(31, {101, 102, 103, 104, 101})));
  const VectorData data = read(folder / "drawn.osm", {.points = false, .lines = false});
  ASSERT_EQ(data.features.size(), 3U);
  std::map<std::uint64_t, std::string> heights;
  for (const auto& feature : data.features)
    heights[feature.number] = std::string(feature.tags.value("height"));
  EXPECT_EQ(heights.size(), 3U);  // each has a number of its own
  EXPECT_TRUE(heights.contains(tiler::osm_number(OsmKind::Way, 31)));
  for (const auto& [number, height] : heights) {
    EXPECT_EQ(height, "9");
    // Numbers below 0 are no element's.
    EXPECT_EQ(tiler::osm_element(number).has_value(),
              number == tiler::osm_number(OsmKind::Way, 31));
  }
  EXPECT_EQ(counts_of(data)["elements that were never uploaded (numbers below 0)"], 10);
  EXPECT_EQ(counts_of(data)["features numbered by OpenStreetMap"], 1);
}

TEST(VectorDrivers, ElementsThatAnEditorDeletedAreLeftOut) {
  const ScratchFolder folder;
  write_text(folder / "edited.osm",
             osm(nodes(1, 0.0) + nodes(11, 0.01) + nodes(21, 0.02) + way(31, {1, 2, 3, 4, 1}) +
                 way(32, {11, 12, 13, 14, 11}, "action='delete'") +
                 way(33, {21, 22, 23, 24, 21}, "visible=\"false\"")));
  const VectorData data = read(folder / "edited.osm", {.points = false, .lines = false});
  ASSERT_EQ(data.features.size(), 1U);
  EXPECT_EQ(data.features[0].number, tiler::osm_number(OsmKind::Way, 31));
  EXPECT_EQ(counts_of(data)["elements that an editor deleted, left out"], 2);
}

TEST(VectorDrivers, WhatAnExtractCutsIsCounted) {
  const ScratchFolder folder;
  const std::string relation =
      "<relation id='51'><member type='way' ref='31' role='outer'/><member type='way' ref='777' "
      "role='outer'/><tag k='type' v='multipolygon'/><tag k='building' v='yes'/></relation>\n"
      "<relation id='52'><member type='way' ref='778' role=''/><tag k='type' "
      "v='route'/></relation>\n";
  write_text(folder / "cut.osm",
             osm(nodes(1, 0.0) + way(31, {1, 2, 3, 4, 1}) + way(32, {1, 2, 900, 4, 1}) +
                 way(33, {901, 902, 903}) + relation));
  const auto counts = counts_of(read(folder / "cut.osm"));
  EXPECT_EQ(counts.at("ways without nodes in the file, left out"), 1);
  EXPECT_EQ(counts.at("ways of which the file lacks nodes, cut short"), 1);
  EXPECT_EQ(counts.at("areas of which the file lacks ways, cut or left out"), 1);
  const tiler::OsmCensus census = tiler::count_osm((folder / "cut.osm").string());
  EXPECT_EQ(census.num_nodes, 4);  // none of the comment
  EXPECT_EQ(census.num_ways, 3);
  EXPECT_EQ(census.num_areas, 1);
  EXPECT_TRUE(census.is_whole);
}

// Overpass writes what is asked for first, then what it needs: "out body; >; out skel qt;".
TEST(VectorDrivers, WaysBeforeTheirNodesAreReadWhateverTheFilesOrder) {
  const ScratchFolder folder;
  const std::string relation =
      "<relation id='51'><member type='way' ref='31' role='outer'/><tag k='type' "
      "v='multipolygon'/><tag k='building' v='yes'/></relation>\n";
  const std::string ways = way(31, {1, 2, 3, 4, 1}) + way(32, {11, 12, 13, 14, 11}) +
                           way(33, {901, 902, 903}) + way(34, {21, 22, 900, 24, 21});
  const std::string low = nodes(1, 0.0);
  const std::string high = nodes(11, 0.01) + nodes(21, 0.02);
  const auto numbers_of = [](const VectorData& data) {
    std::vector<std::uint64_t> numbers;
    for (const auto& feature : data.features) numbers.push_back(feature.number);
    return numbers;
  };
  write_text(folder / "sorted.osm", osm(low + high + ways + relation));
  const VectorData sorted = read(folder / "sorted.osm");
  ASSERT_EQ(sorted.features.size(), 3U);  // way 31 is in the relation
  for (const std::string& elements : {relation + ways + low + high, ways + high + low + relation,
                                      low + ways + relation + high, high + low + ways + relation}) {
    write_text(folder / "other.osm", osm(elements));
    const VectorData data = read(folder / "other.osm");
    EXPECT_EQ(numbers_of(data), numbers_of(sorted));
    auto counts = counts_of(data);
    EXPECT_EQ(counts, counts_of(sorted));
    EXPECT_EQ(counts["ways without nodes in the file, left out"], 1);
    EXPECT_EQ(counts["ways of which the file lacks nodes, cut short"], 1);
    EXPECT_FALSE(counts.contains("areas of which the file lacks ways, cut or left out"));
  }
}

// Such a query writes what it met by its tags, and once more as a skeleton what it met as a member.
TEST(VectorDrivers, ElementsThatStandTwiceAreReadOnceAndInFull) {
  const ScratchFolder folder;
  const std::string ways = way(31, {1, 2, 3, 4, 1}) + way(32, {11, 12, 13, 14, 11});
  const std::string low = nodes(1, 0.0), high = nodes(11, 0.01);
  const std::string skeleton = "<way id='31'><nd ref='1'/><nd ref='2'/></way>\n";
  const auto one_node = [&](const std::string& of) { return of.substr(0, of.find('\n') + 1); };
  for (const std::string& elements :
       {one_node(low) + ways + low + high, low + one_node(low) + high + ways,
        low + high + ways + high + low, ways + skeleton + high + low,
        skeleton + ways + low + high}) {
    SCOPED_TRACE(elements);
    write_text(folder / "twice.osm", osm(elements));
    const VectorData data = read(folder / "twice.osm");
    ASSERT_EQ(data.features.size(), 2U);
    for (const auto& feature : data.features) EXPECT_EQ(feature.tags.value("height"), "9");
    EXPECT_GE(counts_of(data).at("nodes and ways that stand there once more, of which one is read"),
              1);
  }
}

// The head of a file says what its bytes mean.
TEST(VectorDrivers, AFileThatIsPutInOrderKeepsItsEncoding) {
  const ScratchFolder folder;
  write_text(folder / "latin.osm",
             "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>\n<osm version=\"0.6\">\n"
             "<way id='31'><nd ref='1'/><nd ref='2'/><nd ref='3'/><nd ref='1'/>"
             "<tag k='building' v='yes'/><tag k='name' v='Caf\xE9'/></way>\n" +
                 nodes(1, 0.0) + "</osm>\n");
  const VectorData data = read(folder / "latin.osm");
  ASSERT_EQ(data.features.size(), 1U);
  EXPECT_EQ(data.features[0].tags.value("name"), "Caf\xC3\xA9");
}

// More than GDAL waits for: of ways that came first it gave a quarter.
TEST(VectorDrivers, ManyWaysBeforeTheirNodesAreAllRead) {
  const ScratchFolder folder;
  constexpr int kNum = 120'000;
  std::string ways;
  for (int i = 0; i < kNum; ++i)
    ways += fmt::format(
        "<way id=\"{}\"><nd ref=\"1\"/><nd ref=\"2\"/><nd ref=\"3\"/><nd ref=\"1\"/>"
        "<tag k=\"building\" v=\"yes\"/></way>",
        i + 1);
  write_text(folder / "many.osm", osm(ways + nodes(1, 0.0)));
  EXPECT_EQ(read(folder / "many.osm").features.size(), static_cast<std::size_t>(kNum));
}

TEST(VectorDrivers, AFileOfWhichNothingIsLeftIsAnErrorWithAWayOut) {
  const ScratchFolder folder;
  write_text(folder / "ways.osm", osm(way(31, {1, 2, 3, 4, 1}) + way(32, {5, 6, 7, 5})));
  expect_error(
      ErrorKind::Input,
      {"ways.osm", "none of its 2 ways has a place", "complete_ways", "(._;>;); out body;"},
      [&] { read(folder / "ways.osm"); });
  write_text(
      folder / "null.geojson",
      R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{"a":1},"geometry":null}]})");
  expect_error(ErrorKind::Input, {"null.geojson", "none of its 1 features has a geometry"},
               [&] { read(folder / "null.geojson"); });
}

// Protocol Buffers, by hand.
std::string varint(std::uint64_t value) {
  std::string bytes;
  while (value >= 128) {
    bytes += static_cast<char>(value % 128 + 128);
    value /= 128;
  }
  return bytes + static_cast<char>(value);
}
std::string field(int number, const std::string& content) {
  return varint(static_cast<std::uint64_t>(number) * 8 + 2) + varint(content.size()) + content;
}
std::string field(int number, std::uint64_t value) {
  return varint(static_cast<std::uint64_t>(number) * 8) + varint(value);
}
std::uint64_t zigzag(std::int64_t value) {
  return value < 0 ? static_cast<std::uint64_t>(-2 * value - 1)
                   : static_cast<std::uint64_t>(2 * value);
}
std::string steps_of(const std::vector<std::int64_t>& values) {
  std::string bytes;
  std::int64_t before = 0;
  for (const std::int64_t value : values) {
    bytes += varint(zigzag(value - before));
    before = value;
  }
  return bytes;
}
std::string blob(const std::string& kind, const std::string& content) {
  const std::string body = field(1, content);
  const std::string header = field(1, kind) + field(3, body.size());
  std::string size;
  for (int shift = 24; shift >= 0; shift -= 8)
    size += static_cast<char>(header.size() >> shift & 255);
  return size + header + body;
}
/// A file of one way about a square, whose nodes are there or whose places it holds itself.
std::string pbf(bool with_nodes, bool with_places, bool is_way_first = false) {
  std::string features =
      field(4, std::string("OsmSchema-V0.6")) + field(4, std::string("DenseNodes"));
  if (with_places) features += field(5, std::string("LocationsOnWays"));
  const std::string strings =
      field(1, std::string()) + field(1, std::string("building")) + field(1, std::string("yes"));
  std::vector<std::int64_t> ids = {1, 2, 3, 4};
  std::vector<std::int64_t> lats;
  std::vector<std::int64_t> lons;
  for (const auto& [lat, lon] : kSquare) {
    lats.push_back(std::llround(lat * 1e7));
    lons.push_back(std::llround(lon * 1e7));
  }
  std::string nodes;
  if (with_nodes)
    nodes = field(
        2, field(2, field(1, steps_of(ids)) + field(8, steps_of(lats)) + field(9, steps_of(lons))));
  for (auto* values : {&ids, &lats, &lons}) values->push_back(values->front());
  std::string way = field(1, std::uint64_t{77}) + field(2, varint(1)) + field(3, varint(2)) +
                    field(8, steps_of(ids));
  if (with_places) way += field(9, steps_of(lats)) + field(10, steps_of(lons));
  const std::string ways = field(2, field(3, way));
  const std::string groups = is_way_first ? ways + nodes : nodes + ways;
  return blob("OSMHeader", features) + blob("OSMData", field(1, strings) + groups);
}
void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

TEST(VectorDrivers, PlacesHeldByWaysThemselvesAreToldAndNotReadAsNone) {
  const ScratchFolder folder;
  write_bytes(folder / "right.osm.pbf", pbf(true, false));
  const VectorData right = read(folder / "right.osm.pbf");
  ASSERT_EQ(right.features.size(), 1U);
  EXPECT_EQ(right.features[0].number, tiler::osm_number(OsmKind::Way, 77));
  write_bytes(folder / "both.osm.pbf", pbf(true, true));  // --keep-untagged-nodes
  EXPECT_EQ(read(folder / "both.osm.pbf").features.size(), 1U);
  write_bytes(folder / "held.osm.pbf", pbf(false, true));
  expect_error(ErrorKind::Input,
               {"held.osm.pbf", "1 of its 1 ways hold their places themselves", "osmium export"},
               [&] { read(folder / "held.osm.pbf"); });
  write_bytes(folder / "none.osm.pbf", pbf(false, false));
  expect_error(ErrorKind::Input, {"none of its 1 ways has a place"},
               [&] { read(folder / "none.osm.pbf"); });
}

TEST(VectorDrivers, BinaryFilesInAnotherOrderAreRefusedWithAWayOut) {
  const ScratchFolder folder;
  write_bytes(folder / "turned.osm.pbf", pbf(true, false, true));
  expect_error(ErrorKind::Input,
               {"turned.osm.pbf", "1 of its ways and areas stand before", "osmium sort"},
               [&] { read(folder / "turned.osm.pbf"); });
}

// Whatever stands in a file, counting it ends, and stays in its bounds.
TEST(VectorDrivers, CensusOfDamagedFilesEnds) {
  const ScratchFolder folder;
  const std::string sound = pbf(true, true);
  for (std::size_t size = 0; size < sound.size(); size += 3) {
    write_bytes(folder / "cut.osm.pbf", sound.substr(0, size));
    EXPECT_LE(tiler::count_osm((folder / "cut.osm.pbf").string()).num_nodes, 4);
  }
  for (std::size_t at = 0; at < sound.size(); ++at) {
    std::string damaged = sound;
    damaged[at] = static_cast<char>(damaged[at] ^ 0xff);
    write_bytes(folder / "damaged.osm.pbf", damaged);
    EXPECT_LE(tiler::count_osm((folder / "damaged.osm.pbf").string()).num_ways, 1);
  }
  write_bytes(folder / "open.osm", "<osm><node id='1'" + std::string(3 << 20, ' '));
  EXPECT_FALSE(tiler::count_osm((folder / "open.osm").string()).is_whole);
  EXPECT_FALSE(tiler::count_osm((folder / "absent.osm").string()).is_whole);
}

// Nothing is dropped in silence, however deep it lies.
TEST(VectorDrivers, ObjectsNestedDeeplyAreKeptAsTextAndCounted) {
  const ScratchFolder folder;
  const auto nested = [](int levels) {
    std::string text = "7";
    for (int i = 0; i < levels; ++i) text = R"({"d":)" + text + "}";
    return text;
  };
  write_text(
      folder / "deep.geojson",
      R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{"height":"9","a":)" +
          nested(6) + R"(,"b":)" + nested(12) +
          R"(},"geometry":{"type":"Point","coordinates":[1.5,42.5]}}]})");
  const VectorData data = read(folder / "deep.geojson");
  ASSERT_EQ(data.features.size(), 1U);
  const tiler::FeatureTags& tags = data.features[0].tags;
  EXPECT_EQ(tags.value("height"), "9");
  EXPECT_EQ(tags.value("a.d.d.d.d.d.d"), "7");
  EXPECT_EQ(counts_of(data).at("values nested too deeply, not understood"), 1);
  EXPECT_EQ(std::count_if(tags.all().begin(), tags.all().end(),
                          [](const auto& tag) {
                            return tag.first.starts_with("b.d") &&
                                   tag.second.find("\"d\"") != std::string::npos;
                          }),
            1);
}

TEST(VectorDrivers, ListsFlagsAndObjectsOfGeoJsonAreTags) {
  const ScratchFolder folder;
  const auto feature = [](const std::string& properties) {
    return R"({"type":"Feature","properties":)" + properties +
           R"(,"geometry":{"type":"Point","coordinates":[1.5,42.5]}})";
  };
  write_text(
      folder / "a.geojson",
      R"({"type":"FeatureCollection","features":[)" +
          feature(
              R"({"names":["a","b"],"levels":[2,3],"heights":[1.5,2.5],"bridge":true,"oneway":false,)"
              R"("mixed":[1,"x",true],"tags":{"building":"yes","height":9.5,"lit":false},)"
              R"("meta":{"user":"somebody","deep":{"er":1}},"nothing":null,"empty":""})") +
          "]}");
  const VectorData data = read(folder / "a.geojson");
  ASSERT_EQ(data.features.size(), 1U);
  const tiler::FeatureTags& tags = data.features[0].tags;
  const std::vector<std::pair<std::string, std::string>> expected = {
      {"bridge", "yes"},    {"building", "yes"}, {"height", "9.5"},     {"heights", "1.5;2.5"},
      {"levels", "2;3"},    {"lit", "no"},       {"meta.deep.er", "1"}, {"meta.user", "somebody"},
      {"mixed", "1;x;yes"}, {"names", "a;b"},    {"oneway", "no"}};
  EXPECT_EQ(tags.all(), expected);
}

}  // namespace
}  // namespace terracast::test
