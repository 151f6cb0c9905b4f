// The recordings of real flights: what is read and dropped, held against counts that a script of its
// own takes from the same files (longest chain by brute force, ECEF by the formula), and against what
// the files themselves measured apart from the places: speeds, distances from home, velocities.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/toml_reader.h"
#include "geo/fixes/csv_table.h"
#include "geo/fixes/recording.h"
#include "tests/geo/trajectory_support.h"
#include "tests/support/test_data.h"

namespace terracast::geo {
namespace {

using terracast::test::shared_data;

constexpr double kDegree = std::numbers::pi / 180.0;

struct RealFlight {
  std::string file;
  std::string config;
  Geodetic origin;
  std::size_t num_fixes, num_repeated, num_impossible;
  std::vector<std::size_t> fixes_of_parts;
  double most_median_speed_difference_mps;  ///< 0: the file holds no speeds
};

std::string config_of(const RealFlight& flight) {
  return fmt::format("file = \"{}\"\n{}", (shared_data() / "trajectories" / flight.file).string(),
                     flight.config);
}

RecordingOptions options_of(const RealFlight& flight) {
  RecordingOptions options;
  core::TomlDocument::parse(config_of(flight), "test.toml").read(options);
  return options;
}

std::string adsb(const std::string& above, double sigma_m, double max_gap_s = 30.0) {
  return fmt::format(
      "format = \"adsb\"\nabove = \"{}\"\n{}sigma_m = {}\nsigma_height_m = 10.0\nmax_gap_s = {}\n",
      above, above == "pressure" ? "pressure_offset_m = 60.0\n" : "", sigma_m, max_gap_s);
}

// Speeds over ground are broadcast apart from the places. In the tables of 10 s and more they differ
// from the chords between the fixes around by 5.1, 8.2 and 5.5 m/s themselves (medians, by a script).
const std::vector<RealFlight>& real_flights() {
  static const std::vector<RealFlight> flights = {
      {"andorra_flight_SAVAN09.csv",
       adsb("ellipsoid", 30.0),
       {42.9, 1.5, 1500.0},
       757,
       5,
       1,
       {197, 554},
       0.5},
      {"andorra_flight_SAVAN14.csv",
       adsb("ellipsoid", 30.0),
       {42.6, 1.5, 1500.0},
       753,
       4,
       0,
       {736, 13},
       1.0},
      {"liguria_survey_flight.csv",
       adsb("pressure", 15.0),
       {44.0, 8.0, 0.0},
       1516,
       0,
       0,
       {1516},
       8.0},
      {"nice_vor_calibration_flight.csv",
       adsb("pressure", 15.0),
       {43.6, 7.1, 0.0},
       1246,
       0,
       0,
       {1246},
       11.0},
      {"mercantour_ign_survey_flight.csv",
       adsb("pressure", 50.0, 120.0),
       {44.0, 7.2, 0.0},
       630,
       0,
       0,
       {3, 627},
       8.0},
      {"dji_mavic2zoom_lahore_60hz.csv",
       R"(
format = "csv"
place_columns = ["latitude_deg", "longitude_deg", "altitude_m"]
time_column = "timestamp_local"
time_unit = "text"
utc_offset_h = 5.0
above = "egm96"
sigma_m = 0.3
max_speed_mps = 40.0
)",
       {31.45, 74.4, 0.0},
       7113,
       6191,
       0,
       {922},
       0.0},
      {"dji_p4_rtk.SRT",
       R"(
format = "srt"
order = "lon_lat"
above = "home"
home_height_m = 20.0
home_above = "ellipsoid"
sigma_m = 0.3
sigma_attitude_deg = 0.1
)",
       {-34.23, -58.85, 0.0},
       55,
       0,
       0,
       {55},
       0.3},
      {"dji_phantom4rtk_argentina_6dof.csv",
       R"(
format = "csv"
place_columns = ["latitude_deg", "longitude_deg", "height_above_home_m"]
time_column = "t_s"
above = "home"
home_height_m = 20.0
home_above = "ellipsoid"
attitude_columns = ["body_yaw_deg", "body_pitch_deg", "body_roll_deg"]
gimbal_columns = ["gimbal_yaw_deg", "gimbal_pitch_deg", "gimbal_roll_deg"]
sigma_m = 0.3
sigma_attitude_deg = 0.1
)",
       {-34.23, -58.85, 0.0},
       55,
       0,
       0,
       {55},
       0.0},
      {"comma2k19_sanfrancisco_ecef_6dof.csv",
       R"(
format = "csv"
frame = "ecef"
place_columns = ["ecef_x_m", "ecef_y_m", "ecef_z_m"]
time_column = "t_s"
attitude_columns = ["qw", "qx", "qy", "qz"]
attitude_axes = "frd"
attitude_frame = "ecef"
sigma_m = 0.01
sigma_attitude_deg = 0.1
)",
       {37.7, -122.4, 0.0},
       1200,
       0,
       0,
       {1200},
       0.0},
      {"korita-zbevnica.gpx",
       R"(
format = "gpx"
above = "egm96"
sigma_m = 5.0
max_gap_s = 120.0
max_speed_mps = 10.0
)",
       {45.4, 14.1, 0.0},
       871,
       0,
       0,
       {103, 72, 13, 42, 280},
       0.0},
      {"Mojstrovka.gpx",
       R"(
format = "gpx"
above = "egm96"
timing = "speed"
speed_mps = 1.5
sigma_m = 5.0
)",
       {46.43, 13.74, 0.0},
       184,
       0,
       0,
       {184},
       0.0},
  };
  return flights;
}

class RealFlights : public testing::TestWithParam<RealFlight> {
 protected:
  void SetUp() override {
    TERRACAST_NEEDS_SHARED_DATA("trajectories/" + GetParam().file);
    if (!std::filesystem::exists("/usr/share/proj/egm96_15.gtx"))
      GTEST_SKIP() << "egm96_15.gtx is missing: install proj-data";
    geoid_ = Geoid::egm96("/usr/share/proj/egm96_15.gtx", scratch_.path());
  }
  TrajectoryContext context() const {
    return {.frame = frame_,
            .ground_height_m = [](double, double) { return std::optional(-500.0); },
            .geoid = geoid_};
  }

  terracast::test::ScratchFolder scratch_;
  WorldFrame frame_{GetParam().origin};
  std::shared_ptr<const Geoid> geoid_;
};

TEST_P(RealFlights, AreReadCleanedAndSmoothed) {
  const RealFlight& flight = GetParam();
  const RecordingOptions options = options_of(flight);
  const Recording recording = read_recording(options, context());
  EXPECT_EQ(recording.num_fixes, flight.num_fixes);
  EXPECT_EQ(recording.dropped.num_repeated, flight.num_repeated);
  EXPECT_EQ(recording.dropped.num_impossible + recording.dropped.num_out_of_order,
            flight.num_impossible);
  std::vector<std::size_t> fixes_of_parts;
  for (const SmoothPart& part : recording.parts) fixes_of_parts.push_back(part.num_fixes);
  EXPECT_EQ(fixes_of_parts, flight.fixes_of_parts);
  const auto longest = std::max_element(
      recording.parts.begin(), recording.parts.end(),
      [](const SmoothPart& a, const SmoothPart& b) { return a.num_fixes < b.num_fixes; });
  // Outliers, and manoeuvres that are believed, take a part of what sigma allows.
  EXPECT_LT(longest->horizontal_rms_m, 1.01 * options.sigma_m);
  EXPECT_GT(longest->horizontal_rms_m, 0.6 * options.sigma_m);
  if (flight.most_median_speed_difference_mps > 0.0) {
    ASSERT_TRUE(longest->median_speed_difference_mps);
    EXPECT_LT(*longest->median_speed_difference_mps, flight.most_median_speed_difference_mps);
  }
}

TEST_P(RealFlights, FlySmoothly) {
  const auto options = test::options_from("kind = \"recorded\"\n" + config_of(GetParam()));
  const auto motion = options.kind_options().build(context());
  double most_mps2 = 0.0;
  constexpr int kCount = 2000;
  for (int i = 1; i < kCount; ++i) {
    const double t = motion->duration_s() * i / kCount;
    constexpr double kStep_s = 1e-3;
    const BodyState state = motion->at(t);
    const BodyState before = motion->at(t - kStep_s), after = motion->at(t + kStep_s);
    const Eigen::Vector3d velocity =
        (after.world_from_body.translation - before.world_from_body.translation) / (2 * kStep_s);
    ASSERT_LT((state.velocity_world_mps - velocity).norm(), 1e-4) << t;
    most_mps2 = std::max(
        most_mps2, (after.velocity_world_mps - before.velocity_world_mps).norm() / (2 * kStep_s));
    ASSERT_NEAR(state.world_from_body.rotation.norm(), 1.0, 1e-12);
  }
  // None of these vehicles pulls more than 2 g.
  EXPECT_LT(most_mps2, 20.0);
}

INSTANTIATE_TEST_SUITE_P(Files, RealFlights, testing::ValuesIn(real_flights()),
                         [](const auto& flight) {
                           std::string name = flight.param.file;
                           std::replace_if(
                               name.begin(), name.end(),
                               [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); },
                               '_');
                           return name;
                         });

std::unique_ptr<Trajectory> fly(const std::string& file, const WorldFrame& frame) {
  for (const RealFlight& flight : real_flights()) {
    if (flight.file != file) continue;
    return test::options_from("kind = \"recorded\"\n" + config_of(flight))
        .kind_options()
        .build({.frame = frame,
                .ground_height_m = [](double, double) { return std::optional(-500.0); },
                .geoid = nullptr});
  }
  return nullptr;
}

TEST(RealFlight, ACarsVelocitiesAndCameraAgreeWithItsPlaces) {
  TERRACAST_NEEDS_SHARED_DATA("trajectories/comma2k19_sanfrancisco_ecef_6dof.csv");
  const std::string file = "comma2k19_sanfrancisco_ecef_6dof.csv";
  const WorldFrame frame({37.7, -122.4, 0.0});
  const auto motion = fly(file, frame);
  // The velocities are columns of their own, measured by Doppler; the camera looks along the street.
  const CsvTable table(shared_data() / "trajectories" / file, ',');
  const double zero_s = *table.number(0, table.column("t_s"));
  std::vector<double> differences, angles_deg;
  for (std::size_t row = 1; row + 1 < table.num_rows(); ++row) {
    const BodyState state = motion->at(*table.number(row, table.column("t_s")) - zero_s);
    const Eigen::Vector3d velocity = frame.ecef_from_world().rotation * state.velocity_world_mps;
    const Eigen::Vector3d measured(*table.number(row, table.column("vx_ms")),
                                   *table.number(row, table.column("vy_ms")),
                                   *table.number(row, table.column("vz_ms")));
    differences.push_back((velocity - measured).norm());
    const Eigen::Vector3d ahead = frame.ecef_from_world().rotation *
                                  (state.world_from_body.rotation * Eigen::Vector3d::UnitX());
    if (measured.norm() > 5.0)
      angles_deg.push_back(std::acos(std::clamp(ahead.dot(measured.normalized()), -1.0, 1.0)) /
                           kDegree);
    // The body stands upright.
    ASSERT_GT((state.world_from_body.rotation * Eigen::Vector3d::UnitZ())
                  .dot(frame.up_world(state.world_from_body.translation)),
              0.97);
  }
  std::sort(differences.begin(), differences.end());
  std::sort(angles_deg.begin(), angles_deg.end());
  EXPECT_LT(differences[differences.size() / 2], 0.1);
  EXPECT_LT(differences[differences.size() * 95 / 100], 0.3);
  ASSERT_GT(angles_deg.size(), 500u);
  EXPECT_LT(angles_deg[angles_deg.size() * 95 / 100], 6.0);
}

TEST(RealFlight, APhantomsSubtitlesAndTableAreOneFlight) {
  TERRACAST_NEEDS_SHARED_DATA("trajectories/dji_p4_rtk.SRT");
  const WorldFrame frame({-34.23, -58.85, 0.0});
  const auto subtitles = fly("dji_p4_rtk.SRT", frame);
  const auto table = fly("dji_phantom4rtk_argentina_6dof.csv", frame);
  ASSERT_NEAR(subtitles->duration_s(), 54.0, 1e-9);
  for (int t = 0; t <= 54; ++t) {
    const BodyState a = subtitles->at(t), b = table->at(t);
    ASSERT_LT((a.world_from_body.translation - b.world_from_body.translation).norm(), 1e-6);
    ASSERT_LT(a.world_from_body.rotation.angularDistance(b.world_from_body.rotation), 1e-9);
  }
  // As its first line says: 698.70 m from home, whose place it states; heading 110.4 degrees, the
  // camera 24.4 degrees down. It starts within a second, and the gimbal turns by 0.4 degrees then.
  const BodyState start = subtitles->at(0.0);
  const Eigen::Vector3d home = frame.world_from_geodetic({-34.232707, -58.847509, 20.0});
  const Geodetic place = frame.geodetic_from_world(start.world_from_body.translation);
  EXPECT_NEAR(place.height_m, 105.8, 0.5);
  EXPECT_NEAR((start.world_from_body.translation - home).head<2>().norm(), 698.70, 3.0);
  const Eigen::Vector3d ahead =
      frame.world_from_enu(start.world_from_body.translation).transpose() *
      (start.world_from_body.rotation * Eigen::Vector3d::UnitX());
  EXPECT_NEAR(std::atan2(ahead.x(), ahead.y()) / kDegree, 110.4, 0.6);
  EXPECT_NEAR(std::asin(ahead.z()) / kDegree, -24.4, 0.6);
}

}  // namespace
}  // namespace terracast::geo
