// Recorded flights: what is dropped, how parts come about, and what is flown, on motions that are
// known and on real ones.

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <numbers>
#include <random>

#include "core/schema_writer.h"
#include "core/toml_reader.h"
#include "geo/fixes/csv_table.h"
#include "geo/fixes/recording.h"
#include "geo/sun.h"
#include "geo/units.h"
#include "tests/geo/trajectory_support.h"
#include "tests/support/test_data.h"

namespace terracast::geo {
namespace {

using terracast::test::shared_data;
using test::GroundWorld;
using test::message_of;
using test::options_from;

constexpr double kDegree = std::numbers::pi / 180.0;

RecordingOptions recording_from(const std::string& toml) {
  RecordingOptions options;
  core::TomlDocument::parse(toml, "test.toml").read(options);
  return options;
}

/// Fixes in metres east, north, up of the world's origin; time_s,x,y,z.
struct Row {
  double time_s;
  Eigen::Vector3d place;
};

class RecordedFlight : public testing::Test {
 protected:
  std::string config(const std::vector<Row>& rows, const std::string& more) {
    const std::filesystem::path file = scratch_ / "fixes.csv";
    std::ofstream csv(file);
    csv << "time_s,x,y,z\n";
    for (const Row& row : rows)
      csv << fmt::format("{:.6f},{:.6f},{:.6f},{:.6f}\n", row.time_s, row.place.x(), row.place.y(),
                         row.place.z());
    return fmt::format(R"(
file = "{}"
format = "csv"
frame = "local"
place_columns = ["x", "y", "z"]
origin = {{ lat_deg = 42.5, lon_deg = 1.5, height_m = 100.0 }}
{})",
                       file.string(), more);
  }
  Recording read(const std::vector<Row>& rows, const std::string& more) {
    return read_recording(recording_from(config(rows, more)), world_.context());
  }
  std::unique_ptr<Trajectory> fly(const std::vector<Row>& rows, const std::string& more) {
    return test::trajectory_from("kind = \"recorded\"\n" + config(rows, more), world_);
  }
  /// Where a motion is, in metres about the recording's origin.
  Eigen::Vector3d local(const BodyState& state) const {
    return state.world_from_body.translation - Eigen::Vector3d(0.0, 0.0, 100.0);
  }

  terracast::test::ScratchFolder scratch_;
  GroundWorld world_;
};

Eigen::Vector3d weaving(double t) {
  return {15.0 * t, 80.0 * std::sin(t / 8.0), 30.0 * std::sin(t / 11.0)};
}

std::vector<Row> weaving_rows(double duration_s, double step_s) {
  std::vector<Row> rows;
  const int count = static_cast<int>(std::lround(duration_s / step_s));
  for (int i = 0; i <= count; ++i) rows.push_back({i * step_s, weaving(i * step_s)});
  return rows;
}

TEST_F(RecordedFlight, FollowsTheTruthThroughNoiseAndOutliers) {
  std::vector<Row> rows = weaving_rows(300.0, 1.0);
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (Row& row : rows)
    row.place += Eigen::Vector3d(2.0 * normal(random), 2.0 * normal(random), 4.0 * normal(random));
  for (std::size_t i = 20; i < rows.size(); i += 40) rows[i].place.x() += 60.0;
  const std::string sigmas = "sigma_m = 2.0\nsigma_height_m = 4.0\n";
  const Recording recording = read(rows, sigmas);
  ASSERT_EQ(recording.parts.size(), 1u);
  // Each outlier counts as one of 3 sigma, which leaves the others a little less than sigma.
  EXPECT_NEAR(recording.parts[0].horizontal_rms_m, 2.0, 0.3);
  EXPECT_NEAR(recording.parts[0].vertical_rms_m, 4.0, 0.6);
  EXPECT_GE(recording.parts[0].num_outliers, 7u);
  const auto motion = fly(rows, sigmas);
  double level = 0.0, height = 0.0, speed = 0.0;
  constexpr int kCount = 1000;
  for (int i = 0; i <= kCount; ++i) {
    const double t = motion->duration_s() * i / kCount;
    const BodyState state = motion->at(t);
    const Eigen::Vector3d miss = local(state) - weaving(t);
    level += miss.head<2>().squaredNorm() / 2.0;
    height += miss.z() * miss.z();
    const Eigen::Vector3d velocity = (weaving(t + 1e-3) - weaving(t - 1e-3)) / 2e-3;
    speed += (state.velocity_world_mps - velocity).squaredNorm() / 3.0;
  }
  // The noise is averaged over some ten fixes, which also rounds the curves a little.
  EXPECT_LT(std::sqrt(level / kCount), 1.3);
  EXPECT_LT(std::sqrt(height / kCount), 2.6);
  EXPECT_LT(std::sqrt(speed / kCount), 0.7);
}

TEST_F(RecordedFlight, AReceiverThatHoldsItsPlaceIsTakenAtItsOwnRate) {
  // 60 records a second of a receiver that moves on 5 times a second.
  std::vector<Row> rows;
  for (int i = 0; i <= 60 * 40; ++i)
    rows.push_back({i / 60.0, weaving(std::floor(i / 12.0) / 5.0)});
  const Recording recording = read(rows, "sigma_m = 0.05\n");
  EXPECT_EQ(recording.num_fixes, 2401u);
  EXPECT_EQ(recording.dropped.num_repeated, 2401u - 201u);
  ASSERT_EQ(recording.parts.size(), 1u);
  EXPECT_EQ(recording.parts[0].num_fixes, 201u);
  const auto motion = fly(rows, "sigma_m = 0.05\n");
  for (int i = 0; i <= 500; ++i) {
    const double t = motion->duration_s() * i / 500;
    const BodyState state = motion->at(t);
    // A natural spline bends away from a curve at its ends.
    const bool is_at_an_end = t < 2.0 || t > 38.0;
    ASSERT_LT((local(state) - weaving(t)).norm(), is_at_an_end ? 0.5 : 0.15) << t;
    // No stairs: the speed is that of the flight all the time.
    const Eigen::Vector3d velocity = (weaving(t + 1e-3) - weaving(t - 1e-3)) / 2e-3;
    ASSERT_LT((state.velocity_world_mps - velocity).norm(), is_at_an_end ? 0.8 : 0.3) << t;
  }
}

TEST_F(RecordedFlight, ABodyThatRestsStaysWhereItIs) {
  // 8 m/s, braking for 8 s, a minute at rest at one recorded place, and away again.
  std::vector<Row> rows;
  std::mt19937 random(12);
  std::normal_distribution<double> normal(0.0, 0.2);
  for (int i = 0; i <= 200; ++i) {
    const double before = std::min(i - 60.0, 0.0), after = std::max(i - 120.0, 0.0);
    const auto eased = [](double t) { return t < 8.0 ? 0.5 * t * t : 8.0 * (t - 4.0); };
    const Eigen::Vector3d place(eased(after) - eased(-before), 0.0, 0.0);
    const bool rests = i >= 60 && i <= 120;
    rows.push_back(
        {static_cast<double>(i),
         place + (rests ? 0.0 : 1.0) * Eigen::Vector3d(normal(random), normal(random), 0.0)});
  }
  const auto motion = fly(rows, "sigma_m = 0.2\nmax_gap_s = 10.0\n");
  EXPECT_NEAR(motion->duration_s(), 200.0, 1e-9);
  for (int i = 66; i <= 114; ++i) {
    const BodyState state = motion->at(i);
    ASSERT_LT(local(state).norm(), 0.4) << i;
    ASSERT_LT(state.velocity_world_mps.norm(), 0.3) << i;
    // It goes on looking where it went, level.
    const Eigen::Vector3d ahead = state.world_from_body.rotation * Eigen::Vector3d::UnitX();
    ASSERT_GT(ahead.x(), 0.99) << i;
    ASSERT_NEAR(ahead.z(), 0.0, 1e-6) << i;  // the Earth curves by that
  }
}

TEST_F(RecordedFlight, AHoverThatTurnsRoundTurnsItsHeadingSmoothly) {
  // East for 40 s, rest for 20 s, then back west, climbing straight up in between.
  std::vector<Row> rows;
  for (int i = 0; i <= 100; ++i) {
    const double along = i < 40 ? i : i <= 60 ? 40.0 : 100.0 - i;
    const double up = std::clamp(i - 42, 0, 16);
    rows.push_back({static_cast<double>(i), {10.0 * along, 0.05 * (i % 2), 2.0 * up}});
  }
  const auto motion = fly(rows, "sigma_m = 0.3\nslow_mps = 2.0\n");
  double most_turn = 0.0;
  for (int i = 1; i < 2000; ++i) {
    const double t = motion->duration_s() * i / 2000;
    const BodyState state = motion->at(t);
    const Eigen::Matrix3d axes = state.world_from_body.rotation.toRotationMatrix();
    most_turn = std::max(most_turn, state.angular_velocity_body_radps.norm());
    ASSERT_GT(axes(2, 2), 0.8) << t;  // upright through the climb
    constexpr double kStep_s = 1e-4;
    const Eigen::AngleAxisd turn(motion->at(t - kStep_s).world_from_body.rotation.conjugate() *
                                 motion->at(t + kStep_s).world_from_body.rotation);
    ASSERT_LT(
        (turn.angle() * turn.axis() / (2 * kStep_s) - state.angular_velocity_body_radps).norm(),
        1e-3 * (1.0 + state.angular_velocity_body_radps.norm()))
        << t;
  }
  EXPECT_GT((motion->at(20.0).world_from_body.rotation * Eigen::Vector3d::UnitX()).x(), 0.99);
  EXPECT_LT((motion->at(80.0).world_from_body.rotation * Eigen::Vector3d::UnitX()).x(), -0.99);
  EXPECT_LT(most_turn, 1.5);
}

TEST_F(RecordedFlight, ImpossibleFixesAreDroppedAndCounted) {
  std::vector<Row> rows = weaving_rows(100.0, 1.0);
  for (const std::size_t i : {0u, 30u, 31u, 32u, 70u}) rows[i].place.y() += 5000.0;
  std::swap(rows[50], rows[51]);
  rows[80].time_s = 5e8;  // a clock that jumped
  const Recording recording = read(rows, "max_speed_mps = 60.0\n");
  EXPECT_EQ(recording.dropped.num_impossible, 5u);
  EXPECT_EQ(recording.dropped.num_out_of_order, 2u);
  ASSERT_EQ(recording.parts.size(), 1u);
  EXPECT_EQ(recording.parts[0].num_fixes, 101u - 7u);
  const std::string summary =
      summary_of(recording, recording_from(config(rows, "max_speed_mps = 60.0\n")));
  EXPECT_NE(summary.find("5 impossible (faster than 60 m/s)"), std::string::npos) << summary;
  EXPECT_NE(summary.find("2 out of the order of time"), std::string::npos) << summary;
}

// A clock that jumps ahead within a part, once: the attitudes after it are as good as ever.
TEST_F(RecordedFlight, AClockThatJumpsOnceTakesNoAttitudeAway) {
  const std::filesystem::path file = scratch_ / "jump.csv";
  std::ofstream csv(file);
  csv << "time_s,latitude_deg,longitude_deg,height_m,yaw,pitch,roll\n";
  const auto roll_deg = [](double t) { return 20.0 * std::sin(0.8 * t); };
  for (int i = 0; i < 400; ++i) {
    const double t = 0.1 * i;
    csv << fmt::format("{:.1f},{:.7f},1.5,1500,0,0,{:.6f}\n", i == 30 ? 23.0 : t, 42.5 + 2e-6 * i,
                       roll_deg(t));
  }
  csv.close();
  const std::string text = fmt::format(
      "kind = \"recorded\"\nformat = \"csv\"\nabove = \"ellipsoid\"\nsigma_attitude_deg = 0.0\n"
      "attitude_columns = [\"yaw\", \"pitch\", \"roll\"]\nfile = \"{}\"\n",
      file.string());
  const auto motion = test::trajectory_from(text, world_);
  const auto upright = test::trajectory_from(text + "attitude = \"path\"\n", world_);
  for (double t = 4.0; t < 36.0; t += 0.5) {
    const Eigen::AngleAxisd turn(upright->at(t).world_from_body.rotation.conjugate() *
                                 motion->at(t).world_from_body.rotation);
    EXPECT_NEAR(turn.angle(), std::abs(radians_from_degrees(roll_deg(t))), 1e-3) << t;
  }
}

TEST_F(RecordedFlight, GapsSplitItAndThePartIsChosen) {
  std::vector<Row> rows;
  for (const Row& row : weaving_rows(200.0, 1.0))
    if (row.time_s <= 40.0 || (row.time_s > 75.0 && row.time_s <= 77.0) || row.time_s >= 120.0)
      rows.push_back(row);
  const Recording recording = read(rows, "");
  ASSERT_EQ(recording.parts.size(), 2u);
  EXPECT_EQ(recording.dropped.num_in_short_parts, 2u);
  EXPECT_NEAR(fly(rows, "")->duration_s(), 80.0, 1e-9);
  const auto first = fly(rows, "part = 0\n");
  EXPECT_NEAR(first->duration_s(), 40.0, 1e-9);
  EXPECT_LT((local(first->at(0.0)) - weaving(0.0)).norm(), 1e-6);
  const std::string message = message_of(core::ErrorKind::Config, [&] { fly(rows, "part = 2\n"); });
  EXPECT_NE(message.find("0: 0.0 s to 40.0 s, 1: 120.0 s to 200.0 s"), std::string::npos)
      << message;
  EXPECT_EQ(read(rows, "max_gap_s = 50.0\n").parts.size(), 1u);
}

TEST_F(RecordedFlight, PartsBecomeSequencesOfTheirOwn) {
  // Parts of 40 s, 10 s and 80 s.
  std::vector<Row> rows;
  for (const Row& row : weaving_rows(200.0, 1.0))
    if (row.time_s <= 40.0 || (row.time_s >= 75.0 && row.time_s <= 85.0) || row.time_s >= 120.0)
      rows.push_back(row);
  const std::string entry =
      "name = \"F\"\nkind = \"recorded\"\nrate_hz = 2.0\n" + config(rows, "split = true\n");
  const auto sequences = split_sequences(options_from(entry), world_.context());
  ASSERT_EQ(sequences.size(), 3u);
  const std::vector<double> starts_s = {0.0, 75.0, 120.0};
  const std::vector<std::size_t> num_frames = {81, 21, 161};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(sequences[i].name, fmt::format("F_{}", i));
    const auto states = sample_frames(sequences[i], world_.context()).states;
    EXPECT_EQ(states.size(), num_frames[i]);
    EXPECT_LT((local(states[0]) - weaving(starts_s[i])).norm(), 1e-6);
    // As an entry for that part would be written.
    const std::string text = core::toml_text(sequences[i]);
    EXPECT_NE(text.find(fmt::format("part = {}", i)), std::string::npos) << text;
    EXPECT_NE(text.find("split = false"), std::string::npos) << text;
  }
  // The short one holds no 50 frames, and none holds 500.
  const auto names = [&](int frames) {
    std::string all;
    for (const auto& sequence : split_sequences(
             options_from(fmt::format("num_frames = {}\n", frames) + entry), world_.context()))
      all += sequence.name + " " + std::to_string(sequence.num_frames) + " ";
    return all;
  };
  EXPECT_EQ(names(50), "F_0 50 F_1 50 ");
  EXPECT_NE(message_of(core::ErrorKind::Input, [&] { names(500); }).find("no part"),
            std::string::npos);
  EXPECT_EQ(split_sequences(options_from(test::orbit_text(100.0, 10.0)), world_.context()).size(),
            1u);
  EXPECT_NE(message_of(core::ErrorKind::Config, [&] { fly(rows, "split = true\npart = 1\n"); })
                .find("leave one of them out"),
            std::string::npos);
}

TEST_F(RecordedFlight, PartsOutsideTheWorldOrTooLowAreClippedOrRefused) {
  const std::vector<Row> rows = weaving_rows(200.0, 1.0);
  world_.ground = [frame = world_.frame](double lat_deg, double lon_deg) -> std::optional<double> {
    const Eigen::Vector3d at = frame.world_from_geodetic({lat_deg, lon_deg, 1000.0});
    if (at.x() > 2250.0) return std::nullopt;                   // left after 150 s
    return at.x() > 600.0 && at.x() < 750.0 ? 1090.0 : 1000.0;  // a hill from 40 s to 50 s
  };
  const std::string outside = message_of(core::ErrorKind::Input, [&] { fly(rows, ""); });
  EXPECT_NE(outside.find("outside = \"clip\""), std::string::npos) << outside;
  double left_at_s = 0.0;
  ASSERT_EQ(std::sscanf(outside.c_str(), "the recording leaves the world's ground at t = %lf",
                        &left_at_s),
            1);
  EXPECT_NEAR(left_at_s, 150.0, 0.5);
  const std::string low = message_of(core::ErrorKind::Input,
                                     [&] { fly(rows, "outside = \"clip\"\nmin_agl_m = 50.0\n"); });
  EXPECT_NE(low.find("too_low = \"clip\""), std::string::npos) << low;
  const auto longest = fly(rows, "outside = \"clip\"\ntoo_low = \"clip\"\nmin_agl_m = 50.0\n");
  // From behind the hill to the world's end; samples are 5 m apart.
  EXPECT_NEAR(longest->duration_s(), 100.0, 1.0);
  EXPECT_NEAR(local(longest->at(0.0)).x(), 750.0, 6.0);
  const auto first =
      fly(rows, "outside = \"clip\"\ntoo_low = \"clip\"\nmin_agl_m = 50.0\npart = 0\n");
  EXPECT_NEAR(first->duration_s(), 40.0, 0.5);
  for (int i = 0; i <= 100; ++i)
    ASSERT_GT(
        test::agl_m(world_, first->at(first->duration_s() * i / 100).world_from_body.translation),
        50.0 - 0.01);
}

TEST_F(RecordedFlight, ExchangedLatitudeAndLongitudeAreTold) {
  // The world reaches 0.5 degrees from latitude 42.5, longitude 1.5.
  world_.ground = [](double lat_deg, double lon_deg) -> std::optional<double> {
    if (std::abs(lat_deg - 42.5) > 0.5 || std::abs(lon_deg - 1.5) > 0.5) return std::nullopt;
    return 1000.0;
  };
  const std::filesystem::path file = scratch_ / "geodetic.csv";
  const auto told = [&](double lat_deg, double lon_deg, const std::string& more) {
    std::ofstream csv(file);
    csv << "time_s,latitude_deg,longitude_deg,height_m\n";
    for (int i = 0; i < 100; ++i)
      csv << fmt::format("{},{:.7f},{:.7f},2000\n", i, lat_deg + 1e-4 * i, lon_deg);
    csv.close();
    return message_of(core::ErrorKind::Input, [&] {
      test::trajectory_from(fmt::format("kind = \"recorded\"\nfile = \"{}\"\nformat = \"csv\"\n"
                                        "above = \"ellipsoid\"\n{}",
                                        file.string(), more),
                            world_);
    });
  };
  for (const char* more : {"", "outside = \"clip\"\n"}) {
    const std::string exchanged = told(1.5, 42.5, more);
    EXPECT_NE(exchanged.find("with latitude and longitude exchanged"), std::string::npos)
        << exchanged;
    const std::string far_off = told(52.5, 1.5, more);
    EXPECT_EQ(far_off.find("exchanged"), std::string::npos) << far_off;
  }
  const std::string beyond_the_pole = told(142.5, 42.5, "");
  EXPECT_NE(beyond_the_pole.find("the fix of line 2 lies at latitude 142.5"), std::string::npos)
      << beyond_the_pole;
}

TEST_F(RecordedFlight, CanBeFlownAtASpeedOfItsOwn) {
  std::vector<Row> rows = weaving_rows(100.0, 1.0);
  for (Row& row : rows) row.time_s = 7.0;  // no times worth the name
  const std::string message = message_of(core::ErrorKind::Input, [&] { fly(rows, ""); });
  EXPECT_NE(message.find("timing = \"speed\""), std::string::npos) << message;
  // Times in the wrong unit.
  const std::string apart = message_of(core::ErrorKind::Input,
                                       [&] { fly(weaving_rows(100.0, 1.0), "max_gap_s = 0.5\n"); });
  EXPECT_NE(apart.find("max_gap_s = 0.5"), std::string::npos) << apart;
  EXPECT_NE(apart.find("unit of the times"), std::string::npos) << apart;
  const auto motion = fly(rows, "timing = \"speed\"\nspeed_mps = 25.0\n");
  double chords_m = 0.0;
  for (std::size_t i = 1; i < rows.size(); ++i)
    chords_m += (rows[i].place - rows[i - 1].place).norm();
  EXPECT_NEAR(motion->duration_s(), chords_m / 25.0, 1e-3);
  for (int i = 1; i < 100; ++i)
    ASSERT_NEAR(motion->at(motion->duration_s() * i / 100).velocity_world_mps.norm(), 25.0, 0.3);
}

TEST_F(RecordedFlight, GivenAttitudesAreFlownSmoothly) {
  // A wide turn with a nose that looks 90 degrees to the side and rolls, an attitude a second.
  const std::filesystem::path file = scratch_ / "attitudes.csv";
  const auto angles = [](double t) {
    return Eigen::Vector3d(1.2 * t, 10.0 * std::sin(t / 7.0), 20.0 * std::sin(t / 5.0));
  };
  std::ofstream csv(file);
  csv << "time_s,x,y,z,yaw,pitch,roll\n";
  for (int t = 0; t <= 60; ++t)
    csv << fmt::format("{},{:.6f},0,0,{:.9f},{:.9f},{:.9f}\n", t, 20.0 * t, angles(t)[0],
                       angles(t)[1], angles(t)[2]);
  csv.close();
  const auto motion = test::trajectory_from(fmt::format(R"(
kind = "recorded"
file = "{}"
format = "csv"
frame = "local"
place_columns = ["x", "y", "z"]
origin = {{ lat_deg = 42.5, lon_deg = 1.5, height_m = 100.0 }}
attitude_columns = ["yaw", "pitch", "roll"]
sigma_attitude_deg = 0.01
)",
                                                        file.string()),
                                            world_);
  for (int i = 0; i <= 600; ++i) {
    const double t = motion->duration_s() * i / 600;
    const BodyState state = motion->at(t);
    const Eigen::Matrix3d enu = world_.frame.world_from_enu(state.world_from_body.translation);
    const Eigen::Vector3d a = angles(t) * kDegree;
    const Eigen::Vector3d ahead =
        enu.transpose() * (state.world_from_body.rotation * Eigen::Vector3d::UnitX());
    const Eigen::Vector3d expected(std::sin(a[0]) * std::cos(a[1]), std::cos(a[0]) * std::cos(a[1]),
                                   std::sin(a[1]));
    // Between attitudes a second apart, at their ends too.
    const double bound = (t < 2.0 || t > 58.0 ? 0.2 : 0.03) * kDegree;
    ASSERT_LT((ahead - expected).norm(), bound) << t;
    const Eigen::Vector3d left =
        enu.transpose() * (state.world_from_body.rotation * Eigen::Vector3d::UnitY());
    ASSERT_NEAR(left.z(), std::sin(a[2]) * std::cos(a[1]), bound) << t;
    if (i == 0 || i == 600) continue;
    constexpr double kStep_s = 1e-3;
    const Eigen::AngleAxisd turn(motion->at(t - kStep_s).world_from_body.rotation.conjugate() *
                                 motion->at(t + kStep_s).world_from_body.rotation);
    ASSERT_LT(
        (turn.angle() * turn.axis() / (2 * kStep_s) - state.angular_velocity_body_radps).norm(),
        2e-5)
        << t;
  }
}

TEST_F(RecordedFlight, IsFlownWhereItsAttitudeIsKnown) {
  const std::filesystem::path file = scratch_ / "attitudes.csv";
  const auto fly_with = [&](const std::function<bool(int)>& has_attitude) {
    std::ofstream csv(file);
    csv << "time_s,x,y,z,yaw,pitch,roll\n";
    for (int t = 0; t <= 100; ++t)
      csv << fmt::format("{},{},0,0,{}\n", t, 20 * t, has_attitude(t) ? "90,0,0" : ",,");
    csv.close();
    return test::trajectory_from(fmt::format(R"(
kind = "recorded"
file = "{}"
format = "csv"
frame = "local"
place_columns = ["x", "y", "z"]
origin = {{ lat_deg = 42.5, lon_deg = 1.5, height_m = 100.0 }}
attitude_columns = ["yaw", "pitch", "roll"]
)",
                                             file.string()),
                                 world_);
  };
  const auto motion = fly_with([](int t) { return t >= 10 && t <= 70 && t % 3 != 0; });
  EXPECT_NEAR(motion->duration_s(), 60.0, 1e-9);
  EXPECT_NEAR(local(motion->at(0.0)).x(), 200.0, 1e-6);
  const std::string message =
      message_of(core::ErrorKind::Input, [&] { fly_with([](int t) { return t < 20 || t > 80; }); });
  EXPECT_NE(message.find("no attitude between 19.0 s and 81.0 s"), std::string::npos) << message;
}

TEST_F(RecordedFlight, HeightsSayWhatTheyAreAbove) {
  const std::filesystem::path file = scratch_ / "heights.csv";
  std::ofstream(file)
      << "time_s,latitude_deg,longitude_deg,height_m\n0,42.5,1.5,80\n1,42.5001,1.5,80\n"
         "2,42.5002,1.5,80\n3,42.5003,1.5,80\n";
  const auto start_m = [&](const std::string& more, std::shared_ptr<const Geoid> geoid) {
    TrajectoryContext context = world_.context();
    context.geoid = std::move(geoid);
    const auto motion =
        options_from(fmt::format("kind = \"recorded\"\nformat = \"csv\"\nmin_agl_m = 0.0\n"
                                 "too_low = \"clip\"\nfile = \"{}\"\n{}",
                                 file.string(), more))
            .kind_options()
            .build(context);
    return world_.frame.geodetic_from_world(motion->at(0.0).world_from_body.translation).height_m;
  };
  const auto refused = [&](const std::string& more) {
    return message_of(core::ErrorKind::Config, [&] { start_m(more, nullptr); });
  };
  EXPECT_NE(refused("").find("pressure_offset_m"), std::string::npos);
  EXPECT_NE(refused("above = \"pressure\"").find("pressure_offset_m"), std::string::npos);
  EXPECT_NE(refused("above = \"egm96\"").find("geoid"), std::string::npos);
  EXPECT_NEAR(start_m("above = \"ground\"", nullptr), 1080.0, 1e-6);
  EXPECT_NEAR(start_m("above = \"home\"", nullptr), 1080.0, 1e-6);
  EXPECT_NEAR(
      start_m("above = \"home\"\nhome_height_m = 1200.0\nhome_above = \"ellipsoid\"", nullptr),
      1280.0, 1e-6);
  EXPECT_NEAR(start_m("above = \"ellipsoid\"\nheight_offset_m = 1000.0", nullptr), 1080.0, 1e-6);
  if (!std::filesystem::exists("/usr/share/proj/egm96_15.gtx"))
    GTEST_SKIP() << "egm96_15.gtx is missing: install proj-data";
  const auto geoid = Geoid::egm96("/usr/share/proj/egm96_15.gtx", scratch_.path());
  const double undulation_m = geoid->undulation_m(42.5, 1.5);
  EXPECT_NEAR(start_m("above = \"egm96\"\nheight_offset_m = 1000.0", geoid), 1080.0 + undulation_m,
              1e-6);
  EXPECT_NEAR(start_m("above = \"pressure\"\npressure_offset_m = 1007.0", geoid),
              1087.0 + undulation_m, 1e-6);
}

// A place and the ground below it are not at the same x and y far from the origin; it is the body that
// must stay inside.
TEST_F(RecordedFlight, ClipsWhereTheBodyItselfLeavesTheWorld) {
  const std::filesystem::path file = scratch_ / "leaves.csv";
  std::ofstream csv(file);
  csv << "time_s,latitude_deg,longitude_deg,height_m\n";
  for (int i = 0; i < 100; ++i) csv << fmt::format("{},{:.6f},1.5,6000\n", i, 42.6 + 1e-3 * i);
  csv.close();
  const std::string text =
      fmt::format("kind = \"recorded\"\nformat = \"csv\"\nabove = \"ellipsoid\"\nfile = \"{}\"\n",
                  file.string());
  TrajectoryContext context = world_.context();
  context.half_size_m = 15000.0;
  const auto motion = options_from(text + "outside = \"clip\"\n").kind_options().build(context);
  const double last_m = motion->at(motion->duration_s()).world_from_body.translation.y();
  EXPECT_LE(last_m, 15000.0);
  EXPECT_GT(last_m, 15000.0 - 120.0);  // a fix each 111 m
  const std::string message =
      message_of(core::ErrorKind::Input, [&] { options_from(text).kind_options().build(context); });
  EXPECT_NE(message.find("outside"), std::string::npos) << message;
}

TEST_F(RecordedFlight, ItsOwnTimeOfDaySetsTheSun) {
  const std::filesystem::path file = scratch_ / "times.csv";
  std::ofstream csv(file);
  csv << "when,latitude_deg,longitude_deg,height_m\n";
  for (int i = 0; i < 30; ++i)
    csv << fmt::format("2020-04-15T07:39:{:02}.500Z,{:.6f},1.5,1200\n", i, 42.5 + 1e-4 * i);
  csv.close();
  const std::string text = fmt::format(
      "kind = \"recorded\"\nformat = \"csv\"\nabove = \"ellipsoid\"\ntime_column = \"when\"\n"
      "time_unit = \"text\"\nstart_s = 3.25\nfile = \"{}\"\n",
      file.string());
  EXPECT_EQ(sample_frames(options_from(text), world_.context()).utc_start,
            "2020-04-15T07:39:03.750Z");
  EXPECT_EQ(
      sample_frames(options_from(text + "utc_start = \"2021-01-01T00:00:00Z\"\n"), world_.context())
          .utc_start,
      "2021-01-01T00:00:00Z");
  EXPECT_EQ(sample_frames(options_from(test::orbit_text(100.0, 10.0)), world_.context()).utc_start,
            "2025-06-21T10:00:00Z");
}

TEST(UtcText, GoesThereAndBack) {
  for (const char* text : {"1970-01-01T00:00:00Z", "2000-02-29T23:59:59.999Z",
                           "1969-12-31T23:59:59.500Z", "2020-12-31T12:34:56.001Z",
                           "0001-03-01T00:00:00Z", "9999-12-31T23:59:59Z", "1900-03-01T06:00:00Z"})
    EXPECT_EQ(utc_from_unix_seconds(unix_seconds_from_utc(text)), text);
  EXPECT_EQ(utc_from_unix_seconds(1585840798.0), "2020-04-02T15:19:58Z");  // date -u -d @1585840798
  EXPECT_EQ(utc_from_unix_seconds(0.99996), "1970-01-01T00:00:01Z");
  message_of(core::ErrorKind::Input, [] { utc_from_unix_seconds(1e15); });
}

}  // namespace
}  // namespace terracast::geo
