// What holds for every format of recordings: nothing that a file says goes by unseen, and every message that a file
// without heights ends in names a way out that works.

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/toml_reader.h"
#include "geo/fixes/recording.h"
#include "tests/geo/fixes_support.h"

namespace terracast::geo {
namespace {

using test::message_of;

/// A right recording of a format.
struct Sample {
  const char* format;
  std::string keys;
  std::string above;
  /// Name and text of each file; with one thing more than the reader knows, where `more` is true. The first is given
  /// to the reader, or its folder where the name has one.
  std::function<std::vector<std::pair<std::string, std::string>>(bool more)> files;
  /// What the ledger calls it; empty: the layout is fixed, and has no room for more.
  std::string unknown;
};

std::vector<std::pair<std::string, std::string>> oxts_files(bool more) {
  std::string packet = "42.5 1.5 1500";
  for (int i = 3; i < 30; ++i) packet += " 0";
  return {{"oxts/timestamps.txt", "2011-09-26 13:02:25.5\n"},
          {"oxts/data/0000000000.txt", packet + (more ? " 5" : "")}};
}

/// A record of 17 doubles, and a double more.
std::vector<std::pair<std::string, std::string>> sbet_files(bool more) {
  return {{"recording", std::string(more ? 144 : 136, '\0')}};
}

/// A log of PX4 with one place, and with a message of a type that is none.
std::vector<std::pair<std::string, std::string>> ulog_files(bool more) {
  const auto message = [](char type, const std::string& payload) {
    return std::string{static_cast<char>(payload.size()), '\0', type} + payload;
  };
  std::string log = std::string("ULog\x01\x12\x35\x01", 8) + std::string(8, '\0');
  log +=
      message('F', "vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;");
  log += message('A', std::string(3, '\0') + "vehicle_global_position");
  log += message('D', std::string(2 + 8 + 8 + 8 + 4, '\0'));
  if (more) log += message('w', "ake");
  return {{"recording", log}};
}

std::vector<Sample> samples() {
  const auto one_file = [](const char* text, const char* more_text) {
    return [=](bool more) {
      return std::vector<std::pair<std::string, std::string>>{
          {"recording", more ? more_text : text}};
    };
  };
  return {
      {"adsb", "", "ellipsoid",
       one_file("timestamp,latitude,longitude,altitude,geoaltitude,groundspeed,track,"
                "icao24\n1600000000,1,2,3,4,5,6,a\n",
                "timestamp,latitude,longitude,altitude,geoaltitude,groundspeed,track,icao24,wake\n"
                "1600000000,1,2,3,4,5,6,a,7\n"),
       "wake"},
      {"csv", "speed_column = \"v\"", "ellipsoid",
       one_file("time_s,latitude_deg,longitude_deg,height_m,v\n0,1,2,3,4\n",
                "time_s,latitude_deg,longitude_deg,height_m,v,wake\n0,1,2,3,4,5\n"),
       "wake"},
      {"gpx", "", "ellipsoid",
       one_file(
           "<gpx><trk><trkseg><trkpt lat=\"1\" lon=\"2\"><ele>3</ele></trkpt></trkseg></trk></gpx>",
           "<gpx><trk><trkseg><trkpt lat=\"1\" "
           "lon=\"2\"><ele>3</ele><wake/></trkpt></trkseg></trk></gpx>"),
       "point/wake"},
      {"gpx", "", "ellipsoid",
       one_file(
           "<gpx><trk><trkseg><trkpt lat=\"1\" lon=\"2\"><ele>3</ele></trkpt></trkseg></trk></gpx>",
           "<gpx><trk><trkseg><trkpt lat=\"1\" lon=\"2\" "
           "wake=\"5\"><ele>3</ele></trkpt></trkseg></trk></gpx>"),
       "point@wake"},
      {"gpx", "", "ellipsoid",
       one_file("<gpx><trk><trkseg><trkpt lat=\"1\" lon=\"2\"/></trkseg></trk></gpx>",
                "<gpx><wake/><trk><trkseg><trkpt lat=\"1\" lon=\"2\"/></trkseg></trk></gpx>"),
       "wake"},
      {"euroc", "", "",
       one_file("#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y "
                "[],q_RS_z []\n1,2,3,4,1,0,0,0\n",
                "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y "
                "[],q_RS_z [],wake [m]\n1,2,3,4,1,0,0,0,5\n"),
       "wake"},
      {"jsbsim", "", "ellipsoid",
       one_file("Time,/fdm/jsbsim/position/lat-geod-deg,position/long-gc-deg,position/geod-alt-ft,"
                "attitude/phi-rad,attitude/theta-rad,attitude/psi-rad,fcs/a\n0,1,2,3,0,0,0,0\n",
                "Time,/fdm/jsbsim/position/lat-geod-deg,position/long-gc-deg,position/geod-alt-ft,"
                "attitude/phi-rad,attitude/theta-rad,attitude/psi-rad,fcs/a,wake\n"
                "0,1,2,3,0,0,0,0,5\n"),
       "wake"},
      {"oxts", "", "ellipsoid", oxts_files, "field 31"},
      {"sbet", "", "ellipsoid", sbet_files, ""},
      {"srt", "", "ellipsoid",
       one_file(
           "1\n00:00:01,000 --> 00:00:02,000\n[latitude: 1] [longitude: 2] [abs_alt: 3]\n",
           "1\n00:00:01,000 --> 00:00:02,000\n[latitude: 1] [longitude: 2] [abs_alt: 3 wake: 5]\n"),
       "wake"},
      {"tum", "", "", one_file("1 2 3 4 0 0 0 1\n", "1 2 3 4 0 0 0 1 5\n"), "field 9"},
      {"ulog", "", "egm96", ulog_files, "message w"}};
}

class FixLaws : public test::Recordings {
 protected:
  FixTable read_sample(const Sample& sample, bool more) {
    std::filesystem::path file;
    for (const auto& [name, text] : sample.files(more)) {
      const std::filesystem::path one = written(name, text);
      if (file.empty()) file = name == "recording" ? one : one.parent_path();
    }
    return test::format_from(sample.format, sample.keys)->read(file, sample.above);
  }
};

TEST_F(FixLaws, OneThingMoreThanAReaderKnowsStandsInItsLedgerAsUnknown) {
  for (const FixFormatInfo& info : fix_formats()) {
    bool has_sample = false;
    for (const Sample& sample : samples()) {
      if (sample.format != info.name) continue;
      has_sample = true;
      const FixTable plain = read_sample(sample, false);
      if (sample.unknown.empty()) {
        test::message_of(core::ErrorKind::Input, [&] { read_sample(sample, true); });
        continue;
      }
      const FixTable more = read_sample(sample, true);
      EXPECT_TRUE(plain.ledger.warnings().empty()) << info.name << "\n" << plain.ledger.table();
      ASSERT_TRUE(more.ledger.entries().contains(sample.unknown))
          << info.name << more.ledger.table();
      EXPECT_EQ(more.ledger.entries().at(sample.unknown).num_unknown, 1) << info.name;
      EXPECT_EQ(more.fixes.size(), plain.fixes.size()) << info.name;
    }
    EXPECT_TRUE(has_sample) << "no sample of format " << info.name;
  }
}

TEST_F(FixLaws, NamesThatAReaderUsesOrIgnoresAreInItsTableAsSuch) {
  for (const Sample& sample : samples()) {
    if (std::string_view(sample.format) == "csv") continue;  // its names are the config's
    for (const FixFormatInfo& info : fix_formats()) {
      if (sample.format != info.name) continue;
      const FixTable table = read_sample(sample, !sample.unknown.empty());
      for (const auto& [name, entry] : table.ledger.entries()) {
        const core::KnownName* known = nullptr;
        for (const core::KnownTable& one : info.known)
          if (known == nullptr) known = core::find_known(one.names, name);
        EXPECT_EQ(known == nullptr, entry.num_unknown > 0) << info.name << ": " << name;
        if (entry.num_used > 0) {
          ASSERT_NE(known, nullptr) << info.name << ": " << name;
          EXPECT_TRUE(known->is_used) << info.name << ": " << name;
        }
      }
    }
  }
}

TEST_F(FixLaws, TablesAreWholeAndWithoutContradictions) {
  for (const FixFormatInfo& info : fix_formats()) {
    ASSERT_FALSE(info.known.empty()) << info.name;
    for (const core::KnownTable& table : info.known) {
      EXPECT_EQ(table.reader, info.name);
      for (std::size_t i = 0; i < table.names.size(); ++i) {
        EXPECT_FALSE(table.names[i].words.empty()) << info.name << ": " << table.names[i].name;
        EXPECT_EQ(core::find_known(table.names, table.names[i].name), &table.names[i])
            << info.name << ": " << table.names[i].name << " stands twice";
      }
    }
  }
}

// Files are cut short, and bytes of them are others: each ends in an error of the file, or in a table.
TEST_F(FixLaws, FilesCutShortOrWithAnotherByteEndInAnErrorOrATable) {
  std::vector<Sample> all = samples();
  const auto add = [&](const char* format, const char* keys, const char* text) {
    all.push_back({format, keys, "home",
                   [=](bool) {
                     return std::vector<std::pair<std::string, std::string>>{{"recording", text}};
                   },
                   ""});
  };
  add("srt", "order = \"lon_lat\"",
      "1\n00:00:01,000 --> 00:00:02,000\n<font size=\"36\">F/2.8, SS 60, EV: Fnum:2, LeCurve(64) "
      "(1,2,), GPS (-82.5, "
      "27.5, 10), HOME(W: 1, N: 2) 2019.9.8 16:49:24\\NReH:4 H 1.25m, F.PRY (2.7°, -7.0°, "
      "110.1°)</font>\n");
  add("csv", "angle_unit = \"dms\"\ntime_unit = \"text\"",
      "# c\n#time_s,latitude_deg,longitude_deg,height_m\n2020-04-02T15:19:58.5+02:00,\"46° 30' "
      "12\"\" N\",7 E,3\n");
  add("gpx", "",
      "<g:gpx xmlns:g=\"u\"><g:rte><g:rtept lat=\"1\" "
      "lon=\"2\"><g:time>2020-04-02T15:19:58Z</g:time><g:extensions>"
      "<g:speed>3</g:speed></g:extensions></g:rtept></g:rte></g:gpx>");
  std::size_t num_tables = 0;
  for (const Sample& sample : all) {
    if (std::string_view(sample.format) == "oxts")
      continue;  // of files that tum's reader has the like of
    const std::string text = sample.files(true).front().second;
    const auto format = test::format_from(sample.format, sample.keys);
    const auto try_to_read = [&](const std::string& damaged) {
      try {
        format->read(written("recording", damaged), sample.above);
        ++num_tables;
      } catch (const core::Error& error) {
        EXPECT_TRUE(error.kind() == core::ErrorKind::Input ||
                    error.kind() == core::ErrorKind::Config)
            << error.what() << "\n"
            << damaged;
      }
    };
    // Each third byte in turn becomes one of these, and is the last.
    constexpr std::string_view kOthers("\0\n\",(:-9\xC2#<", 11);
    for (std::size_t at = 0; at < text.size(); at += 3) {
      try_to_read(text.substr(0, at));
      for (const std::size_t shift : {0u, 5u}) {
        std::string damaged = text;
        damaged[at] = kOthers[(at + shift) % kOthers.size()];
        try_to_read(damaged);
      }
    }
  }
  EXPECT_GT(num_tables, all.size());  // a digit that is another is a number still
}

/// A recording that has places and times, but no heights.
struct WithoutHeights {
  const char* format;
  std::string text;
  std::string keys;
};

std::vector<WithoutHeights> without_heights() {
  std::string gpx = "<gpx><trk><trkseg>", srt, csv = "time_s,latitude_deg,longitude_deg,height_m\n",
              two = "time_s,latitude_deg,longitude_deg\n",
              adsb = "time,icao24,lat,lon,velocity,baroaltitude,geoaltitude\n",
              bare = "time,icao24,lat,lon\n", few = gpx;
  for (int i = 0; i < 20; ++i) {
    const std::string place = fmt::format("42.{:06},1.5", 500000 + 100 * i);
    const std::string point =
        fmt::format("<trkpt lat=\"42.{:06}\" lon=\"1.5\"><time>2024-06-01T10:00:{:02}Z</time>",
                    500000 + 100 * i, i);
    gpx += point + "</trkpt>";
    few += point + (i < 2 ? "<ele>1200</ele>" : "") + "</trkpt>";
    srt += fmt::format(
        "{0}\n00:00:{0:02},000 --> 00:00:59,000\n[latitude : 42.{1:06}] [longtitude : 1.5]\n\n", i,
        500000 + 100 * i);
    csv += fmt::format("{},{},\n", i, place);
    two += fmt::format("{},{}\n", i, place);
    adsb += fmt::format("{},a,{},10,,\n", 1700000000 + i, place);
    bare += fmt::format("{},a,{}\n", 1700000000 + i, place);
  }
  gpx += "</trkseg></trk></gpx>";
  few += "</trkseg></trk></gpx>";
  return {
      {"gpx", gpx, ""},   {"gpx", few, ""},
      {"srt", srt, ""},   {"csv", csv, ""},
      {"csv", two, ""},   {"adsb", adsb, ""},
      {"adsb", bare, ""}, {"csv", two, "place_columns = [\"latitude_deg\", \"longitude_deg\"]\n"}};
}

class WaysOut : public FixLaws {
 protected:
  /// The motion's height above the ground at its middle; the message that it ends in otherwise.
  std::pair<double, std::string> flown(const WithoutHeights& sample, const std::string& keys) {
    const std::filesystem::path file = written("recording", sample.text);
    try {
      const auto motion = test::trajectory_from(
          fmt::format("kind = \"recorded\"\nformat = \"{}\"\nfile = \"{}\"\n{}{}", sample.format,
                      file.string(), sample.keys, keys),
          world_);
      const BodyState state = motion->at(0.5 * motion->duration_s());
      return {test::agl_m(world_, state.world_from_body.translation), ""};
    } catch (const core::Error& error) {
      return {0.0, error.what()};
    }
  }
  test::GroundWorld world_;
};

TEST_F(WaysOut, OfARecordingWithoutHeightsIsNamedByEveryMessageAndWorks) {
  for (const WithoutHeights& sample : without_heights()) {
    for (const std::string& above :
         {std::string(""), std::string("above = \"ellipsoid\"\n"),
          std::string("above = \"home\"\n"),
          std::string("above = \"pressure\"\npressure_offset_m = 60.0\n")}) {
      std::string keys = above;
      std::string message = flown(sample, keys).second;
      // Two points have a height, which is looked for above a geoid that this world has not.
      if (message.find("need a geoid") != std::string::npos &&
          sample.text.find("<ele>") != std::string::npos)
        continue;
      ASSERT_NE(message.find("above = \"none\""), std::string::npos)
          << sample.format << " " << keys << message;
    }
    // As the message says, with a height and without one.
    const auto [height_m, message] = flown(sample, "above = \"none\"\nheight_offset_m = 100.0\n");
    EXPECT_EQ(message, "") << sample.format;
    EXPECT_NEAR(height_m, 100.0, 0.01)
        << sample.format;  // the ground is level; the Earth curves by less
    const std::string low = flown(sample, "above = \"none\"\n").second;
    EXPECT_NE(low.find("height_offset_m"), std::string::npos) << low;
  }
}

TEST_F(WaysOut, HeightsAboveTheGroundOfAFileWithoutAnyAreTheOffset) {
  for (const WithoutHeights& sample : without_heights()) {
    if (sample.text.find("<ele>") != std::string::npos) continue;  // two have one
    const auto [height_m, message] = flown(sample, "above = \"ground\"\nheight_offset_m = 100.0\n");
    const bool needs_columns = message.find("unknown column") != std::string::npos;
    if (needs_columns) {
      EXPECT_NE(message.find("above = \"none\""), std::string::npos) << message;
      continue;
    }
    EXPECT_EQ(message, "") << sample.format;
    EXPECT_NEAR(height_m, 100.0, 0.01) << sample.format;
  }
}

// A message names what to write; the next message may name another key, and in the end it flies.
TEST_F(WaysOut, FollowedOneAfterTheOtherEndInAFlight) {
  std::string route = "<gpx><rte>", waypoints = "<gpx>", satellites, radians;
  for (int i = 0; i < 20; ++i) {
    const std::string place = fmt::format("lat=\"42.{:06}\" lon=\"1.5\"", 500000 + 100 * i);
    route += "<rtept " + place + "/>";
    waypoints += "<wpt " + place + "/>";
    satellites +=
        fmt::format("{0}\n00:00:{0:02},000 --> 00:00:59,000\nGPS (1.5, 42.{1:06}, 15)\n\n", i,
                    500000 + 100 * i);
    constexpr double kRadian = 0.017453292519943295;
    radians += fmt::format(
        "{0}\n00:00:{0:02},000 --> 00:00:59,000\n[latitude: {1:.9f}] [longitude: {2:.9f}] "
        "[abs_alt: 1100]\n\n",
        i, (42.5 + 1e-4 * i) * kRadian, 1.5 * kRadian);
  }
  world_.ground = [](double lat_deg, double lon_deg) -> std::optional<double> {
    if (std::abs(lat_deg - 42.5) > 0.5 || std::abs(lon_deg - 1.5) > 0.5) return std::nullopt;
    return 1000.0;
  };
  struct Way {
    const char* words;  ///< of a message
    const char* keys;   ///< what it makes a reader write
  };
  const std::vector<Way> ways = {{"above is not given", "above = \"ellipsoid\"\n"},
                                 {"above = \"none\"", "above = \"none\"\nheight_offset_m = 80.0\n"},
                                 {"timing = \"speed\"", "timing = \"speed\"\n"},
                                 {"points = \"waypoints\"", "points = \"waypoints\"\n"},
                                 {"order = \"lon_lat\"", "order = \"lon_lat\"\n"},
                                 {"angle_unit = \"rad\"", "angle_unit = \"rad\"\n"}};
  const auto without = [](std::string keys, const std::string& key) {
    const std::size_t begin = keys.find(key + " = ");
    return begin == std::string::npos ? keys
                                      : keys.erase(begin, keys.find('\n', begin) + 1 - begin);
  };
  for (const WithoutHeights& sample :
       {WithoutHeights{"gpx", route + "</rte></gpx>", ""},
        WithoutHeights{"gpx", waypoints + "</gpx>", ""}, WithoutHeights{"srt", satellites, ""},
        WithoutHeights{"srt", radians, ""}}) {
    std::string keys, message;
    std::size_t num_steps = 0;
    for (; num_steps < ways.size(); ++num_steps) {
      message = flown(sample, keys).second;
      if (message.empty()) break;
      const auto way = std::find_if(ways.begin(), ways.end(), [&](const Way& one) {
        return message.find(one.words) != std::string::npos;
      });
      ASSERT_NE(way, ways.end()) << message;
      keys = without(keys, std::string(way->keys, std::string(way->keys).find(' '))) + way->keys;
    }
    EXPECT_EQ(message, "") << sample.format << " after " << num_steps << " steps: " << keys;
  }
}

TEST_F(WaysOut, OfSubtitlesNameTheHeightThatTheyHave) {
  const auto cues = [](const std::string& height) {
    std::string text;
    for (int i = 0; i < 20; ++i)
      text += fmt::format(
          "{0}\n00:00:{0:02},000 --> 00:00:59,000\n[latitude : 42.{1:06}] [longtitude : 1.5] "
          "{2}\n\n",
          i, 500000 + 100 * i, height);
    return WithoutHeights{"srt", text, ""};
  };
  const WithoutHeights only_home = cues("[rel_alt: 80.0]"),
                       only_altitude = cues("[altitude: 1080.0]");
  EXPECT_NE(flown(only_home, "above = \"ellipsoid\"\n").second.find("above = \"home\""),
            std::string::npos);
  EXPECT_NEAR(flown(only_home, "above = \"home\"\n").first, 80.0, 0.01);
  EXPECT_NE(flown(only_altitude, "above = \"home\"\n").second.find("above = \"ellipsoid\""),
            std::string::npos);
  EXPECT_NEAR(flown(only_altitude, "above = \"ellipsoid\"\n").first, 80.0, 0.01);
  EXPECT_NEAR(flown(only_altitude, "above = \"none\"\nheight_offset_m = 50.0\n").first, 50.0, 0.01);
}

}  // namespace
}  // namespace terracast::geo
