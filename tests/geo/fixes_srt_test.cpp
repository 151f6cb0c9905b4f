// Subtitles of aircraft, in the wordings that DJI's and Autel's write.

#include <cmath>

#include "geo/fixes/srt_fields.h"
#include "tests/geo/fixes_support.h"

namespace terracast::geo {
namespace {

using test::remarks_of;

std::string value_of(const std::string& text, const std::string& name) {
  for (const SrtField& field : srt_fields(srt_text(text)))
    if (field.name == name) return field.value;
  return "(none)";
}

TEST(SrtFields, AreFoundInAllWordings) {
  struct Case {
    const char* text;
    const char* name;
    const char* value;
  };
  for (const Case& one : {
           Case{"<font size=\"36\">FrameCnt : 1, DiffTime : 16ms", "framecnt", "1"},
           Case{"<font size=\"36\">FrameCnt : 1, DiffTime : 16ms", "difftime", "16ms"},
           Case{"[latitude : 31.45] [longtitude : 74.39]", "longtitude", "74.39"},
           Case{"[latitude: 31.45] [longitude: 74.39]", "latitude", "31.45"},
           Case{"[rel_alt: 0.300 abs_alt: 549.679] </font>", "abs_alt", "549.679"},
           Case{"[rel_alt: 0.300 abs_alt: 549.679] </font>", "rel_alt", "0.300"},
           Case{"[dzoom_ratio: 10000, delta:0],[latitude: -22.7]", "delta", "0"},
           Case{"[dzoom_ratio: 10000, delta:0],[latitude: -22.7]", "latitude", "-22.7"},
           Case{"[shutter : 1/80.0] [ev : -0.7]", "shutter", "1/80.0"},
           Case{"GPS(149.0,-20.2,16) BAROMETER:1.9", "gps", "149.0,-20.2,16"},
           Case{"GPS(149.0,-20.2,16) BAROMETER:1.9", "barometer", "1.9"},
           Case{"GPS(39.9,116.3,69.8) BAROMETER(91.2)", "barometer", "91.2"},
           Case{"F/2.8, SS 206.14, ISO 150, EV 0, GPS (-82.6, 27.7, 10), D 2.80m, H 0.10m", "h",
                "0.10m"},
           Case{"F/2.8, SS 206.14, ISO 150, EV -1/3, GPS (-82.6, 27.7, 10)", "ev", "-1/3"},
           Case{"F/2.8, SS 206.14, ISO 150", "f", "2.8"},
           Case{"H.S 2.88m/s, V.S -0.10m/s, F.PRY (2.7°, -7.0°, 110.1°)", "v.s", "-0.10m/s"},
           Case{"V.S 0.00m/s, F.PRY (2.7°, -7.0°, 110.1°)", "f.pry", "2.7°, -7.0°, 110.1°"},
           Case{"RTK (120.08, 30.21, 28), HOME (120.08, 30.21, 103.55m)", "home",
                "120.08, 30.21, 103.55m"},
           Case{"ISO:100 Shutter:60 EV: Fnum:2.2", "fnum", "2.2"},
           Case{"ISO:100 Shutter:60 EV: Fnum:2.2", "ev", ""},
           Case{"HOME(149.0,-20.2) 2017.08.05 14:11:51\nGPS(1,2,3)", kSrtDate,
                "2017.08.05 14:11:51"},
           Case{"2020-04-02 15:19:58,720,764\n[iso : 100]", kSrtDate,
                "2020-04-02 15:19:58,720,764"},
           Case{"2024-01-18 10:23:26.397", kSrtDate, "2024-01-18 10:23:26.397"},
           Case{"HOME(-117.9, 33.6) 2019.9.8 16:49:24\\NGPS(W: 117.9, N: 33.6, -37) ReH:4 "
                "\\NISO:100",
                "reh", "4"},
           Case{"HOME(-117.9, 33.6) 2019.9.8 16:49:24\\NGPS(W: 117.9, N: 33.6, -37)", kSrtDate,
                "2019.9.8 16:49:24"},
           Case{"M.M AE_METER_CENTER, A.T (126,109), Isp Info (PIPE 1,ADJ 0,De 0) GPS (-2.5, 52.0, "
                "15)",
                "gps", "-2.5, 52.0, 15"},
           Case{"M.M AE_METER_CENTER, A.T (126,109)", "m.m", "AE_METER_CENTER"},
           Case{"LeCurve(64) (1024,1024,), AfSpd 0/0", "afspd", "0/0"},
           Case{"{\\an8}[latitude: 5]", "latitude", "5"},
       })
    EXPECT_EQ(value_of(one.text, one.name), one.value) << one.text;
}

class SrtFiles : public test::Recordings {
 protected:
  static std::string cue(const std::string& text, int second = 1) {
    return fmt::format("{0}\n00:00:{0:02},000 --> 00:00:{1:02},000\n{2}\n\n", second, second + 1,
                       text);
  }
};

TEST_F(SrtFiles, ThePublishedLayoutsGivePlaceHeightAndTime) {
  struct Case {
    const char* text;
    const char* above;
    Eigen::Vector3d place;
    double time_s;  ///< from 1970, of those with a date
    const char* keys;
  };
  // Times by `date -u -d`.
  for (const Case& one : {Case{"<font size=\"28\">SrtCnt : 1, DiffTime : 33ms\n2024-01-18 "
                               "10:23:26.397\n[iso : 150] [shutter : "
                               "1/5000.0] [fnum : 170] [ev : 0] [ct : 5023] [color_md : default] "
                               "[focal_len : 240] [dzoom_ratio: "
                               "10000, delta:0],[latitude: -22.5] [longitude: -47.5] [rel_alt: "
                               "0.300 abs_alt: 549.679] </font>",
                               "ellipsoid",
                               {-22.5, -47.5, 549.679},
                               1705573406.397,
                               ""},
                          Case{"<font size=\"36\">FrameCnt : 1, DiffTime : 41ms\n2023-07-15 "
                               "11:55:16,320,933\n[iso : 100] "
                               "[latitude : 5.5] [longtitude : 6.5] [altitude: 7.5] </font>",
                               "egm96",
                               {5.5, 6.5, 7.5},
                               1689422116.320933,
                               ""},
                          Case{"F/2.8, SS 206.14, ISO 150, EV 0, GPS (-82.5, 27.5, 10), D 2.80m, H "
                               "1.25m, H.S 0.00m/s, V.S 0.00m/s ",
                               "home",
                               {27.5, -82.5, 1.25},
                               1.0,
                               "order = \"lon_lat\""},
                          Case{"F/6.3, SS 60, ISO 100, EV 0, RTK (120.5, 30.5, 28), HOME (120.0, "
                               "30.0, 103.55m), D 75.36m, H 76.19m",
                               "home",
                               {30.5, 120.5, 76.19},
                               1.0,
                               "order = \"lon_lat\""},
                          Case{"2022.06.21 16:06:17\nGPS(36.5,-6.5,0.0M) BAROMETER:0.3M",
                               "home",
                               {36.5, -6.5, 0.3},
                               1655827577.0,
                               "order = \"lat_lon\""},
                          Case{"HOME(W: 97.5, N: 30.25) 2020-11-01 15:29:24\nGPS(W: 97.25, N: "
                               "30.5, 161.5m)\nISO:105 SHUTTER:500 "
                               "EV:0.0 F-NUM:2.8",
                               "egm96",
                               {30.5, -97.25, 161.5},
                               1604244564.0,
                               ""},
                          Case{"HOME(E: 7.5, S: 30.25) 2019.9.8 16:49:24\\NGPS(E: 7.25, S: -30.5, "
                               "55.47m) ReH:4.5 \\NISO:100",
                               "home",
                               {-30.5, 7.25, 4.5},
                               1567961364.0,
                               ""}}) {
    for (const std::string& line_end : {std::string("\n"), std::string("\r\n")}) {
      std::string text = "\xEF\xBB\xBF" + cue(one.text);
      for (std::size_t at = 0;
           line_end.size() == 2 && (at = text.find('\n', at)) != std::string::npos; at += 2)
        text.insert(at, 1, '\r');
      const FixTable table = read("srt", one.keys, text, one.above);
      ASSERT_EQ(table.fixes.size(), 1u) << one.text;
      EXPECT_EQ(table.fixes[0].place, one.place) << one.text;
      EXPECT_NEAR(table.fixes[0].time_s, one.time_s, 1e-6) << one.text;
      EXPECT_TRUE(table.ledger.warnings().empty()) << table.ledger.table();
    }
  }
}

TEST_F(SrtFiles, LettersThatContradictTheirSignsAreNotUnderstoodAndCounted) {
  for (const char* wrong :
       {"GPS(E: -7.5, N: 30.5, 1m)", "GPS(W: -117.-9605, N: 33.6, 1m)", "GPS(N: 1, N: 2, 1m)"}) {
    const FixTable table = read("srt", "", cue("GPS(E: 7.5, N: 30.5, 1m)") + cue(wrong, 2));
    ASSERT_EQ(table.fixes.size(), 2u);
    EXPECT_TRUE(table.fixes[0].has_place());
    EXPECT_FALSE(table.fixes[1].has_level_place()) << wrong;
    EXPECT_EQ(table.ledger.entries().at("gps").num_not_understood(), 1) << wrong;
  }
}

TEST_F(SrtFiles, UnitsAreThoseThatTheFileStates) {
  const auto height_m = [&](const std::string& field) {
    const FixTable table = read("srt", "",
                                cue("[latitude: 1] [longitude: 2] [rel_alt: 7]") +
                                    cue("[latitude: 1] [longitude: 2] " + field, 2),
                                "home");
    if (table.ledger.entries().at("h").num_not_understood() > 0) return -1.0;
    return table.fixes[1].place.z();
  };
  EXPECT_EQ(height_m("H 80.5m"), 80.5);
  EXPECT_EQ(height_m("H 80.5M"), 80.5);
  EXPECT_EQ(height_m("H 80.5"), 80.5);
  EXPECT_NEAR(height_m("H 100ft"), 30.48, 1e-12);
  EXPECT_EQ(height_m("H 80.5yd"), -1.0);
  EXPECT_EQ(height_m("H -"), -1.0);
  const FixTable speeds =
      read("srt", "", cue("[latitude: 1] [longitude: 2] [abs_alt: 7] H.S 36km/h"));
  EXPECT_NEAR(*speeds.fixes[0].speed_mps, 10.0, 1e-12);
}

TEST_F(SrtFiles, FramesOfThirtyAndSixtyASecondKeepTheirTimes) {
  for (const int rate : {30, 60}) {
    std::string text;
    for (int i = 0; i < 2 * rate; ++i) {
      const int ms = i * 1000 / rate;
      text += fmt::format(
          "{}\n00:00:{:02},{:03} --> 00:00:59,000\nFrameCnt : {}, DiffTime : {}ms\n"
          "[latitude: 1.5] [longitude: {:.6f}] [abs_alt: 7]\n\n",
          i + 1, ms / 1000, ms % 1000, i + 1, 1000 / rate, 2.0 + 1e-6 * i);
    }
    const FixTable table = read("srt", "", text);
    ASSERT_EQ(table.fixes.size(), static_cast<std::size_t>(2 * rate));
    for (int i = 0; i < 2 * rate; ++i)
      EXPECT_NEAR(table.fixes[static_cast<std::size_t>(i)].time_s, i * 1000 / rate * 1e-3, 1e-9);
  }
}

TEST_F(SrtFiles, SubtitlesWithoutTimingsTakeTheirDatesAndThoseWithoutBlankLinesStayApart) {
  const FixTable dated =
      read("srt", "",
           "1\n2017.08.05 14:11:51,393,525\n[latitude : 1] [longtitude : 2] [altitude: 3]\n\n"
           "2\n2017.08.05 14:11:52,393,525\n[latitude : 1] [longtitude : 2] [altitude: 4]\n");
  ASSERT_EQ(dated.fixes.size(), 2u);
  EXPECT_NEAR(dated.fixes[1].time_s, 1501942312.393525,
              1e-6);  // date -u -d "2017-08-05 14:11:52" +%s
  std::string close = cue("[latitude: 1] [longitude: 2] [abs_alt: 3]") +
                      cue("[latitude: 4] [longitude: 5] [abs_alt: 6]", 2);
  for (std::size_t at = 0; (at = close.find("\n\n")) != std::string::npos;) close.erase(at, 1);
  const FixTable table = read("srt", "", close);
  ASSERT_EQ(table.fixes.size(), 2u);
  EXPECT_EQ(table.fixes[1].place, Eigen::Vector3d(4.0, 5.0, 6.0));
  EXPECT_EQ(table.fixes[1].time_s, 2.0);
  // Some with a date, some without: the latter have no time on the camera's clock.
  const FixTable mixed =
      read("srt", "",
           cue("2017.08.05 14:11:51\n[latitude: 1] [longitude: 2] [abs_alt: 3]") +
               cue("[latitude: 1] [longitude: 2] [abs_alt: 3]", 2));
  EXPECT_EQ(mixed.fixes[0].time_s, 1501942311.0);
  EXPECT_TRUE(std::isnan(mixed.fixes[1].time_s));
  EXPECT_NE(remarks_of(mixed).find("1 of 2 subtitles have no date"), std::string::npos);
}

TEST_F(SrtFiles, AFieldThatIsCalledDateIsNotTakenForOne) {
  const FixTable table =
      read("srt", "", cue("[date: soon] [latitude: 1] [longitude: 2] [abs_alt: 3]"));
  EXPECT_FALSE(table.has_utc());
  EXPECT_EQ(table.fixes[0].time_s, 1.0);
  EXPECT_EQ(table.ledger.entries().at("date").num_unknown, 1);
  // Nor does one take what stands behind it for its own.
  const FixTable dated =
      read("srt", "", cue("2017.08.05 14:11:51 (local) [latitude: 1] [longitude: 2] [abs_alt: 3]"));
  EXPECT_EQ(dated.fixes[0].time_s, 1501942311.0);
  EXPECT_EQ(dated.ledger.entries().at("(local)").num_unknown, 1);
}

TEST_F(SrtFiles, RadiansAreReadWhereTheKeySaysSo) {
  const FixTable table = read("srt", "angle_unit = \"rad\"",
                              cue("[latitude: 0.5] [longtitude: -1.0] [altitude: 1429.5]"));
  EXPECT_NEAR(table.fixes[0].place.x(), 28.64788975654116, 1e-12);
  EXPECT_NEAR(table.fixes[0].place.y(), -57.29577951308232, 1e-12);
}

TEST_F(SrtFiles, FilesWithoutAnyPlaceSayWhatTheyHold) {
  const std::string message = refused("srt", "", cue("ISO:100 Shutter:60"));
  EXPECT_NE(message.find("there are the fields iso, shutter"), std::string::npos) << message;
  EXPECT_NE(
      refused("srt", "", cue("[latitude: 0] [longitude: 0] [abs_alt: 0]")).find("other than 0, 0"),
      std::string::npos);
  EXPECT_NE(refused("srt", "", "").find("no subtitles"), std::string::npos);
}

}  // namespace
}  // namespace terracast::geo
