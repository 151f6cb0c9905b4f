// Files of recorded flights: each format's own conventions, and what is refused.

#include <gtest/gtest.h>

#include <numbers>

#include "geo/fixes/csv_table.h"
#include "geo/fixes/text.h"
#include "geo/fixes/times.h"
#include "tests/geo/fixes_support.h"

namespace terracast::geo {
namespace {

using test::format_from;
using test::message_of;

class Fixes : public test::Recordings {};

/// The forward and left axes of an attitude, in its frame.
Eigen::Vector3d forward(const Eigen::Quaterniond& q) { return q * Eigen::Vector3d::UnitX(); }
Eigen::Vector3d left(const Eigen::Quaterniond& q) { return q * Eigen::Vector3d::UnitY(); }

const double kHalf = std::sqrt(0.5);

TEST(FixText, TimesAreReadInTheFormsThatRecordersWrite) {
  // `date -u -d "2020-04-02 15:19:58" +%s`
  constexpr double kWhole = 1585840798.0;
  EXPECT_EQ(unix_seconds_from_text("2020-04-02T15:19:58Z", 3.0, "here"), kWhole);
  EXPECT_EQ(unix_seconds_from_text("2020-04-02 15:19:58", 5.0, "here"), kWhole - 5 * 3600);
  EXPECT_EQ(unix_seconds_from_text("2020.04.02 15:19:58", 0.0, "here"), kWhole);
  EXPECT_EQ(unix_seconds_from_text("2020-04-02T15:19:58+02:30", 0.0, "here"), kWhole - 9000);
  EXPECT_EQ(unix_seconds_from_text("2020-04-02T15:19:58-0100", 0.0, "here"), kWhole + 3600);
  EXPECT_NEAR(unix_seconds_from_text("2020-04-02 15:19:58,720,764", 0.0, "here"), kWhole + 0.720764,
              1e-6);
  EXPECT_NEAR(unix_seconds_from_text("2020-04-02 15:19:58.123456789", 0.0, "here"),
              kWhole + 0.123456789, 1e-6);
  for (const char* wrong :
       {"", "2020-04-02", "yesterday", "2020-13-02T00:00:00Z", "2020-04-02T15:19",
        "2020-04-02T15:19:58+2", "2020-04-02T25:00:00Z", "2020-04-02T15:19:58.123456789+2:00",
        "2020-04-02T15:19:58.123456789 CEST", "2020-04-02T15:19:58+99:00",
        "2020-04-02T15:19:58+02:60"})
    EXPECT_NE(
        message_of(core::ErrorKind::Input, [&] { unix_seconds_from_text(wrong, 0.0, "here"); })
            .find("here"),
        std::string::npos);
}

TEST(FixText, NumbersAreDecimalFiniteAndWhole) {
  EXPECT_EQ(number_of(" -12.5 "), -12.5);
  EXPECT_EQ(number_of("+3e2"), 300.0);
  for (const char* wrong : {"", "1,5", "nan", "inf", "1e999", "0x10", "12 m", "--1", "+-1"})
    EXPECT_FALSE(number_of(wrong)) << wrong;
}

TEST_F(Fixes, CsvTablesFollowTheRfc) {
  const auto file = written("t.csv",
                            "\xEF\xBB\xBF"
                            "a, b ,\"c \"\"q\"\", d\"\r\n1,2,\"x,\r\ny\"\r\n\r\n4,5,");
  const CsvTable table(file, ',');
  EXPECT_EQ(table.column_names(), (std::vector<std::string>{"a", "b", "c \"q\", d"}));
  ASSERT_EQ(table.num_rows(), 2u);
  EXPECT_EQ(table.cell(0, 2), "x,\r\ny");
  EXPECT_EQ(table.number(1, 0), 4.0);
  EXPECT_FALSE(table.number(1, 2));
  EXPECT_NE(table.where(1).find("line 5"), std::string::npos) << table.where(1);
  const auto broken = [&](const std::string& text) {
    return message_of(core::ErrorKind::Input, [&] { CsvTable(written("b.csv", text), ','); });
  };
  EXPECT_NE(broken("").find("empty"), std::string::npos);
  EXPECT_NE(broken("a,b\n1,2\n1,2,3\n").find("line 3: 3 fields"), std::string::npos);
  EXPECT_NE(broken("a,b\n1,\"2\n").find("line 2: a double quote"), std::string::npos);
  EXPECT_NE(message_of(core::ErrorKind::Input, [&] { table.column("bb"); }).find("a, b, c"),
            std::string::npos);
  message_of(core::ErrorKind::Io, [&] { CsvTable(scratch_ / "none.csv", ','); });
}

TEST_F(Fixes, CsvTakesItsUnitsAndFramesFromTheConfig) {
  const FixTable table = read("csv", R"(
separator = ";"
place_columns = ["lat", "lon", "alt"]
angle_unit = "rad"
length_unit = "ft"
time_column = "when"
time_unit = "unix_ms"
speed_column = "v"
speed_unit = "kn"
)",
                              "when;lat;lon;alt;v\n1000;0.5;-1.0;1000;100\n2000;;-1.0;1000;\n");
  ASSERT_EQ(table.fixes.size(), 2u);
  EXPECT_TRUE(table.has_utc());
  EXPECT_EQ(table.fixes[0].time_s, 1.0);
  EXPECT_NEAR(table.fixes[0].place.x(), 28.64788975654116, 1e-12);
  EXPECT_NEAR(table.fixes[0].place.y(), -57.29577951308232, 1e-12);
  EXPECT_NEAR(table.fixes[0].place.z(), 304.8, 1e-12);
  EXPECT_NEAR(*table.fixes[0].speed_mps, 51.44444444444444, 1e-12);
  EXPECT_FALSE(table.fixes[1].has_place());
  EXPECT_FALSE(table.fixes[1].speed_mps);
}

TEST_F(Fixes, CsvAttitudesLeadFromTheBodyToTheirFrame) {
  const std::string angles = R"(
place_columns = ["x", "y", "z"]
time_column = "t"
attitude_columns = ["yaw", "pitch", "roll"]
gimbal_columns = ["yaw", "pitch", "roll"]
)";
  // Heading east, the nose 30 degrees up, then banked to the right by 90.
  const FixTable ned =
      read("csv", angles, "t,x,y,z,yaw,pitch,roll\n0,0,0,0,90,30,0\n1,0,0,0,0,0,90\n");
  EXPECT_LT((forward(*ned.fixes[0].attitude) - Eigen::Vector3d(std::sqrt(0.75), 0, 0.5)).norm(),
            1e-15);
  EXPECT_LT((left(*ned.fixes[0].attitude) - Eigen::Vector3d(0, 1, 0)).norm(), 1e-15);
  EXPECT_LT((forward(*ned.fixes[1].gimbal) - Eigen::Vector3d(0, 1, 0)).norm(), 1e-15);
  EXPECT_LT((left(*ned.fixes[1].gimbal) - Eigen::Vector3d(0, 0, 1)).norm(), 1e-15);
  // The same east-north-up angles that OXTS takes: yaw anticlockwise from east.
  const FixTable enu = read("csv", angles + "attitude_axes = \"flu\"\nattitude_frame = \"enu\"\n",
                            "t,x,y,z,yaw,pitch,roll\n0,0,0,0,90,-30,0\n");
  EXPECT_LT((forward(*enu.fixes[0].attitude) - Eigen::Vector3d(0, std::sqrt(0.75), 0.5)).norm(),
            1e-15);
  // A camera that looks north, its right to the east, its down to the ground; and the inverse.
  const std::string camera = R"(
place_columns = ["x", "y", "z"]
time_column = "t"
attitude_columns = ["w", "i", "j", "k"]
attitude_axes = "rdf"
attitude_frame = "enu"
)";
  for (const bool is_inverse : {false, true}) {
    const FixTable rdf = read("csv", camera + (is_inverse ? "attitude_inverse = true\n" : ""),
                              fmt::format("t,x,y,z,w,i,j,k\n0,0,0,0,{:.17g},{:.17g},0,0\n", kHalf,
                                          is_inverse ? kHalf : -kHalf));
    EXPECT_LT((forward(*rdf.fixes[0].attitude) - Eigen::Vector3d(0, 1, 0)).norm(), 1e-15);
    EXPECT_LT((left(*rdf.fixes[0].attitude) - Eigen::Vector3d(-1, 0, 0)).norm(), 1e-15);
  }
  EXPECT_NE(refused("csv", camera, "t,x,y,z,w,i,j,k\n0,0,0,0,2,0,0,0\n").find("length 2"),
            std::string::npos);
}

TEST_F(Fixes, CsvRefusesWhatItCannotRead) {
  EXPECT_NE(refused("csv", "", "time,latitude_deg,longitude_deg,height_m\n").find("\"time_s\""),
            std::string::npos);
  const std::string header = "time_s,latitude_deg,longitude_deg,height_m\n";
  EXPECT_NE(refused("csv", "", header + "0,1,2,3\n1,x,2,3\n").find("line 3: latitude_deg = \"x\""),
            std::string::npos);
  EXPECT_NE(refused("csv", "", header + "0,1,2,3\n1,1,inf,3\n")
                .find("line 3: longitude_deg = \"inf\" is no number"),
            std::string::npos);
  for (const char* nothing : {"", "NA", "null", "nan", "NaN"}) {
    const FixTable table = read("csv", "", header + "0,1,2,3\n1,1," + nothing + ",3\n");
    EXPECT_FALSE(table.fixes.at(1).has_place()) << nothing;
    EXPECT_EQ(table.empty.at("longitude_deg"), 1u) << nothing;
  }
  EXPECT_NE(refused("csv", "time_unit = \"text\"\n", header + "noon,1,2,3\n").find("line 2"),
            std::string::npos);
  message_of(core::ErrorKind::Config,
             [] { format_from("csv", "attitude_columns = [\"a\", \"b\"]"); });
  message_of(core::ErrorKind::Config, [] { format_from("csv", "gimbal_columns = [\"a\"]"); });
}

TEST_F(Fixes, GpxHoldsTracksWhoseSegmentsAreParts) {
  const FixTable table = read("gpx", "", R"(<?xml version="1.0"?>
<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1">
<wpt lat="1" lon="2"/>
<trk><trkseg></trkseg><trkseg>
<trkpt lat="46.5" lon="13.25"><ele>1614.5</ele><time>2010-10-03T09:36:30Z</time></trkpt>
<trkpt lat="46.5" lon="13.25"><time>2010-10-03T09:36:31Z</time></trkpt>
</trkseg></trk><trk><trkseg><trkpt lat="-46" lon="-13"><ele>2</ele></trkpt></trkseg></trk></gpx>)");
  ASSERT_EQ(table.fixes.size(), 3u);
  EXPECT_TRUE(table.has_utc());
  EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(46.5, 13.25, 1614.5));
  EXPECT_EQ(table.fixes[0].time_s, 1286098590.0);  // date -u -d 2010-10-03T09:36:30Z +%s
  EXPECT_FALSE(table.fixes[1].has_place());
  EXPECT_TRUE(std::isnan(table.fixes[2].time_s));
  EXPECT_TRUE(table.fixes[0].starts_part);
  EXPECT_FALSE(table.fixes[1].starts_part);
  EXPECT_TRUE(table.fixes[2].starts_part);
  EXPECT_NE(refused("gpx", "", "<gpx>\n<trk>\n<trkseg>").find("not XML"), std::string::npos);
  EXPECT_NE(refused("gpx", "", "<kml/>").find("<gpx>"), std::string::npos);
  EXPECT_NE(
      refused("gpx", "",
              "<gpx><trk><trkseg>\n<trkpt lon=\"1\"><ele>1</ele></trkpt></trkseg></trk></gpx>")
          .find("point 0 (counted from 0): lat"),
      std::string::npos);
  // A document type that would blow its entities up is not expanded.
  EXPECT_NE(
      refused("gpx", "", R"(<!DOCTYPE g [<!ENTITY a "x"><!ENTITY b "&a;&a;">]><gpx>&b;</gpx>)")
          .find("no points of tracks"),
      std::string::npos);
}

TEST_F(Fixes, TumHoldsPosesOfACamera) {
  const FixTable table =
      read("tum", "",
           fmt::format("# timestamp tx ty tz qx qy qz qw\n\n1.5 1 2 3 {:.17g} 0 0 {:.17g}\n",
                       -kHalf, kHalf));
  ASSERT_EQ(table.fixes.size(), 1u);
  EXPECT_EQ(table.frame, FixFrame::Local);
  EXPECT_EQ(table.fixes[0].time_s, 1.5);
  EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(1, 2, 3));
  // A quarter turn back about x stands the camera's z up along the file's y.
  EXPECT_LT((forward(*table.fixes[0].attitude) - Eigen::Vector3d(0, 1, 0)).norm(), 1e-15);
  // Where a tracker was lost.
  const FixTable lost = read("tum", "", "1 nan nan nan nan nan nan nan\n2 1 2 3 0 0 0 1\n");
  EXPECT_FALSE(lost.fixes.at(0).has_place());
  EXPECT_FALSE(lost.fixes.at(0).attitude);
  EXPECT_TRUE(lost.fixes.at(1).has_place());
  EXPECT_EQ(lost.empty.at("qw"), 1u);
  EXPECT_NE(refused("tum", "", "1 0 0 0 0 1 0 0 0 0 1 0\n").find("twelve of a matrix"),
            std::string::npos);
  EXPECT_NE(refused("tum", "unix_times = true", "1585840798000 2 3 4 0 0 0 1\n")
                .find("unix_times = false"),
            std::string::npos);
  EXPECT_NE(refused("tum", "", "1 2 3 4 5 6 7\n").find("line 1"), std::string::npos);
  EXPECT_NE(refused("tum", "", "0 0 0 0 0 0 0 0\n").find("quaternion"), std::string::npos);
}

TEST_F(Fixes, OxtsHoldsEllipsoidalHeightsAndEastNorthUpAngles) {
  std::string packet = "49.01 8.43 112.8 0.1 0.2 1.5707963267948966 3.0 4.0";
  for (int i = 8; i < 30; ++i) packet += " 0";
  written("oxts/data/0000000000.txt", packet + "\n");
  written("oxts/data/0000000001.txt", packet + "\n");
  written("oxts/timestamps.txt", "2011-09-26 13:02:25.964389445\n2011-09-26 13:02:26.064389445\n");
  const auto format = format_from("oxts", "");
  EXPECT_EQ(format->heights_above(), "ellipsoid");
  const FixTable table = format->read(scratch_ / "oxts", "ellipsoid");
  ASSERT_EQ(table.fixes.size(), 2u);
  EXPECT_NEAR(table.fixes[1].time_s - table.fixes[0].time_s, 0.1, 1e-15);
  EXPECT_EQ(table.zero_unix_s, 1317042145.0);
  EXPECT_NEAR(table.fixes[0].time_s, 0.964389445, 1e-15);
  EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(49.01, 8.43, 112.8));
  EXPECT_EQ(*table.fixes[0].speed_mps, 5.0);
  // Yaw 90 degrees is north, pitch + is the front down, roll + the left side up.
  const Eigen::Vector3d ahead = forward(*table.fixes[0].attitude);
  EXPECT_NEAR(ahead.y(), std::cos(0.2), 1e-12);
  EXPECT_NEAR(ahead.z(), -std::sin(0.2), 1e-12);
  EXPECT_NEAR(left(*table.fixes[0].attitude).z(), std::sin(0.1) * std::cos(0.2), 1e-12);
  written("oxts/data/0000000002.txt", packet + "\n");
  EXPECT_NE(message_of(core::ErrorKind::Input, [&] { format->read(scratch_ / "oxts", ""); })
                .find("2 times"),
            std::string::npos);
  written("oxts/timestamps.txt",
          "2011-09-26 13:02:25.0\n2011-09-26 13:02:26.0\n2011-09-26 13:02:27.0\n");
  written("oxts/data/0000000002.txt", "1 2 3\n");
  EXPECT_NE(message_of(core::ErrorKind::Input, [&] { format->read(scratch_ / "oxts", ""); })
                .find("3 numbers"),
            std::string::npos);
  message_of(core::ErrorKind::Io, [&] { format->read(scratch_ / "nowhere", ""); });
}

const char* const kPhantom = R"(1
00:00:01,500 --> 00:00:02,000
F/5.6, SS 400, ISO 100, EV 0, GPS (-58.85, -34.25, 15), HOME (-58.75, -34.5, -57.98m), D 698.70m, H 85.80m, H.S 2.88m/s, V.S 0.00m/s, F.PRY (2.0°, -7.0°, 90.0°), G.PRY (-24.0°, 0.0°, 180.0°)

)";

TEST_F(Fixes, SrtOfAPhantomStatesItsOrder) {
  EXPECT_NE(refused("srt", "", kPhantom, core::ErrorKind::Config).find("order = \"lon_lat\""),
            std::string::npos);
  const FixTable table = read("srt", "order = \"lon_lat\"", kPhantom, "home");
  ASSERT_EQ(table.fixes.size(), 1u);
  const Fix& fix = table.fixes[0];
  EXPECT_EQ(fix.time_s, 1.5);
  EXPECT_FALSE(table.has_utc());
  EXPECT_EQ(fix.place, Eigen::Vector3d(-34.25, -58.85, 85.80));
  EXPECT_EQ(table.home, (Geodetic{-34.5, -58.75, 0.0}));
  EXPECT_EQ(*fix.speed_mps, 2.88);
  // The body looks east, the camera south and 24 degrees down.
  EXPECT_GT(forward(*fix.attitude).x(), 0.99);
  EXPECT_NEAR(left(*fix.attitude).z(),
              -std::sin(7.0 * std::numbers::pi / 180) * std::cos(2.0 * std::numbers::pi / 180),
              1e-12);
  EXPECT_NEAR(forward(*fix.gimbal).y(), -std::cos(24.0 * std::numbers::pi / 180), 1e-12);
  EXPECT_NEAR(forward(*fix.gimbal).z(), -std::sin(24.0 * std::numbers::pi / 180), 1e-12);
  EXPECT_EQ(read("srt", "order = \"lat_lon\"", kPhantom, "home").fixes[0].place,
            Eigen::Vector3d(-58.85, -34.25, 85.80));
  // It writes no height of its own.
  EXPECT_NE(message_of(core::ErrorKind::Config,
                       [&] { read("srt", "order = \"lon_lat\"", kPhantom, "ellipsoid"); })
                .find("above = \"home\""),
            std::string::npos);
}

TEST_F(Fixes, SrtOfAMavicNamesItsNumbersAndHasADate) {
  const char* text = R"(1
00:00:00,000 --> 00:00:00,016
<font size="36">FrameCnt : 1, DiffTime : 16ms
2020-04-02 15:19:58,720,764
[iso : 100] [latitude : 31.452012] [longtitude : 74.398751] [altitude: 213.983002] </font>

2
00:00:00,016 --> 00:00:00,033
2020-04-02 15:19:58,737,447
[latitude: 31.5] [longitude: 74.5] [rel_alt: 85.500 abs_alt: 200.125] [gb_yaw: 90.0 gb_pitch: -90.0 gb_roll: 0.0]
)";
  const FixTable table = read("srt", "utc_offset_h = 5.0", text);
  ASSERT_EQ(table.fixes.size(), 2u);
  EXPECT_TRUE(table.has_utc());
  EXPECT_NEAR(table.fixes[0].time_s, 1585840798.720764 - 5 * 3600, 1e-6);
  EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(31.452012, 74.398751, 213.983002));
  EXPECT_EQ(table.fixes[1].place, Eigen::Vector3d(31.5, 74.5, 200.125));
  EXPECT_NEAR(forward(*table.fixes[1].gimbal).z(), -1.0, 1e-15);
  EXPECT_NE(refused("srt", "", "WEBVTT\n\nhello\n").find("no subtitle"), std::string::npos);
}

TEST_F(Fixes, SrtWithoutAPlaceYetHoldsZeros) {
  const char* text = R"(1
00:00:00,000 --> 00:00:01,000
[latitude: 0.000000] [longitude: 0.000000] [rel_alt: 0.000 abs_alt: 0.000]

2
00:00:01,000 --> 00:00:02,000
[latitude: 42.5] [longitude: 1.5] [rel_alt: 5.000 abs_alt: 1005.000]
)";
  const FixTable table = read("srt", "", text, "home");
  ASSERT_EQ(table.fixes.size(), 2u);
  EXPECT_FALSE(table.fixes[0].has_place());
  EXPECT_EQ(table.fixes[1].place, Eigen::Vector3d(42.5, 1.5, 5.0));
}

TEST_F(Fixes, SrtOfOlderAircraftHasABarometer) {
  const char* text = R"(1
00:00:01,000 --> 00:00:02,000
HOME(149.0251,-20.2532) 2017.08.05 14:11:51
GPS(149.0252,-20.2533,16) BAROMETER:1.9
ISO:100 Shutter:60 EV: Fnum:2.2
)";
  const FixTable table = read("srt", "order = \"lon_lat\"", text, "home");
  EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(-20.2533, 149.0252, 1.9));
  EXPECT_EQ(table.home, (Geodetic{-20.2532, 149.0251, 0.0}));
  EXPECT_EQ(table.fixes[0].time_s, 1501942311.0);  // date -u -d "2017-08-05 14:11:51" +%s
}

TEST_F(Fixes, AdsbTellsItsTwoAltitudesApart) {
  const std::string text =
      "timestamp_utc,callsign,latitude_deg,longitude_deg,baro_altitude_ft,geo_altitude_ft,"
      "groundspeed_kt,track_deg,vertical_rate_ftmin\n"
      "2022-03-25T07:51:08.000Z,SAVAN09,43.0,1.0,10000,10500,208,202,0\n"
      "2022-03-25T07:51:09.000Z,SAVAN09,43.0,1.0,10000,,208,202,0\n";
  const FixTable geometric = read("adsb", "", text, "ellipsoid");
  EXPECT_NEAR(geometric.fixes[0].place.z(), 3200.4, 1e-9);
  EXPECT_FALSE(geometric.fixes[1].has_place());
  EXPECT_NEAR(read("adsb", "", text, "pressure").fixes[1].place.z(), 3048.0, 1e-9);
  EXPECT_NEAR(*geometric.fixes[0].speed_mps, 107.00444444444, 1e-9);
  EXPECT_NE(message_of(core::ErrorKind::Config, [&] { read("adsb", "", text, "egm96"); })
                .find("pressure_offset_m"),
            std::string::npos);
}

TEST_F(Fixes, AdsbKnowsOpenSkysStateVectorsAndAsksForOneAircraft) {
  const std::string text =
      "time,icao24,lat,lon,velocity,heading,vertrate,callsign,baroaltitude,geoaltitude\n"
      "1648194668,aa01,43.0,1.0,100.5,20,0,ONE,3000,3100\n"
      "1648194669,bb02,44.0,2.0,100.5,20,0,TWO,3000,3200\n";
  EXPECT_NE(refused("adsb", "", text).find("aa01 (1 rows), bb02 (1 rows)"), std::string::npos);
  for (const char* aircraft : {"bb02", "TWO"}) {
    const FixTable table = read("adsb", fmt::format("aircraft = \"{}\"", aircraft), text);
    ASSERT_EQ(table.fixes.size(), 1u);
    EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(44.0, 2.0, 3200.0));
    EXPECT_EQ(*table.fixes[0].speed_mps, 100.5);
  }
  // Call signs are often empty, and change from flight to flight.
  const std::string head = text.substr(0, text.find('\n') + 1);
  EXPECT_NE(refused("adsb", "",
                    head + "1,aa01,43.0,1.0,100.5,20,0,ONE,3000,3100\n"
                           "2,bb02,44.0,2.0,100.5,20,0,,3000,3200\n")
                .find("bb02"),
            std::string::npos);
  EXPECT_EQ(read("adsb", "",
                 head + "1,aa01,43.0,1.0,100.5,20,0,ONE,3000,3100\n"
                        "2,aa01,43.0,1.0,100.5,20,0,,3000,3100\n"
                        "3,aa01,43.0,1.0,100.5,20,0,TWO,3000,3100\n")
                .fixes.size(),
            3u);
  EXPECT_NE(refused("adsb", "aircraft = \"cc03\"", text).find("aa01"), std::string::npos);
  EXPECT_NE(refused("adsb", "", "a,b\n1,2\n").find("format = \"csv\""), std::string::npos);
}

TEST_F(Fixes, TablesWithoutTheWantedAltitudeSayWhatElseThereIs) {
  const std::string message =
      refused("adsb", "",
              "timestamp_utc,latitude_deg,longitude_deg,baro_altitude_ft,"
              "geo_altitude_ft\n2022-03-25T07:51:08.000Z,43.0,1.0,10000,\n");
  EXPECT_NE(message.find("above = \"pressure\""), std::string::npos) << message;
}

TEST_F(Fixes, DamagedFilesOfEveryFormatEndInAnError) {
  // Bytes of no format; each reader refuses them or finds no fix.
  std::string bytes;
  for (int i = 0; i < 4096; ++i) bytes += static_cast<char>((i * 7919 + i / 13) & 0xff);
  for (const FixFormatInfo& info : fix_formats()) {
    try {
      const FixTable table = info.make()->read(written("noise", bytes), "ellipsoid");
      for (const Fix& fix : table.fixes) EXPECT_FALSE(fix.has_place()) << info.name;
    } catch (const core::Error& error) {
      EXPECT_TRUE(error.kind() == core::ErrorKind::Input || error.kind() == core::ErrorKind::Io)
          << info.name << ": " << error.what();
    }
  }
}

}  // namespace
}  // namespace terracast::geo
