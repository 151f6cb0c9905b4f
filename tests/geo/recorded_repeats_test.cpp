// Fixes that stand in a recording several times: rows at the same time, and a receiver that is slower than the recorder.

#include <cmath>
#include <fstream>

#include "core/toml_reader.h"
#include "geo/fixes/recording.h"
#include "tests/geo/trajectory_support.h"
#include "tests/support/test_data.h"

namespace terracast::geo {
namespace {

class RepeatedFixes : public testing::Test {
 protected:
  /// Rows of time_s,x,y,z in metres about the world's origin, 100 m up.
  std::string config(const std::string& rows) {
    const std::filesystem::path file = scratch_ / "fixes.csv";
    std::ofstream(file) << "time_s,x,y,z\n" << rows;
    return fmt::format(R"(
file = "{}"
format = "csv"
frame = "local"
place_columns = ["x", "y", "z"]
origin = {{ lat_deg = 42.5, lon_deg = 1.5, height_m = 100.0 }}
)",
                       file.string());
  }
  Recording read(const std::string& rows) {
    RecordingOptions options;
    core::TomlDocument::parse(config(rows), "test.toml").read(options);
    const Recording recording = read_recording(options, world_.context());
    summary_ = summary_of(recording, options);
    return recording;
  }

  terracast::test::ScratchFolder scratch_;
  test::GroundWorld world_;
  std::string summary_;
};

TEST_F(RepeatedFixes, RowsThatAreWrittenTwiceAreOneFix) {
  std::string rows;
  for (int i = 0; i < 50; ++i)
    for (int twice = 0; twice < 2; ++twice) rows += fmt::format("{},{},0,0\n", i, 20 * i);
  const Recording recording = read(rows);
  EXPECT_EQ(recording.dropped.num_repeated, 50u);
  ASSERT_EQ(recording.parts.size(), 1u);
  EXPECT_EQ(recording.parts[0].num_fixes, 50u);
  EXPECT_NE(summary_.find("50 repeated"), std::string::npos) << summary_;
}

TEST_F(RepeatedFixes, ABodyThatRestsInRowsThatAreWrittenTwiceKeepsItsTimes) {
  // Without a place that changes, hold_s has no median to follow; the second row of each time is a repeat anyway.
  std::string rows;
  for (int i = 0; i < 50; ++i) rows += fmt::format("{0},7,7,7\n{0},7,7,7\n", i);
  const Recording recording = read(rows);
  EXPECT_EQ(recording.dropped.num_repeated, 50u);
  EXPECT_EQ(recording.dropped.num_of_same_time, 0u);
  ASSERT_EQ(recording.parts.size(), 1u);
  EXPECT_EQ(recording.parts[0].num_fixes, 50u);
}

TEST_F(RepeatedFixes, OtherPlacesAtTheSameTimeAreCountedByThemselves) {
  std::string rows;
  for (int i = 0; i < 50; ++i) {
    rows += fmt::format("{},{},0,0\n", i, 20 * i);
    if (i % 10 == 5) rows += fmt::format("{},{},3,0\n", i, 20 * i);
  }
  const Recording recording = read(rows);
  EXPECT_EQ(recording.dropped.num_of_same_time, 5u);
  EXPECT_EQ(recording.dropped.num_out_of_order, 0u);
  EXPECT_EQ(recording.parts.at(0).num_fixes, 50u);
  EXPECT_NE(summary_.find("5 at the time of another"), std::string::npos) << summary_;
}

// 50 rows a second, a place of the receiver each 0.1 s, a barometer's height in each row.
TEST_F(RepeatedFixes, ABarometerOfItsOwnRateDoesNotHideThatThePlaceIsHeld) {
  const auto east_m = [](double t) { return 15.0 * t; };
  std::string rows;
  for (int i = 0; i <= 50 * 40; ++i)
    rows +=
        fmt::format("{:.2f},{:.3f},0,{:.3f}\n", i / 50.0, east_m((i / 5) / 10.0), 10.0 + 0.02 * i);
  const Recording recording = read(rows);
  EXPECT_EQ(recording.num_fixes, 2001u);
  EXPECT_EQ(recording.dropped.num_repeated, 2001u - 401u);
  const auto motion = test::trajectory_from("kind = \"recorded\"\n" + config(rows), world_);
  for (int i = 1; i < 500; ++i) {
    const BodyState state = motion->at(motion->duration_s() * i / 500);
    // No stairs; heights are those of the rows that are kept, at their times.
    ASSERT_NEAR(state.velocity_world_mps.x(), 15.0, 1e-3) << i;
    ASSERT_NEAR(state.velocity_world_mps.z(), 1.0, 1e-3)
        << i;  // the Earth curves by less over 600 m
  }
}

// A recorder that writes a row for each fix: a climb on the spot is flown row by row.
TEST_F(RepeatedFixes, AClimbOnTheSpotKeepsItsHeights) {
  std::string rows;
  for (int i = 0; i <= 100; ++i) {
    const double x = i < 30 ? 10.0 * i : i <= 60 ? 300.0 : 300.0 + 10.0 * (i - 60);
    rows += fmt::format("{},{},0,{}\n", i, x, i < 30 ? 0.0 : i <= 60 ? 2.0 * (i - 30) : 60.0);
  }
  const Recording recording = read(rows);
  EXPECT_EQ(recording.dropped.num_repeated, 0u);
  EXPECT_EQ(recording.parts.at(0).num_fixes, 101u);
}

TEST_F(RepeatedFixes, TheLogTellsWhatTheFileHoldsOnceForAllItsParts) {
  std::string rows;
  for (int i = 0; i < 120; ++i)
    if (i % 60 < 50) rows += fmt::format("{},{},0,0\n", i, 20 * i);
  const std::filesystem::path file = scratch_ / "more.csv";
  std::ofstream csv(file);
  csv << "time_s,x,y,z,wake,rotor\n";
  for (std::size_t at = 0; at < rows.size();) {
    const std::size_t end = rows.find('\n', at);
    csv << rows.substr(at, end - at) << ",5,\n";
    at = end + 1;
  }
  csv.close();
  std::string text = config("");
  text.replace(text.find("fixes.csv"), 9, "more.csv");
  const core::Log log("test");
  TrajectoryContext context = world_.context();
  context.log = &log;
  const TrajectoryOptions options =
      test::options_from("kind = \"recorded\"\nmax_gap_s = 5.0\nsplit = true\n" + text);
  testing::internal::CaptureStderr();
  for (const auto& sequence : split_sequences(options, context)) sample_frames(sequence, context);
  const std::string told = testing::internal::GetCapturedStderr();
  const auto num_told = [&](const std::string& words) {
    std::size_t count = 0;
    for (std::size_t at = told.find(words); at != std::string::npos; at = told.find(words, at + 1))
      ++count;
    return count;
  };
  EXPECT_EQ(num_told("wake is not known, and stands 100 times"), 1u) << told;
  EXPECT_EQ(num_told("rotor is not known"), 1u) << told;
  EXPECT_EQ(num_told("read: time_s (100 times), x (100 times)"), 1u) << told;
}

}  // namespace
}  // namespace terracast::geo
