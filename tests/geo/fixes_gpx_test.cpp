// GPX as it is written in the wild: namespaces, what stands beside tracks, empty elements, extensions.

#include "tests/geo/fixes_support.h"

namespace terracast::geo {
namespace {

using test::remarks_of;
using testing::Test;

class GpxFiles : public test::Recordings {
 protected:
  /// A track of one segment, with what a point holds.
  static std::string track(const std::string& points) {
    return "<gpx version=\"1.1\"><trk><trkseg>" + points + "</trkseg></trk></gpx>";
  }
  static std::string point(const std::string& inside) {
    return "<trkpt lat=\"46.5\" lon=\"13.25\">" + inside + "</trkpt>";
  }
};

TEST_F(GpxFiles, NamesAreTheSameInAnyNamespaceAndWithAnyPrefix) {
  const std::string inside =
      "<{0}trk><{0}trkseg><{0}trkpt lat=\"46.5\" lon=\"13.25\"><{0}ele>7</{0}ele>"
      "<{0}time>2010-10-03T09:36:30Z</{0}time></{0}trkpt></{0}trkseg></{0}trk>";
  struct Case {
    const char* prefix;
    const char* declared;
  };
  for (const Case& one :
       {Case{"", ""}, Case{"", "xmlns=\"http://www.topografix.com/GPX/1/0\""},
        Case{"", "xmlns=\"http://www.topografix.com/GPX/1/1\""},
        Case{"g:", "xmlns:g=\"http://www.topografix.com/GPX/1/1\""},
        Case{"ns0:", "xmlns:ns0=\"http://www.topografix.com/GPX/1/0\""}, Case{"gpx:", ""}}) {
    const std::string form = "<{0}gpx {1}>" + inside + "</{0}gpx>";
    const std::string text = fmt::format(fmt::runtime(form), one.prefix, one.declared);
    const FixTable table = read("gpx", "", text);
    ASSERT_EQ(table.fixes.size(), 1u) << text;
    EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(46.5, 13.25, 7.0)) << text;
    EXPECT_EQ(table.fixes[0].time_s, 1286098590.0) << text;  // date -u -d 2010-10-03T09:36:30Z +%s
    EXPECT_TRUE(table.ledger.warnings().empty()) << table.ledger.table();
  }
}

TEST_F(GpxFiles, TwoPrefixesOfOneNamespaceAreOneAndAnotherNamespaceIsNot) {
  const std::string text =
      "<gpx xmlns=\"u\" xmlns:a=\"u\" xmlns:b=\"v\"><a:trk><trkseg><a:trkpt lat=\"1\" lon=\"2\">"
      "<b:ele>900</b:ele><a:ele>3</a:ele></a:trkpt><b:trkpt lat=\"5\" "
      "lon=\"6\"/></trkseg></a:trk></gpx>";
  const FixTable table = read("gpx", "", text);
  ASSERT_EQ(table.fixes.size(), 1u);
  EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(table.ledger.entries().at("point/b:ele").num_unknown, 1);
  EXPECT_EQ(table.ledger.entries().at("trkseg/b:trkpt").num_unknown, 1);
}

TEST_F(GpxFiles, EmptyElementsAreNotThereAndAreCounted) {
  for (const char* empty : {"<ele/>", "<ele></ele>", "<ele> \n </ele>"}) {
    const FixTable table =
        read("gpx", "", track(point("<ele>7</ele>") + point(empty) + point("<ele>8</ele>")));
    ASSERT_EQ(table.fixes.size(), 3u);
    EXPECT_TRUE(table.fixes[1].has_level_place());
    EXPECT_FALSE(table.fixes[1].has_place());
    EXPECT_EQ(table.empty.at("point/ele"), 1u);
  }
  const FixTable times = read("gpx", "", track(point("<time/>") + point("<time> </time>")));
  EXPECT_TRUE(std::isnan(times.fixes[0].time_s));
  EXPECT_EQ(times.empty.at("point/time"), 2u);
  const FixTable nowhere = read("gpx", "", track("<trkpt lat=\"\" lon=\"1\"/>" + point("")));
  EXPECT_FALSE(nowhere.fixes.at(0).has_level_place());
  EXPECT_EQ(nowhere.empty.at("point@lat"), 1u);
  // What is there and is wrong is refused, with the line.
  EXPECT_NE(refused("gpx", "", track("\n\n" + point("<ele>high</ele>"))).find("line 3, point 0"),
            std::string::npos);
  EXPECT_NE(refused("gpx", "", track(point("<ele>7,5</ele>"))).find("decimal comma"),
            std::string::npos);
  EXPECT_NE(refused("gpx", "", track(point("<time>noon</time>"))).find("\"noon\" is no time"),
            std::string::npos);
}

TEST_F(GpxFiles, RoutesAreFlownWhereThereAreNoTracksAndWaypointsWherePointsSaysSo) {
  const std::string route =
      "<rte><name>r</name><rtept lat=\"1\" lon=\"2\"><ele>3</ele></rtept>"
      "<rtept lat=\"1\" lon=\"3\"><ele>3</ele></rtept></rte>";
  const std::string waypoints = "<wpt lat=\"7\" lon=\"8\"><ele>9</ele></wpt>";
  const std::string all = "<gpx>" + waypoints + route + "<trk><trkseg>" + point("<ele>4</ele>") +
                          "</trkseg></trk></gpx>";
  const FixTable tracks = read("gpx", "", all);
  ASSERT_EQ(tracks.fixes.size(), 1u);
  EXPECT_EQ(tracks.fixes[0].place.z(), 4.0);
  EXPECT_EQ(tracks.ledger.entries().at("rte").num_ignored, 1);
  EXPECT_EQ(tracks.ledger.entries().at("wpt").num_ignored, 1);
  EXPECT_NE(remarks_of(tracks).find("2 points of routes"), std::string::npos);
  const FixTable routes = read("gpx", "", "<gpx>" + waypoints + route + route + "</gpx>");
  ASSERT_EQ(routes.fixes.size(), 4u);
  EXPECT_TRUE(routes.fixes[2].starts_part);
  EXPECT_FALSE(routes.fixes[3].starts_part);
  EXPECT_NE(remarks_of(routes).find("the routes are flown"), std::string::npos);
  EXPECT_EQ(read("gpx", "points = \"waypoints\"", all).fixes.at(0).place.z(), 9.0);
  // The message names what is there, and its way out works.
  const std::string only_waypoints = "<gpx>" + waypoints + waypoints + "</gpx>";
  const std::string message = refused("gpx", "", only_waypoints);
  EXPECT_NE(message.find("no tracks in it; it holds 2 points of waypoints"), std::string::npos)
      << message;
  ASSERT_NE(message.find("points = \"waypoints\""), std::string::npos) << message;
  EXPECT_EQ(read("gpx", "points = \"waypoints\"", only_waypoints).fixes.size(), 2u);
  EXPECT_NE(refused("gpx", "points = \"routes\"", track(point(""))).find("points = \"tracks\""),
            std::string::npos);
}

TEST_F(GpxFiles, SpeedsOfGpx10AndOfKnownExtensionsAreReadAndOthersAreNot) {
  EXPECT_EQ(*read("gpx", "", track(point("<speed>2.5</speed>"))).fixes[0].speed_mps, 2.5);
  const auto with_extension = [&](const std::string& address) {
    return read(
        "gpx", "",
        "<gpx xmlns=\"http://www.topografix.com/GPX/1/1\" xmlns:x=\"" + address +
            "\"><trk><trkseg><trkpt lat=\"1\" lon=\"2\"><extensions><x:TrackPointExtension>"
            "<x:hr>120</x:hr><x:speed>3.5</x:speed></x:TrackPointExtension></extensions></trkpt>"
            "</trkseg></trk></gpx>");
  };
  const FixTable garmin = with_extension("http://www.garmin.com/xmlschemas/TrackPointExtension/v2");
  EXPECT_EQ(*garmin.fixes[0].speed_mps, 3.5);
  EXPECT_EQ(garmin.ledger.entries().at("extensions/hr").num_ignored, 1);
  EXPECT_TRUE(garmin.ledger.warnings().empty()) << garmin.ledger.table();
  // In whose unit nobody said.
  const FixTable other = with_extension("http://example.com/knots");
  EXPECT_FALSE(other.fixes[0].speed_mps);
  EXPECT_EQ(other.ledger.entries().at("extensions/x:speed").num_unknown, 1);
  EXPECT_EQ(*read("gpx", "", track(point("<extensions><speed>4</speed></extensions>")))
                 .fixes[0]
                 .speed_mps,
            4.0);
}

TEST_F(GpxFiles, ExtensionsOfATrackAreNotThoseOfItsPoints) {
  const FixTable table =
      read("gpx", "",
           "<gpx><extensions><speed>1</speed></extensions><trk><extensions><speed>2"
           "</speed><color>red</color></extensions><trkseg>" +
               point("") + "</trkseg></trk></gpx>");
  EXPECT_FALSE(table.fixes[0].speed_mps);
  EXPECT_EQ(table.ledger.entries().at("gpx/extensions/speed").num_unknown, 1);
  EXPECT_EQ(table.ledger.entries().at("trk/extensions/speed").num_unknown, 1);
  EXPECT_EQ(table.ledger.entries().at("trk/extensions/color").num_ignored, 1);
}

TEST_F(GpxFiles, ExtensionsOfAnyDepthAreCountedWithoutRecursion) {
  constexpr int kDepth = 20000;
  std::string deep;
  for (int i = 0; i < kDepth; ++i) deep += "<y>";
  for (int i = 0; i < kDepth; ++i) deep += "</y>";
  const FixTable table = read("gpx", "", track(point("<extensions>" + deep + "</extensions>")));
  EXPECT_EQ(table.ledger.entries().at("extensions/y").num_unknown, kDepth);
}

TEST_F(GpxFiles, TracksWithoutSegmentsAreAPart) {
  const FixTable table = read(
      "gpx", "", "<gpx><trk>" + point("") + point("") + "</trk><trk>" + point("") + "</trk></gpx>");
  ASSERT_EQ(table.fixes.size(), 3u);
  EXPECT_FALSE(table.fixes[1].starts_part);
  EXPECT_TRUE(table.fixes[2].starts_part);
}

TEST_F(GpxFiles, TimesWithoutAZoneAreUtcAndTold) {
  const FixTable table = read("gpx", "",
                              track(point("<time>2010-10-03T09:36:30</time>") +
                                    point("<time>2010-10-03T11:36:31+02:00</time>")));
  EXPECT_EQ(table.fixes[0].time_s, 1286098590.0);
  EXPECT_EQ(table.fixes[1].time_s, 1286098591.0);
  EXPECT_NE(remarks_of(table).find("1 times state no zone"), std::string::npos);
}

}  // namespace
}  // namespace terracast::geo
