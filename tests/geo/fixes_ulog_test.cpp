// Logs of PX4, written here to the bit from the format's definition: what is read of them, and what is refused.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <ctime>
#include <numbers>

#include "tests/geo/fixes_support.h"

namespace terracast::geo {
namespace {

using test::format_from;

constexpr double kDegree = std::numbers::pi / 180.0;

/// Numbers one after the other, little-endian.
template <class... Numbers>
std::string packed(Numbers... numbers) {
  std::string bytes;
  const auto add = [&](auto number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
  };
  (add(numbers), ...);
  return bytes;
}

std::string message(char type, const std::string& payload) {
  return packed(static_cast<std::uint16_t>(payload.size())) + type + payload;
}
std::string header(std::uint64_t start_us = 0) {
  return std::string("ULog\x01\x12\x35\x01", 8) + packed(start_us);
}
std::string flags(std::uint8_t incompatible = 0, std::array<std::uint64_t, 3> appended = {}) {
  return message('B', std::string(8, '\0') + static_cast<char>(incompatible) +
                          std::string(7, '\0') + packed(appended[0], appended[1], appended[2]));
}
std::string format(const std::string& text) { return message('F', text); }
std::string subscribe(std::uint16_t id, const std::string& topic, std::uint8_t instance = 0) {
  return message('A', packed(instance, id) + topic);
}
std::string data(std::uint16_t id, const std::string& record) {
  return message('D', packed(id) + record);
}
std::string dropout(std::uint16_t duration_ms) { return message('O', packed(duration_ms)); }
std::string mark() { return message('S', "\x2F\x73\x13\x20\x25\x0C\xBB\x12"); }

const std::string kGlobalFormat = format(
    "vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;float "
    "alt_ellipsoid;uint8_t lat_lon_reset_counter;uint8_t[3] _padding0;");
const std::string kAttitudeFormat =
    format("vehicle_attitude:uint64_t timestamp;float[4] q;uint8_t quat_reset_counter;");

std::string global_record(std::uint64_t time_us, double lat, double lon, float alt,
                          float alt_ellipsoid, std::uint8_t resets = 0) {
  return packed(time_us, lat, lon, alt, alt_ellipsoid, resets);  // without the padding at the end
}

/// A flight of ten places at 10 Hz with attitudes at 50 Hz.
std::string flight() {
  std::string log = header() + flags() + kGlobalFormat + kAttitudeFormat +
                    subscribe(0, "vehicle_global_position") + subscribe(1, "vehicle_attitude");
  for (std::uint64_t i = 0; i < 50; ++i) {
    if (i % 5 == 0)
      log += data(0, global_record(1000000 + 20000 * i, 42.5 + 1e-6 * static_cast<double>(i), 1.5,
                                   1200.0F, 1250.0F));
    const double yaw = 0.02 * static_cast<double>(i);
    log += data(1, packed(1000000 + 20000 * i, static_cast<float>(std::cos(0.5 * yaw)), 0.0F, 0.0F,
                          static_cast<float>(std::sin(0.5 * yaw)), std::uint8_t{0}));
  }
  return log;
}

class UlogFiles : public test::Recordings {};

TEST_F(UlogFiles, PlacesAndAttitudesHaveTimesOfTheirOwn) {
  const FixTable table = read("ulog", "", flight(), "egm96");
  ASSERT_EQ(table.fixes.size(), 10u);
  ASSERT_EQ(table.attitudes.size(), 50u);
  EXPECT_EQ(table.fixes[3].time_s, 1.3);
  EXPECT_EQ(table.fixes[3].place, Eigen::Vector3d(42.5 + 15e-6, 1.5, 1200.0));
  EXPECT_FALSE(table.has_utc());
  EXPECT_TRUE(table.ledger.warnings().empty()) << table.ledger.table();
  EXPECT_EQ(read("ulog", "", flight(), "ellipsoid").fixes[3].place.z(), 1250.0);
  // Yaw is clockwise from north, the body's x forward, y left, z up.
  EXPECT_EQ(table.attitudes[10].time_s, 1.2);
  const Eigen::Vector3d forward = table.attitudes[10].attitude * Eigen::Vector3d::UnitX();
  EXPECT_LT((forward - Eigen::Vector3d(std::sin(0.2), std::cos(0.2), 0.0)).norm(), 1e-7);
  const Eigen::Vector3d up = table.attitudes[10].attitude * Eigen::Vector3d::UnitZ();
  EXPECT_LT((up - Eigen::Vector3d::UnitZ()).norm(), 1e-7);
}

TEST_F(UlogFiles, RollAndPitchAreAboutForwardAndRight) {
  const double roll = 0.3, pitch = 0.2;
  const Eigen::Quaterniond q = Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  const auto f = [](double number) { return static_cast<float>(number); };
  const std::string log = flight() + data(1, packed(std::uint64_t{3000000}, f(q.w()), f(q.x()),
                                                    f(q.y()), f(q.z()), std::uint8_t{0}));
  const Eigen::Quaterniond attitude = read("ulog", "", log, "egm96").attitudes.back().attitude;
  // Nose up, right side down.
  EXPECT_NEAR((attitude * Eigen::Vector3d::UnitX()).z(), std::sin(pitch), 1e-6);
  EXPECT_NEAR((attitude * -Eigen::Vector3d::UnitY()).z(), -std::sin(roll) * std::cos(pitch), 1e-6);
}

TEST_F(UlogFiles, FieldsStandWhereTheFormatSaysAndFormatsNest) {
  const std::string log =
      header() +
      format(
          "vehicle_global_position:inner[2] before;float alt;int16_t more;double lon;uint64_t "
          "timestamp;double lat;") +
      format("inner:uint8_t a;uint32_t[3] b;") + subscribe(7, "vehicle_global_position") +
      data(7, std::string(26, 'x') +
                  packed(250.0F, std::int16_t{-3}, 1.25, std::uint64_t{5000000}, 42.25));
  const FixTable table = read("ulog", "", log, "egm96");
  ASSERT_EQ(table.fixes.size(), 1u);
  EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(42.25, 1.25, 250.0));
  EXPECT_EQ(table.fixes[0].time_s, 5.0);
}

/// North, east, down of an origin.
std::string local_log(float x, float y, float z, bool is_global) {
  return header() +
         format(
             "vehicle_local_position:uint64_t timestamp;uint64_t timestamp_sample;double "
             "ref_lat;double ref_lon;float x;float y;float z;float vx;float vy;float "
             "ref_alt;bool xy_valid;bool z_valid;bool v_xy_valid;bool xy_global;bool z_global;") +
         subscribe(0, "vehicle_local_position") +
         data(0, packed(std::uint64_t{2000000}, std::uint64_t{1990000}, 47.0, 8.5, x, y, z, 3.0F,
                        4.0F, 400.0F, true, true, true, is_global, is_global));
}

TEST_F(UlogFiles, LocalPlacesLieOnTheSphereThatPx4LaysThemOutOn) {
  const double north_m = 3000.0, east_m = -4000.0;
  const Fix fix =
      read("ulog", "",
           local_log(static_cast<float>(north_m), static_cast<float>(east_m), -30.0F, true),
           "egm96")
          .fixes.at(0);
  EXPECT_EQ(fix.time_s, 1.99);  // of the sample, not of the message
  EXPECT_EQ(fix.place.z(), 430.0);
  EXPECT_EQ(fix.speed_mps, 5.0);
  // The other way round, by vectors on the sphere of 6371 km: the distance and the azimuth come back.
  const auto unit = [](double lat_deg, double lon_deg) {
    return Eigen::Vector3d(std::cos(lat_deg * kDegree) * std::cos(lon_deg * kDegree),
                           std::cos(lat_deg * kDegree) * std::sin(lon_deg * kDegree),
                           std::sin(lat_deg * kDegree));
  };
  const Eigen::Vector3d origin = unit(47.0, 8.5), place = unit(fix.place.x(), fix.place.y());
  const Eigen::Vector3d east = Eigen::Vector3d::UnitZ().cross(origin).normalized();
  const Eigen::Vector3d north = origin.cross(east);
  EXPECT_NEAR(6371000.0 * std::atan2(origin.cross(place).norm(), origin.dot(place)), 5000.0, 1e-6);
  EXPECT_NEAR(std::atan2(place.dot(east), place.dot(north)), std::atan2(east_m, north_m), 1e-9);
}

TEST_F(UlogFiles, HeightsAreThoseThatTheConfigAsksFor) {
  const std::string log = local_log(0.0F, 0.0F, -30.0F, true);
  const FixTable home = read("ulog", "", log, "home");
  EXPECT_EQ(home.fixes[0].place.z(), 30.0);
  EXPECT_EQ(home.home->lat_deg, 47.0);
  EXPECT_TRUE(std::isnan(read("ulog", "", log, "none").fixes[0].place.z()));
  const std::string message = refused("ulog", "", log, core::ErrorKind::Config, "ellipsoid");
  EXPECT_NE(message.find("egm96"), std::string::npos) << message;
  EXPECT_NE(message.find("home"), std::string::npos) << message;
}

TEST_F(UlogFiles, FlightsWithoutAReceiverStandAboutTheConfigsOrigin) {
  const std::string log = local_log(10.0F, 20.0F, -30.0F, false);
  const std::string message = refused("ulog", "", log, core::ErrorKind::Input, "egm96");
  EXPECT_NE(message.find("local_origin"), std::string::npos) << message;
  const FixTable table = read("ulog", "places = \"local_origin\"", log, "");
  EXPECT_EQ(table.frame, FixFrame::Local);
  EXPECT_EQ(table.fixes.at(0).place, Eigen::Vector3d(20.0, 10.0, 30.0));
}

TEST_F(UlogFiles, ReceiversOfBothGenerationsAreReadAndSetTheClock) {
  const std::string old_log =
      header() +
      format(
          "vehicle_gps_position:uint64_t timestamp;uint64_t time_utc_usec;int32_t lat;int32_t "
          "lon;int32_t alt;int32_t alt_ellipsoid;float vel_n_m_s;float vel_e_m_s;uint8_t "
          "fix_type;") +
      subscribe(0, "vehicle_gps_position") +
      data(0, packed(std::uint64_t{10000000}, std::uint64_t{0}, 0, 0, 0, 0, 0.0F, 0.0F,
                     std::uint8_t{0})) +
      data(0, packed(std::uint64_t{11000000}, std::uint64_t{1700000011000000}, 425000001, -15000002,
                     1234567, 1284567, 3.0F, -4.0F, std::uint8_t{3}));
  const FixTable old_table = read("ulog", "", old_log, "egm96");
  ASSERT_EQ(old_table.fixes.size(), 2u);
  EXPECT_FALSE(old_table.fixes[0].has_place());
  EXPECT_LT((old_table.fixes[1].place - Eigen::Vector3d(42.5000001, -1.5000002, 1234.567)).norm(),
            1e-12);
  EXPECT_EQ(old_table.fixes[1].speed_mps, 5.0);
  EXPECT_TRUE(old_table.has_utc());
  EXPECT_EQ(old_table.zero_unix_s, 1700000000.0);
  EXPECT_EQ(old_table.fixes[1].time_s, 11.0);
  EXPECT_EQ(old_table.fixes[0].time_s, 10.0);

  const std::string new_log =
      header() +
      format(
          "sensor_gps:uint64_t timestamp;double latitude_deg;double longitude_deg;double "
          "altitude_msl_m;double altitude_ellipsoid_m;uint64_t time_utc_usec;uint8_t fix_type;") +
      subscribe(3, "sensor_gps", 0) + subscribe(4, "sensor_gps", 1) +
      data(3,
           packed(std::uint64_t{1}, 42.0, 1.0, 100.0, 150.0, std::uint64_t{0}, std::uint8_t{3})) +
      data(4, packed(std::uint64_t{1}, 43.0, 1.0, 100.0, 150.0, std::uint64_t{0}, std::uint8_t{3}));
  const FixTable first = read("ulog", "", new_log, "ellipsoid");
  EXPECT_EQ(first.fixes.at(0).place, Eigen::Vector3d(42.0, 1.0, 150.0));
  EXPECT_NE(test::remarks_of(first).find("2 instances"), std::string::npos);
  EXPECT_EQ(read("ulog", "instance = 1", new_log, "ellipsoid").fixes.at(0).place.x(), 43.0);
  // What is read of one instance is not of the other.
  EXPECT_EQ(first.ledger.entries().at("sensor_gps.latitude_deg").num_used, 1);
  EXPECT_EQ(first.ledger.entries().at("sensor_gps.latitude_deg").num_ignored, 1);
  const std::string message =
      refused("ulog", "instance = 2", new_log, core::ErrorKind::Input, "ellipsoid");
  EXPECT_NE(message.find("sensor_gps (instance 1)"), std::string::npos) << message;
}

TEST_F(UlogFiles, JumpsOfTheEstimateBeginAPart) {
  std::string log = header() + kGlobalFormat + subscribe(0, "vehicle_global_position");
  for (std::uint64_t i = 0; i < 4; ++i)
    log += data(0, global_record(i * 100000, 42.5, 1.5, 100.0F, 150.0F, i < 2 ? 0 : 1));
  const FixTable table = read("ulog", "", log, "egm96");
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(table.fixes[i].starts_part, i == 2) << i;
}

TEST_F(UlogFiles, DropoutsAndWhatIsCutOffAreTold) {
  const std::string log = flight() + dropout(60) + dropout(200);
  const FixTable table = read("ulog", "", log + message('L', "6 a text").substr(0, 7), "egm96");
  EXPECT_EQ(table.fixes.size(), 10u);
  const std::string remarks = test::remarks_of(table);
  EXPECT_NE(remarks.find("2 times, for 0.260 s in all and 0.200 s at the longest"),
            std::string::npos)
      << remarks;
  EXPECT_NE(remarks.find(fmt::format("byte {} is cut off", log.size())), std::string::npos)
      << remarks;
}

TEST_F(UlogFiles, AppendedDataIsReadBehindAMessageThatIsCutOff) {
  const std::string records = data(0, global_record(1, 42.0, 1.0, 100.0F, 150.0F));
  const std::string begin =
      kGlobalFormat + subscribe(0, "vehicle_global_position") + records.substr(0, 20);
  const std::uint64_t appended_at = header().size() + flags().size() + begin.size();
  const std::string log = header() + flags(1, {appended_at, 0, 0}) + begin + records;
  const FixTable table = read("ulog", "", log, "egm96");
  ASSERT_EQ(table.fixes.size(), 1u);
  EXPECT_EQ(table.fixes[0].place.x(), 42.0);
  EXPECT_NE(test::remarks_of(table).find("cut off"), std::string::npos);
  EXPECT_NE(refused("ulog", "", header() + flags(1, {9999, 0, 0}) + begin, core::ErrorKind::Input,
                    "egm96")
                .find("9999"),
            std::string::npos);
}

TEST_F(UlogFiles, DamageIsSkippedToTheNextMarkOrRefusedWithItsByte) {
  const std::string garbage(37, '\x03');
  const std::string record = data(0, global_record(5000000, 42.0, 1.0, 100.0F, 150.0F));
  const FixTable table = read("ulog", "", flight() + garbage + mark() + record, "egm96");
  EXPECT_EQ(table.fixes.size(), 11u);
  // The record before it, which no message follows, may be part of the damage.
  constexpr std::size_t kLast = 3 + 2 + 25;
  EXPECT_EQ(table.attitudes.size(), 49u);
  EXPECT_NE(test::remarks_of(table).find(
                fmt::format("67 bytes in 1 place, the first at byte {}", flight().size() - kLast)),
            std::string::npos)
      << test::remarks_of(table);
  const std::string message =
      refused("ulog", "", flight() + garbage + record, core::ErrorKind::Input, "egm96");
  EXPECT_NE(message.find(fmt::format("byte {}", flight().size())), std::string::npos) << message;
}

TEST_F(UlogFiles, DamageThatLooksLikeMessagesIsSkippedToo) {
  const std::string record = data(0, global_record(5000000, 42.0, 1.0, 100.0F, 150.0F));
  const std::string damages[] = {
      data(0, "xx"),                  // a record too short
      data(0, std::string(64, 'x')),  // and too long
      subscribe(0, "vehicle_attitude"),
      subscribe(9, "of no format"),  //
      format("no colon"),
      flags(),
      message('D', "x"),
      message('O', ""),                                 //
      message('L', std::string(3, 'x')).substr(0, 5)};  // ends in the mark
  for (const std::string& damage : damages) {
    const FixTable table = read("ulog", "", flight() + damage + mark() + record, "egm96");
    EXPECT_EQ(table.fixes.size(), 11u) << damage;
    EXPECT_NE(test::remarks_of(table).find(fmt::format("{} bytes in 1 place, the first at byte {}",
                                                       damage.size(), flight().size())),
              std::string::npos)
        << test::remarks_of(table);
    EXPECT_TRUE(table.ledger.warnings().empty()) << table.ledger.table();
  }
}

TEST_F(UlogFiles, ARecordWithoutItsMiddleIsNotFilledUpFromTheNext) {
  const auto record = [](std::uint64_t i) {
    return data(0, global_record(i * 100000, 42.5, 1.5, 100.0F, 150.0F));
  };
  std::string log = header() + kGlobalFormat + subscribe(0, "vehicle_global_position") + record(1) +
                    record(2) + record(3).erase(20, 8) + record(4) + mark() + record(5);
  const FixTable table = read("ulog", "", log, "egm96");
  ASSERT_EQ(table.fixes.size(), 3u);
  for (const Fix& fix : table.fixes)
    EXPECT_EQ(fix.place, Eigen::Vector3d(42.5, 1.5, 100.0)) << fix.time_s;
  EXPECT_EQ(table.fixes[2].time_s, 0.5);
}

// 20 000 numbers of one topic, whose records leave out a thousand fields.
TEST_F(UlogFiles, ManyNumbersOfOneTopicAreCountedOnce) {
  std::string text = "vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;";
  for (int i = 0; i < 900; ++i) text += fmt::format("uint8_t _padding{};", i);
  std::string log = header() + format(text);
  constexpr std::uint16_t kNumIds = 20000;
  for (std::uint16_t id = 0; id < kNumIds; ++id)
    log += subscribe(id, "vehicle_global_position") +
           data(id, packed(std::uint64_t{id}, 42.0, 1.0, 100.0F));
  const std::clock_t begin = std::clock();
  const FixTable table = read("ulog", "", log, "egm96");
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 2.0);
  EXPECT_EQ(table.fixes.size(), kNumIds);
  EXPECT_EQ(table.ledger.entries().at("vehicle_global_position.lat").num_used, kNumIds);
}

/// A receiver's record of the newer layout.
std::string receiver_log(const std::string& more, const std::vector<std::uint64_t>& utc_us) {
  std::string log =
      header() + more +
      format(
          "sensor_gps:uint64_t timestamp;double latitude_deg;double longitude_deg;double "
          "altitude_msl_m;uint64_t time_utc_usec;uint8_t fix_type;") +
      subscribe(3, "sensor_gps");
  for (std::size_t i = 0; i < utc_us.size(); ++i)
    log += data(
        3, packed(std::uint64_t{1000000 * (i + 1)}, 42.0, 1.0, 100.0, utc_us[i], std::uint8_t{3}));
  return log;
}

TEST_F(UlogFiles, TimesThatCannotBeUtcAreNotTaken) {
  const FixTable table =
      read("ulog", "",
           receiver_log("", {0, 18'000'000'000'000'000'000u, 18'000'000'000'000'000'000u,
                             500'000'000'000, 1700000005000000}),
           "egm96");
  EXPECT_EQ(table.zero_unix_s, 1700000000.0);
  EXPECT_NE(test::remarks_of(table).find("3 times of sensor_gps"), std::string::npos)
      << test::remarks_of(table);
  EXPECT_FALSE(read("ulog", "", receiver_log("", {0, 5}), "egm96").has_utc());
}

TEST_F(UlogFiles, UtcOfTheStartIsTakenWhereNoReceiverStatesIt) {
  const std::string key = "uint64_t boot_time_utc_us";
  const auto boot = [&](std::uint64_t utc_us) {
    return message('I', static_cast<char>(key.size()) + key + packed(utc_us));
  };
  EXPECT_EQ(read("ulog", "", receiver_log(boot(1600000000000000), {0}), "egm96").zero_unix_s,
            1600000000.0);
  EXPECT_EQ(read("ulog", "", receiver_log(boot(1600000000000000), {1700000001000000}), "egm96")
                .zero_unix_s,
            1700000000.0);
  EXPECT_FALSE(read("ulog", "", receiver_log(boot(7), {0}), "egm96").has_utc());
}

TEST_F(UlogFiles, WhatContradictsItselfIsRefused) {
  const std::string start = header() + kGlobalFormat;
  const std::string subscribed = start + subscribe(0, "vehicle_global_position");
  const struct {
    std::string log, word;
  } cases[] = {
      {"ULog", "does not begin"},
      {header().substr(0, 12), "within the header"},
      {header() + flags(2), "feature"},
      {header() + flags() + flags(), "first message"},
      {header() + message('B', "short"), "40 or more"},
      {header() + format("no colon"), "defines no format"},
      {header() + format("a:float[0] b;"), "defines no format"},
      {header() + format("a:float b;float b;"), "defines no format"},
      {start + format("vehicle_global_position:uint64_t timestamp;"), "a second time"},
      {start + subscribe(0, "nothing"), "no format before"},
      {subscribed + kAttitudeFormat + subscribe(0, "vehicle_attitude"), "is that of"},
      {subscribed + message('D', "x"), "no number of its topic"},
      {subscribed + message('O', ""), "no duration"},
      {subscribed + data(0, packed(std::uint64_t{1}, 42.0)), "its format takes 33 to 36"},
      {header() + format("vehicle_global_position:inner a;") + format("inner:inner b;") +
           subscribe(0, "vehicle_global_position") + data(0, "12345678"),
       "holds itself"},
      {header() + format("vehicle_global_position:inner a;") +
           subscribe(0, "vehicle_global_position") + data(0, "12345678"),
       "neither a number nor a format"},
      {header() + format("vehicle_global_position:double[65535] a;") +
           subscribe(0, "vehicle_global_position") + data(0, "12345678"),
       "more than 65535 bytes"},
      {header() + format("vehicle_global_position:float lat;") +
           subscribe(0, "vehicle_global_position") + data(0, "1234"),
       "no number lon"},
      {flight() + data(1, packed(std::uint64_t{9}, 2.0F, 0.0F, 0.0F, 0.0F, std::uint8_t{0})),
       "length 2.0000"}};
  for (const auto& [log, word] : cases) {
    const std::string message = refused("ulog", "", log, core::ErrorKind::Input, "egm96");
    EXPECT_NE(message.find(word), std::string::npos) << word << ": " << message;
  }
}

TEST_F(UlogFiles, ALogIsFlownWithTheAttitudesBetweenItsPlaces) {
  test::GroundWorld world;
  const auto file = written("flight.ulg", flight());
  const std::string keys = fmt::format(
      "kind = \"recorded\"\nfile = \"{}\"\nformat = \"ulog\"\nabove = \"ellipsoid\"\n"
      "sigma_attitude_deg = 0.0\n",
      file.string());
  const auto motion = test::trajectory_from(keys, world);
  EXPECT_NEAR(motion->duration_s(), 0.9, 1e-9);
  for (const double time_s : {0.1, 0.33, 0.6}) {
    const MotionState state = motion->at(time_s);
    // One turn rate throughout, by which the end pieces differ less and less.
    EXPECT_NEAR(state.angular_velocity_body_radps.z(), -1.0, 1e-3) << time_s;
    const Eigen::Vector3d forward_enu =
        world.frame.world_from_enu(state.world_from_body.translation).transpose() *
        (state.world_from_body.rotation * Eigen::Vector3d::UnitX());
    EXPECT_NEAR(std::atan2(forward_enu.x(), forward_enu.y()), time_s, 1e-5) << time_s;
  }
  // The antenna is 0.5 m ahead of the body's point and 0.2 m above it.
  const auto moved = test::trajectory_from(keys + "lever_arm_m = [-0.5, 0.0, -0.2]\n", world);
  const MotionState at = motion->at(0.4), other = moved->at(0.4);
  const Eigen::Vector3d arm_body =
      at.world_from_body.rotation.conjugate() *
      (other.world_from_body.translation - at.world_from_body.translation);
  EXPECT_LT((arm_body - Eigen::Vector3d(-0.5, 0.0, -0.2)).norm(), 1e-3);
  EXPECT_NE(test::message_of(core::ErrorKind::Config,
                             [&] { test::trajectory_from(keys + "timing = \"speed\"\n", world); })
                .find("times of their own"),
            std::string::npos);
}

}  // namespace
}  // namespace terracast::geo
