// Tables as they are written in the wild: separators, decimal commas, comments, times in any unit, angles in words.

#include "geo/fixes/angles.h"
#include "geo/fixes/column_units.h"
#include "geo/fixes/csv_times.h"
#include "geo/fixes/times.h"
#include "tests/geo/fixes_support.h"

namespace terracast::geo {
namespace {

using test::format_from;
using test::message_of;
using test::remarks_of;

class CsvFiles : public test::Recordings {};

/// Of the first fix; on the file's own clock where it is not UTC.
double unix_s(const FixTable& table) {
  return table.zero_unix_s.value_or(0.0) + table.fixes.at(0).time_s;
}

const std::string kHeader = "time_s,latitude_deg,longitude_deg,height_m\n";

TEST(FixAngles, AreReadAsMapsWriteThem) {
  // 46 + 30/60 + 12/3600.
  constexpr double k46 = 46.0 + 30.0 / 60.0 + 12.0 / 3600.0;
  for (const char* text :
       {"46° 30' 12\" N", "46°30'12\"N", "46° 30′ 12″ N", "N46 30 12", "46d30m12s", "46:30:12",
        " 46º30’12”", "46° 30.2' N", "N 46 30.2", "46 deg 30 min 12 sec", "46° 30' 12''"})
    EXPECT_NEAR(degrees_from_text(text, "NS").value_or(0.0), k46, 1e-12) << text;
  EXPECT_NEAR(*degrees_from_text("46° 30' 12\" S", "NS"), -k46, 1e-12);
  EXPECT_NEAR(*degrees_from_text("-46:30:12", "NS"), -k46, 1e-12);
  EXPECT_NEAR(*degrees_from_text("W 7.25", "EW"), -7.25, 1e-12);
  EXPECT_EQ(*degrees_from_text("7", "EW"), 7.0);
  for (const char* wrong : {"", "N", "46° 60' N", "46° 30' 60\"", "-46° S", "46.5° 30'", "46° E",
                            "46°30'12\" N N", "north", "46 30 12 5", "1e1", "--1"})
    EXPECT_FALSE(degrees_from_text(wrong, "NS")) << wrong;
}

TEST(FixTimes, AreReadInAllFormsOfIso8601AndOfRecorders) {
  constexpr double kWhole = 1585840798.0;  // date -u -d "2020-04-02 15:19:58" +%s
  struct Case {
    const char* text;
    double seconds;
    bool has_zone;
  };
  for (const Case& one :
       {Case{"2020-04-02T15:19:58Z", kWhole, true}, Case{"2020-04-02t15:19:58z", kWhole, true},
        Case{"20200402T151958Z", kWhole, true}, Case{"2020-04-02 15:19:58 UTC", kWhole, true},
        Case{"2020/04/02 15:19:58", kWhole, false}, Case{"2020.4.2 15:19:58", kWhole, false},
        Case{"2020-04-02T15:19:58,5", kWhole + 0.5, false},
        Case{"2020-04-02T15:19:58.500+02", kWhole + 0.5 - 7200, true},
        Case{"2020-04-02 15:19:58 -03:30", kWhole + 12600, true},
        Case{"2020-04-02T15:19:58.5000000000001Z", kWhole + 0.5, true},
        Case{"2016-12-31T23:59:60Z", 1483228800.0, true}}) {
    const auto time = stated_time(one.text, 0.0);
    ASSERT_TRUE(time) << one.text;
    EXPECT_NEAR(time->unix_s, one.seconds, 1e-6) << one.text;
    EXPECT_EQ(time->has_zone, one.has_zone) << one.text;
  }
  for (const char* wrong :
       {"02/04/2020 15:19:58", "2020-04-02", "2020-4-2T15:19", "2020-02-30 00:00:00",
        "2020-04.02 15:19:58", "2020-04-02T24:00:00Z", "2020-04-02T15:19:58 PM"})
    EXPECT_FALSE(stated_time(wrong, 0.0)) << wrong;
  EXPECT_EQ(*seconds_of_clock("00:01:02,345"), 62.345);
  EXPECT_EQ(*seconds_of_clock("100:00:01.5"), 360001.5);
  for (const char* wrong : {"1:2:3", "00:01", "00:01:02,", "00:01:02 x"})
    EXPECT_FALSE(seconds_of_clock(wrong)) << wrong;
}

TEST_F(CsvFiles, NumbersAreInTheUnitThatAKeyOrElseTheColumnsNameStates) {
  struct Case {
    Quantity quantity;
    const char *name, *unit;
  };
  for (const Case& one : {Case{Quantity::Length, "height_m", "m"},
                          Case{Quantity::Length, "alt_ft", "ft"},
                          Case{Quantity::Length, "height_above_takeoff(feet)", "ft"},
                          Case{Quantity::Length, "Altitude [m]", "m"},
                          Case{Quantity::Length, "z.mm", "mm"},
                          Case{Quantity::Length, "altitude", ""},
                          Case{Quantity::Length, "m", ""},
                          Case{Quantity::Length, "alt_msl", ""},
                          Case{Quantity::Speed, "speed(mph)", "mph"},
                          Case{Quantity::Speed, "speed [km/h]", "kmh"},
                          Case{Quantity::Speed, "gs_kt", "kn"},
                          Case{Quantity::Speed, "v (m/s)", "mps"},
                          Case{Quantity::Speed, "speed", ""},
                          Case{Quantity::Angle, "lat_rad", "rad"},
                          Case{Quantity::Angle, "yaw(degrees)", "deg"},
                          Case{Quantity::Angle, "lon_e7", "deg_e7"},
                          Case{Quantity::Angle, "lat (\u00B0)", "deg"},
                          Case{Quantity::Angle, "latitude", ""},
                          Case{Quantity::Length, "altitude (ft MSL)", "ft"},
                          Case{Quantity::Length, "alt_ft_msl", "ft"},
                          Case{Quantity::Length, "height (ft.)", "ft"},
                          Case{Quantity::Length, "alt_dm", ""},
                          Case{Quantity::Angle, "lat [degE7]", "deg_e7"},
                          Case{Quantity::Angle, "lat_degE7", "deg_e7"},
                          Case{Quantity::Angle, "lat [1e-7 deg]", "deg_e7"},
                          Case{Quantity::Attitude, "Yaw (deg.)", "deg"},
                          Case{Quantity::Attitude, "heading (\u00B0 true)", "deg"},
                          Case{Quantity::Attitude, "yaw_e7", ""},
                          Case{Quantity::Speed, "speed_km_h", "kmh"},
                          Case{Quantity::Speed, "speed_m_s", "mps"},
                          Case{Quantity::Speed, "v [m s-1]", "mps"},
                          Case{Quantity::Speed, "params-1_mph", "mph"},
                          Case{Quantity::Speed, "v (ft/s)", ""},
                          Case{Quantity::Time, "time_ms_utc", "ms"}})
    EXPECT_EQ(unit_of_name(one.quantity, one.name), one.unit) << one.name;

  const auto first = [&](const std::string& names, const std::string& cells,
                         const std::string& keys) {
    return read("csv", keys, names + "\n" + cells + "\n");
  };
  const std::string columns =
      "place_columns = [\"lat_e7\", \"lon(rad)\", \"alt(feet)\"]\nspeed_column = \"speed(mph)\"\n"
      "attitude_columns = [\"yaw_rad\", \"pitch_rad\", \"roll_rad\"]\nattitude_frame = \"enu\"\n"
      "attitude_axes = \"flu\"\n";
  const std::string names =
      "time_s,lat_e7,lon(rad),alt(feet),speed(mph),yaw_rad,pitch_rad,roll_rad";
  const FixTable by_name = first(names, "0,460000000,0.1,1000,60,0.5,0,0", columns);
  const Fix& fix = by_name.fixes.at(0);
  EXPECT_NEAR(fix.place[0], 46.0, 1e-12);
  EXPECT_NEAR(fix.place[1], 18.0 / 3.14159265358979323846, 1e-12);
  EXPECT_NEAR(fix.place[2], 304.8, 1e-10);
  EXPECT_NEAR(*fix.speed_mps, 26.8224, 1e-12);
  EXPECT_NEAR(fix.attitude->angularDistance(Eigen::Quaterniond::Identity()), 0.5, 1e-12);
  EXPECT_THAT(by_name.remarks, testing::IsSupersetOf(
                                   {testing::HasSubstr("alt(feet) is read as length_unit = \"ft\", "
                                                       "as its name says"),
                                    testing::HasSubstr("speed(mph) is read as speed_unit")}));
  const FixTable by_key =
      first(names, "0,460000000,0.1,1000,60,0.5,0,0", columns + "length_unit = \"m\"\n");
  EXPECT_EQ(by_key.fixes.at(0).place[2], 1000.0);
  EXPECT_THAT(by_key.remarks,
              testing::Contains(testing::HasSubstr(
                  "alt(feet) is read as length_unit = \"m\", while its name says ft")));
  const FixTable other =
      first("time_s,latitude_deg,longitude_deg,alt_dm", "0,1,2,30",
            "place_columns = [\"latitude_deg\", \"longitude_deg\", \"alt_dm\"]\n");
  EXPECT_EQ(other.fixes.at(0).place[2], 30.0);
  EXPECT_THAT(other.remarks,
              testing::Contains(testing::HasSubstr("while its name says dm, which no key states")));
  // What says nothing is in metres and degrees, without a word.
  const FixTable plain = first("time_s,latitude_deg,longitude_deg,height_m", "0,1,2,3", "");
  EXPECT_EQ(plain.fixes.at(0).place, Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(plain.remarks.empty());
}

TEST_F(CsvFiles, TimesAreInTheUnitThatTheColumnsNameOrAKeyStates) {
  struct Case {
    const char* name;
    const char* unit;
  };
  for (const Case& one : {Case{"time_s", "s"}, Case{"time_ms", "ms"}, Case{"timestamp_us", "us"},
                          Case{"t [ns]", "ns"}, Case{"Time (ms)", "ms"}, Case{"time[µs]", "us"},
                          Case{"unix_ms", "unix_ms"}, Case{"Epoch Time (us)", "unix_us"},
                          Case{"elapsed_seconds", "s"}, Case{"t.usec", "us"}, Case{"time", ""},
                          Case{"status", ""}, Case{"ms", ""}, Case{"items", ""}})
    EXPECT_EQ(time_unit_of_name(one.name), one.unit) << one.name;
  const auto first_s = [&](const std::string& name, const std::string& cell,
                           const std::string& keys) {
    return read("csv", "time_column = \"" + name + "\"\n" + keys,
                name + ",latitude_deg,longitude_deg,height_m\n" + cell + ",1,2,3\n");
  };
  EXPECT_EQ(first_s("time_ms", "1500", "").fixes[0].time_s, 1.5);
  EXPECT_EQ(first_s("#timestamp [ns]", "2500000000", "").fixes[0].time_s, 2.5);
  EXPECT_EQ(unix_s(first_s("t", "1585840798000000", "time_unit = \"unix_us\"")), 1585840798.0);
  const FixTable dates = first_s("when", "2020-04-02 15:19:58", "");
  EXPECT_EQ(unix_s(dates), 1585840798.0);
  EXPECT_TRUE(dates.has_utc());
  EXPECT_NE(remarks_of(dates).find("time_unit = \"text\", as its first cell says"),
            std::string::npos);
  EXPECT_NE(remarks_of(dates).find("taken to be UTC"), std::string::npos) << remarks_of(dates);
  // A key has the last word, and is told.
  const FixTable other = first_s("time_ms", "1500", "time_unit = \"s\"");
  EXPECT_EQ(other.fixes[0].time_s, 1500.0);
  EXPECT_NE(remarks_of(other).find("its name says ms"), std::string::npos);
}

TEST_F(CsvFiles, TimesInAnotherUnitAreRefusedAndTheUnitThatTheMessageNamesReadsThem) {
  const auto table_of = [](const std::string& cell) {
    return "t,latitude_deg,longitude_deg,height_m\n" + cell + ",1,2,3\n";
  };
  struct Case {
    const char* cell;
    const char* unit;
    const char* way_out;
  };
  for (const Case& one :
       {Case{"1585840798000", "unix_s", "unix_ms"}, Case{"1585840798000000", "unix_ms", "unix_us"},
        Case{"1585840798000000000", "unix_s", "unix_ns"},
        Case{"2020-04-02T15:19:58Z", "ms", "text"}, Case{"15:19:58", "s", "clock"},
        Case{"15:19:58", "text", "clock"}, Case{"2020-04-02T15:19:58Z", "clock", "text"}}) {
    const std::string keys = "time_column = \"t\"\ntime_unit = ";
    const std::string message =
        refused("csv", fmt::format("{}\"{}\"", keys, one.unit), table_of(one.cell));
    EXPECT_NE(message.find(fmt::format("time_unit = \"{}\"", one.way_out)), std::string::npos)
        << message;
    EXPECT_NE(message.find("line 2"), std::string::npos) << message;
    const FixTable table =
        read("csv", fmt::format("{}\"{}\"", keys, one.way_out), table_of(one.cell));
    EXPECT_EQ(unix_s(table), std::string(one.way_out) == "clock" ? 55198.0 : 1585840798.0)
        << one.cell;
  }
  // Plain seconds that look like those since 1970 say so.
  EXPECT_NE(remarks_of(read("csv", "time_column = \"t\"\n", table_of("1585840798"))).find("unix_s"),
            std::string::npos);
}

TEST_F(CsvFiles, TimesOfDayGoOnAfterMidnightAndSecondsOfAWeekAfterItsEnd) {
  const auto times = [&](const std::string& keys, const std::string& cells) {
    std::string text = "t,latitude_deg,longitude_deg,height_m\n";
    for (std::string_view rest = cells; !rest.empty();) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      text += std::string(rest.substr(0, end)) + ",1,2,3\n";
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    std::vector<double> result;
    for (const Fix& fix : read("csv", "time_column = \"t\"\n" + keys, text).fixes)
      result.push_back(fix.time_s);
    return result;
  };
  EXPECT_EQ(times("", "23:59:59 23:59:59.5 00:00:00 00:00:00.5"),
            (std::vector<double>{86399.0, 86399.5, 86400.0, 86400.5}));
  // A row out of order beside midnight stays on its day.
  EXPECT_EQ(times("", "23:59:59 00:00:01 23:59:59.5 00:00:02"),
            (std::vector<double>{86399.0, 86401.0, 86399.5, 86402.0}));
  EXPECT_EQ(times("time_wraps_s = 604800", "604799 0 1"),
            (std::vector<double>{604799.0, 604800.0, 604801.0}));
  EXPECT_EQ(times("time_unit = \"s\"", "604799 0 1"), (std::vector<double>{604799.0, 0.0, 1.0}));
}

TEST_F(CsvFiles, SemicolonsAndDecimalCommasAreReadByTheKeysThatMessagesName) {
  const std::string text =
      "time_s;latitude_deg;longitude_deg;height_m\n0,5;46,25;7,5;1500,25\n1;46,5;7,5;1500\n";
  const std::string first = refused("csv", "", text);
  ASSERT_NE(first.find("separator = \";\""), std::string::npos) << first;
  const std::string second = refused("csv", "separator = \";\"", text);
  ASSERT_NE(second.find("decimal_sign = \",\""), std::string::npos) << second;
  const FixTable table = read("csv", "separator = \";\"\ndecimal_sign = \",\"", text);
  EXPECT_EQ(table.fixes.at(0).place, Eigen::Vector3d(46.25, 7.5, 1500.25));
  EXPECT_EQ(table.fixes.at(0).time_s, 0.5);
  const std::string tabs = "time_s\tlatitude_deg\tlongitude_deg\theight_m\n0\t1\t2\t3\n";
  ASSERT_NE(refused("csv", "", tabs).find("separator = \"tab\""), std::string::npos);
  EXPECT_EQ(read("csv", "separator = \"tab\"", tabs).fixes.at(0).place.z(), 3.0);
  // In quotes a comma is no separator; without them a row has too many fields.
  EXPECT_NE(refused("csv", "", kHeader + "0,\"46,5\",7,3\n").find("decimal_sign"),
            std::string::npos);
  EXPECT_NE(refused("csv", "", kHeader + "0,46,5,7,3\n").find("double quotes"), std::string::npos);
  EXPECT_NE(refused("adsb", "", tabs).find("format = \"csv\""), std::string::npos);
  EXPECT_NE(message_of(core::ErrorKind::Config, [] { format_from("csv", "decimal_sign = \",\""); })
                .find("separator"),
            std::string::npos);
}

TEST_F(CsvFiles, AnglesInWordsAreReadByTheUnitThatTheMessageNames) {
  const std::string quoted = kHeader + "0,\"46° 30' 12\"\" N\",7° 30' W,1500\n";
  const std::string message = refused("csv", "", quoted);
  ASSERT_NE(message.find("angle_unit = \"dms\""), std::string::npos) << message;
  const FixTable table = read("csv", "angle_unit = \"dms\"", quoted);
  EXPECT_NEAR(table.fixes[0].place.x(), 46.0 + 30.0 / 60.0 + 12.0 / 3600.0, 1e-12);
  EXPECT_NEAR(table.fixes[0].place.y(), -7.5, 1e-12);
  EXPECT_NE(
      refused("csv", "angle_unit = \"dms\"", kHeader + "0,46° 30' E,7,1500\n").find("no latitude"),
      std::string::npos);
}

TEST_F(CsvFiles, CommentsAreCountedAndMayHoldTheHeader) {
  const FixTable table =
      read("csv", "", "# by a logger\n" + kHeader + "# lost\n0,1,2,3\n#4,1,2,3\n1,1,2,4\n");
  ASSERT_EQ(table.fixes.size(), 2u);
  EXPECT_EQ(table.fixes[1].line, 6u);
  EXPECT_EQ(table.ledger.entries().at("# comments").num_ignored, 3);
  const FixTable behind = read("csv", "", "# by a logger\n#" + kHeader + "0,1,2,3\n");
  ASSERT_EQ(behind.fixes.size(), 1u);
  EXPECT_EQ(behind.ledger.entries().at("# comments").num_ignored, 1);
  EXPECT_EQ(behind.fixes[0].place, Eigen::Vector3d(1.0, 2.0, 3.0));
}

TEST_F(CsvFiles, HeadersInOtherCaseQuotesAndTrailingSeparatorsAreRead) {
  for (const std::string& text :
       {std::string("TIME_S,Latitude_Deg,LONGITUDE_DEG,Height_M\n0,1,2,3\n"),
        std::string("\"time_s\",\"latitude_deg\",\"longitude_deg\",\"height_m\"\n\"0\",\"1\",\"2\","
                    "\"3\"\n"),
        std::string("time_s,latitude_deg,longitude_deg,height_m,\n0,1,2,3,\n"),
        std::string("time_s,latitude_deg,longitude_deg,height_m,\n0,1,2,3\n"),
        kHeader + "0,1,2,3,,\n", std::string("\xEF\xBB\xBF") + kHeader + "0,1,2,3\r\n",
        std::string("time_s,latitude_deg,longitude_deg,height_m\r0,1,2,3\r")}) {
    const FixTable table = read("csv", "", text);
    ASSERT_EQ(table.fixes.size(), 1u) << text;
    EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(1.0, 2.0, 3.0)) << text;
    EXPECT_TRUE(table.ledger.warnings().empty()) << table.ledger.table();
  }
  // One of two columns that are called the same is not chosen by chance.
  for (const char* twice : {"height_m", "Height_m"})
    EXPECT_NE(refused("csv", "",
                      fmt::format("time_s,latitude_deg,longitude_deg,HEIGHT_M,{}\n0,1,2,3,4\n",
                                  std::string(twice) == "height_m" ? "HEIGHT_M" : twice))
                  .find("columns 4 and 5"),
              std::string::npos);
  EXPECT_EQ(read("csv", "", "time_s,latitude_deg,longitude_deg,HEIGHT_M,height_m\n0,1,2,3,4\n")
                .fixes[0]
                .place.z(),
            4.0);
}

TEST_F(CsvFiles, TextThatIsNotUtf8IsRefusedWithWords) {
  EXPECT_NE(refused("csv", "", std::string("\xFF\xFEt\0", 4)).find("UTF-16"), std::string::npos);
  EXPECT_NE(refused("tum", "", std::string("1 2\0", 4)).find("byte 3 is 0"), std::string::npos);
}

TEST_F(CsvFiles, AFileThatIsTooLargeIsRefusedBeforeItIsRead) {
  const std::filesystem::path file = written("large.csv", "t\n");
  std::filesystem::resize_file(file, std::uintmax_t{30} << 30);  // sparse: a thousand million rows
  const std::string message =
      message_of(core::ErrorKind::Input, [&] { format_from("csv", "")->read(file, "ellipsoid"); });
  EXPECT_NE(message.find("cut it into parts"), std::string::npos) << message;
}

}  // namespace
}  // namespace terracast::geo
